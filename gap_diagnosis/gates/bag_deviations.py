"""How far each parameter of a refit model deviates in each bag.

Bags have different signals, so only a model compares them: what a refit model leaves in a bag is
projected on the model's sensitivity to its parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_sim_node import effects as fx

from ..model.evidence import Evidence
from ..model.rig_model import Model

BagErrors = Callable[[Sequence[Model], int], np.ndarray]
"""Takes models and the index of a bag, returns their errors in it, float64 (models, errors), in
standard deviations of what is left; not finite where a motion diverges."""
BagBlocks = Callable[[int], np.ndarray]
"""Takes the index of a bag, returns the block that each of its errors belongs to, (errors,)."""

GROUPS: dict[str, tuple[str, ...]] = {
    "friction": ("fs", "fsm", "fv", "fvm"),
    "stiffness": ("k0", "k1"),
}
"""Parameters of the bare plant that drift together."""
SCATTERING: dict[str, tuple[str, ...]] = {
    **{name: (name,) for name in GROUPS["friction"]},
    "stiffness": GROUPS["stiffness"],
}
"""Parameters whose scatter is told apart."""
STEP = 0.01
"""Relative step of the central difference."""
MOST_CHANGE = 0.5
"""Greatest relative deviation of a bag."""
PASSES = 5
SETTLED = 0.5
"""A fit of a bag ends after so many passes, or at a step below this share of its uncertainty."""


@dataclass(frozen=True)
class Deviations:
    """Deviations (realizations, parameters) from the model, and their covariance in each bag."""

    names: list[str]
    values: np.ndarray
    covariance: np.ndarray
    accounted: float

    def each(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Return name, deviation and std of each parameter."""
        std = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))
        return list(zip(self.names, self.values.T, std.T, strict=True))

    def groups(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Return the same of friction, the mean over its parameters, and of stiffness."""
        columns = []
        for group, parts in GROUPS.items():
            share = np.array([float(name in parts or name == group) for name in self.names])
            if share.any():
                share /= share.sum()
                std = np.sqrt(np.einsum("i,nij,j->n", share, self.covariance, share))
                columns.append((group, self.values @ share, std))
        return columns


def run_errors(evidence: Evidence, variance: np.ndarray) -> tuple[BagErrors, BagBlocks]:
    """Return the errors of runs in standard deviations of each cell, and their blocks.

    Args:
        evidence: the runs.
        variance: (cells,), of an error in each cell, rad2.
    """
    parts = {
        index: [i for i, part in enumerate(evidence.parts) if part.record == index]
        for index in range(len(evidence.records.records))
    }

    def errors(models: Sequence[Model], index: int) -> np.ndarray:
        scale = np.sqrt(variance[evidence.cell_of(parts[index])])
        return evidence.errors(models, parts[index]) / scale

    return errors, lambda index: evidence.part_of(parts[index])


def deviations(
    errors: BagErrors, bags: int, model: Model, blocks: BagBlocks | None = None
) -> Deviations | None:
    """Fit the relative deviations of the parameters to each bag.

    None if the model diverges, or a bag does not determine all parameters, as where the link never
    moves.

    Args:
        errors: of models in a bag.
        bags: how many there are.
        model: the refit model.
        blocks: to which block of a bag each error belongs, where errors are alike within a block;
            None where each errs for itself.
    """
    on = [n for n, parts in SCATTERING.items() if any(_has(model, part) for part in parts)]
    if not on:
        return None
    groups, fits = [SCATTERING[name] for name in on], []
    for index in range(bags):
        block = None if blocks is None else blocks(index)
        fit = _fit_bag(errors, model, groups, index, block)
        if fit is None:
            return None
        fits.append(fit)
    values, spread, there, left = (np.array(part) for part in zip(*fits, strict=True))
    return Deviations(on, values, spread, 1.0 - float(left.sum() / there.sum()))


def _fit_bag(
    errors: BagErrors,
    model: Model,
    groups: Sequence[tuple[str, ...]],
    index: int,
    block: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray, float, float] | None:
    """Fit one bag by Gauss-Newton from the model.

    Returns:
        Deviations and their covariance, widened by what they leave; the squares that the model
        leaves, and those that the deviations leave. None if the model diverges, or the bag does
        not determine all parameters.
    """
    at, found = np.zeros(len(groups)), None
    there = least = np.inf
    shifts = STEP * np.vstack([np.zeros(len(groups)), np.eye(len(groups)), -np.eye(len(groups))])
    for _ in range(PASSES):
        rows = errors([_changed(model, groups, at + shift) for shift in shifts], index)
        if not np.isfinite(rows).all():
            break
        cost = float(rows[0] @ rows[0])
        if cost >= least:
            break
        there, least = (cost if found is None else there), cost
        ends = np.split(rows[1:], 2)
        columns = (ends[0] - ends[1]).T / (2.0 * STEP)
        step = np.linalg.lstsq(columns, -rows[0], rcond=None)[0]
        after = rows[0] + columns @ step
        left = float(after @ after)
        covariance = _covariance(columns, after, block)
        if not (np.diag(covariance) > 0.0).all():
            return None
        at = np.clip(at + step, -MOST_CHANGE, MOST_CHANGE)
        found = at, covariance, there, left
        if np.all(np.abs(step) <= SETTLED * np.sqrt(np.diag(covariance))):
            break
    return found


def _covariance(columns: np.ndarray, left: np.ndarray, block: np.ndarray | None) -> np.ndarray:
    """Return the covariance of a fit by what it leaves, widened by what is alike in blocks.

    Without blocks the errors are in standard deviations of noise, and never leave less than that.
    """
    inverse = np.linalg.pinv(columns.T @ columns)
    chi2 = float(left @ left) / (left.size - columns.shape[1])
    if block is None:
        return inverse * max(chi2, 1.0)
    plain = inverse * chi2
    names = np.unique(block)
    scores = np.array([columns[block == name].T @ left[block == name] for name in names])
    count = len(names) / max(len(names) - 1, 1)
    robust = count * np.diag(inverse @ (scores.T @ scores) @ inverse)
    wider = np.sqrt(np.maximum(robust / np.maximum(np.diag(plain), 1e-300), 1.0))
    return plain * np.outer(wider, wider)


def _added(model: Model, name: str) -> list[str]:
    """Return the effect parameters of a model that add to a parameter of the bare plant."""
    return [n for n in model.effects if fx.parameter(n).adds_to == name]


def _has(model: Model, name: str) -> bool:
    own = model.plant.get(name, 0.0)
    return bool(own) or any(model.effects[n] for n in _added(model, name))


def _changed(model: Model, groups: Sequence[tuple[str, ...]], deviation: np.ndarray) -> Model:
    """Return the model with each group of parameters changed by a relative deviation."""
    plant, effects = dict(model.plant), dict(model.effects)
    for group, change in zip(groups, deviation, strict=True):
        for name in group:
            for values, own in ((plant, [name]), (effects, _added(model, name))):
                values |= {n: (1.0 + float(change)) * values[n] for n in own if n in values}
    return Model(plant, effects)
