"""One file, read and understood: its signals on an even grid, its period, and what is doubtful."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError

from ..drive_off import off_times
from . import coherence, impossible, part
from .columns import read_columns
from .doubts import doubts_of_signals, doubts_of_values
from .import_map import OWN_TIME, TIME, Column, is_linear, is_time, refuse_both_axes
from .integrals import DRIFTS, integrals
from .known_torque import without_known
from .made_torque import MADE, ONCE, SWINGS_FREE, made_torque
from .own_stamps import own_stamps
from .part import LEAST_SAMPLES
from .repetition import Repetition, find_repetition, insists
from .stamps import FASTEST_HZ, LONGEST_S
from .timing import Timing, of_one_clock, of_own_clocks, resample
from .words import with_sign
from .wraps import without_wraps

SYMBOLS = {"reference": "r", "torque": "u", "position": "y", "link": "q"}
FASTER = "its controller runs faster than it is sampled, so it is taken as no periodic run"


@dataclass(frozen=True)
class ImportOptions:
    """What the files do not say themselves; None is found in them.

    Attributes:
        columns: where each quantity stands, from `parse_map`.
        sample_rate_hz: needed without a time column; with an uneven one, the rate of the grid.
        samples_per_period: N.
        transient_periods: leading periods to discard.
        periods: periods to keep after those; None keeps all whole ones.
        skip_samples: samples to leave out at the beginning.
        keep_samples: samples to keep after those; None keeps all.
        excited_harmonics: excited lines.
        levels: number of amplitudes; the files come level by level.
        repeat_reference: whether the reference is one period, played again and again.
        controllers: files that describe the controller: none, one for all, or one for each file.
        swings_free: whether no torque acts, so that none is mapped.
    """

    columns: Mapping[str, Column]
    sample_rate_hz: float | None = None
    samples_per_period: int | None = None
    transient_periods: int = 1
    periods: int | None = None
    skip_samples: int = 0
    keep_samples: int | None = None
    excited_harmonics: tuple[int, ...] | None = None
    levels: int = 1
    repeat_reference: bool = False
    controllers: tuple[Path, ...] = ()
    swings_free: bool = False


@dataclass(frozen=True)
class Samples:
    """The columns of one file, in SI, as they stand there.

    Attributes:
        path: the file.
        columns: where each quantity stands, in the unit that it was given or is stated in.
        values: {quantity: float64 (samples,)}, without time.
        timing: when they were taken.
        notes: what was done to them.
        doubts: what is evidently wrong, but might be meant.
    """

    path: Path
    columns: Mapping[str, Column]
    values: Mapping[str, np.ndarray]
    timing: Timing
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Record:
    """One file on an even grid.

    Attributes:
        path: the file.
        columns: where each quantity stands, in the unit that it was given or is stated in.
        sample_rate_hz: rate of the grid.
        signals: {symbol: float64 (samples,)} in SI.
        timing: when its samples were taken.
        repetition: its period, or a clause that says why there is none.
        notes: what was done to the signals.
        doubts: what is evidently wrong, but might be meant.
    """

    path: Path
    columns: Mapping[str, Column]
    sample_rate_hz: float
    signals: Mapping[str, np.ndarray]
    timing: Timing
    repetition: Repetition | str
    notes: tuple[str, ...]
    doubts: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.signals["y"].size


def read_samples(path: Path, options: ImportOptions) -> Samples:
    """Read the columns of one file; raise InputError."""
    given = options.columns
    arrays, headings = read_columns(path, [column.name for column in given.values()])
    columns = {q: each.read_as(path, q, headings[each.name]) for q, each in given.items()}
    refuse_both_axes(f"{path}:", columns)
    notes: tuple[str, ...] = ()
    for name in dict.fromkeys(column.name for q, column in columns.items() if not is_time(q)):
        mapped = [q for q, column in columns.items() if column.name == name and not is_time(q)]
        arrays[name], note = with_sign(" and ".join(mapped), arrays[name])
        notes += () if note is None else (note,)
    notes += tuple(
        f"{quantity} is {column.name} with the nanoseconds of {headings[column.name].nanoseconds}"
        for quantity, column in columns.items()
        if headings[column.name].nanoseconds
    )
    values = {q: column.factor * arrays[column.name] for q, column in columns.items()}
    times = {q: values.pop(q) for q in columns if is_time(q)}
    stamps: dict[str, np.ndarray] = {}
    if set(times) - {TIME} or any(np.isnan(each).any() for each in values.values()):
        values, stamps = own_stamps(path, values, times)
    if len({id(each) for each in stamps.values()}) == 1:  # sampled together after all
        times, stamps = {TIME: stamps["position"]}, {}
    slow = {
        q.removesuffix(OWN_TIME) for q, each in columns.items() if is_time(q) and each.by_factor
    }
    skip, keep, rate_hz = options.skip_samples, options.keep_samples, options.sample_rate_hz
    if rate_hz is not None and not 0.0 < rate_hz <= FASTEST_HZ:
        raise InputError(
            f"{path}: {rate_hz:g} Hz is no possible sample rate; give one above 0 and up to "
            f"{FASTEST_HZ:g} Hz."
        )
    if stamps:
        if options.repeat_reference:
            raise InputError(
                f"{path}: its signals have stamps of their own, so no reference can be repeated; "
                "leave out --repeat-reference."
            )
        values, stamps = part.of_time(path, values, stamps, skip, keep)
        slow |= set(values) if TIME in slow else set()
        values, timing = of_own_clocks(path, values, stamps, rate_hz, slow=slow)
    else:
        values = _of_one_length(path, values, columns, repeat=options.repeat_reference)
        values = part.of_rows(path, values | times, skip, keep)
        time = values.pop(TIME, None)
        values, timing = of_one_clock(path, values, time, rate_hz, slow=TIME in slow)
    left = min(each.size for each in values.values())
    if left < LEAST_SAMPLES or left > LONGEST_S * timing.rate_hz:
        raise InputError(
            f"{path}: {left} samples at {timing.rate_hz:g} Hz are no record; give at least "
            f"{LEAST_SAMPLES} samples, in at most {LONGEST_S:g} s."
        )
    values, turns = without_wraps(path, values, columns)
    notes += turns
    said = (each.contradiction(q, headings[each.name]) for q, each in columns.items())
    own = timing.stamps_s.get("position")
    doubts = doubts_of_values(values, columns, timing.rate_hz, own)
    return Samples(path, columns, values, timing, notes, (*filter(None, said), *doubts))


def _of_one_length(
    path: Path, values: dict[str, np.ndarray], columns: Mapping[str, Column], *, repeat: bool
) -> dict[str, np.ndarray]:
    """Return signals that were sampled together; raise InputError if one has another length."""
    size = values["position"].size
    if repeat and 0 < values.get("reference", np.empty(0)).size <= size:
        values = {**values, "reference": np.resize(values["reference"], size)}
    for quantity, each in values.items():
        if each.size != size:
            raise InputError(
                f"{path}: {columns[quantity].name} has {each.size} samples, but "
                f"{columns['position'].name} has {size}; they must be of one length, or "
                "--repeat-reference plays a single period of the reference again and again, or "
                f"{quantity}{OWN_TIME}=COLUMN maps stamps of its own."
            )
    return values


def understand(
    samples: Samples,
    rate_hz: float,
    options: ImportOptions,
    law: TransferFunction | None = None,
    faster: bool = False,
) -> Record:
    """Bring a file onto the grid and find its period; raise InputError where it cannot be right.

    Args:
        samples: of the file.
        rate_hz: of the grid.
        options: how to understand them.
        law: what makes a torque that was not recorded.
        faster: whether the controller runs faster than the record is sampled.
    """
    path, columns, timing, values = samples.path, samples.columns, samples.timing, samples.values
    notes = (*samples.notes, *timing.notes)
    if timing.stamps_s:
        values, errors = resample(path, timing, values, rate_hz)
        notes += errors
    values, integrated = integrals(values, columns, rate_hz)
    values, known = without_known(values)
    notes += (*integrated, *known)
    signals = {SYMBOLS[quantity]: each for quantity, each in values.items()}
    if law is not None and "u" not in signals:
        signals["u"] = made_torque(law, signals["r"], signals["y"], rate_hz)
        notes += (MADE if law.steps > 1 else MADE + ONCE,)
    if options.swings_free:
        signals["u"] = np.zeros(signals["y"].size)
        notes += (SWINGS_FREE,)
    if not np.ptp(signals["y"]) > 0:
        raise InputError(f"{path}: the position is constant; map the column that carries it.")
    found: Repetition | str
    cannot = DRIFTS if columns["position"].is_speed else FASTER if faster else None
    if cannot is None:
        found = find_repetition(str(path), signals, rate_hz, options)
    elif insists(options):
        raise InputError(f"{path}: {cannot}; leave out what is said of its periods and lines.")
    else:
        found = cannot
    repetition = found if isinstance(found, Repetition) else None
    doubts = doubts_of_signals(
        path, signals, repetition, columns, options.swings_free, samples.doubts
    )
    off = off_times(signals["u"], signals["y"], rate_hz) if repetition is None else None
    if off is not None and impossible.TORQUE not in doubts:
        unit = "N" if is_linear(columns) else "N m"
        notes += (f"{off.told(rate_hz, unit)}; analysis and diagnosis leave these out",)
    other = coherence.unrelated(signals, repetition)
    if other is not None:
        raise InputError(f"{path}: {other}.")
    if repetition is not None:
        signals = {symbol: each[: repetition.samples] for symbol, each in signals.items()}
        notes += repetition.notes
    return Record(path, columns, rate_hz, signals, timing, found, notes, doubts)
