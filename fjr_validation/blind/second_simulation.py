"""Plays the second plant in its loop: controller, run from rest, and its own error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from . import second_laws as law
from .second_plant import run

STEPS_PER_SECOND = 100_000
"""Default rate of the fine steps; `discretisation_error` tells what it costs."""

_SUMS = (("jm", "j"), ("fsm", "fs"), ("fvm", "fv"))
_FURTHEST_RAD = 50.0


@dataclass(frozen=True)
class Loop:
    """The sampled controller u = (b_r(z) r - b_y(z) y)/a(z) in powers z^0, z^-1, ...

    Attributes:
        sample_rate_hz: its rate.
        reference: b_r.
        position: b_y, of the same length.
        denominator: a, of the same length; a0 = 1.
        limit_nm: the torque is clamped to +- this, the state is not.
    """

    sample_rate_hz: float
    reference: tuple[float, ...]
    position: tuple[float, ...]
    denominator: tuple[float, ...]
    limit_nm: float = math.inf

    @classmethod
    def pd(
        cls, sample_rate_hz: float = 1000.0, p: float = 200.0, d: float = 60.0, n: float = 24.0
    ) -> Loop:
        """Return u = P e + D N (e - x), x' = a x + (1 - a) e, a = exp(-N Ts), e = r - y."""
        a = math.exp(-n / sample_rate_hz)
        numerator = (p + d * n, -a * p - d * n)
        return cls(sample_rate_hz, numerator, numerator, (1.0, -a))


@dataclass(frozen=True)
class Chance:
    """What chance adds to a run, float64 (samples,) each; None for nothing.

    Attributes:
        noise: encoder noise in rad.
        wander: a torque that wanders, of unit variance; `wander_nm` scales it.
        jitter: of the encoder's stamp, of unit variance; `jitter_s` scales it.
    """

    noise: np.ndarray | None = None
    wander: np.ndarray | None = None
    jitter: np.ndarray | None = None


@dataclass(frozen=True)
class Record:
    """Sampled signals, float64 (samples,) each: y, q and th in rad, u in N m."""

    y: np.ndarray
    u: np.ndarray
    q: np.ndarray
    th: np.ndarray


@dataclass(frozen=True)
class Play:
    """How a run is played.

    Attributes:
        loop: the controller.
        chance: what chance adds.
        elapsed_s: time since the rig was switched on.
        steps_per_second: rate of the fine steps, made whole for each sample.
    """

    loop: Loop = field(default_factory=Loop.pd)
    chance: Chance = field(default_factory=Chance)
    elapsed_s: float = 0.0
    steps_per_second: float = STEPS_PER_SECOND


def simulate(
    reference: np.ndarray,
    plant: Mapping[str, float],
    settings: Mapping[str, float] | None = None,
    play: Play | None = None,
) -> Record:
    """Simulate the closed loop from rest.

    Args:
        reference: r, float64 (samples,) in rad.
        plant: the bare plant's eight parameters by name; k0 infinite: motor and link are one body.
        settings: effects by the names of `second_laws.SETTINGS`; missing ones are off.
        play: how the run is played; in the interface's default loop if None.

    Raises:
        KeyError: a setting that the second plant does not know.
        FloatingPointError: the motion diverges.
    """
    play = play or Play()
    loop, chance = play.loop, play.chance
    r = np.ascontiguousarray(reference, float)
    zero = np.zeros(r.size)
    given = (chance.noise, chance.wander, chance.jitter)
    noise, wander, jitter = (
        zero if part is None else np.ascontiguousarray(part, float) for part in given
    )
    steps = max(1, math.ceil(play.steps_per_second / loop.sample_rate_hz - 1e-9))
    law_of_loop = [np.array(part) for part in (loop.reference, loop.position, loop.denominator)]
    out = Record(*(np.empty(r.size) for _ in range(4)))
    run(
        r, noise, wander, jitter, loop.sample_rate_hz, steps, *law_of_loop, loop.limit_nm,
        _plant(plant), _ordered(settings or {}), play.elapsed_s, out.y, out.u, out.q, out.th,
    )  # fmt: skip
    if not (np.isfinite(out.y).all() and np.abs(out.y).max(initial=0.0) < _FURTHEST_RAD):
        raise FloatingPointError("the second plant's motion diverges")
    if math.isinf(plant["k0"]):
        out.q[:] = out.th
    return out


def _plant(plant: Mapping[str, float]) -> tuple[float, ...]:
    """Return the plant as it is compiled: of a rigid axis the motor has all."""
    values = dict(plant)
    if math.isinf(plant["k0"]):
        values |= {motor: plant[motor] + plant[link] for motor, link in _SUMS}
    return tuple(float(values[name]) for name in law.PLANT_NAMES)


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
    play: Play | None = None,
) -> float:
    """Return rms(y - y_fine) / rms(y_fine), y_fine at eight times the rate."""
    play = play or Play()
    fine = Play(play.loop, play.chance, play.elapsed_s, 8.0 * play.steps_per_second)
    y = simulate(reference, plant, settings, play).y
    exact = simulate(reference, plant, settings, fine).y
    return float(np.linalg.norm(y - exact) / np.linalg.norm(exact))
