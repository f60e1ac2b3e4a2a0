"""Plain ways to diagnose, which the project's own is compared with.

refit    fit the bare parameters, name nothing
bic      fit the effects of the catalogue that promise most linearly after the refit; the lowest
         BIC is named
sparse   sequentially thresholded least squares (Brunton et al. 2016) of what the refit leaves
         on the linearised features of all effects; BIC chooses the threshold
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gap_diagnosis.outcome.diagnosis import Diagnosis, Stage, Verdict
from gap_diagnosis.outcome.gap_size import Gap
from gap_diagnosis.starts.catalogue import catalogue
from gap_diagnosis.starts.search_space import starts

from .baseline_fit import Problem, fit, jacobian, verdict_of

_UNDETECTED = 1.5  # chi2 per equation below which there is nothing left to explain
_STEPS_OF_EFFECT = 3
_MOST_NAMED = 3
_MOST_FITTED = 4  # effects that `bic` fits: those whose linear gain is greatest
_FOR_FITS = 0.5  # of the budget
_ANGLES = ("phase_rad", "angle_rad")


@dataclass(frozen=True)
class _Refit:
    problem: Problem
    values: dict[str, float]
    residual: np.ndarray
    before: np.ndarray

    @property
    def gaps(self) -> dict[Stage, Gap]:
        gap = self.problem.gap_of
        return {"nominal": gap(self.problem.nominal), "refit": gap(self.values)}

    @property
    def without_effect(self) -> Verdict:
        return "no_gap" if np.mean(self.before**2) < _UNDETECTED else "parameters_only"


def _refitted(folder: Path, nominal: Mapping[str, float]) -> _Refit:
    problem = Problem(folder, nominal)
    before = problem.residual(problem.nominal)
    values, residual = fit(problem, problem.nominal, problem.fitted)
    return _Refit(problem, values, residual, before)


def refit_only(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by the parameter fit alone: good enough, or unexplained."""
    refit = _refitted(folder, nominal)
    explained = np.mean(refit.residual**2) < _UNDETECTED
    found = refit.without_effect if explained else "unexplained"
    return verdict_of(refit.problem, refit.gaps, refit.values, {}, found)


def _projected(basis: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return vector - basis @ (basis.T @ vector)


def _features(refit: _Refit, basis: np.ndarray) -> list[tuple[str, dict[str, float], np.ndarray]]:
    """Return (effect, values, change of the residual beyond any refit) of the starting points.

    All effects have their first start tried before any has its second, for half of the budget.
    """
    found = []
    problem = refit.problem
    points = {
        e: starts(e, problem.scales, None, problem.nominal) for e in catalogue(problem.nominal)
    }
    for row in itertools.zip_longest(*points.values()):
        for effect, point in zip(points, row, strict=True):
            if point is None or problem.seconds_left < _FOR_FITS * problem.budget_s:
                continue
            residual = problem.residual({**refit.values, **point})
            if np.isfinite(residual).all():
                found.append((effect, point, _projected(basis, residual - refit.residual)))
    return found


def _gain(feature: np.ndarray, left: np.ndarray) -> float:
    """Return by how much chi2 falls along a feature; only in its direction, not against it."""
    power = feature @ feature
    along = -(feature @ left)
    return float(along * along / power) if power > 0.0 and along > 0.0 else 0.0


def lowest_bic(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by the lowest BIC over the bare plant and every single effect."""
    refit = _refitted(folder, nominal)
    bare = refit.problem.fitted
    slopes = jacobian(refit.problem, refit.values, bare, refit.residual)
    basis = np.linalg.qr(slopes)[0]
    left = _projected(basis, refit.residual)
    features = _features(refit, basis)
    penalty = np.log(refit.problem.equations)
    outcomes = [(refit.residual @ refit.residual + len(bare) * penalty, "", refit.values)]
    gains = [(_gain(change, left), name, point) for name, point, change in features]
    best = {name: (gain, point) for gain, name, point in sorted(gains, key=lambda one: one[0])}
    hopeful = sorted(best, key=lambda name: -best[name][0])[:_MOST_FITTED]
    for effect in hopeful:
        gain, point = best[effect]
        if gain <= penalty:
            continue
        free = (
            *bare,
            *(name for name, value in point.items() if value != 0.0 or name.endswith(_ANGLES)),
        )
        values, residual = fit(refit.problem, {**refit.values, **point}, free, _STEPS_OF_EFFECT)
        outcomes.append((residual @ residual + len(free) * penalty, effect, values))
    return _bic_verdict(refit, sorted(outcomes, key=lambda outcome: outcome[0]))


def _bic_verdict(refit: _Refit, outcomes: list[tuple[float, str, dict[str, float]]]) -> Diagnosis:
    best, effect, values = outcomes[0]
    weights = np.exp(-0.5 * (np.array([bic for bic, _, _ in outcomes]) - best))
    present = {effect: float(1.0 / weights.sum())} if effect else {}
    gaps = refit.gaps
    if effect:
        gaps["cause"] = refit.problem.gap_of(values)
    return verdict_of(refit.problem, gaps, values, present, refit.without_effect)


def sparse_regression(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by the few features that explain what the refit leaves."""
    refit = _refitted(folder, nominal)
    slopes = jacobian(refit.problem, refit.values, refit.problem.fitted, refit.residual)
    basis = np.linalg.qr(slopes)[0]
    left = _projected(basis, refit.residual)
    features = [f for f in _features(refit, basis) if np.linalg.norm(f[2]) > 1e-9]
    columns = np.array([change / np.linalg.norm(change) for _, _, change in features]).T
    penalty = np.log(refit.problem.equations)
    best, chosen = left @ left, np.zeros(0, int)
    for threshold in np.geomspace(0.02, 0.8, 12) * np.linalg.norm(left):
        kept = _thresholded(columns, -left, threshold)
        if not kept.size:
            break
        rest = left + columns[:, kept] @ np.linalg.lstsq(columns[:, kept], -left, rcond=None)[0]
        bic = rest @ rest + 2.0 * kept.size * penalty
        if bic < best:
            best, chosen = bic, kept
    strength = columns.T @ -left
    order = sorted(chosen.tolist(), key=lambda index: -strength[index])
    names = list(dict.fromkeys(features[index][0] for index in order))[:_MOST_NAMED]
    sure = float(np.clip(1.0 - best / (left @ left), 0.0, 1.0))
    present = dict.fromkeys(names, sure)
    return verdict_of(refit.problem, refit.gaps, refit.values, present, refit.without_effect)


def _thresholded(columns: np.ndarray, target: np.ndarray, threshold: float) -> np.ndarray:
    """Return the columns that survive: fit, drop what is below the threshold or negative, again."""
    kept = np.arange(columns.shape[1])
    while kept.size:
        weights = np.linalg.lstsq(columns[:, kept], target, rcond=1e-8)[0]
        stays = weights >= threshold
        if stays.all():
            return kept
        kept = kept[stays]
    return kept
