"""A recorded torque that comes late: it acted before the log says so.

A drive's log often holds a current that was filtered, or read later than the encoder. The rig then
seems to move before it is pushed, which no delay of an actuator explains: that of a torque which
drives the model cannot be less than none. What the model lacks goes with the rate of the torque,
and how late the torque comes follows from that, to first order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from fjr_kit.telling import Progress
from fjr_records.records import RecordSet

from ..fits.comparison import CellFit
from ..fits.gains import gain
from ..model.evidence import Evidence
from ..model.steady_runs import SteadyRuns
from .torque_timing import Timing

_LATEST_S = 0.1
"""Longest that a torque comes late; the longest delay of an actuator is as long."""
_LEAST = 0.75  # of a sample: less is how a torque acts between its samples
_ROUNDS = 4
_SETTLED = 0.1  # of a sample, or of what it is late
_LATE = ("delay", "actuator_lag")


def brought_forward(torque: np.ndarray, samples: float, period: int = 1) -> np.ndarray:
    """Return a signal as much earlier; at the end it goes on with its last period.

    Args:
        torque: float64 (samples,).
        samples: by how many, not necessarily a whole number.
        period: its last samples, which repeat; the last one alone if it has no period.
    """
    ahead = np.resize(torque[-period:], int(np.ceil(samples)) + 1)
    longer = np.concatenate([torque, ahead])
    return CubicSpline(np.arange(longer.size), longer)(np.arange(torque.size) + samples)


def with_early_torque(records: RecordSet, late_s: float) -> RecordSet:
    """Return records whose torque is that much earlier."""
    samples = late_s * records.sample_rate_hz
    moved = []
    for record in records.records:
        period = record.samples - records.run_in if isinstance(records, SteadyRuns) else 1
        moved.append(replace(record, torque=brought_forward(record.torque, samples, period)))
    return replace(records, records=tuple(moved))


def brought_to_its_time(timing: Timing, best: CellFit, progress: Progress) -> Timing | None:
    """Return what a search begins with if the torque comes late, as what was found shows.

    Args:
        timing: what the search began with.
        best: what it ended with.
        progress: told that the torque is moved.

    Returns:
        None where a loop makes the torque of any run, where something acts late already, or where
        unseen parts do not speak for it.
    """
    first = timing.fitter
    evidence = first.evidence
    settled = evidence.slow or evidence.records.swings_free or any(evidence.player.loop.laws)
    if settled or set(best.effects) & set(_LATE):
        return None
    rate = evidence.records.sample_rate_hz
    late, fitter, fit = 0.0, first, best
    for _ in range(_ROUNDS):
        further = _lateness(fitter.evidence, fit)
        if not np.isfinite(further) or not 0.0 < late + further < _LATEST_S:
            break
        progress("torque brought forward")
        late += further
        fitter = first.with_runs(with_early_torque(evidence.records, late))
        fit = fitter.taken_over(fit)
        if abs(further) < _SETTLED * max(1.0 / rate, late):
            break
    if late * rate < _LEAST or not gain(first, fit, best).present:
        return None
    return replace(
        timing, fitter=fitter, refit=fitter.refit(), other=None, late_s=timing.late_s + late
    )


def is_late(late_s: float) -> str:
    """Return the note on a torque that was brought forward."""
    return (
        f"The recorded torque comes {1e3 * late_s:.2g} ms after it acted, as that of a filter "
        "does, or one that is read after the encoder: the rig moved as much earlier than this "
        "torque would have moved it. It was brought forward by that time."
    )


def _lateness(evidence: Evidence, fit: CellFit) -> float:
    """Return how late the torque comes by what a model lacks, s; NaN where its motion diverges."""
    player = evidence.player
    runs = sorted({evidence.parts[p].record for p in evidence.parts_for("fit", "select")})
    missing = player.missing_torque(fit.model, runs)
    product = square = 0.0
    added = player.added(fit.model)
    for lacks, index in zip(missing, runs, strict=True):
        torque = evidence.records.records[index].torque
        rate = np.gradient(torque) * evidence.records.sample_rate_hz
        seen = added(rate)
        product += float(lacks @ seen)
        square += float(seen @ seen)
    return product / square if square > 0.0 else 0.0
