"""Rigs drawn at random: plant, controller tuned to it, size of its motion.

Everything is drawn relative to what the rig itself is, so that desktop servos and robot axes come
out alike: friction over torque, crossover over antiresonance, cubic stiffness over deflection.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from .second_simulation import Loop

RATES_HZ = (200.0, 250.0, 400.0, 500.0, 800.0, 1000.0, 2000.0, 4000.0, 5000.0)
INERTIA_KG_M2 = (1e-3, 10.0)
INERTIA_RATIO = (0.2, 5.0)
RESONANCE_HZ = (5.0, 60.0)
RIGID_SHARE = 0.2
_RIGID_CROSSOVER_HZ = (2.0, 10.0)
_CROSSOVER = (0.15, 0.6)
"""Crossover over the antiresonance, or over the resonance where that is lower in effect."""
_MARGIN = 2.0  # greatest |1/(1 + C G)|, the inverse of the distance from -1
_SAMPLES_PER_CYCLE = (12.0, 40.0)  # at the resonance; at the crossover
_SLOWEST_HZ = 0.8
_TRIES = 500


@dataclass(frozen=True)
class Rig:
    """A rig before its friction is set.

    Attributes:
        plant: the eight bare parameters; fs, fsm and k1 still zero.
        loop: its controller.
        controller: the controller as experiment descriptions say it.
        crossover_hz: where |C G| is about one.
        resonance_hz: free resonance; infinite for a rigid axis.
    """

    plant: Mapping[str, float]
    loop: Loop
    controller: Mapping[str, Any]
    crossover_hz: float
    resonance_hz: float

    @property
    def rigid(self) -> bool:
        """Whether motor and link are one body."""
        return math.isinf(self.resonance_hz)

    @property
    def band_hz(self) -> float:
        """Highest frequency worth exciting."""
        top = 8.0 * self.crossover_hz if self.rigid else 2.0 * self.resonance_hz
        return min(max(top, 8.0 * self.crossover_hz), 0.35 * self.loop.sample_rate_hz)

    @property
    def steps_per_second(self) -> float:
        """Rate of fine steps at which the second plant errs by about a thousandth or less."""
        return float(np.clip(50.0 * self.band_hz * 50.0, 50_000.0, 300_000.0))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def draw_rig(rng: np.random.Generator) -> Rig:
    """Return a rig whose linear loop is stable with margin."""
    for _ in range(_TRIES):
        rig = _draw(rng)
        if _is_sound(rig):
            return rig
    raise RuntimeError("no rig with a stable loop was drawn")


def _draw(rng: np.random.Generator) -> Rig:
    total, ratio = log_uniform(rng, *INERTIA_KG_M2), log_uniform(rng, *INERTIA_RATIO)
    rigid = rng.random() < RIGID_SHARE
    resonance = math.inf if rigid else log_uniform(rng, *RESONANCE_HZ)
    motor, link = total / (1.0 + ratio), total * ratio / (1.0 + ratio)
    stiffness = (2.0 * math.pi * resonance) ** 2 * motor * link / total
    if rigid:
        crossover = log_uniform(rng, *_RIGID_CROSSOVER_HZ)
    else:
        antiresonance = resonance / math.sqrt(1.0 + ratio)
        crossover = antiresonance * log_uniform(rng, *_CROSSOVER)
    least = _SAMPLES_PER_CYCLE[1] * crossover
    least = least if rigid else max(least, _SAMPLES_PER_CYCLE[0] * resonance)
    rate = float(rng.choice([rate for rate in RATES_HZ if rate >= least] or RATES_HZ[-1:]))
    omega = 2.0 * math.pi * crossover
    viscous = total * omega * log_uniform(rng, 0.05, 0.8)
    share = rng.uniform(0.3, 0.8)
    gains = {
        "p": total * omega**2 * rng.uniform(0.3, 0.7),
        "d": total * omega * rng.uniform(0.7, 1.2),
        "n": omega * rng.uniform(2.5, 8.0),
    }
    gains = {name: float(f"{value:.4g}") for name, value in gains.items()}
    plant = {
        "jm": motor, "j": link, "fs": 0.0, "fsm": 0.0, "fv": (1.0 - share) * viscous,
        "fvm": share * viscous, "k0": stiffness, "k1": 0.0,
    }  # fmt: skip
    controller = {"kind": "pd_filtered", **gains, "torque_limit_nm": None}
    return Rig(plant, Loop.pd(rate, **gains), controller, crossover, resonance)


def _is_sound(rig: Rig) -> bool:
    """Tell whether the sampled linear loop is stable, has its margin and is fast enough."""
    if rig.crossover_hz < _SLOWEST_HZ:
        return False
    rate, loop = rig.loop.sample_rate_hz, rig.loop
    a, b, c = sampled(rig.plant, rate)
    frequency = np.geomspace(0.05 * rig.crossover_hz, 0.49 * rate, 600)
    z = np.exp(2j * np.pi * frequency / rate)
    plant = np.array([c @ np.linalg.solve(each * np.eye(len(a)) - a, b) for each in z])
    law = np.polyval(loop.position, z) / np.polyval(loop.denominator, z)
    if np.abs(1.0 / (1.0 + plant * law)).max() > _MARGIN:
        return False
    return bool(np.abs(_closed_loop_poles(a, b, c, loop)).max() < 1.0)


def sampled(
    plant: Mapping[str, float], rate_hz: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the linear plant under a held torque: x' = A x + B u, th = C x, without friction."""
    if math.isinf(plant["k0"]):
        inertia, viscous = plant["jm"] + plant["j"], plant["fvm"] + plant["fv"]
        a = np.array([[0.0, 1.0], [0.0, -viscous / inertia]])
        b, c = np.array([0.0, 1.0 / inertia]), np.array([1.0, 0.0])
    else:
        k, j, jm = plant["k0"], plant["j"], plant["jm"]
        a = np.array([
            [0.0, 1.0, 0.0, 0.0],
            [-k / j, -plant["fv"] / j, k / j, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [k / jm, 0.0, -k / jm, -plant["fvm"] / jm],
        ])  # fmt: skip
        b, c = np.array([0.0, 0.0, 0.0, 1.0 / jm]), np.array([0.0, 0.0, 1.0, 0.0])
    size = len(a)
    both = np.zeros((size + 1, size + 1))
    both[:size, :size], both[:size, size] = a, b
    held = expm(both / rate_hz)
    return held[:size, :size], held[:size, size], c


def _closed_loop_poles(a: np.ndarray, b: np.ndarray, c: np.ndarray, loop: Loop) -> np.ndarray:
    """Return the poles of the sampled loop with a first-order controller in observer form."""
    b0, b1 = loop.position
    pole = -loop.denominator[1]
    size = len(a)
    closed = np.zeros((size + 1, size + 1))
    closed[:size, :size] = a - b0 * np.outer(b, c)
    closed[:size, size] = b
    closed[size, :size] = (-b1 - pole * b0) * c
    closed[size, size] = pole
    return np.linalg.eigvals(closed)
