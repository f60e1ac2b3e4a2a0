"""Values of a band-limited signal between samples at uneven instants, and their error.

Yen's interpolation: among all signals of a band the one of least energy through the samples, which
is the best linear prediction (kriging) of a process with that spectrum. It is solved in overlapping
windows. The spectrum has two steps, chosen by the data: most power below a band edge, and a floor
up to the Nyquist frequency, so that measurement noise is passed on as it is instead of smoothed
away. The error comes from the data as well: samples are left out and predicted, which the inverse
of the windows' matrix gives in closed form.

Sources: J. L. Yen, On nonuniform sampling of bandwidth-limited signals, IRE Trans. Circuit Theory
3, 1956; H. G. Feichtinger, K. Groechenig and T. Strohmer, Efficient numerical methods in
non-uniform sampling theory, Numer. Math. 69, 1995 (overlapping blocks); O. Dubrule, Cross
validation of kriging in a unique neighborhood, Math. Geology 15, 1983 (leaving out in closed form).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

WINDOW = 64
MARGIN = 16
"""Samples on either side of a window that only serve those between them."""
CORE = WINDOW - 2 * MARGIN

BANDS = (0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9)
"""Band edges that are tried, as parts of the Nyquist frequency."""
FLOORS = (1e-9, 1e-7, 1e-5, 1e-3, 1e-1, 1.0)
"""Parts of the power in the floor that are tried."""

_RIDGE = 1e-3  # of the floor: keeps the matrix well-conditioned
_BATCH = 256


@dataclass(frozen=True)
class Spectrum:
    """A spectrum of two steps.

    Attributes:
        band: edge of the upper step, as a part of the Nyquist frequency.
        floor: part of the power that is spread evenly up to the Nyquist frequency.
    """

    band: float
    floor: float

    def covariance(self, lag: np.ndarray) -> np.ndarray:
        """Return the covariance at lags in samples, of unit power."""
        floor = self.floor * np.sinc(lag)
        return floor if self.floor == 1.0 else floor + (1.0 - self.floor) * np.sinc(self.band * lag)

    def inverse(self, times: np.ndarray) -> np.ndarray:
        """Return the inverse covariances (windows, n, n) at times (windows, n) in samples."""
        matrix = self.covariance(times[:, :, None] - times[:, None, :])
        diagonal = np.arange(times.shape[1])
        matrix[:, diagonal, diagonal] += _RIDGE * self.floor
        return np.linalg.inv(matrix)


def interpolate(
    times: np.ndarray, values: np.ndarray, points: np.ndarray, spectrum: Spectrum
) -> np.ndarray:
    """Return the values at other instants.

    Args:
        times: rising instants of the samples, in samples, float64 (n,), n >= WINDOW.
        values: float64 (n,).
        points: instants asked for, float64 (p,), rising.
        spectrum: the signal's.

    Returns:
        float64 (p,).
    """
    mean = values.mean()
    core = np.clip(np.searchsorted(times, points) // CORE, 0, (len(times) - 1) // CORE)
    out = np.empty(len(points))
    for cores in _batches(core):
        chosen = slice(*np.searchsorted(core, [cores[0], cores[-1] + 1]))
        rows = _windows(cores, len(times))
        origin = times[rows[:, :1]]
        local = times[rows] - origin
        weights = np.einsum("wij,wj->wi", spectrum.inverse(local), values[rows] - mean)
        which = np.searchsorted(cores, core[chosen])
        lags = points[chosen, None] - origin[which] - local[which]
        out[chosen] = mean + np.einsum("pj,pj->p", spectrum.covariance(lags), weights[which])
    return out


def _batches(core: np.ndarray) -> Iterator[np.ndarray]:
    cores = np.unique(core)
    for at in range(0, len(cores), _BATCH):
        yield cores[at : at + _BATCH]


def _windows(cores: np.ndarray, samples: int) -> np.ndarray:
    """Return the indices of the samples of windows, int64 (windows, WINDOW)."""
    starts = np.clip(cores * CORE - MARGIN, 0, samples - WINDOW)
    return starts[:, None] + np.arange(WINDOW)


def choose_spectrum(times: np.ndarray, values: np.ndarray) -> Spectrum:
    """Return the spectrum that predicts left-out samples best.

    Args:
        times: instants of windows of consecutive samples, in samples, (windows, WINDOW).
        values: likewise.
    """
    tried = {Spectrum(band, floor) for band in BANDS for floor in FLOORS}
    return min(
        sorted(tried, key=lambda one: (-one.floor, one.band)),
        key=lambda one: held_out_rms(times, values, one),
    )


def held_out_rms(
    times: np.ndarray,
    values: np.ndarray,
    spectrum: Spectrum,
    gap: int = 1,
    places: range = range(MARGIN, WINDOW - MARGIN),
) -> float:
    """Return the rms error at samples that were left out and predicted from the others.

    Args:
        times: windows as in `choose_spectrum`.
        values: likewise.
        spectrum: of the signal.
        gap: how many consecutive samples are left out at a time.
        places: where in the windows.
    """
    inverse = spectrum.inverse(times - times[:, :1])
    solved = np.einsum("wij,wj->wi", inverse, values - values.mean())
    squares, count = 0.0, 0
    for first in range(places.start, places.stop - gap + 1, gap):
        out = slice(first, first + gap)
        errors = np.linalg.solve(inverse[:, out, out], solved[:, out, None])
        squares += float(np.sum(errors**2))
        count += errors.size
    return float(np.sqrt(squares / count))


def lost_rms(
    times: np.ndarray,
    values: np.ndarray,
    spectrum: Spectrum,
    samples: int,
    gaps: Mapping[int, int],
) -> float:
    """Return what gaps and the ends of the record add to the rms error.

    Samples are left out in the same pattern: within windows for gaps, at their ends for the ends.

    Args:
        times: windows as in `choose_spectrum`.
        values: likewise.
        spectrum: of the signal.
        samples: how many the record holds, with the lost ones.
        gaps: how many gaps there are of each number of lost samples.
    """
    ends = held_out_rms(times, values, spectrum, places=range(1, MARGIN))
    squares = min(2.0 * MARGIN / samples, 1.0) * ends**2
    for gap, count in gaps.items():
        part = count * (gap + 1) / samples
        squares += part * held_out_rms(times, values, spectrum, gap) ** 2
    return float(np.sqrt(squares))


def between_rms(times: np.ndarray, values: np.ndarray, spectrum: Spectrum) -> float:
    """Return the rms error of values between samples, at most.

    A left-out sample is predicted across two sample periods, a value between samples across one, so
    the estimate is on the safe side. What cannot be told from an error is counted as one:
    measurement noise and noise of the stamps.
    """
    return held_out_rms(times, values, spectrum) * noise_gain(times, spectrum)


def noise_gain(times: np.ndarray, spectrum: Spectrum) -> float:
    """Return by how much white noise grows between the samples: rms over rms, at least 1."""
    local = times - times[:, :1]
    points = local[:, MARGIN:-MARGIN] + 0.5
    covariance = spectrum.covariance(points[:, :, None] - local[:, None, :])
    weights = covariance @ spectrum.inverse(local)
    return float(max(np.sqrt(np.mean(np.sum(weights**2, axis=2))), 1.0))
