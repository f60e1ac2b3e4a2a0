"""Period spectra in one pass: the mean over periods and its noise covariance, line by line.

Only running sums are kept (Welford's update), so memory does not grow with the number of periods.
Scaling: |X| is the peak amplitude of a line, 2/N times the DFT, and 1/N at DC.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

Samples = tuple[np.ndarray, ...]
"""r (rad), u (N m), y (rad) and, with a second encoder, q (rad) of consecutive samples, float64 of
the same shape (samples,)."""


@dataclass(frozen=True)
class LinkSpectra:
    """Spectra of the link position q of one realization, lines as in `RealizationSpectra`.

    Attributes:
        mean: complex (K+1,), Q averaged over periods.
        var: (K+1,) variance of the mean.
        cov_torque, cov_position: complex (K+1,), covariance of Q with U and with Y.
    """

    mean: np.ndarray
    var: np.ndarray
    cov_torque: np.ndarray
    cov_position: np.ndarray


@dataclass(frozen=True)
class RealizationSpectra:
    """Spectra of one realization: K+1 lines from DC on; index k is harmonic k of f0.

    Attributes:
        periods: P, number of periods behind the means.
        frequency_hz: (K+1,).
        reference, torque, position: complex (K+1,), R, U, Y averaged over periods.
        var_torque, var_position: (K+1,) variance of the means U and Y over periods,
            sum_p |D|^2 / (P (P-1)) (the paper's C_n); NaN where P = 1.
        cov_position_torque: complex (K+1,), covariance of Y and U, sum_p D_Y D_U* / (P (P-1)).
        link: the link position; None without a second encoder.
    """

    periods: int
    frequency_hz: np.ndarray
    reference: np.ndarray
    torque: np.ndarray
    position: np.ndarray
    var_torque: np.ndarray
    var_position: np.ndarray
    cov_position_torque: np.ndarray
    link: LinkSpectra | None = None

    def of_link(self) -> RealizationSpectra:
        """Return the spectra with the link position in the place of the motor's."""
        assert self.link is not None
        return replace(
            self,
            position=self.link.mean,
            var_position=self.link.var,
            cov_position_torque=self.link.cov_torque,
            link=None,
        )

    def noise_of_both(self, g: np.ndarray, g_link: np.ndarray, lines: np.ndarray) -> np.ndarray:
        """Return the covariance that noise gives to Q - G_link U and Y - G U, complex (L,).

        Args:
            g: complex (L,), torque to motor position at the lines, rad/(N m).
            g_link: complex (L,), torque to link position.
            lines: (L,), harmonics.
        """
        assert self.link is not None
        return (
            self.link.cov_position[lines]
            - np.conj(g) * self.link.cov_torque[lines]
            - g_link * np.conj(self.cov_position_torque[lines])
            + g_link * np.conj(g) * self.var_torque[lines]
        )

    def noise_of_residual(self, g: np.ndarray, lines: np.ndarray) -> np.ndarray:
        """Return the variance that noise gives to Y - G U, E|D_Y - G D_U|^2.

        Args:
            g: complex (L,), G at the lines, rad/(N m).
            lines: (L,), harmonics.
        """
        cross = np.conj(g) * self.cov_position_torque[lines]
        power = self.var_position[lines] + np.abs(g) ** 2 * self.var_torque[lines]
        return np.maximum(power - 2 * cross.real, 0.0)


def line_spectrum(period: np.ndarray, lines: int | None = None) -> np.ndarray:
    """Return lines of whole periods, |X| the peak amplitude (1/N at DC).

    Args:
        period: samples of shape (..., N).
        lines: how many lines from DC on; None for all N//2 + 1.

    Returns:
        Complex (..., lines).
    """
    spectrum = scipy.fft.rfft(period)[..., :lines] * (2.0 / period.shape[-1])
    spectrum[..., 0] *= 0.5
    return spectrum


class PeriodSums:
    """Running sums over the period spectra of one realization, at all lines up to Nyquist.

    `alternating` is the sum of y's spectra with signs that alternate from period to period, where a
    motion of twice the period stands.
    """

    def __init__(self, samples_per_period: int) -> None:
        """Start with no period."""
        lines = samples_per_period // 2 + 1
        self.periods = 0
        self.reference, self.torque, self.position = np.zeros((3, lines), complex)
        self.scatter_torque, self.scatter_position = np.zeros((2, lines))
        self.scatter_cross, self.alternating = np.zeros((2, lines), complex)
        self.link: np.ndarray | None = None
        self.scatter_link = np.zeros(lines)
        self.scatter_link_cross = np.zeros((2, lines), complex)

    def add(self, period: Samples) -> None:
        """Add one period of r, u, y and, from the first one on, perhaps q."""
        self.periods += 1
        reference, torque, position, *link = line_spectrum(np.stack(period))
        self.alternating += position if self.periods % 2 else -position
        self.reference += (reference - self.reference) / self.periods
        torque_before, position_before = torque - self.torque, position - self.position
        self.torque += torque_before / self.periods
        self.position += position_before / self.periods
        torque_after = np.conj(torque - self.torque)
        position_after = np.conj(position - self.position)
        self.scatter_torque += (torque_before * torque_after).real
        self.scatter_position += (position_before * position_after).real
        self.scatter_cross += position_before * torque_after
        if link:
            self._add_link(link[0], torque_after, position_after)

    def _add_link(self, link: np.ndarray, torque: np.ndarray, position: np.ndarray) -> None:
        """Add a spectrum of q; conjugates of what U and Y still differ from their means."""
        mean = np.zeros_like(link) if self.link is None else self.link
        before = link - mean
        self.link = mean + before / self.periods
        self.scatter_link += (before * np.conj(link - self.link)).real
        self.scatter_link_cross[0] += before * torque
        self.scatter_link_cross[1] += before * position

    def spectra(self, base_frequency_hz: float, last_line: int) -> RealizationSpectra:
        """Return means and their noise covariance from DC to harmonic `last_line`."""
        keep = slice(last_line + 1)
        degrees = self.periods * (self.periods - 1)
        scale = 1.0 / degrees if degrees else np.nan
        link = None
        if self.link is not None:
            cross = self.scatter_link_cross[:, keep] * scale
            link = LinkSpectra(
                self.link[keep].copy(), self.scatter_link[keep] * scale, cross[0], cross[1]
            )
        return RealizationSpectra(
            periods=self.periods,
            frequency_hz=base_frequency_hz * np.arange(last_line + 1),
            reference=self.reference[keep].copy(),
            torque=self.torque[keep].copy(),
            position=self.position[keep].copy(),
            var_torque=self.scatter_torque[keep] * scale,
            var_position=self.scatter_position[keep] * scale,
            cov_position_torque=self.scatter_cross[keep] * scale,
            link=link,
        )
