"""A small nonlinear closed loop in plain NumPy, many realizations at once: ground for statistics.

Torque u = K (r - y) with y = x + v; the plant is x'' + d x' + k x = u + c u^3, discretised, so its
nonlinearity is static and odd, and the noise v feeds back through the controller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fjr_records.lines import Lines, classify
from fjr_records.spectra import PeriodSums, RealizationSpectra

RATE_HZ = 100.0
GAIN = 400.0


@dataclass(frozen=True)
class Signals:
    """r, u, y of shape (realizations, periods, N), transient already discarded."""

    reference: np.ndarray
    torque: np.ndarray
    position: np.ndarray


def lines(samples: int = 512, seed: int = 0) -> Lines:
    """Return an odd grid to 0.4 fs with one of each three odd lines left out at random."""
    odd = np.arange(1, int(0.4 * samples), 2)
    groups = odd[: odd.size // 3 * 3].reshape(-1, 3)
    out = groups[np.arange(len(groups)), np.random.default_rng(seed).integers(0, 3, len(groups))]
    return classify(np.setdiff1d(odd, out).tolist(), out.tolist())


def multisines(
    excited: np.ndarray, count: int, samples: int, rng: np.random.Generator
) -> np.ndarray:
    """Return one period of `count` random-phase multisines of rms 1, (count, N)."""
    spectrum = np.zeros((count, samples // 2 + 1), complex)
    spectrum[:, excited] = np.exp(2j * np.pi * rng.random((count, excited.size)))
    return np.fft.irfft(spectrum, samples) * samples / np.sqrt(2.0 * excited.size)


def run(
    reference: np.ndarray, cubic: float, noise: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate from rest; return (u, y) of the shape (realizations, samples) of `reference`."""
    step, stiffness, damping = 1.0 / RATE_HZ, 100.0, 12.0
    noise = np.broadcast_to(noise, reference.shape)
    torque, position = np.empty_like(reference), np.empty_like(reference)
    x, v = np.zeros((2, len(reference)))
    for k in range(reference.shape[1]):
        y = x + noise[:, k]
        u = GAIN * (reference[:, k] - y)
        torque[:, k], position[:, k] = u, y
        v = v + step * (u + cubic * u**3 - stiffness * x - damping * v)
        x = x + step * v
    return torque, position


def experiment(
    grid: Lines,
    count: int,
    periods: int,
    rng: np.random.Generator,
    *,
    cubic: float = 0.0,
    noise_std: float = 0.0,
    samples: int = 512,
    transient: int = 2,
) -> Signals:
    """Simulate `count` realizations with new phases each."""
    period = multisines(grid.excited, count, samples, rng)
    reference = np.tile(period, periods + transient)
    noise = noise_std * rng.standard_normal(reference.shape)
    torque, position = run(reference, cubic, noise)
    shape = (count, periods + transient, samples)
    r, u, y = (signal.reshape(shape)[:, transient:] for signal in (reference, torque, position))
    return Signals(r, u, y)


def spectra(signals: Signals, last_line: int) -> list[RealizationSpectra]:
    """Feed all periods of each realization to the product's running sums."""
    count, periods, samples = signals.reference.shape
    out = []
    for m in range(count):
        sums = PeriodSums(samples)
        for p in range(periods):
            sums.add((signals.reference[m, p], signals.torque[m, p], signals.position[m, p]))
        out.append(sums.spectra(RATE_HZ / samples, last_line))
    return out
