"""A mass behind a spring, seen in the torque that the model of a rigid axis lacks.

A mass m on a spring follows the acceleration a of the motor as m w^2/(s^2 + 2 zeta w s + w^2) a: at
each frequency w this torque is linear in m, though nothing of it is linear in the compliance. So
frequencies are tried one after the other, and m follows by least squares. A pendulum that hangs on
a cart, or a load on a soft belt, acts so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import bilinear, lfilter

from ..model.rig_model import Model
from .other_splits import YIELDS
from .seen_together import solved

_APART = 0.1  # from one frequency to the next, relative
_COARSE = 0.07  # ratio of damping of the first tries: peaks are as wide as frequencies are apart
_NEAR, _DAMPED = (0.95, 1.0, 1.05), (0.03, 0.1)
"""Frequencies over the best of the first tries, and ratios of damping, that are tried then."""
_FEWEST_PERIODS = 3.0  # of the lowest frequency, in the shortest run
_APART_AT_LEAST = 1.2  # ratio of two frequencies that are both taken
_SHARES = (0.01, 0.99)  # of the inertia behind the spring
_VISCOUS = ("fvm", "viscous_friction.motor_nm_s_rad")


@dataclass(frozen=True)
class Hidden:
    """A mass behind a spring.

    Attributes:
        inertia: of the mass, kg m2.
        added: to the inertia of the model that lacks it, both masses together, kg m2.
        frequency: its natural frequency with the motor held, rad/s.
        damping: its damping ratio then.
        left: squares of the torque that it leaves.
    """

    inertia: float
    added: float
    frequency: float
    damping: float
    left: float

    @property
    def stiffness(self) -> float:
        """Stiffness of its spring, N m/rad."""
        return self.inertia * self.frequency**2

    @property
    def drag(self) -> float:
        """Viscous friction that damps it so, N m s/rad."""
        return 2.0 * self.damping * self.frequency * self.inertia


def hidden(
    runs: Sequence[np.ndarray],
    rate: float,
    highest_hz: float,
    beside: Sequence[np.ndarray],
    missing: np.ndarray,
    seen: Callable[[np.ndarray], np.ndarray],
    most: int = 2,
) -> list[Hidden]:
    """Return masses behind springs that explain a torque best, the best first.

    Args:
        runs: angle of each run, (samples,), rad.
        rate: of the samples, Hz.
        highest_hz: up to which the torque is known.
        beside: what else is in the torque, as seen, (places,) each; the last one is that of more
            inertia of the motor, for a size of one.
        missing: the torque that a rigid model lacks, (places,), N m.
        seen: makes of a torque of all runs, (samples,), what is seen of it, (places,).
        most: how many are returned.
    """

    def best(tried: Sequence[tuple[float, float]]) -> list[Hidden]:
        each = (_at(*one, runs, rate, beside, missing, seen) for one in tried)
        return sorted((one for one in each if one is not None), key=_left)

    chosen: list[Hidden] = []
    for one in best(masses(min(run.size for run in runs) / rate, highest_hz)):
        if all(abs(np.log(one.frequency / c.frequency)) > np.log(_APART_AT_LEAST) for c in chosen):
            chosen.append(one)
    refined = [
        min([one, *best([(f * one.frequency, z) for f in _NEAR for z in _DAMPED])], key=_left)
        for one in chosen[:most]
    ]
    return sorted(refined, key=_left)


def _left(one: Hidden) -> float:
    return one.left


def masses(shortest_s: float, highest_hz: float) -> list[tuple[float, float]]:
    """Return the frequencies (rad/s) and damping ratios that are tried first.

    Args:
        shortest_s: length of the shortest run.
        highest_hz: up to which the torque is known.
    """
    lowest = _FEWEST_PERIODS / shortest_s
    if not lowest < highest_hz:
        return []
    count = int(np.log(highest_hz / lowest) / _APART) + 2
    tried = 2.0 * np.pi * np.geomspace(lowest, highest_hz, count)
    return [(frequency, _COARSE) for frequency in tried.tolist()]


def _at(
    frequency: float,
    damping: float,
    runs: Sequence[np.ndarray],
    rate: float,
    beside: Sequence[np.ndarray],
    missing: np.ndarray,
    seen: Callable[[np.ndarray], np.ndarray],
) -> Hidden | None:
    """Return the mass at one frequency and damping; None where none pulls."""
    torque = torque_of_mass(frequency, damping, runs, rate)
    *_, motor, inertia = (found := solved([*beside, seen(torque)], missing))[0]
    if not inertia > 0.0:
        return None
    return Hidden(inertia, motor + inertia, frequency, damping, found[1])


def torque_of_mass(
    frequency: float, damping: float, runs: Sequence[np.ndarray], rate: float
) -> np.ndarray:
    """Return the torque on the motor of a mass of one behind a spring, (samples,) of all runs.

    Args:
        frequency: of the mass with the motor held, rad/s.
        damping: its damping ratio then.
        runs: angle of each run, (samples,), rad.
        rate: of the samples, Hz.
    """
    ways = bilinear([frequency**2, 0.0, 0.0], [1.0, 2.0 * damping * frequency, frequency**2], rate)
    return -np.concatenate([lfilter(*ways, run - run[0]) for run in runs])


def with_mass(model: Model, mass: Hidden) -> Model | None:
    """Return the model of a rigid axis with a mass behind a spring more.

    What damps the mass is a share of the viscous friction, as far as there is any. None where
    nothing, or all, is left to the motor.

    Args:
        model: that lacks the mass.
        mass: behind a spring.
    """
    total = model.plant["jm"] + mass.added
    share = mass.inertia / total if total > 0.0 else 1.0
    if not _SHARES[0] < share < _SHARES[1]:
        return None
    viscous = sum(size for n, size in {**model.plant, **model.effects}.items() if n in _VISCOUS)
    yields = {
        "compliance_rad_nm": 1.0 / mass.stiffness,
        "link_inertia_share": share,
        "link_coulomb_share": 0.0,
        "link_viscous_share": min(mass.drag / viscous, 1.0) if viscous else 0.0,
    }
    own = {f"{YIELDS}.{name}": value for name, value in yields.items()}
    return Model({**model.plant, "jm": total}, {**model.effects, **own})
