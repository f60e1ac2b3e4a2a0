"""From records of a rig without ROS to bags of the interface: `fjr import`."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bla_analyzer.discover import find_lines, find_period
from bla_analyzer.lines import classify
from bla_analyzer.realization import REFERENCE_REPEATS
from bla_analyzer.spectra import line_spectrum
from fjr_interface.bag_writer import BagWriter
from fjr_interface.errors import InputError
from fjr_interface.experiment import Experiment
from fjr_interface.topics import LINK_POSITION, SIGNALS

from .arrays import read_columns
from .campaign import bag_folder
from .import_map import Column

SYMBOLS = {"reference": "r", "torque": "u", "position": "y", "link": "q"}

UNEVEN = 0.01
"""Greatest deviation of one time step from the mean one, relative to it."""
SAME_AMPLITUDE = 0.1
"""Greatest deviation of a line's amplitude from that in the first realization of a level."""
ALIKE = 2e-3
"""Greatest deviation of lines from their mean amplitude at which one number stands for all."""
SILENT = 1e-7
"""Amplitude relative to the strongest line below which a line is not excited."""


@dataclass(frozen=True)
class ImportOptions:
    """What the files do not say themselves; None is found in them.

    Attributes:
        columns: where each quantity stands, from `parse_map`.
        sample_rate_hz: needed without a time column.
        samples_per_period: N.
        transient_periods: leading periods to discard.
        periods: periods to keep after those; None keeps all and refuses a last one that is cut.
        skip_samples: samples to leave out at the beginning.
        excited_harmonics: excited lines.
        levels: number of amplitudes; the files come level by level.
    """

    columns: Mapping[str, Column]
    sample_rate_hz: float | None = None
    samples_per_period: int | None = None
    transient_periods: int = 1
    periods: int | None = None
    skip_samples: int = 0
    excited_harmonics: tuple[int, ...] | None = None
    levels: int = 1


@dataclass(frozen=True)
class Record:
    """One file, read and understood.

    Attributes:
        path: the file.
        sample_rate_hz: rate of its samples.
        samples_per_period: N.
        periods: P after the transient.
        signals: {symbol: float64 (samples,)} in SI, transient included.
        excited: (F,), excited harmonics.
        amplitudes: (F,), amplitude of the reference there.
    """

    path: Path
    sample_rate_hz: float
    samples_per_period: int
    periods: int
    signals: Mapping[str, np.ndarray]
    excited: np.ndarray
    amplitudes: np.ndarray


def import_files(
    files: Sequence[str | Path], out: str | Path, options: ImportOptions
) -> list[tuple[Experiment, Path]]:
    """Turn each file into the bag of one realization, all or none.

    Args:
        files: records in the order level by level, realization by realization.
        out: the experiment folder to make.
        options: how to understand them.

    Returns:
        The description and folder of each bag.

    Raises:
        InputError: the folder exists, a file cannot be used, or the files do not belong together.
    """
    out = Path(out)
    if out.exists():
        raise InputError(f"{out}: exists already; choose another folder or remove it.")
    realizations, rest = divmod(len(files), options.levels) if options.levels > 0 else (0, 1)
    if rest or not realizations:
        raise InputError(
            f"{len(files)} files cannot be {options.levels} levels of equally many realizations; "
            "give as many files for each level."
        )
    records = [read_record(Path(file), options) for file in files]
    _check_one_grid(records)
    experiments = [
        experiment
        for level in range(options.levels)
        for experiment in _describe(
            records[level * realizations : (level + 1) * realizations], level, options
        )
    ]
    return _write(out, records, experiments)


def read_record(path: Path, options: ImportOptions) -> Record:
    """Read one file and find in it what the options leave open; raise InputError."""
    columns = options.columns
    arrays = read_columns(path, [column.name for column in columns.values()])
    values = {
        quantity: column.factor * arrays[column.name][options.skip_samples :]
        for quantity, column in columns.items()
    }
    if not values["reference"].size:
        raise InputError(f"{path}: no samples are left after {options.skip_samples} skipped ones.")
    rate = _sample_rate(path, values.pop("time", None), options.sample_rate_hz)
    reference = values["reference"]
    samples = options.samples_per_period or find_period(str(path), reference)
    periods = _periods(path, reference.size, samples, options)
    end = samples * (options.transient_periods + periods)
    kept = reference[samples * options.transient_periods : end].reshape(periods, samples)
    excited, amplitudes = _lines(path, kept, options.excited_harmonics)
    signals = {SYMBOLS[quantity]: value[:end] for quantity, value in values.items()}
    return Record(path, rate, samples, periods, signals, excited, amplitudes)


def _sample_rate(path: Path, time: np.ndarray | None, given: float | None) -> float:
    """Return the sample rate in Hz, from the time column in s if there is one."""
    if time is None:
        if given is None or not 0 < given < float("inf"):
            raise InputError(f"{path}: give a sample rate in Hz, or map a time column.")
        return given
    step = (time[-1] - time[0]) / max(time.size - 1, 1)
    if not step > 0:
        raise InputError(f"{path}: the time column does not increase; map another column.")
    uneven = np.flatnonzero(np.abs(np.diff(time) - step) > UNEVEN * step)
    if uneven.size:
        raise InputError(
            f"{path}: the time column goes on by {np.diff(time)[uneven[0]]:g} s after sample "
            f"{uneven[0]} but by {step:g} s on average; resample the record, or give the sample "
            "rate without a time column."
        )
    rate = 1.0 / step
    rate = round(rate) if abs(rate - round(rate)) < 1e-6 * rate else rate
    if given is not None and abs(rate - given) > 1e-4 * given:
        raise InputError(
            f"{path}: the time column says {rate:g} Hz, not {given:g} Hz; leave one of them out."
        )
    return float(given or rate)


def _periods(path: Path, size: int, samples: int, options: ImportOptions) -> int:
    """Return the number of periods to keep."""
    total, rest = divmod(size, samples)
    periods = total - options.transient_periods if options.periods is None else options.periods
    if periods < 1 or periods + options.transient_periods > total:
        raise InputError(
            f"{path}: {size} samples are {size / samples:.6g} periods of {samples}, too few for "
            f"{options.transient_periods} transient periods and {max(periods, 1)} to keep."
        )
    if rest and options.periods is None:
        raise InputError(
            f"{path}: {size} samples are {size / samples:.6g} periods of {samples}, which is not "
            "whole; correct the period, or say how many periods to keep."
        )
    return periods


def _lines(
    path: Path, reference: np.ndarray, given: tuple[int, ...] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return excited harmonics and amplitudes of a reference of shape (periods, N)."""
    scale = np.std(reference[0])
    difference = np.std(reference - reference[0], axis=1).max()
    if not scale > 0:
        raise InputError(f"{path}: the reference is constant; map the column that carries it.")
    if difference > REFERENCE_REPEATS * scale:
        raise InputError(
            f"{path}: the reference does not repeat after {reference.shape[1]} samples (rms "
            f"difference {difference / scale:.1%}); correct the period or the transient periods."
        )
    mean = reference.mean(axis=0)
    if given is None:
        return find_lines(str(path), mean)
    excited = np.asarray(given)
    if 2 * excited[-1] >= mean.size:
        raise InputError(
            f"{path}: harmonic {excited[-1]} is not below half of {mean.size} samples; correct the "
            "excited harmonics."
        )
    level = np.abs(line_spectrum(mean))
    silent = excited[level[excited] <= SILENT * level[1:].max()]
    if silent.size:
        raise InputError(
            f"{path}: the reference is zero on harmonic {silent[0]}; correct the excited harmonics."
        )
    return excited, level[excited]


def _check_one_grid(records: Sequence[Record]) -> None:
    first = records[0]
    for record in records[1:]:
        same = (
            record.sample_rate_hz == first.sample_rate_hz
            and record.samples_per_period == first.samples_per_period
            and record.periods == first.periods
            and np.array_equal(record.excited, first.excited)
        )
        if not same:
            raise InputError(
                f"{first.path} and {record.path} differ in sample rate, period, number of "
                "periods or excited lines; import them into separate folders."
            )


def _describe(records: Sequence[Record], level: int, options: ImportOptions) -> list[Experiment]:
    """Return the experiment descriptions of one level."""
    first = records[0]
    for record in records[1:]:
        if np.abs(record.amplitudes / first.amplitudes - 1.0).max() > SAME_AMPLITUDE:
            raise InputError(
                f"{record.path}: the amplitudes of the reference differ from those of {first.path};"
                " say how many levels the files hold, or import it into another folder."
            )
    amplitudes = np.mean([record.amplitudes for record in records], axis=0)
    common = Experiment(
        sample_rate_hz=first.sample_rate_hz,
        samples_per_period=first.samples_per_period,
        periods=first.periods,
        transient_periods=options.transient_periods,
        realizations=len(records),
        level=level,
        levels=options.levels,
        amplitude_rad=_rounded(amplitudes),
        excited_harmonics=first.excited.tolist(),
        detection_harmonics=classify(first.excited.tolist()).odd.tolist(),
    )
    sources = {quantity: [c.name, c.factor] for quantity, c in options.columns.items()}
    return [
        common.model_copy(
            update={
                "realization": index,
                "imported": {"file": record.path.name, "columns": sources},
            }
        )
        for index, record in enumerate(records)
    ]


def _rounded(amplitudes: np.ndarray) -> float | list[float]:
    """Return one amplitude if all lines are alike, else one for each."""
    mean = amplitudes.mean()
    if np.abs(amplitudes - mean).max() <= ALIKE * mean:
        return float(f"{mean:.4g}")
    return [float(f"{amplitude:.6g}") for amplitude in amplitudes]


def _write(
    out: Path, records: Sequence[Record], experiments: Sequence[Experiment]
) -> list[tuple[Experiment, Path]]:
    """Write the bags into a hidden folder and move it to its place when it is complete."""
    hidden = out.with_name(f".{out.name}.{os.getpid()}.partial")
    try:
        for record, one in zip(records, experiments, strict=True):
            signals = (*SIGNALS, LINK_POSITION) if "q" in record.signals else SIGNALS
            folder = bag_folder(hidden, one.level, one.realization)
            with BagWriter(folder, one, signals=signals) as bag:
                bag.write_arrays(**record.signals)
        hidden.rename(out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}).") from None
    finally:
        shutil.rmtree(hidden, ignore_errors=True)
    return [(one, bag_folder(out, one.level, one.realization)) for one in experiments]
