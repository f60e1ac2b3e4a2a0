"""The detection limit of an effect, found on the second plant itself.

It is the size at which the steady position changes by three times the floor, after a refit of the
eight bare parameters. Both are compared on the DFT lines up to the highest excited,
at the level where the change shows best. The floor is what averaging over periods leaves of the
noise, and 0.1 % of the signal: what a simulation may be off by discretisation alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from . import second_plant
from .draws import Draw

FLOORS = 3.0
"""How many times the floor an effect at its detection limit changes the position."""

_STEPS_PER_SECOND = 50_000
_REPEATABILITY = 1e-3
_STEP = 0.02
_REFITS, _MOST_CHANGE = 4, 0.3  # steps of a refit; of a logarithm in one step


@dataclass(frozen=True)
class Run:
    """One realization to be played: reference and noise over all periods, and when it starts."""

    reference: np.ndarray
    noise: np.ndarray
    elapsed_s: float
    samples_per_period: int
    periods: int
    lines: int


def play(
    run: Run, plant: Mapping[str, float], settings: Mapping[str, float]
) -> second_plant.Record:
    """Simulate one realization, coarsely."""
    return second_plant.simulate(
        run.reference,
        plant,
        settings,
        noise=run.noise,
        elapsed_s=run.elapsed_s,
        steps_per_second=_STEPS_PER_SECOND,
    )


def _lines(run: Run, signal: np.ndarray) -> np.ndarray:
    """Return the DFT lines of the kept periods, complex (periods, lines), peak amplitudes."""
    kept = signal[-run.periods * run.samples_per_period :].reshape(run.periods, -1)
    return np.fft.rfft(kept, axis=1)[:, : run.lines] * (2.0 / run.samples_per_period)


class Visibility:
    """How far an effect shows above the floor once the bare parameters are refitted.

    Attributes:
        peaks: greatest |u| (`torque`, N m) and sample-to-sample slope (`torque_rate`, N m/s).
    """

    def __init__(self, runs: Sequence[Run], plant: Mapping[str, float]) -> None:
        """Play the bare plant and its parameter changes; one run for each level."""
        self._runs, self._plant = runs, plant
        records = [play(run, plant, {}) for run in runs]
        spectra = [_lines(run, record.y) for run, record in zip(runs, records, strict=True)]
        self._floors = [_floor(spectrum) for spectrum in spectra]
        self._base = self._weigh(spectra)
        columns = [self._slope(name) for name in plant]
        stacked = np.concatenate([_real(column) for column in np.transpose(columns, (1, 0, 2))], 1)
        self._slopes = stacked.T
        self._inverse = np.linalg.pinv(self._slopes)
        torques = [
            record.u[run.samples_per_period :] for run, record in zip(runs, records, strict=True)
        ]
        rate = second_plant.Loop().sample_rate_hz
        self.peaks = {
            "torque": max(np.abs(u).max() for u in torques),
            "torque_rate": max(np.abs(np.diff(u)).max() for u in torques) * rate,
        }

    def _slope(self, name: str) -> np.ndarray:
        """Return the change of the lines over the floor by a parameter's relative change."""
        up, down = (
            self._change({**self._plant, name: self._plant[name] * factor}, {})
            for factor in (1.0 + _STEP, 1.0 - _STEP)
        )
        return (up - down) / (2.0 * _STEP)

    def _weigh(self, spectra: Sequence[np.ndarray]) -> np.ndarray:
        means = [spectrum.mean(0) for spectrum in spectra]
        return np.array([m / floor for m, floor in zip(means, self._floors, strict=True)])

    def _change(self, plant: Mapping[str, float], settings: Mapping[str, float]) -> np.ndarray:
        """Return the change of the lines over the floor, complex (levels, lines)."""
        played = [_lines(run, play(run, plant, settings).y) for run in self._runs]
        return self._weigh(played) - self._base

    def of(self, settings: Mapping[str, float]) -> float:
        """Return the rms change over the floor at the level where it shows best, after a refit.

        The refit takes Gauss-Newton steps with the slopes of the bare plant, so that an effect that
        only scales the parameters, however much, does not count as seen.
        """
        plant = dict(self._plant)
        left = np.inf
        for _ in range(_REFITS):
            try:
                change = _real(self._change(plant, settings)).ravel()
            except FloatingPointError:
                break
            steps = -(self._inverse @ change)
            rest = change + self._slopes @ steps
            shown = np.sqrt(np.mean(rest.reshape(len(self._runs), -1) ** 2, 1) * 2.0).max()
            left = min(left, float(shown))
            factors = np.exp(np.clip(steps, -_MOST_CHANGE, _MOST_CHANGE))
            plant = {n: v * f for (n, v), f in zip(plant.items(), factors.tolist(), strict=True)}
            if np.abs(steps).max() < _STEP:
                break
        return left


def _real(lines: np.ndarray) -> np.ndarray:
    """Return complex (..., lines) as real (..., 2 lines)."""
    return np.concatenate([lines.real, lines.imag], axis=-1)


def _floor(spectrum: np.ndarray) -> float:
    """Return the rms of a line of the mean over periods, by noise and by repeatability."""
    periods = spectrum.shape[0]
    noise = np.mean(np.var(spectrum, axis=0, ddof=1)) / periods
    signal = np.mean(np.abs(spectrum.mean(0)) ** 2)
    return float(np.sqrt(noise + _REPEATABILITY**2 * signal))


class Sizes:
    """Finds sizes of an effect by how far they show."""

    def __init__(self, draw: Draw, visibility: Visibility) -> None:
        """Take an effect and what tells how far it shows."""
        self._draw, self._visibility = draw, visibility
        self._known: dict[float, float] = {}

    @property
    def limit(self) -> float | None:
        """Size at the detection limit; None if no sensible size reaches it."""
        return self.showing(1.0)

    def relative(self, size: float) -> float:
        """Return how far a size shows, over what the detection limit shows."""
        if size not in self._known:
            settings = self._draw.settings(size, self._visibility.peaks)
            self._known[size] = self._visibility.of(settings) / FLOORS
        return self._known[size]

    def showing(self, relative: float) -> float | None:
        """Return the size that shows that many times the detection limit, within a tenth.

        Secant search on log size; None if even `draw.most` shows less, `draw.least` if that shows
        more.
        """
        low, high = max(self._draw.most * 1e-5, self._draw.least), self._draw.most
        if self._draw.least and self.relative(low) > relative:
            return low
        if self.relative(high) < relative:
            return None
        size = min(self._draw.start, high)
        for _ in range(14):
            ratio = self.relative(size) / relative
            if abs(ratio - 1.0) < 0.1:
                break
            low, high = (size, high) if ratio < 1.0 else (low, size)
            guess = size / ratio if ratio > 0.0 else 0.0
            size = guess if low * 1.05 < guess < high / 1.05 else float(np.sqrt(low * high))
        return size
