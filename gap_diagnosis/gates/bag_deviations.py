"""How far each parameter of a refit model deviates in each bag.

Bags have different phases, so only a model compares them: what a refit model leaves in a bag is
projected on the model's sensitivity to its parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from ..model.simulated_rig import Model, Simulator

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


def deviations(
    recorded: RecordedExperiment, noise: NoiseLevels, simulator: Simulator, model: Model
) -> Deviations | None:
    """Fit the relative deviations of the parameters to each bag.

    None if the model diverges, or a bag does not determine all parameters, as where the link never
    moves.
    """
    on = {n: g for n, g in SCATTERING.items() if any(model.plant.get(part, 0.0) for part in g)}
    fits = []
    for index, r in enumerate(recorded.realizations):
        std = noise.position[noise.row(r.level)]
        scale = np.concatenate([[1.0], np.full(std.size - 1, np.sqrt(2.0))]) / std
        measured = r.spectrum(r.position, recorded.lines).mean(0)
        fit = _fit_bag(simulator, model, list(on.values()), index, measured, scale) if on else None
        if fit is None:
            return None
        fits.append(fit)
    values, spread, there, left = (np.array(part) for part in zip(*fits, strict=True))
    return Deviations(list(on), values, spread, 1.0 - float(left.sum() / there.sum()))


def _fit_bag(
    simulator: Simulator,
    model: Model,
    groups: Sequence[tuple[str, ...]],
    index: int,
    measured: np.ndarray,
    scale: np.ndarray,
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
        models = [_changed(model, groups, at + shift) for shift in shifts]
        lines = line_spectrum(simulator.many(models, [index])[:, 0, 0], scale.size)
        if not np.isfinite(lines).all():
            break
        errors = _parts((measured - lines[0]) * scale)
        cost = float(errors @ errors)
        if cost >= least:
            break
        there, least = (cost if found is None else there), cost
        ends = np.split(lines[1:], 2)
        columns = _parts((ends[0] - ends[1]) / (2.0 * STEP) * scale).T
        step = np.linalg.lstsq(columns, errors, rcond=None)[0]
        left = float(np.sum((errors - columns @ step) ** 2))
        chi2 = left / (errors.size - step.size)
        covariance = np.linalg.pinv(columns.T @ columns) * max(chi2, 1.0)
        if not (np.diag(covariance) > 0.0).all():
            return None
        at = np.clip(at + step, -MOST_CHANGE, MOST_CHANGE)
        found = at, covariance, there, left
        if np.all(np.abs(step) <= SETTLED * np.sqrt(np.diag(covariance))):
            break
    return found


def _changed(model: Model, groups: Sequence[tuple[str, ...]], deviation: np.ndarray) -> Model:
    """Return the model with each group of parameters changed by a relative deviation."""
    plant = dict(model.plant)
    for group, change in zip(groups, deviation, strict=True):
        plant |= {name: (1.0 + float(change)) * plant[name] for name in group if name in plant}
    return Model(plant, model.effects)


def _parts(lines: np.ndarray) -> np.ndarray:
    """Return real and imaginary parts of lines (..., lines) beside each other; DC is real."""
    return np.concatenate([lines.real, lines[..., 1:].imag], axis=-1)
