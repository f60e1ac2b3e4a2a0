"""Noise of the mean line spectra, from period-to-period differences.

Nonlinear distortion repeats with every period of the same reference; what does not repeat is noise.
Its power is a smooth function of frequency (a white sensor noise shaped by the closed loop), so the
scatter of a level is pooled over realizations and over neighbouring lines of the same level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .periodic import RecordedExperiment, RecordedRealization

HALF_WIDTH = 3
"""Number of neighbours on each side over which noise power is averaged, fewer at the lowest lines:
there friction lets noise wander, and its power falls steeply."""
RELATIVE_WIDTH = 0.06
"""Half width of that average relative to frequency, where it exceeds HALF_WIDTH lines."""
NUMERICAL_FLOOR = 1e-6
"""Least noise that is assumed, relative to the rms of excited lines: no simulation is better."""

ONE_PERIOD = (
    "Only one period was kept, so noise cannot be told from what repeats: no significance, no "
    "noise floor and no periodicity can be stated, and what stands at even lines counts as noise; "
    "record two periods or more."
)


@dataclass(frozen=True)
class NoiseLevels:
    """Noise of the mean spectrum over the P kept periods of one realization.

    Spectra are scaled to peak amplitude (`spectra.line_spectrum`). For lines above DC the standard
    deviation is that of the complex value, sqrt(E|V|^2), so 2 |V|^2/std^2 is chi-square with 2
    degrees of freedom; at DC it is that of the real value.

    Attributes:
        levels: the levels, as in `RecordedExperiment.levels`.
        position: float64 (levels, lines), rad.
        torque: float64 (levels, lines), N m.
        link: float64 (levels, lines), rad, of a second encoder; None without.
        dof: float64 (levels, lines), real degrees of freedom of each variance.
        measurable: bool (levels,), whether noise was seen; else the numerical floor stands there.
    """

    levels: tuple[int, ...]
    position: np.ndarray
    torque: np.ndarray
    link: np.ndarray | None
    dof: np.ndarray
    measurable: np.ndarray

    def row(self, level: int) -> int:
        """Return the row of a level."""
        return self.levels.index(level)

    def of_outputs(self, recorded: RecordedExperiment) -> np.ndarray:
        """Return the noise of y, and of q if there, of each realization (n, outputs, lines)."""
        rows = [self.row(realization.level) for realization in recorded.realizations]
        outputs = [self.position] if self.link is None else [self.position, self.link]
        return np.stack([noise[rows] for noise in outputs], axis=1)


def noise_levels(recorded: RecordedExperiment) -> NoiseLevels | None:
    """Estimate the noise of the mean spectra; None where only one period was kept (`ONE_PERIOD`).

    Several realizations of a level are pooled; one is enough.
    """
    if recorded.experiment.periods < 2:
        return None
    rows = [_level_noise(recorded, level) for level in recorded.levels]
    signals, dof, measurable = (np.array(column) for column in zip(*rows, strict=True))
    position, torque, *link = signals.transpose(1, 0, 2)
    return NoiseLevels(
        recorded.levels, position, torque, link[0] if link else None, dof, measurable
    )


def _level_noise(recorded: RecordedExperiment, level: int):
    """Return std of y, u and q (signals, lines), dof, and whether y has noise, of one level."""
    members = [r for r in recorded.realizations if r.level == level]
    lines, periods = recorded.lines, recorded.experiment.periods
    raw_dof = np.full(lines, 2.0 * len(members) * (periods - 1))
    raw_dof[0] *= 0.5
    deviations, floors = [], []
    for name in ("position", "torque", "link")[: 3 if recorded.has_link else 2]:
        power = np.mean([scatter_of_mean(r, getattr(r, name), lines) for r in members], axis=0)
        smooth, dof = smoothed(power, raw_dof)
        excited = recorded.experiment.excited_harmonics
        means = [r.spectrum(getattr(r, name), lines).mean(0)[excited] for r in members]
        floor = NUMERICAL_FLOOR * float(np.sqrt(np.mean(np.abs(means) ** 2)))
        deviations.append(np.sqrt(np.maximum(smooth, floor**2)))
        floors.append(smooth > floor**2)
    return np.array(deviations), dof, bool(np.median(floors[0]))


def even_lines_as_noise(recorded: RecordedExperiment) -> NoiseLevels:
    """Return an upper bound of the noise where only one period was kept: all that is at even lines.

    One period cannot tell noise from even distortion, so the fits must not explain either. Without
    free even lines the numerical floor stands there.
    """
    rows = [_even_level(recorded, level) for level in recorded.levels]
    position, torque, *link = np.array(rows).transpose(1, 0, 2)
    levels, dof = recorded.levels, np.full(position.shape, 2.0)
    unseen = np.zeros(len(levels), bool)
    return NoiseLevels(levels, position, torque, link[0] if link else None, dof, unseen)


def _even_level(recorded: RecordedExperiment, level: int) -> np.ndarray:
    """Return the rms at even lines of y, u and q, continued over all lines, (signals, lines)."""
    members = [r for r in recorded.realizations if r.level == level]
    lines, kinds = np.arange(recorded.lines), recorded.kinds()
    even, excited = np.flatnonzero(kinds == "even"), np.flatnonzero(kinds == "excited")
    rows = []
    for name in ("position", "torque", "link")[: 3 if recorded.has_link else 2]:
        spectra = np.array([r.spectrum(getattr(r, name), lines.size).mean(0) for r in members])
        power = np.mean(np.abs(spectra) ** 2, axis=0)
        known = np.interp(lines, even, power[even]) if even.size else np.zeros(lines.size)
        known[0] *= 0.25
        floor = NUMERICAL_FLOOR * float(np.sqrt(np.mean(power[excited])))
        rows.append(np.sqrt(np.maximum(smoothed(known, np.ones(lines.size))[0], floor**2)))
    return np.array(rows)


def scatter_of_mean(realization: RecordedRealization, signal: np.ndarray, lines: int) -> np.ndarray:
    """Return the raw variance of the mean spectrum over the kept periods, float64 (lines,).

    sum_p |X_p - mean|^2 / (P (P - 1)), of 2 (P - 1) real degrees of freedom, P - 1 at DC.
    """
    spectra = realization.spectrum(signal, lines)
    periods = len(spectra)
    return (np.abs(spectra - spectra.mean(0)) ** 2).sum(0) / (periods * (periods - 1))


def smoothed(power: np.ndarray, dof: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Average noise power over neighbouring lines, weighted by degrees of freedom.

    Args:
        power: (lines,), raw power from DC on, each of `dof` real degrees of freedom.
        dof: (lines,).

    Returns:
        (smooth power, its degrees of freedom), (lines,) each. DC has a quarter of the power of its
        neighbours: half of their amplitude by scaling.
    """
    weight = dof.copy()
    equal = power.copy()
    equal[0] *= 4.0
    count = np.concatenate([[0.0], np.cumsum(weight)])
    total = np.concatenate([[0.0], np.cumsum(weight * equal)])
    index = np.arange(power.size)
    half = np.maximum(np.clip(index, 1, HALF_WIDTH), np.rint(RELATIVE_WIDTH * index)).astype(int)
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, power.size)
    degrees = count[high] - count[low]
    smooth = (total[high] - total[low]) / degrees
    smooth[0] *= 0.25
    return smooth, degrees
