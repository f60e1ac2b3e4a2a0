"""How far an effect shows in the position, found on the second plant itself.

The change that an effect makes is compared on the DFT lines up to the highest that counts, at the
first run of each level. What a change of the bare parameters would take over is projected out,
with slopes of the bare plant: no fit is iterated. The detection limit of an effect is the size at
which, at the level where it shows best, three times the floor are left. The floor is what averaging
leaves of the noise and 0.1 % of the signal: what a simulation may be off by discretisation alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fjr_kit.showing import BareRefit

from .excitations import Run

FLOORS = 3.0
"""How many times the floor an effect at its detection limit changes the position."""

_REPEATABILITY = 1e-3
_STEP = 0.02

Player = Callable[[Mapping[str, float], Mapping[str, float]], list[np.ndarray]]
"""Returns y of the first run of each level for a plant and settings, without noise."""


class Visibility:
    """Changes of the position, relative to its rms at each level."""

    def __init__(
        self, runs: Sequence[Run], play: Player, plant: Mapping[str, float], noise_rad: float
    ) -> None:
        """Play the bare plant and its parameter changes."""
        self._runs, self._play, self._plant = runs, play, dict(plant)
        base = self._spectra(plant, {})
        self._signal = [_rms(spectrum) for spectrum in base]
        averaged = [2.0 * noise_rad / math.sqrt(run.kept) for run in runs]
        self._floors = [
            math.hypot(noise / signal, _REPEATABILITY)
            for noise, signal in zip(averaged, self._signal, strict=True)
        ]
        self._base = self._weighed(base)
        names = _free(plant)
        slopes = np.array([self._slope(name) for name in names]).T
        self._refit = BareRefit(plant, names, slopes)

    def change(self, plant: Mapping[str, float], settings: Mapping[str, float]) -> np.ndarray:
        """Return the change by settings from the bare plant, real (equations,)."""
        return self._weighed(self._spectra(plant, settings)) - self._base

    def between(self, one: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> np.ndarray:
        """Return the change from one set of positions to another, real (equations,)."""
        return self._weighed(self._lines(one)) - self._weighed(self._lines(other))

    def left(self, change: np.ndarray) -> np.ndarray:
        """Return what a refit of the bare parameters cannot take over."""
        return self._refit.left(change)

    def left_by_refit(
        self,
        target: Sequence[np.ndarray],
        play: Callable[[Mapping[str, float]], Sequence[np.ndarray]],
    ) -> np.ndarray:
        """Return what a refit of the bare parameters leaves of target positions, (equations,).

        A large effect, such as an eccentric encoder, which scales all parameters, bends them so far
        that slopes at the true ones mislead.

        Args:
            target: positions with the effect.
            play: returns positions without it for other bare parameters.

        Raises:
            Unsuitable: the motion diverges on the way.
        """
        return self._refit.left_by_refit(
            lambda plant: self.between(target, play(plant)), self.share
        )

    def relative(self, change: np.ndarray) -> float:
        """Return how far a change shows once refitted, over what the detection limit shows."""
        parts = np.split(self.left(change), self._ends)
        shown = [_size(part) / floor for part, floor in zip(parts, self._floors, strict=True)]
        return max(shown) / FLOORS

    def share(self, change: np.ndarray) -> float:
        """Return the rms of a change over that of the position, all levels counting the same."""
        return math.sqrt(np.mean([_size(part) ** 2 for part in np.split(change, self._ends)]))

    @property
    def _ends(self) -> np.ndarray:
        return np.cumsum([2 * run.lines for run in self._runs])[:-1]

    def _spectra(
        self, plant: Mapping[str, float], settings: Mapping[str, float]
    ) -> list[np.ndarray]:
        return self._lines(self._play(plant, settings))

    def _lines(self, positions: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [run.spectrum(y) for run, y in zip(self._runs, positions, strict=True)]

    def _weighed(self, spectra: Sequence[np.ndarray]) -> np.ndarray:
        parts = [
            np.concatenate([lines.real, lines.imag]) / signal
            for lines, signal in zip(spectra, self._signal, strict=True)
        ]
        return np.concatenate(parts)

    def _slope(self, name: str) -> np.ndarray:
        up, down = (
            self.change({**self._plant, name: self._plant[name] * factor}, {})
            for factor in (1.0 + _STEP, 1.0 - _STEP)
        )
        return (up - down) / (2.0 * _STEP)


def _free(plant: Mapping[str, float]) -> list[str]:
    """Return the parameters that a refit would free: those that are there."""
    names = [name for name, value in plant.items() if value != 0.0]
    rigid = math.isinf(plant["k0"])
    return [name for name in names if not rigid or name in ("jm", "fsm", "fvm")]


def _rms(spectrum: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.abs(spectrum) ** 2)))


def _size(part: np.ndarray) -> float:
    """Return the rms of complex lines that are written as reals."""
    return float(np.sqrt(2.0 * np.mean(part**2)))
