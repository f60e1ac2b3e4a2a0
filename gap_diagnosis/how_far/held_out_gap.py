"""The gap of each simulation on held-out data, with intervals: the one place that computes it.

Four figures of each stage, each the rms over held-out realizations of what one realization gives:

    position, torque   rms error of the mean period over its rms
    bla_sigma          rms over lines of |G_model - G_rig|/std of the rig's BLA
    distortion_db      rms over odd and even detection lines of the level's difference, dB

and the misfit that the fits are judged by.

G = Y/U is that of one realization, the same phases for rig and simulation. The bootstrap draws
realizations of each level with replacement (Efron 1979), from the held-out ones where every level
has two or more, else from all: its intervals say how far the figures depend on the phases that
were played. With one realization at each level they are unknown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_records.lines import Lines, classify, interpolate_frf
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from ..model.simulated_rig import Signals
from ..outcome.diagnosis import Figure, Gap, GapFigures, Gaps, StageFigures

STAGES = ("nominal", "refit", "explained")
_DRAWS = 2000
_SEEN = 3.0  # times its noise that a level must reach to be told from it

_Spectra = tuple[np.ndarray, np.ndarray]
"""Lines of y and u of one realization, complex."""


@dataclass(frozen=True)
class _Squares:
    """Squared figures of one stage by name, float64 (realizations,) each."""

    position: np.ndarray
    torque: np.ndarray
    bla_sigma: np.ndarray
    distortion_db: np.ndarray


def held_out_gap(
    recorded: RecordedExperiment,
    held: Sequence[int],
    signals: Mapping[str, Signals],
    misfits: Mapping[str, float],
    closes: bool,
) -> tuple[Gaps, GapFigures]:
    """Return the gap of each stage, and its figures with 95 % intervals.

    Args:
        recorded: the experiment.
        held: held-out realizations.
        signals: of each simulation by stage, those that diverge included.
        misfits: held-out misfit per degree of freedom by stage.
        closes: whether an effect was added, so that a share of the gap closed can be stated.
    """
    figures = _figures(recorded, held, signals, closes)
    gaps = {stage: _gap(figures, stage, misfits[stage]) for stage in STAGES}
    noise = None if figures.position.noise_floor is None else _gap(figures, "noise_floor", 1.0)
    return Gaps(**gaps, noise_floor=noise), figures


def _gap(figures: GapFigures, stage: str, misfit: float) -> Gap:
    position, torque = (getattr(part, stage) for part in (figures.position, figures.torque))
    return Gap(
        nrmse_position=None if position is None else position.value,
        nrmse_torque=None if torque is None else torque.value,
        chi2_per_dof=misfit,
    )


def _figures(
    recorded: RecordedExperiment,
    held: Sequence[int],
    signals: Mapping[str, Signals],
    closes: bool,
) -> GapFigures:
    grid = _Grid(recorded)
    stages = {name: _squares(grid, *signals[name]) for name in STAGES}
    floor = _floor(grid) if recorded.experiment.periods > 1 else None
    choice = _Choice(np.array(held), _draws(recorded, held))
    figures = {}
    for name in ("position", "torque", "bla_sigma", "distortion_db"):
        squares = {stage: getattr(found, name) for stage, found in stages.items()}
        least = np.zeros(len(recorded.realizations)) if floor is None else getattr(floor, name)
        figures[name] = StageFigures(
            **{stage: _root(values, choice) for stage, values in squares.items()},
            noise_floor=None if floor is None else _root(least, choice),
            closed=_closed(squares["refit"], squares["explained"], least, choice)
            if closes
            else None,
        )
    return GapFigures(**figures)


@dataclass(frozen=True)
class _Choice:
    """Indices of the held-out realizations, and those of each draw, (draws, held-out)."""

    held: np.ndarray
    draws: np.ndarray


def _draws(recorded: RecordedExperiment, held: Sequence[int]) -> np.ndarray:
    levels = np.array([r.level for r in recorded.realizations])
    enough = all(np.count_nonzero(levels[list(held)] == level) > 1 for level in recorded.levels)
    pool = np.array(held) if enough else np.arange(levels.size)
    rng = np.random.default_rng(0)
    return np.stack([rng.choice(pool[levels[pool] == levels[i]], _DRAWS) for i in held], axis=1)


def _squares(grid: _Grid, position: np.ndarray, torque: np.ndarray) -> _Squares:
    rows = [
        grid.squares(index, *signals)
        for index, signals in enumerate(zip(position, torque, strict=True))
    ]
    return _Squares(*np.array(rows).T)


def _floor(grid: _Grid) -> _Squares:
    """Return what a perfect simulation would leave: the noise of the mean period."""
    return _Squares(*np.array([grid.floor(index) for index in range(grid.size)]).T)


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
            return [np.nan] * 4
        r, at = self._recorded.realizations[index], self._lines.excited
        y, u = self._mean_spectra(index)
        model = line_spectrum(position, y.size), line_spectrum(torque, y.size)
        means = [(simulated, r.kept(s).mean(0)) for simulated, s in
                 ((position, r.position), (torque, r.torque))]  # fmt: skip
        errors = [float(np.mean((a - b) ** 2) / np.mean(b**2)) for a, b in means]
        far = np.abs(model[0][at] / model[1][at] - y[at] / u[at]) ** 2
        excess = [
            self._excess_db(model, (y, u), self._noise(index, lines), lines)
            for lines in (self._lines.odd, self._lines.even)
            if lines.size
        ]
        distortion = float(np.mean(np.square(excess))) if excess else np.nan
        return [*errors, float(np.mean(far / self._variance(index))), distortion]

    def floor(self, index: int) -> list[float]:
        """Return the squared figures of the noise alone."""
        r, at = self._recorded.realizations[index], self._lines.excited
        periods = self._recorded.experiment.periods
        shares = [
            float(r.kept(s).var(axis=0, ddof=1).mean() / periods / np.mean(r.kept(s).mean(0) ** 2))
            for s in (r.position, r.torque)
        ]
        torque = np.abs(self._mean_spectra(index)[1][at]) ** 2
        of_g = self._noise(index, at) / torque
        return [*shares, float(np.mean(of_g / self._variance(index))), 0.0]

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
        return np.maximum(_smooth(scatter), np.nan_to_num(noise))

    def _noise(self, index: int, at: np.ndarray) -> np.ndarray:
        """Return the noise power of Y - G U over the mean of the periods, (lines,); NaN for one."""
        r, lines = self._recorded.realizations[index], self._recorded.lines
        y, u = r.spectrum(r.position, lines), r.spectrum(r.torque, lines)
        if len(y) < 2:
            return np.full(at.size, np.nan)
        left = y[:, at] - self._response((y.mean(0), u.mean(0)), at) * u[:, at]
        scatter = (np.abs(left - left.mean(0)) ** 2).sum(0) / (len(y) * (len(y) - 1))
        return _smooth(scatter)

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


def _smooth(power: np.ndarray, half: int = 3) -> np.ndarray:
    """Average over neighbouring lines: a variance of few realizations is rough."""
    window = np.ones(2 * half + 1)
    count = np.convolve(np.ones(power.size), window, "same")
    return np.convolve(power, window, "same") / count


def _root(squares: np.ndarray, choice: _Choice) -> Figure | None:
    """Return the rms over realizations with its interval; None where a held-out one diverges."""
    value = float(np.sqrt(squares[choice.held].mean()))
    if not np.isfinite(value):
        return None
    return _figure(value, np.sqrt(squares[choice.draws].mean(axis=1)), choice)


def _closed(
    before: np.ndarray, after: np.ndarray, least: np.ndarray, choice: _Choice
) -> Figure | None:
    """Return 1 - (E_after^2 - N^2)/(E_before^2 - N^2) with its interval.

    None where that means nothing: a motion diverges, what the refit leaves cannot be told from
    noise (its own interval holds zero), or the effect brings the simulation no nearer.
    """
    there, left = before - least, after - least
    value = there[choice.held].mean()
    if not (np.isfinite(there).all() and np.isfinite(left).all() and value > 0.0):
        return None
    drawn, open_ = there[choice.draws].mean(1), np.maximum(left[choice.draws].mean(1), 0.0)
    share = float(1.0 - max(left[choice.held].mean(), 0.0) / value)
    if share <= 0.0 or np.percentile(drawn, 2.5) <= 0.0:
        return None
    return _figure(share, 1.0 - open_[drawn > 0.0] / drawn[drawn > 0.0], choice)


def _figure(value: float, drawn: np.ndarray, choice: _Choice) -> Figure:
    known = drawn.size > 0 and np.isfinite(drawn).all()
    if not (known and np.ptp(choice.draws, axis=0).any()):
        return Figure(value=value, low=None, high=None)
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Figure(value=value, low=float(min(low, value)), high=float(max(high, value)))
