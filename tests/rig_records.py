"""Records of random emulated rigs under noise, chirp, multisine and trapezoid of one power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controller_node import CONTROLLER, pd_filtered
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from fjr_sim_node.theory.linear import g0

RATE = 500.0
BAND_HZ = (0.1, 30.0)
RMS_RAD = {True: 0.05, False: 0.3}
"""Rms of the reference, for linear rigs and those with friction, which must move."""


@dataclass(frozen=True)
class Rig:
    """A plant with its controller."""

    values: dict
    controller: np.ndarray
    linear: bool


def random_rig(seed: int, *, linear: bool) -> Rig:
    """Return a rig of inertia ratio 0.2 to 2.7, resonance 5 to 20 Hz, damping 2 to 15 %."""
    rng = np.random.default_rng(seed)
    link = 0.3 * np.exp(rng.uniform(-0.7, 0.7))
    motor = link * np.exp(rng.uniform(-1.5, 1.0))
    reduced = link * motor / (link + motor)
    stiffness = (2 * np.pi * rng.uniform(5, 20)) ** 2 * reduced
    damping = 2 * rng.uniform(0.02, 0.15) * np.sqrt(stiffness * reduced) / reduced
    values = {"jm": motor, "j": link, "k0": stiffness, "k1": 0.0, "fs": 0.0, "fsm": 0.0}
    values |= {"fv": 0.5 * damping * link, "fvm": 0.5 * damping * motor}
    if not linear:
        values |= {"fs": rng.uniform(1.5, 4.5), "fsm": rng.uniform(1.5, 4.5), "k1": 3 * stiffness}
    crossover, inertia = 2 * np.pi * 2.0, link + motor
    gains = {"p": 0.7 * inertia * crossover**2, "d": 1.2 * inertia * crossover}
    law = CONTROLLER.check(gains | {"n": 10 * crossover, "sample_rate_hz": RATE})
    return Rig(PLANT.check(PLANT.defaults() | values), pd_filtered.coefficients(law), linear)


def reference(kind: str, seconds: float, rms: float, rng: np.random.Generator) -> np.ndarray:
    """Return a reference of flat power over BAND_HZ; a trapezoid has that of moves and rests."""
    samples = int(seconds * RATE)
    t = np.arange(samples) / RATE
    if kind == "chirp":
        low, high = BAND_HZ
        phase = 2 * np.pi * (low * t + (high - low) * t**2 / (2 * seconds))
        return rms * np.sqrt(2.0) * np.sin(phase + rng.uniform(0, 2 * np.pi))
    if kind == "trapezoid":
        knots = np.arange(0.0, seconds + 1.0, 0.5)
        levels = np.repeat(rng.uniform(-2, 2, knots.size // 2 + 1), 2)[: knots.size]
        return rms * np.interp(t, knots, levels)
    period = samples if kind == "multisine" else 2 * samples
    frequency = np.fft.rfftfreq(period, 1.0 / RATE)
    inside = (frequency >= BAND_HZ[0]) & (frequency <= BAND_HZ[1])
    spectrum = np.zeros(frequency.size, complex)
    if kind == "multisine":
        spectrum[inside] = np.exp(2j * np.pi * rng.random(inside.sum()))
    else:
        spectrum[inside] = rng.standard_normal(inside.sum()) + 1j * rng.standard_normal(
            inside.sum()
        )
    signal = np.fft.irfft(spectrum, period)
    return rms * signal[:samples] / np.std(signal)


def record(
    rig: Rig, kind: str, seconds: float, *, noise: float, seed: int, noise_seed: int = 0
) -> np.ndarray:
    """Return r, u, y from rest, (3, samples); encoder noise relative to the rms of r."""
    rms = RMS_RAD[rig.linear]
    r = reference(kind, seconds, rms, np.random.default_rng([seed, 1]))
    encoder = noise * rms * np.random.default_rng([seed, 2, noise_seed]).standard_normal(r.size)
    run = simulate(r, RATE, coefficients(rig.values), rig.controller, encoder)
    return np.stack([r, run.torque, run.position])


def truth(rig: Rig, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the sampled response of a linear rig, rad/(N m)."""
    return g0(rig.values, frequency_hz, RATE)
