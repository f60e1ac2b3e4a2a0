"""Local polynomial method: leakage and transients estimated from neighbouring lines and removed.

A transient, and leakage of a record that is not a whole number of periods, are smooth functions of
frequency, as the FRF is; multisine lines with random phases and noise are not. So over a few lines
both smooth parts are polynomials and the rest is known (Pintelon, Schoukens, Vandersteen, Barbe
2010, Mechanical Systems and Signal Processing 24(3), parts I and II; System Identification, 2nd ed.
2012, ch. 7). Limits: the transient must decay within the record (its spectrum is then smooth over a
window of 2 n + 1 lines), and the FRF must not bend more than a polynomial of order R within it: a
record of T seconds resolves a resonance of 3 dB bandwidth B while B T exceeds about 2 n.
"""

from __future__ import annotations

import numpy as np

from fjr_kit.errors import InputError
from fjr_records.spectra import RealizationSpectra, Samples

from ..results.result import BlaEstimate
from .robust import INPUT_VARIANCE_LIMIT, confidence_radius

ORDER = 2
HALF_WINDOW = 6
PERIODIC_WINDOW = 5
"""Least number of lines on each side that tell the transient of a periodic record; twice the number
of periods if that is more, which still spans little more than two lines of the grid."""


def transient_free_spectra(
    record: Samples,
    periods: int,
    base_frequency_hz: float,
    last_line: int,
    order: int = ORDER,
) -> RealizationSpectra:
    """Return the spectra of a periodic record from its very start, its transient taken out.

    Over P whole periods, a periodic signal has lines at multiples of P only; what lies between them
    is transient and noise. The transient at a line is the polynomial through its neighbours, and
    what is left there is the noise covariance. No period is discarded.

    Args:
        record: r, u, y of P whole periods from rest on, (P N,) each.
        periods: P, two or more.
        base_frequency_hz: 1/period.
        last_line: highest harmonic of the result.
        order: order of the polynomial of the transient.

    Raises:
        InputError: one period only, or a record that is no whole number of periods.
    """
    samples = record[0].size
    if periods < 2 or samples % periods:
        raise InputError(
            "The local polynomial method for periodic records needs two or more whole periods; "
            "record more, or use local_polynomial_bla."
        )
    spectra = np.fft.rfft(np.stack(record)) * (2.0 / samples)
    spectra[:, 0] *= 0.5
    window = max(PERIODIC_WINDOW, 2 * periods)
    one_side = [offset for offset in range(1, 2 * window + 1) if offset % periods][:window]
    offsets = np.array([sign * offset for sign in (-1, 1) for offset in one_side])
    terms = (offsets[:, None] / window) ** np.arange(order + 1)
    at_zero = np.linalg.pinv(terms)[0]
    rest = np.eye(offsets.size) - terms @ np.linalg.pinv(terms)
    degrees = offsets.size - order - 1
    lines = np.arange(last_line + 1) * periods
    near = np.abs(lines[:, None] + offsets)
    mirrored = lines[:, None] + offsets < 0
    around = spectra[1:, near]
    around = np.where(mirrored, np.conj(around), around)
    corrected = spectra[1:, lines] - around @ at_zero
    residual = around @ rest.T
    covariance = np.einsum("akn,bkn->abk", residual, np.conj(residual)) / degrees
    widened = covariance * (1.0 + at_zero @ at_zero)
    return RealizationSpectra(
        periods=periods,
        frequency_hz=base_frequency_hz * np.arange(last_line + 1),
        reference=spectra[0, lines],
        torque=corrected[0],
        position=corrected[1],
        var_torque=widened[0, 0].real,
        var_position=widened[1, 1].real,
        cov_position_torque=widened[1, 0],
    )


def local_polynomial_bla(
    record: Samples,
    sample_rate_hz: float,
    band_hz: tuple[float, float],
) -> BlaEstimate:
    """Estimate the BLA from one record of any broadband reference, periodic or not.

    At each line k, over r = -n..n: [Y; U](k+r) = (sum_i g_i r^i) R(k+r) + sum_i t_i r^i + noise,
    by least squares; G = G_ry/G_ru at r = 0 (the indirect method, paper eq. 11), so it holds in
    closed loop. Total variance from the residual; noise and distortion are not told apart.

    Args:
        record: r, u, y, (samples,) each; the reference must excite all lines of the band, with
            phases that vary from line to line (noise, or a multisine over a part of its period).
        sample_rate_hz: rate of the samples.
        band_hz: lowest and highest frequency of the estimate.

    Raises:
        InputError: the record does not hold the band.
    """
    freedom = 2 * HALF_WINDOW + 1 - 2 * (ORDER + 1)
    samples = record[0].size
    spectra = np.fft.rfft(np.stack(record)) * (2.0 / samples)
    spacing = sample_rate_hz / samples
    first, last = int(np.ceil(band_hz[0] / spacing)), int(np.floor(band_hz[1] / spacing))
    if first < HALF_WINDOW or last + HALF_WINDOW >= spectra.shape[1] or last < first:
        raise InputError(
            f"The record of {samples / sample_rate_hz:g} s holds no window of {HALF_WINDOW} lines "
            f"beside {band_hz[0]:g} to {band_hz[1]:g} Hz; narrow the band or record longer."
        )
    lines = np.arange(first, last + 1)
    reach = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    near = lines[:, None] + reach
    powers = (reach[:, None] / HALF_WINDOW) ** np.arange(ORDER + 1)
    terms = np.concatenate(
        [
            spectra[0, near][:, :, None] * powers,
            np.broadcast_to(powers, (*near.shape, ORDER + 1)),
        ],
        axis=2,
    )
    outputs = np.moveaxis(spectra[1:, near], 0, 2)
    inverse = np.linalg.pinv(terms)
    solution = inverse @ outputs
    residual = outputs - terms @ solution
    torque, position = solution[:, 0, 0], solution[:, 0, 1]
    spread = np.sum(np.abs(inverse[:, 0, :]) ** 2, axis=1) / freedom
    g = position / torque
    error = residual[:, :, 1] - g[:, None] * residual[:, :, 0]
    power = np.abs(torque) ** 2
    var_total = spread * np.sum(np.abs(error) ** 2, axis=1) / power
    var_input = spread * np.sum(np.abs(residual[:, :, 0]) ** 2, axis=1) / power
    unknown = np.full(g.shape, np.nan)
    return BlaEstimate(
        method="fast",
        realizations=1,
        periods=1,
        frequency_hz=lines * spacing,
        g=g,
        var_total=var_total,
        var_noise=unknown,
        var_nonlinear=unknown,
        nonlinear_p_value=unknown,
        radius_95=confidence_radius(var_total, freedom),
        coherence=unknown,
        input_relative_variance=var_input,
        reliable=var_input <= INPUT_VARIANCE_LIMIT,
    )
