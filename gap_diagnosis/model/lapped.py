"""The lapped transform: a record as windows of lines, each number at one place in time and band.

    X[m, k] = sqrt(2/N) sum_n w[n] x[m N + n] cos(pi/N (n + 1/2 + N/2) (k + 1/2)),  n = 0 ... 2N - 1

with the sine window w (modified discrete cosine transform; Princen, Bradley 1986, IEEE Trans. ASSP
34(5)). Windows overlap by half and the transform is orthonormal: white noise stays white with its
variance, and the squares of all numbers sum to those of the samples. Line k is the band from
k fs/(2N) to (k + 1) fs/(2N); line 0 is mean and slow motion.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import dct


def windows_in(samples: int, hop: int) -> int:
    """Return how many whole windows of 2 hop samples lie in a record."""
    return max(samples // hop - 1, 0)


def samples_of(windows: slice, hop: int) -> slice:
    """Return the samples of windows from one to another; of all, all."""
    if windows.stop is None:
        return slice(None)
    return slice(windows.start * hop, (windows.stop + 1) * hop)


def lapped(signal: np.ndarray, hop: int) -> np.ndarray:
    """Return the lines of all whole windows of signals.

    Args:
        signal: float64 (..., samples).
        hop: N, even; windows are 2 N samples long and N apart.

    Returns:
        float64 (..., windows, N).
    """
    count = windows_in(signal.shape[-1], hop)
    pieces = signal[..., : (count + 1) * hop].reshape(*signal.shape[:-1], count + 1, hop)
    rise = np.sin(np.pi / (2 * hop) * (np.arange(hop) + 0.5))
    first = pieces[..., :-1, :] * rise
    second = pieces[..., 1:, :] * rise[::-1]
    half = hop // 2
    a, b = first[..., :half], first[..., half:]
    c, d = second[..., :half], second[..., half:]
    folded = np.concatenate([-c[..., ::-1] - d, a - b[..., ::-1]], axis=-1)
    return dct(folded, type=4, norm="ortho", axis=-1)


def unlapped(lines: np.ndarray, hop: int) -> np.ndarray:
    """Return the transposed transform, which undoes `lapped` where two windows overlap.

    Args:
        lines: float64 (..., windows, N).
        hop: N, even.

    Returns:
        float64 (..., (windows + 1) N); zeros without windows.
    """
    folded = dct(lines, type=4, norm="ortho", axis=-1)
    half = hop // 2
    ahead, behind = folded[..., half:], -folded[..., :half]
    rise = np.sin(np.pi / (2 * hop) * (np.arange(hop) + 0.5))
    first = np.concatenate([ahead, -ahead[..., ::-1]], axis=-1) * rise
    second = np.concatenate([behind[..., ::-1], behind], axis=-1) * rise[::-1]
    none = np.zeros((*lines.shape[:-2], 1, hop))
    pieces = np.concatenate([first, none], axis=-2) + np.concatenate([none, second], axis=-2)
    return pieces.reshape(*lines.shape[:-2], -1)
