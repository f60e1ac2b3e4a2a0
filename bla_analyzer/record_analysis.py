"""Analysis of records that are not periodic: chirps, noise, moves, logs, one run or many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fjr_kit.check import Check
from fjr_kit.errors import InputError
from fjr_records.realization import TimeSignals
from fjr_records.record_noise import stands_above_noise
from fjr_records.records import Record, RecordSet
from fjr_records.units import FOLLOWING_LIMIT, compare_units, following

from .bla.arbitrary import ArbitraryBla, arbitrary_bla, run_of
from .bla.sensitivity import of_this_loop
from .checks import reliable_lines
from .compare.metrics import ReferenceModel, compare
from .results.result import BlaEstimate, LevelResult, LineLevels, Result

MOST_SAMPLES = 2**22
"""A longer record is cut into equal parts, each with a transient of its own."""
MOST_SHOWN = 20_000
"""Samples of the time signals that a result holds, at the most; of longer records every n-th."""
FEWEST_LINES = 8
"""Frequencies with an estimate, below which there is no response to speak of."""
GAUSSIAN_KURTOSIS = (2.3, 4.5)
"""A signal whose kurtosis lies outside is far from Gaussian: a sine has 1.5, a normal signal 3."""


def analyze_records(records: RecordSet, models: Sequence[ReferenceModel]) -> Result:
    """Estimate the BLA of each level of a folder of records.

    Args:
        records: all runs.
        models: models to compare the BLA with.

    Raises:
        InputError: no level allows an estimate.
    """
    levels: list[LevelResult] = []
    checks: list[Check] = []
    notes = list(records.notes)
    for level in records.levels:
        members = [i for i, record in enumerate(records.records) if record.level == level]
        groups = [[records.records[i] for i in g] for g in records.repeats if g[0] in members]
        made, of_level = _level(level, groups, records, models)
        levels.append(made)
        checks += _checks(made, groups)
        notes += [f"level {level}: {note}" for note in of_level]
    if all(level.bla is None for level in levels):
        raise InputError(f"{records.source}: {notes[-len(levels)]}")
    repeated = any(len(group) > 1 for group in records.repeats)
    return Result(
        source=records.source,
        excitation="repeated" if repeated else "arbitrary",
        sample_rate_hz=records.sample_rate_hz,
        samples_per_period=max(record.samples for record in records.records),
        periods=1,
        transient_periods=0,
        described=not any("without experiment description" in n for n in records.notes),
        bags=tuple(record.name for record in records.records),
        levels=tuple(levels),
        checks=tuple(checks),
        notes=tuple(notes),
        controller=records.records[0].controller,
    )


def _level(
    level: int,
    groups: Sequence[Sequence[Record]],
    records: RecordSet,
    models: Sequence[ReferenceModel],
) -> tuple[LevelResult, list[str]]:
    sample_rate_hz = records.sample_rate_hz
    played = all(_is_played(record.reference) for group in groups for record in group)
    notes = [] if played else [_why_direct(groups)]
    parts = max(int(np.ceil(r.samples / MOST_SAMPLES)) for group in groups for r in group)
    if parts > 1:
        notes.append(
            f"records longer than {MOST_SAMPLES} samples are cut into {parts} parts, each with a "
            "transient of its own."
        )
    runs = [
        run_of([_signals(record, played, part, parts) for record in group], sample_rate_hz)
        for group in groups
        for part in range(parts)
    ]
    found = None
    try:
        if played:
            found = arbitrary_bla(runs, sample_rate_hz)
        else:
            own = replace(records, records=tuple(record for group in groups for record in group))
            moves = partial(stands_above_noise, own)
            found = _without_reference(arbitrary_bla(runs, sample_rate_hz, slope=True, moves=moves))
    except InputError as error:
        notes.append(str(error))
    else:
        notes += _left_out(found, played) + (_shape(groups) if played else [])
    return _result(level, groups, found, sample_rate_hz, models), notes


def _without_reference(found: ArbitraryBla) -> ArbitraryBla:
    """Return an estimate without the reference, for which the torque stood."""
    unknown = np.full(found.levels.reference.shape, np.nan)
    return replace(found, levels=found.levels.model_copy(update={"reference": unknown}))


def _is_played(reference: np.ndarray | None) -> bool:
    return reference is not None and bool(np.ptp(reference) > 0)


def _why_direct(groups: Sequence[Sequence[Record]]) -> str:
    records = [record for group in groups for record in group]
    without = [record.name for record in records if not _is_played(record.reference)]
    which = without[0] if len(without) == 1 else f"{len(without)} of {len(records)} records"
    return (
        f"{which} without a reference that moves, so G is taken from torque to position directly. "
        "In a closed loop that is biased: noise and friction that the controller answers enter "
        "the torque, and where they dominate it G tends to -1/C, the inverse of the controller."
    )


def _signals(record: Record, played: bool, part: int, parts: int) -> np.ndarray:
    """Return (3, samples): r, u, y; without reference u, u and the slope of y."""
    cut = slice(record.samples * part // parts, record.samples * (part + 1) // parts)
    u, y = record.torque[cut], record.position[cut]
    if played:
        assert record.reference is not None
        return np.stack([record.reference[cut], u, y])
    return np.stack([u[1:], u[1:], np.diff(y)])


def _left_out(found: ArbitraryBla, played: bool) -> list[str]:
    lost = found.left_out_hz
    if not lost.size:
        return []
    kept = found.bla.frequency_hz
    whole = lost.size + kept.size
    bands = ", ".join(
        part
        for part in (
            _band(lost[lost < kept[0]]),
            _band(lost[(lost > kept[0]) & (lost < kept[-1])], "within"),
            _band(lost[lost > kept[-1]]),
        )
        if part
    )
    why = (
        "the torque does not follow the excitation beyond noise and distortion there."
        if played
        else "position or torque do not stand above noise there, or the torque cannot be told from "
        "the transient, as where a sweep begins and ends; G would be that of the controller."
    )
    return [f"{lost.size} of {whole} frequencies are left out ({bands}): {why}"]


def _band(lost: np.ndarray, word: str = "") -> str:
    if not lost.size:
        return ""
    span = f"{lost[0]:.3g} to {lost[-1]:.3g} Hz" if lost.size > 1 else f"{lost[0]:.3g} Hz"
    return f"{lost.size} {word}, {span}" if word else span


def _shape(groups: Sequence[Sequence[Record]]) -> list[str]:
    """Return what the distribution of the reference and its velocity mean for the BLA."""
    references = [group[0].reference for group in groups if group[0].reference is not None]
    found = [_kurtosis(references), _kurtosis([np.diff(r) for r in references])]
    low, high = GAUSSIAN_KURTOSIS
    if all(low <= value <= high for value in found):
        return []
    return [
        f"the reference is not Gaussian (kurtosis {found[0]:.2g}, of its velocity {found[1]:.2g}; "
        "noise and multisines have 3, a sine 1.5): as far as the rig is nonlinear, this BLA holds "
        "for this signal, and noise or a multisine of the same spectrum has another one."
    ]


def _kurtosis(signals: Sequence[np.ndarray]) -> float:
    values = np.concatenate([signal - signal.mean() for signal in signals])
    return float(np.mean(values**4) / np.mean(values**2) ** 2)


def _result(
    level: int,
    groups: Sequence[Sequence[Record]],
    found: ArbitraryBla | None,
    sample_rate_hz: float,
    models: Sequence[ReferenceModel],
) -> LevelResult:
    nothing = np.empty(0)
    empty = LineLevels(**dict.fromkeys(LineLevels.model_fields, nothing))
    records = [record for group in groups for record in group]
    signals = [_shown(record) for record in records]
    rms = [
        float(np.sqrt(np.mean([np.mean((x - x.mean()) ** 2) for x in column])))
        for column in zip(*signals, strict=True)
    ]
    bla = None
    if found is not None:
        bla = of_this_loop(found.bla, records[0].controller, sample_rate_hz)
    return LevelResult(
        level=level,
        amplitude_rad=nothing if found is None else found.levels.reference,
        bla=bla,
        excited=empty if found is None else found.levels,
        odd=empty,
        even=empty,
        left_out_hz=nothing if found is None else found.left_out_hz,
        comparisons=tuple(
            compare(bla, model, sample_rate_hz) for model in models if bla is not None
        ),
        signals=_time_signals(signals[0], sample_rate_hz),
        reference_rms_rad=rms[0],
        torque_rms_nm=rms[1],
        position_rms_rad=rms[2],
        torque_peak_nm=max(float(np.abs(one[1]).max()) for one in signals),
        position_peak_rad=max(float(np.abs(one[2]).max()) for one in signals),
    )


def _shown(record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    reference = record.reference
    unknown = np.full(record.samples, np.nan)
    return unknown if reference is None else reference, record.torque, record.position


def _time_signals(signals: Sequence[np.ndarray], sample_rate_hz: float) -> TimeSignals:
    step = -(-signals[0].size // MOST_SHOWN)
    r, u, y = (signal[::step].copy() for signal in signals)
    time_s = np.arange(signals[0].size)[::step] / sample_rate_hz
    return TimeSignals(time_s=time_s, reference_rad=r, torque_nm=u, position_rad=y)


def _lines_left(level: LevelResult, bla: BlaEstimate) -> Check:
    """Tell whether enough frequencies carry an estimate to speak of a response."""
    kept, f = bla.frequency_hz.size, bla.frequency_hz
    whole = kept + level.left_out_hz.size
    sentence = (
        f"{kept} of {whole} frequencies carry an estimate, from {f[0]:.4g} to {f[-1]:.4g} Hz"
        + (
            "."
            if kept >= FEWEST_LINES
            else ", too few to be a response: excite more, or record longer."
        )
    )
    return Check(
        name="lines_left",
        level=level.level,
        passed=kept >= FEWEST_LINES,
        value=float(max(FEWEST_LINES - kept, 0)),
        limit=0.0,
        sentence=f"level {level.level}: {sentence}",
    )


def _checks(level: LevelResult, groups: Sequence[Sequence[Record]]) -> list[Check]:
    """Return the checks of a level of records."""
    if level.bla is None:
        return [reliable_lines(level.level, None)]
    made = [reliable_lines(level.level, level.bla), _lines_left(level, level.bla)]
    lines = level.excited
    if all(_is_played(record.reference) for group in groups for record in group):
        value, sentence = compare_units(following(lines.reference, lines.position))
        made.append(
            Check(
                name="position_unit",
                level=level.level,
                passed=not value > FOLLOWING_LIMIT,
                value=value,
                limit=FOLLOWING_LIMIT,
                sentence=f"level {level.level}: {sentence}",
            )
        )
    return made
