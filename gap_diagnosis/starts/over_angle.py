"""Ripples and their waves over an angle, the transform of signals for all numbers, its peaks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.fft import ifft, next_fast_len

from fjr_sim_node import effects as fx

_PLACES = 8  # of the angle, in a wave of the greatest number beyond the least


def waves(cycles: float, angle: np.ndarray) -> np.ndarray:
    """Return sine and cosine of some cycles a turn along an angle (rad), float32 (2, ...).

    They are off by 6e-8 times the phase: by half a percent at a thousand turns of a ripple.
    """
    turned = (cycles * angle).astype(np.float32)
    return np.array([np.sin(turned), np.cos(turned)])


def transformed(signal: np.ndarray, angle: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """Return the sums of a signal times cosine + i sine along an angle, of numbers of cycles.

    Each sample is shared by the two nearest of even places of the angle, so that one transform
    gives all sums, to 3 % of the signal's.

    Args:
        signal: (samples,).
        angle: (samples,), rad.
        cycles: numbers per turn in even steps, at least two.

    Returns:
        complex (numbers,).
    """
    first, step = float(cycles[0]), float(cycles[-1] - cycles[0]) / (len(cycles) - 1)
    places = next_fast_len(_PLACES * len(cycles))
    place = angle * (step * places / (2.0 * np.pi))
    below = np.floor(place).astype(int)
    above = place - below
    turned = signal * np.exp(1j * first * angle)
    found = np.zeros(places, complex)
    for at, share in ((below % places, 1.0 - above), ((below + 1) % places, above)):
        found.real += np.bincount(at, share * turned.real, places)
        found.imag += np.bincount(at, share * turned.imag, places)
    shared = np.sinc(np.arange(len(cycles)) / places) ** 2
    return np.asarray(places * ifft(found)[: len(cycles)] / shared)


def peaks(gains: np.ndarray) -> np.ndarray:
    """Return the indices of the maxima, greatest first."""
    padded = np.concatenate([[-1.0], gains, [-1.0]])
    found = np.flatnonzero((gains >= padded[:-2]) & (gains > padded[2:]))
    return np.asarray(found[np.argsort(-gains[found])])


def ripple_of(effect: str, cycles: float, sizes: np.ndarray) -> dict[str, float]:
    """Return a ripple without a second harmonic, by full parameter names, no greater than may be.

    Args:
        effect: identifier of an effect that is periodic in the motor angle.
        cycles: its number per turn.
        sizes: of its sine and cosine, (2,).
    """
    values: Mapping[str, float] = {
        "size": float(np.hypot(*sizes)),
        "cycles": float(cycles),
        "angle": float(np.arctan2(sizes[1], sizes[0])),
    }
    entry = fx.EFFECTS[effect]
    return {
        name: min(values[parameter.role], parameter.high)
        for name, parameter in zip(entry.names, entry.parameters, strict=True)
        if parameter.role in values and not parameter.name.startswith("second")
    }
