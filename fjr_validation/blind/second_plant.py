"""The second plant: a rig that shares nothing with `fjr_sim_node`, for withheld cases.

    J  q''  + fv  q'  + fs  Sgn(q')  + te(q - th) = 0
    Jm th'' + fvm th' + fsm Sgn(th') - te(q - th) = tau

integrated at a fixed fine step by Moreau's midpoint time stepping (Moreau 1988; Acary, Brogliato
2008): forces at half-way positions, viscous friction implicit, Coulomb friction as an impulse that
solves the inclusion, so sticking is exact without any event being located. The sampled controller
is written anew from the interface's control law. `discretisation_error` measures its own error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import second_laws as law
from .second_motion import run

STEPS_PER_SECOND = 100_000
"""Default rate of the fine steps; `discretisation_error` tells what it costs."""


@dataclass(frozen=True)
class Loop:
    """The sampled controller u = P e + D N (e - x), x' = a x + (1 - a) e, a = exp(-N Ts)."""

    sample_rate_hz: float = 1000.0
    p: float = 200.0
    d: float = 60.0
    n: float = 24.0


@dataclass(frozen=True)
class Record:
    """Sampled signals, float64 (samples,) each: y, q and th in rad, u in N m."""

    y: np.ndarray
    u: np.ndarray
    q: np.ndarray
    th: np.ndarray


def simulate(
    reference: np.ndarray,
    plant: Mapping[str, float],
    settings: Mapping[str, float] | None = None,
    *,
    noise: np.ndarray | None = None,
    loop: Loop | None = None,
    elapsed_s: float = 0.0,
    steps_per_second: float = STEPS_PER_SECOND,
) -> Record:
    """Simulate the closed loop from rest.

    Args:
        reference: r, float64 (samples,) in rad.
        plant: the bare plant's eight parameters by name.
        settings: effects by the names of `second_laws.SETTINGS`; missing ones are off.
        noise: encoder noise (samples,) in rad.
        loop: controller and sample rate; the interface's default if None.
        elapsed_s: time since the rig was switched on.
        steps_per_second: rate of the fine steps.

    Raises:
        KeyError: a setting that the second plant does not know.
        FloatingPointError: the motion diverges.
    """
    loop = loop or Loop()
    s = _ordered(settings or {})
    p = tuple(float(plant[name]) for name in law.PLANT_NAMES)
    r = np.ascontiguousarray(reference, float)
    noise = np.zeros(r.size) if noise is None else np.ascontiguousarray(noise, float)
    steps = max(1, round(steps_per_second / loop.sample_rate_hz))
    gains = (loop.p, loop.d, loop.n)
    out = Record(*(np.empty(r.size) for _ in range(4)))
    columns = (out.y, out.u, out.q, out.th)
    run(r, noise, loop.sample_rate_hz, steps, gains, p, s, elapsed_s, *columns)
    if not (np.isfinite(out.y).all() and np.abs(out.y).max() < 50.0):
        raise FloatingPointError("the second plant's motion diverges")
    return out


def _ordered(settings: Mapping[str, float]) -> tuple[float, ...]:
    """Return the settings as the compiled plant takes them."""
    unknown = set(settings) - set(law.SETTINGS)
    if unknown:
        raise KeyError(f"the second plant has no setting {sorted(unknown)[0]}")
    return tuple(float(settings.get(name, 0.0)) for name in law.SETTINGS)


def discretisation_error(
    reference: np.ndarray,
    plant: Mapping[str, float],
    settings: Mapping[str, float] | None = None,
    steps_per_second: float = STEPS_PER_SECOND,
) -> float:
    """Return rms(y - y_fine) / rms(y_fine), y_fine at eight times the rate, without noise."""
    coarse = simulate(reference, plant, settings, steps_per_second=steps_per_second).y
    fine = simulate(reference, plant, settings, steps_per_second=8 * steps_per_second).y
    return float(np.linalg.norm(coarse - fine) / np.linalg.norm(fine))
