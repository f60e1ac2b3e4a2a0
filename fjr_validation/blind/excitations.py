"""What is played on a rig: multisines, or records that are not periodic, in levels and runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from excitation_node import multisine, records
from fjr_interface.experiment import Experiment, RecordDescription

from .rigs import Rig, log_uniform

RECORDS = ("chirp", "noise", "trapezoid", "steps")
LARGEST_RAD = (0.02, 0.5)
"""Range of the reference's rms at the highest level, of slow rigs."""
_SLOW_HZ = 3.0  # crossover above which motions get smaller
_PERIODS_S = (4.0, 5.0, 8.0)
_RECORDS_S = (10.0, 20.0)
_MOST_SAMPLES = 450_000  # of all runs of a case together
_REPEATS_SHARE = 0.5
_FLAT_SHARE = 0.3

Description = Experiment | RecordDescription


@dataclass(frozen=True, eq=False)
class Run:
    """One run to be played.

    Attributes:
        description: what its bag says of it.
        reference: r over the whole run, float64 (samples,) in rad.
        period: samples of a period; those of the whole run where it has none.
        kept: samples at its end that count.
        lines: DFT lines that count, from zero up to the highest excited one.
    """

    description: Description
    reference: np.ndarray
    period: int
    kept: int
    lines: int

    @property
    def level(self) -> int:
        """Its level."""
        return self.description.level

    def spectrum(self, signal: np.ndarray) -> np.ndarray:
        """Return the lines that count of the mean period kept: complex (lines,), peak values."""
        mean = signal[-self.kept :].reshape(-1, self.period).mean(0)
        return np.fft.rfft(mean)[: self.lines] * (2.0 / self.period)


@dataclass(frozen=True)
class Excitation:
    """All runs of a case, level after level.

    Attributes:
        kind: multisine, or one of RECORDS.
        runs: in the order in which they are played.
    """

    kind: str
    runs: tuple[Run, ...]

    @property
    def firsts(self) -> tuple[Run, ...]:
        """The first run of each level."""
        return tuple(run for run in self.runs if run.description.realization == 0)


def draw_multisine(rng: np.random.Generator, rig: Rig) -> Excitation:
    """Return a periodic experiment for a rig."""
    levels, rate = _levels(rng, rig), rig.loop.sample_rate_hz
    period = float(rng.choice([p for p in _PERIODS_S if p >= 4.0 / rig.crossover_hz] or [8.0]))
    realizations = int(rng.integers(2, 4))
    while len(levels) * realizations * 3 * period * rate > _MOST_SAMPLES and realizations > 2:
        realizations -= 1
    if len(levels) * realizations * 3 * period * rate > _MOST_SAMPLES:
        period, levels = min(period, 5.0), levels[-2:]
    values = multisine.EXCITATION.check({
        "sample_rate_hz": rate,
        "base_frequency_hz": 1.0 / period,
        "f_min_hz": 1.0 / period,
        "f_max_hz": math.floor(rig.band_hz * period) / period,
        "grid": str(rng.choice(["odd_random", "odd_random", "odd", "full"])),
        "amplitudes_rad": tuple(levels),
        "realizations": realizations,
        "periods": 2,
        "transient_periods": 1,
        "seed": int(rng.integers(2**31)),
    })  # fmt: skip
    grid = multisine.describe(values, 0, 0).excited_harmonics
    corner = rig.crossover_hz * rng.uniform(1.0, 4.0)
    flat = rng.random() < _FLAT_SHARE
    shape = np.ones(len(grid)) if flat else 1.0 / (1.0 + np.array(grid) / (period * corner))
    values["line_shape"] = tuple((shape / math.sqrt(np.sum(shape**2) / 2.0)).tolist())
    runs = []
    for level in range(len(levels)):
        for realization in range(realizations):
            made = multisine.describe(values, level, realization, dict(rig.controller))
            n = made.samples_per_period
            reference = multisine.reference(made)
            runs.append(Run(made, reference, n, n * made.periods, max(grid) + 1))
    return Excitation("multisine", tuple(runs))


def draw_records(
    rng: np.random.Generator, rig: Rig, *, controller_known: bool, kind: str | None = None
) -> Excitation:
    """Return an experiment of records that are not periodic, from rest."""
    kind = kind or str(rng.choice(RECORDS))
    levels, rate = _levels(rng, rig), rig.loop.sample_rate_hz
    runs_per_level = int(rng.choice([1, 1, 2, 3]))
    duration = rng.uniform(*_RECORDS_S)
    while len(levels) * runs_per_level * duration * rate > _MOST_SAMPLES and runs_per_level > 1:
        runs_per_level -= 1
    duration = max(min(duration, _MOST_SAMPLES / (len(levels) * rate)), _RECORDS_S[0])
    samples = round(duration * rate)
    repeats = rng.random() < _REPEATS_SHARE
    draw = _DRAWERS[kind](rng, rig)
    seeds = rng.integers(2**31, size=(len(levels), runs_per_level))
    runs = []
    for level, rms in enumerate(levels):
        for realization in range(runs_per_level):
            seed = int(seeds[level, 0 if repeats else realization])
            reference = draw(samples, np.random.default_rng(seed))
            reference *= rms / np.std(reference)
            described = RecordDescription.of(
                "record",
                sample_rate_hz=rate,
                realization=realization,
                realizations=runs_per_level,
                level=level,
                levels=len(levels),
                repeat_of=0 if repeats and realization else None,
                controller=dict(rig.controller) if controller_known else None,
                samples=samples,
            )
            lines = math.ceil(rig.band_hz * samples / rate) + 1
            runs.append(Run(described, reference, samples, samples, lines))
    return Excitation(kind, tuple(runs))


def _levels(rng: np.random.Generator, rig: Rig) -> list[float]:
    """Return the reference's rms at each level, rising; the faster the rig, the smaller."""
    top, step = log_uniform(rng, *LARGEST_RAD), rng.uniform(1.5, 3.0)
    top *= min(1.0, _SLOW_HZ / rig.crossover_hz)
    count = int(rng.integers(2, 4))
    return [float(top / step ** (count - 1 - level)) for level in range(count)]


Reference = Callable[[int, np.random.Generator], np.ndarray]
"""Returns so many samples of a reference of any size, with what differs from run to run."""


def _chirp(rng: np.random.Generator, rig: Rig) -> Reference:
    rate, low = rig.loop.sample_rate_hz, rng.uniform(0.1, 0.4)
    sweep: Any = str(rng.choice(["linear", "logarithmic"]))

    def draw(samples: int, chance: np.random.Generator) -> np.ndarray:
        top = rig.band_hz * chance.uniform(0.7, 1.0)
        return records.chirp(
            samples, rate, amplitude_rad=1.0, f_min_hz=low, f_max_hz=top, sweep=sweep
        )

    return draw


def _noise(rng: np.random.Generator, rig: Rig) -> Reference:
    rate, low = rig.loop.sample_rate_hz, rng.uniform(0.1, 0.3)
    top = rig.band_hz * log_uniform(rng, 0.2, 1.0)

    def draw(samples: int, chance: np.random.Generator) -> np.ndarray:
        seed = int(chance.integers(2**31))
        return records.noise(samples, rate, rms_rad=1.0, f_min_hz=low, f_max_hz=top, seed=seed)

    return draw


def _targets(chance: np.random.Generator) -> Sequence[float]:
    """Return targets on both sides of zero, none of them small."""
    sizes = chance.uniform(0.4, 1.0, 6)
    return (sizes * np.where(np.arange(6) % 2, -1.0, 1.0)).tolist()


def _trapezoid(rng: np.random.Generator, rig: Rig) -> Reference:
    rate, omega = rig.loop.sample_rate_hz, 2.0 * math.pi * rig.crossover_hz
    dwell = rng.uniform(0.1, 0.5)
    acceleration = omega**2 * log_uniform(rng, 0.05, 0.5)
    speeds = omega * np.sort(rng.uniform(0.1, 0.5, 3))

    def draw(samples: int, chance: np.random.Generator) -> np.ndarray:
        return records.trapezoid(
            samples,
            rate,
            targets_rad=_targets(chance),
            velocity_rad_s=speeds.tolist(),
            acceleration_rad_s2=acceleration,
            dwell_s=dwell,
        )

    return draw


def _steps(rng: np.random.Generator, rig: Rig) -> Reference:
    rate = rig.loop.sample_rate_hz
    hold = float(np.clip(rng.uniform(3.0, 8.0) / rig.crossover_hz, 0.4, 2.0))

    def draw(samples: int, chance: np.random.Generator) -> np.ndarray:
        return records.steps(samples, rate, targets_rad=_targets(chance), hold_s=hold)

    return draw


_DRAWERS: Mapping[str, Callable[[np.random.Generator, Rig], Reference]] = {
    "chirp": _chirp, "noise": _noise, "trapezoid": _trapezoid, "steps": _steps,
}  # fmt: skip
