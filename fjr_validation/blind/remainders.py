"""The remainder of the open worlds: laws that no catalogue lists, and friction that scatters.

None of these laws is in the catalogue, nor among the nine laws outside of earlier checks. They are
frozen with the scorer before a check that counts.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from .draw import Draw, Drawer, Scales, linear, phase
from .rigs import log_uniform

SCATTER = (0.01, 0.05)
"""Standard deviation of friction from run to run, relative."""
_MOST_DEVIATIONS = 3.0


def _eyring(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"eyring_rad_s": at.speed * log_uniform(rng, 0.05, 0.5)}
    return linear("eyring_drag", {"eyring_nm": at.torque}, 0.05, 0.5, shape)


def _eddy(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"eddy_rad_s": at.speed * log_uniform(rng, 0.3, 1.5)}
    return linear("eddy_drag", {"eddy_nm": at.torque}, 0.05, 0.5, shape)


def _crank(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"crank_cycles": log_uniform(rng, 0.3, 2.0) / at.angle, "crank_phase_rad": phase(rng)}
    return linear("crank_inertia", {"crank_relative": 1.0}, 0.02, 0.5, shape)


def _cushion(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"cushion_rad": at.angle * float(rng.uniform(0.3, 1.0))}
    return linear("end_cushion", {"cushion_nm_rad2": at.torque / at.angle**2}, 0.1, 3.0, shape)


def _heating(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"heating_nm": at.torque, "heating_time_s": log_uniform(rng, 2.0, 10.0)}
    return linear("heating", {"heating_relative": 1.0}, 0.05, 0.5, shape)


def _bending(_: np.random.Generator, at: Scales) -> Draw:
    shape = {"bending_rad": at.deflection}
    return linear("bending_loss", {"bending_nm_s_rad": at.damping}, 0.02, 0.3, shape)


def _interpolation(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"interpolation_cycles": float(round(log_uniform(rng, 10.0, 100.0) / at.angle))}
    return linear("encoder_interpolation", {"interpolation_rad": at.angle}, 2e-3, 0.05, shape)


def _wander(_: np.random.Generator, at: Scales) -> Draw:
    return linear("wandering_torque", {"wander_nm": at.torque}, 0.02, 0.3)


def _jitter(_: np.random.Generator, at: Scales) -> Draw:
    return linear("stamp_jitter", {"jitter_s": at.angle / at.speed}, 5e-3, 0.2)


_ANY_AXIS: tuple[Drawer, ...] = (
    _eyring, _eddy, _crank, _cushion, _heating, _interpolation, _wander, _jitter,
)  # fmt: skip


def laws(*, rigid: bool) -> tuple[Drawer, ...]:
    """Return the drawers of laws outside the catalogue that a rig can have."""
    return _ANY_AXIS if rigid else (*_ANY_AXIS, _bending)


def wandering(rng: np.random.Generator, samples: int, rate_hz: float, time_s: float) -> np.ndarray:
    """Return an Ornstein-Uhlenbeck signal of unit variance and a correlation time, (samples,)."""
    kept = np.exp(-1.0 / (rate_hz * time_s))
    white = np.sqrt(1.0 - kept**2) * rng.standard_normal(samples)
    start = kept * rng.standard_normal()
    return lfilter([1.0], [1.0, -kept], white, zi=[start])[0]


def scattered(
    plant: Mapping[str, float], relative: float, rng: np.random.Generator
) -> dict[str, float]:
    """Return a plant whose Coulomb and viscous friction each have one run's factor.

    Args:
        plant: the mean.
        relative: standard deviation of both factors.
        rng: of this run.
    """
    drawn = np.clip(rng.standard_normal(2), -_MOST_DEVIATIONS, _MOST_DEVIATIONS)
    coulomb, viscous = 1.0 + relative * drawn
    factors = {"fs": coulomb, "fsm": coulomb, "fv": viscous, "fvm": viscous}
    return {name: value * float(factors.get(name, 1.0)) for name, value in plant.items()}
