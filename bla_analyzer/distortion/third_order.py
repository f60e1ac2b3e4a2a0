"""Where third-order distortion of a multisine falls: its power line by line.

The lowest odd distortion of lines X at k is the sum of X(k1) X(k2) X(k3) over k1 + k2 + k3 = k.
Those of an excited line with itself, X(k) |X(l)|^2, repeat in every realization, so they belong to
the BLA, not to the stochastic distortion; a detection line has none of them and more excited
neighbours. So detection lines carry more power: by 2 % over a wide spectrum of 167 lines, by 20 %
in a peak of the closed loop that holds some ten lines.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve

_ROUND_OFF = 1e-11


def third_order_power(excited: np.ndarray, power: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Return the stochastic third-order power that independent random phases give.

    A product of three different lines occurs in six orders, one with a line twice in three; equal
    products add as amplitudes, different ones as powers.

    Args:
        excited: (F,), ascending harmonics.
        power: (F,), power of the signal at them.
        lines: (L,), harmonics asked for.

    Returns:
        (L,), relative; ones if not all of them are reached.
    """
    power = power / power.mean()
    reach = 3 * int(max(lines.max(), excited[-1]))
    double, triple = np.zeros((2, 2 * reach + 1))
    single = np.zeros(2 * reach + 1)
    for sign in (-1, 1):
        single[reach + sign * excited] = power
        double[reach + 2 * sign * excited] = power**2
        triple[reach + 3 * sign * excited] = power**3
    orders = fftconvolve(fftconvolve(single, single, "same"), single, "same")
    twice = 3.0 * (fftconvolve(double, single, "same") - triple)
    different = orders - twice - triple
    squares = np.sum(power**2)
    different[reach + excited] -= 6.0 * power * (squares - power**2)
    twice[reach + excited] -= 3.0 * power**3
    found = 6.0 * different + 3.0 * twice + triple
    if found[reach + lines].min() <= _ROUND_OFF * found.max():
        return np.ones(lines.shape)
    return np.asarray(found[reach + lines])
