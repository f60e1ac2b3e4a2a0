"""Does the rig change while it is recorded? Between periods without a model, between bags with one.

Between the periods of one bag the reference is the same, so no effect that stays what it is can
change the response. A drift changes it where the response is: on excited lines. Noise and a
decaying transient have smooth spectra, so the even lines between, which carry no excitation, tell
how much of the change is theirs.

Bags have different phases, so between them only a model compares: the residuals of a refit model
are projected on its sensitivity to friction and to stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from .model import Model, Simulator
from .noise import NoiseLevels
from .records import RecordedExperiment, spectrum
from .residual_map import line_residuals

EVEN_LINES_PER_BLOCK = 12
"""The noise falls steeply over few lines only; within a block excited and even lines alternate."""
MAX_Z = 8.0
"""Greatest score of one block: a single one may not decide alone."""
PERIOD_Z_LIMIT = 4.5
"""Of 300 records without a gap none exceeded 3.4; a drift of all friction by 1e-4 per second gives
11 or more at 6 bags of 12 s."""
BAG_Z_LIMIT = 7.0
"""Unmodelled effects reach 5.5 through a misfit that differs between bags; without a gap 3.2."""
MISFIT_WITHOUT_STRUCTURE = 8.0
"""Misfit per degree of freedom of a model up to which that holds; the more, the more it differs."""
GROUPS: dict[str, tuple[str, ...]] = {
    "friction": ("fs", "fsm", "fv", "fvm"),
    "stiffness": ("k0", "k1"),
}
"""Parameters of the bare plant that drift together."""
SEEN = 2.0
"""Standard deviations from which a level counts as one that shows a change."""
STEP = 0.01
"""Relative step of the central difference."""


@dataclass(frozen=True)
class PeriodDrift:
    """Change of y from period to period on excited lines, beyond that on even lines.

    Attributes:
        z: its significance, standard normal if nothing drifts.
        per_level: the same of each level, (levels,).
        relative: change over one period of the excited lines, rms over rms, beyond noise; the
            greatest of the levels.
    """

    z: float
    per_level: np.ndarray
    relative: float


def period_drift(recorded: RecordedExperiment) -> PeriodDrift | None:
    """Test for a drift between the periods of the bags.

    Blocks of neighbouring lines give independent F ratios of the linear trend's power on excited
    to that on even lines; their p-values are combined by Stouffer's method. None for one period,
    or where no even line is free of excitation.
    """
    if recorded.experiment.periods < 2:
        return None
    found = [_level_drift(recorded, level) for level in recorded.levels]
    z = [scores for scores, _ in found]
    every = np.concatenate(z)
    if not every.size:
        return None
    return PeriodDrift(
        float(every.sum() / np.sqrt(every.size)),
        np.array([scores.sum() / np.sqrt(max(scores.size, 1)) for scores in z]),
        max(relative for _, relative in found),
    )


def _trend(periods: int) -> np.ndarray:
    """Return the contrast of unit norm that is linear over periods, (P,)."""
    slope = np.arange(periods) - 0.5 * (periods - 1)
    return slope / np.sqrt((slope**2).sum())


def _level_drift(recorded: RecordedExperiment, level: int) -> tuple[np.ndarray, float]:
    """Return the scores of the blocks of one level, and the relative change per period."""
    members = [r for r in recorded.realizations if r.level == level]
    kinds, lines = recorded.kinds(), recorded.lines
    contrast = _trend(recorded.experiment.periods)
    spectra = np.array([r.spectrum(r.position, lines) for r in members])
    power = np.mean(np.abs(np.einsum("p,mpk->mk", contrast, spectra)) ** 2, axis=0)
    even = np.flatnonzero(kinds == "even")
    blocks = [b for b in np.array_split(even, max(even.size // EVEN_LINES_PER_BLOCK, 1)) if b.size]
    scores, excess, signal = [], 0.0, 0.0
    for block in blocks:
        excited = np.flatnonzero(kinds == "excited")
        excited = excited[(excited >= block[0] - 1) & (excited <= block[-1])]
        if not excited.size:
            continue
        ratio = power[excited].mean() / power[block].mean() if power[block].any() else 1.0
        p = stats.f.sf(ratio, 2 * len(members) * excited.size, 2 * len(members) * block.size)
        scores.append(np.clip(stats.norm.isf(p), -MAX_Z, MAX_Z))
        excess += excited.size * (power[excited].mean() - power[block].mean())
        signal += float(np.mean(np.abs(spectra.mean(1)[:, excited]) ** 2, axis=0).sum())
    per_period = max(excess, 0.0) * (contrast[1] - contrast[0]) ** 2
    return np.array(scores), float(np.sqrt(per_period / signal)) if signal else 0.0


@dataclass(frozen=True)
class BagDrift:
    """Change of one group of parameters from bag to bag, as the residuals of a model show it.

    Attributes:
        group: friction or stiffness.
        deviation: (realizations,), relative deviation of the group in each bag from the model.
        std: (realizations,), its standard deviation, widened by the misfit that the group does not
            explain.
        z: significance of differences between the bags of a level, standard normal if there are
            none.
        slope_per_s: relative change per second of the record, as bags differ within levels.
        levels_agree: whether two levels (or the only one) show a change of the same sign; what a
            wrong model leaves may differ in one.
    """

    group: str
    deviation: np.ndarray
    std: np.ndarray
    z: float
    slope_per_s: float
    levels_agree: bool


def bag_drift(
    recorded: RecordedExperiment, noise: NoiseLevels, simulator: Simulator, model: Model
) -> list[BagDrift] | None:
    """Test whether friction or stiffness differ between bags, given a refit model.

    Only bags of the same level are compared: what a wrong model leaves is much alike in them, but
    differs between levels. None where no level has two bags, or the model diverges.
    """
    levels = np.array([r.level for r in recorded.realizations])
    if np.unique(levels).size == levels.size:
        return None
    position = simulator.signals(model)[0]
    residuals = line_residuals(recorded, "position", position)
    std = np.array([noise.position[noise.row(level)] for level in levels])
    scale = np.sqrt(2.0) / std
    scale[:, 0] /= np.sqrt(2.0)
    groups = {name: g for name, g in GROUPS.items() if set(g) & set(model.plant)}
    sensitivity = np.array([_sensitivity(recorded, simulator, model, g) for g in groups.values()])
    if not np.isfinite(residuals).all() or not np.isfinite(sensitivity).all():
        return None
    columns = _parts(sensitivity * scale).transpose(1, 2, 0)
    fits = [_fit(a, b) for a, b in zip(columns, _parts(residuals * scale), strict=True)]
    deviation, spread = (np.array(column) for column in zip(*fits, strict=True))
    elapsed_s = np.array([r.experiment.elapsed_s for r in recorded.realizations])
    return [
        BagDrift(
            group,
            deviation[:, i],
            spread[:, i],
            _difference_z(deviation[:, i], spread[:, i], levels),
            _slope(deviation[:, i], spread[:, i], levels, elapsed_s)[0],
            _agree(deviation[:, i], spread[:, i], levels, elapsed_s),
        )
        for i, group in enumerate(groups)
    ]


def _parts(lines: np.ndarray) -> np.ndarray:
    """Return real and imaginary parts of lines (..., lines) beside each other; DC is real."""
    return np.concatenate([lines.real, lines[..., 1:].imag], axis=-1)


def _sensitivity(
    recorded: RecordedExperiment, simulator: Simulator, model: Model, names: Sequence[str]
) -> np.ndarray:
    """Return dY/d(ln of the named parameters), complex (realizations, lines)."""
    ends = []
    for factor in (1.0 + STEP, 1.0 - STEP):
        changed = {name: factor * model.plant[name] for name in names if name in model.plant}
        plant = {**model.plant, **changed}
        ends.append(spectrum(simulator.signals(Model(plant, model.effects))[0], recorded.lines))
    return (ends[0] - ends[1]) / (2.0 * STEP)


def _fit(columns: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return least-squares deviations and their std, widened by what they leave, (groups,) each."""
    solution = np.linalg.lstsq(columns, errors, rcond=None)[0]
    left = errors - columns @ solution
    chi2 = float(left @ left) / (errors.size - columns.shape[1])
    covariance = np.linalg.inv(columns.T @ columns) * max(chi2, 1.0)
    return solution, np.sqrt(np.diag(covariance))


def _within(values: np.ndarray, std: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return values less the weighted mean of their level."""
    out = values.astype(float)
    for level in np.unique(levels):
        mine = levels == level
        out[mine] -= np.average(values[mine], weights=std[mine] ** -2.0)
    return out


def _difference_z(deviation: np.ndarray, std: np.ndarray, levels: np.ndarray) -> float:
    """Return the significance of differences within levels as a normal score."""
    q = float(np.sum((_within(deviation, std, levels) / std) ** 2))
    degrees = levels.size - np.unique(levels).size
    return float(stats.norm.isf(np.clip(stats.chi2.sf(q, degrees), 1e-300, 1.0 - 1e-15)))


def _slope(
    deviation: np.ndarray, std: np.ndarray, levels: np.ndarray, elapsed_s: np.ndarray
) -> tuple[float, float]:
    """Return the change per second within levels, and its standard deviation."""
    time = _within(elapsed_s, std, levels)
    weight = std**-2.0
    power = float(np.sum(weight * time**2))
    return float(np.sum(weight * time * deviation)) / power, power**-0.5


def _agree(
    deviation: np.ndarray, std: np.ndarray, levels: np.ndarray, elapsed_s: np.ndarray
) -> bool:
    """Tell whether two levels, or the only one that can, show a change of the same sign."""
    members = [np.flatnonzero(levels == level) for level in np.unique(levels)]
    members = [at for at in members if at.size > 1]
    slopes = [_slope(deviation[at], std[at], levels[at], elapsed_s[at]) for at in members]
    seen = [slope > 0.0 for slope, spread in slopes if abs(slope) > SEEN * spread]
    return max(seen.count(True), seen.count(False)) >= min(len(members), 2)
