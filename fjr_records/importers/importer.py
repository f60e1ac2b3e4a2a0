"""From records of a rig without ROS to bags of the interface: `fjr import`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controller_node import controller_file
from controller_node.law import law_as_run
from controller_node.transfer_function import TransferFunction
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_interface.topics import LINK_POSITION, MOTOR_POSITION, MOTOR_TORQUE, REFERENCE
from fjr_kit.atomic import new_folder, refuse_existing
from fjr_kit.errors import InputError

from .describe import Description, describe
from .record_file import ImportOptions, Record, Samples, read_samples, understand
from .refresh import at_the_rate_of_angles
from .repetition import insists

WRONG_CONTROLLER = 0.5
"""Greatest rms difference of the recorded torque from that of a known law, relative to it."""
_SETTLE = 0.1


@dataclass(frozen=True)
class Understood:
    """The files as they would be written.

    Attributes:
        records: what was read, in the order of the files.
        descriptions: of each.
        notes: sentences on what differs between the files.
    """

    records: tuple[Record, ...]
    descriptions: tuple[Description, ...]
    notes: tuple[str, ...]


def read_files(files: Sequence[str | Path], options: ImportOptions) -> Understood:
    """Read and understand files; nothing is written.

    Args:
        files: one run each, in the order level by level, realization by realization.
        options: how to understand them.

    Raises:
        InputError: a file cannot be used, or the files do not belong together.
    """
    if options.levels < 1 or not files or len(files) % options.levels:
        raise InputError(
            f"{len(files)} files cannot be {options.levels} levels of equally many realizations; "
            "give as many files for each level."
        )
    if len(options.controllers) not in (0, 1, len(files)):
        raise InputError(
            f"{len(options.controllers)} controllers are given for {len(files)} files; give one "
            "for all, or one for each file in their order."
        )
    if options.swings_free and options.controllers:
        raise InputError(
            f"{options.controllers[0]}: no controller makes a torque where none acts; leave out "
            "--controller, or --swings-free."
        )
    laws = [controller_file.read_controller(path) for path in options.controllers]
    logged = [read_samples(Path(file), options) for file in files]
    samples = at_the_rate_of_angles(logged, fixed=options.samples_per_period is not None)
    common = _grid_rate(samples)
    rates = [common or each.timing.rate_hz for each in samples]
    sources = [str(path) for path in options.controllers] * (1 if len(laws) > 1 else len(samples))
    controllers: list[dict[str, Any] | None] = [None] * len(samples)
    faster = False
    for number, source in enumerate(sources):
        structure = laws[number if len(laws) > 1 else 0]
        if samples[number].timing.rate_hz < logged[number].timing.rate_hz:
            own = {"rate_hz": structure.rate_hz or logged[number].timing.rate_hz}
            structure = structure.model_copy(update={**own, "between_samples": "joined"})
        faster |= structure.steps(rates[number], f"{source}: controller") > 1
        controllers[number] = controller_file.describe(structure, rates[number], source)
    records = [
        understand(each, rate, options, _maker(each.path, controller, rate, options), faster)
        for each, rate, controller in zip(samples, rates, controllers, strict=True)
    ]
    told = []
    for source in dict.fromkeys(sources):
        of_it = [number for number, own in enumerate(sources) if own == source]
        known = [(records[number], controllers[number] or {}) for number in of_it]
        told += _check_controller(known, source)
    descriptions, notes = describe(records, options.levels, controllers, insists(options))
    return Understood(tuple(records), tuple(descriptions), (*notes, *told))


def _grid_rate(samples: Sequence[Samples]) -> float | None:
    """Return the rate onto which all files are brought: the slowest, if one must be resampled."""
    if not any(each.timing.stamps_s for each in samples):
        return None
    even = [each.timing.rate_hz for each in samples if not each.timing.stamps_s]
    return even[0] if even else min(each.timing.rate_hz for each in samples)


def _maker(
    path: Path, controller: dict[str, Any] | None, rate_hz: float, options: ImportOptions
) -> TransferFunction | None:
    """Return the law that makes a torque which was not recorded; None where it was."""
    if "torque" in options.columns or options.swings_free:
        return None
    if controller is None or "unknown" in controller or "reference" not in options.columns:
        raise InputError(
            f"{path}: no torque is mapped, and only a reference and a controller that is described "
            "in all its gains could make it; map the torque, or describe the controller."
        )
    return law_as_run(controller, rate_hz)


def _check_controller(known: Sequence[tuple[Record, dict[str, Any]]], source: str) -> list[str]:
    """Refuse a controller, known in all its gains, that makes the torque of no file.

    In some of the files something else may have been added to its torque.

    Args:
        known: the records that it is said to have made, each with its description.
        source: its file.

    Returns:
        Sentences on those files whose torque it does not make.
    """
    off = {
        record.path: difference
        for record, controller in known
        if (difference := _off(record, controller)) is not None
    }
    wrong = {path: difference for path, difference in off.items() if difference > WRONG_CONTROLLER}
    if wrong and len(wrong) == len(off):
        path, least = min(off.items(), key=lambda one: one[1])
        raise InputError(
            f"{source}: this controller gives a torque that differs by {min(least, 1e9):.0%} from "
            f"that in {path}; correct gains, units or signs, or mark gains as unknown."
        )
    return [
        f"{path}: the torque differs by {min(difference, 1e9):.0%} from that of {source}, which "
        "makes that of other files: something was added to it, pushes say, or its gains were "
        "others"
        for path, difference in wrong.items()
    ]


def _off(record: Record, controller: dict[str, Any]) -> float | None:
    """Return the rms difference of a recorded torque from that of its law, relative to it.

    None where that cannot be said: no reference, no law, gains that are not known, or a torque that
    never changes.
    """
    if "r" not in record.signals or not controller or "unknown" in controller:
        return None
    r, u, y = (record.signals[symbol] for symbol in "ruy")
    law = law_as_run(controller, record.sample_rate_hz)
    settled = slice(int(_SETTLE * u.size), None)
    scale = float(np.std(u[settled]))
    if scale == 0.0:
        return None
    with np.errstate(all="ignore"):
        off = float(np.std((law.torque(r, y) - u)[settled])) / scale
    return off if off <= np.inf else np.inf  # what overflows is not a number


def write_bags(understood: Understood, out: Path) -> list[Path]:
    """Write one bag for each file, all or none; return their folders.

    Raises:
        InputError: the folder exists, is being written, or cannot be written.
    """
    with new_folder(out) as hidden:
        for record, one in zip(understood.records, understood.descriptions, strict=True):
            there = (REFERENCE, MOTOR_POSITION, MOTOR_TORQUE, LINK_POSITION)
            signals = tuple(signal for signal in there if signal.symbol in record.signals)
            folder = bag_folder(hidden, one.level, one.realization)
            with BagWriter(folder, one, signals=signals) as bag:
                bag.write_arrays(**record.signals)
    return [bag_folder(out, one.level, one.realization) for one in understood.descriptions]


def import_files(
    files: Sequence[str | Path], out: str | Path, options: ImportOptions
) -> list[tuple[Description, Path]]:
    """Turn each file into the bag of one realization, all or none.

    Args:
        files: as in `read_files`.
        out: the experiment folder to make.
        options: how to understand them.

    Returns:
        The description and folder of each bag.

    Raises:
        InputError: see `read_files` and `write_bags`.
    """
    out = Path(out)
    refuse_existing(out)
    understood = read_files(files, options)
    return list(zip(understood.descriptions, write_bags(understood, out), strict=True))
