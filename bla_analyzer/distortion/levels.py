"""Levels of signals, distortion and noise at excited, odd and even lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_records.lines import Lines, interpolate_frf, nearest
from fjr_records.spectra import RealizationSpectra

from ..results.result import LineLevels

SMOOTHING_LINES = 7
"""Number of neighbouring lines whose power is averaged for `LineLevels.smoothed`."""


def corrected_position(
    spectra: RealizationSpectra, g: np.ndarray, lines: Lines, at: np.ndarray
) -> np.ndarray:
    """Return Yc = Y - G U at lines that are not excited, complex (L,) in rad.

    The loop feeds the output distortion back into u, and the plant answers to that; what is left
    after taking this answer away is the distortion itself.

    Args:
        spectra: one realization.
        g: complex (F,), G at the excited lines.
        lines: the grid.
        at: (L,), harmonics.
    """
    return spectra.position[at] - interpolate_frf(at, lines.excited, g) * spectra.torque[at]


def line_levels(
    spectra: Sequence[RealizationSpectra], lines: Lines, at: np.ndarray, g: np.ndarray | None
) -> LineLevels:
    """Return levels at lines of one kind, power averaged over realizations.

    Args:
        spectra: the realizations of a level.
        lines: the grid.
        at: (L,), harmonics of one kind.
        g: complex (F,), BLA at the excited lines; None leaves `corrected` unknown off the excited
            lines.
    """
    if at is lines.excited:
        corrected = np.array([one.position[at] for one in spectra])
        noise = np.array([one.var_position[at] for one in spectra])
    elif g is None:
        corrected = noise = np.full((1, at.size), np.nan)
    else:
        g_at = interpolate_frf(at, lines.excited, g)
        corrected = np.array([corrected_position(one, g, lines, at) for one in spectra])
        noise = np.array([one.noise_of_residual(g_at, at) for one in spectra])
    power = (np.abs(corrected) ** 2).mean(axis=0)
    return LineLevels(
        frequency_hz=spectra[0].frequency_hz[at],
        reference=_rms([one.reference[at] for one in spectra]),
        torque=_rms([one.torque[at] for one in spectra]),
        position=_rms([one.position[at] for one in spectra]),
        corrected=np.sqrt(power),
        smoothed=np.sqrt(_smooth(power, at)),
        noise=np.sqrt(noise.mean(axis=0)),
    )


def _rms(spectra: Sequence[np.ndarray]) -> np.ndarray:
    return np.sqrt((np.abs(np.array(spectra)) ** 2).mean(axis=0))


def _smooth(power: np.ndarray, lines: np.ndarray) -> np.ndarray:
    if not lines.size:
        return power
    return power[nearest(lines, lines, min(SMOOTHING_LINES, lines.size))].mean(axis=1)
