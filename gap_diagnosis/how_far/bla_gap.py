"""The gap of steady periods in BLA and distortion, on held-out realizations, with intervals.

Two figures of each stage, each the rms over held-out realizations of what one realization gives:

    bla_sigma          rms over lines of |G_model - G_rig|/std of the rig's BLA
    distortion_db      rms over odd and even detection lines of the level's difference, dB

G = Y/U is that of one realization, the same phases for rig and simulation. The bootstrap draws
realizations of each level, from the held-out ones where every level has two or more, else from all:
its intervals say how far the figures depend on the phases that were played. With one realization at
each level they are unknown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fjr_records.lines import Lines, classify, interpolate_frf, local_mean
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from ..model.simulated_rig import Signals
from ..outcome.gap_size import StageFigures
from .bootstrap import Choice, stage_figures

STAGES = ("nominal", "refit", "explained")
_SMOOTHED = 7  # lines, since a variance of few realizations is rough
_SEEN = 3.0  # times its noise that a level must reach to be told from it

_Spectra = tuple[np.ndarray, np.ndarray]
"""Lines of y and u of one realization, complex."""


def bla_gap(
    recorded: RecordedExperiment,
    held: Sequence[int],
    signals: Mapping[str, Signals],
    closes: bool,
) -> dict[str, StageFigures]:
    """Return the figures of each stage by name, with 95 % intervals.

    Args:
        recorded: the experiment.
        held: held-out realizations.
        signals: of each simulation by stage, those that diverge included.
        closes: whether an effect was added, so that a share of the gap closed can be stated.
    """
    grid = _Grid(recorded)
    stages = {name: _squares(grid, *signals[name]) for name in STAGES}
    floor = _floor(grid) if recorded.experiment.periods > 1 else None
    choice = Choice.among(held, np.array([r.level for r in recorded.realizations]))
    return {
        name: stage_figures(
            {stage: found[row] for stage, found in stages.items()},
            None if floor is None else floor[row],
            choice,
            closes,
        )
        for row, name in enumerate(("bla_sigma", "distortion_db"))
    }


def _squares(grid: _Grid, position: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return both figures squared, float64 (2, realizations)."""
    rows = [
        grid.squares(index, *signals)
        for index, signals in enumerate(zip(position, torque, strict=True))
    ]
    return np.array(rows).T


def _floor(grid: _Grid) -> np.ndarray:
    """Return what a perfect simulation would leave, (2, realizations): the noise of the mean."""
    return np.array([grid.floor(index) for index in range(grid.size)]).T


class _Grid:
    """Lines and realizations of an experiment, and how well its BLA is known."""

    def __init__(self, recorded: RecordedExperiment) -> None:
        description = recorded.experiment
        self._recorded = recorded
        self._lines: Lines = classify(
            description.excited_harmonics, description.detection_harmonics
        )

    @property
    def size(self) -> int:
        """Number of realizations."""
        return len(self._recorded.realizations)

    def squares(self, index: int, position: np.ndarray, torque: np.ndarray) -> list[float]:
        """Return the squared figures of one realization; NaN where the motion diverges."""
        if not (np.isfinite(position).all() and np.isfinite(torque).all()):
            return [np.nan] * 2
        at = self._lines.excited
        y, u = self._mean_spectra(index)
        model = line_spectrum(position, y.size), line_spectrum(torque, y.size)
        far = np.abs(model[0][at] / model[1][at] - y[at] / u[at]) ** 2
        excess = [
            self._excess_db(model, (y, u), self._noise(index, lines), lines)
            for lines in (self._lines.odd, self._lines.even)
            if lines.size
        ]
        distortion = float(np.mean(np.square(excess))) if excess else np.nan
        return [float(np.mean(far / self._variance(index))), distortion]

    def floor(self, index: int) -> list[float]:
        """Return the squared figures of the noise alone."""
        at = self._lines.excited
        torque = np.abs(self._mean_spectra(index)[1][at]) ** 2
        of_g = self._noise(index, at) / torque
        return [float(np.mean(of_g / self._variance(index))), 0.0]

    def _mean_spectra(self, index: int) -> _Spectra:
        r, lines = self._recorded.realizations[index], self._recorded.lines
        return r.spectrum(r.position, lines).mean(0), r.spectrum(r.torque, lines).mean(0)

    def _variance(self, index: int) -> np.ndarray:
        """Return the variance of the rig's BLA at the level of a realization, (excited,).

        Nonlinearity and noise, or noise alone where a level has one realization.
        """
        at, level = self._lines.excited, self._recorded.realizations[index].level
        members = [i for i, r in enumerate(self._recorded.realizations) if r.level == level]
        spectra = [self._mean_spectra(i) for i in members]
        y, u = (np.array([s[i][at] for s in spectra]) for i in (0, 1))
        turn = np.exp(-1j * np.angle(u))
        g = (y * turn).sum(0) / (u * turn).sum(0)
        power = np.abs(u).mean(0) ** 2
        noise = np.mean([self._noise(i, at) for i in members], axis=0) / power / len(members)
        if len(members) < 2:
            return noise
        scatter = (np.abs(y - g * u) ** 2).sum(0) / (len(members) * (len(members) - 1) * power)
        return np.maximum(local_mean(scatter, _SMOOTHED), np.nan_to_num(noise))

    def _noise(self, index: int, at: np.ndarray) -> np.ndarray:
        """Return the noise power of Y - G U over the mean of the periods, (lines,); NaN for one."""
        r, lines = self._recorded.realizations[index], self._recorded.lines
        y, u = r.spectrum(r.position, lines), r.spectrum(r.torque, lines)
        if len(y) < 2:
            return np.full(at.size, np.nan)
        left = y[:, at] - self._response((y.mean(0), u.mean(0)), at) * u[:, at]
        scatter = (np.abs(left - left.mean(0)) ** 2).sum(0) / (len(y) * (len(y) - 1))
        return local_mean(scatter, _SMOOTHED)

    def _response(self, spectra: _Spectra, at: np.ndarray) -> np.ndarray:
        excited = self._lines.excited
        return interpolate_frf(at, excited, spectra[0][excited] / spectra[1][excited])

    def _excess_db(
        self, model: _Spectra, rig: _Spectra, noise: np.ndarray, at: np.ndarray
    ) -> float:
        """Return by how many dB the distortion at lines exceeds the rig's, noise added to it.

        What lies below three times the noise counts as lying there: it cannot be told.
        """
        floor = float(np.mean(np.nan_to_num(noise))) + 1e-300
        simulated = max(self._distortion(model, at) + floor, _SEEN * floor)
        return float(10.0 * np.log10(simulated / max(self._distortion(rig, at), _SEEN * floor)))

    def _distortion(self, spectra: _Spectra, at: np.ndarray) -> float:
        """Return the mean power of Yc = Y - G U at lines."""
        yc = spectra[0][at] - self._response(spectra, at) * spectra[1][at]
        return float(np.mean(np.abs(yc) ** 2))
