"""Steady periods as runs: what leads to the steady state, then the mean of the periods.

Windows of the mean period are compared; what is before them only brings a simulation into its
steady state. The mean has less noise than any period, which the differences of periods show, and a
simulation of it takes as long as one period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_records.record_noise import RecordNoise, record_noise
from fjr_records.records import Record, RecordSet

from .twist import twist_noise

LONGEST_S = 300.0
"""Of all mean periods together; of more, some realizations of each level are compared."""
LEAST_OF_LEVEL = 3
"""Realizations of a level that are compared at the least: to fit, to select, to report."""


@dataclass(frozen=True)
class SteadyRuns(RecordSet):
    """Runs that end with a steady period.

    Attributes:
        run_in: samples before the steady period, which are not compared.
        noise: of the positions in it.
        top_hz: highest frequency that is excited.
        scatter: of each run, what differs between its periods, times what makes of that one draw of
            the noise of their mean, float64 (2, differences, N): of position in rad, of torque in
            N m; no differences for one period.
        twist_noise: of the twist of the transmission; None without encoders of the link.
    """

    run_in: int = 0
    noise: RecordNoise | None = None
    top_hz: float = math.inf
    scatter: tuple[np.ndarray, ...] = ()
    twist_noise: RecordNoise | None = None


def steady_runs(recorded: RecordedExperiment) -> SteadyRuns:
    """Return the realizations of an experiment as runs that end with the mean of their periods."""
    whole = recorded.as_records()
    noise, description = record_noise(whole), recorded.experiment
    mean = _of_mean(noise, description.periods)
    chosen = compared(recorded)
    records = tuple(_ending_steady(recorded.realizations[i], whole.records[i]) for i in chosen)
    notes = list(recorded.notes)
    if len(chosen) < len(recorded.realizations):
        notes.append(
            f"{len(chosen)} of {len(recorded.realizations)} realizations are compared, those of "
            "each level that reach the greatest torques among them; that is enough to fit, to "
            "select and to report."
        )
    run_in = max(description.transient_periods, 1) * description.samples_per_period
    scatter = tuple(_scatter(recorded.realizations[i]) for i in chosen)
    twisted = None
    if all(record.link is not None for record in whole.records):
        twisted = _of_mean(twist_noise(whole), description.periods)
    top_hz = max(description.excited_harmonics) * description.base_frequency_hz
    return SteadyRuns(
        recorded.source,
        recorded.sample_rate_hz,
        records,
        tuple(notes),
        run_in,
        mean,
        top_hz,
        scatter,
        twisted,
    )


def _of_mean(noise: RecordNoise, periods: int) -> RecordNoise:
    """Return the noise of the mean of some periods; what is rounded away may repeat with them."""
    seen = noise.seen_rad / math.sqrt(periods)
    if noise.rounds:
        return replace(noise, seen_rad=seen)
    return replace(noise, std_rad=noise.std_rad / math.sqrt(periods), seen_rad=seen)


def _scatter(run: RecordedRealization) -> np.ndarray:
    """Return differences between successive periods, of the variance of the noise of their mean."""
    periods = np.array([run.kept(signal) for signal in (run.position, run.torque)])
    return np.diff(periods, axis=1) / math.sqrt(2.0 * periods.shape[1])


def compared(recorded: RecordedExperiment) -> list[int]:
    """Return which realizations are compared: all, or those of each level that fit the time."""
    description, runs = recorded.experiment, recorded.realizations
    period_s = description.samples_per_period / description.sample_rate_hz
    most = int(LONGEST_S / period_s / len(recorded.levels))
    chosen: list[int] = []
    for level in recorded.levels:
        members = [i for i, run in enumerate(runs) if run.level == level]
        members.sort(key=lambda i: -float(np.abs(runs[i].torque).max()))
        chosen += members[: max(most, LEAST_OF_LEVEL)]
    return sorted(chosen)


def _ending_steady(run: RecordedRealization, whole: Record) -> Record:
    def signal(periods: np.ndarray | None) -> np.ndarray | None:
        return None if periods is None else _folded(periods, run.experiment.transient_periods)

    torque, position = signal(run.torque), signal(run.position)
    assert torque is not None and position is not None
    return replace(
        whole,
        reference=signal(run.reference),
        torque=torque,
        position=position,
        link=signal(run.link),
    )


def _folded(periods: np.ndarray, transient: int) -> np.ndarray:
    """Return a transient, or the mean period where none was recorded, and the mean period."""
    mean = periods[transient:].mean(axis=0)
    return np.concatenate([periods[:transient].ravel() if transient else mean, mean])
