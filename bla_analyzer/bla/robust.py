"""Robust method: the BLA from M realizations of P periods (paper eq. 11)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtrc

from fjr_kit.errors import InputError
from fjr_records.spectra import RealizationSpectra

from ..results.result import BlaEstimate, LinkBla
from .sensitivity import sensitivity

INPUT_VARIANCE_LIMIT = 0.02
"""Limit of Var(U)/|U|^2 (17 dB), beyond which a line is not reliable. Bias: with a circular normal
error e of variance s^2 on the mean torque, E{1/(U0 + e)} = (1 - exp(-|U0|^2/s^2))/U0, because the
mean of 1/(U0 + e) over |e| > |U0| is zero: 2 % at 6 dB, none here (see Pintelon and Schoukens,
System Identification: A Frequency Domain Approach, 2nd ed. 2012, ch. 2). Discs: even if all errors
stem from the torque, 95 % discs cover 94 % here for M of 2 to 40, and 90 to 94 % at 10 dB (Monte
Carlo; tests/bla_analyzer/test_bla_calibration.py)."""


def robust_bla(spectra: Sequence[RealizationSpectra], excited: np.ndarray) -> BlaEstimate:
    """Estimate the BLA, its total and noise variance and the stochastic nonlinear variance.

    Where all realizations have a link position, so of that, with the covariance of both errors;
    where they have a reference, the sensitivity of the loop.

    Args:
        spectra: one entry each realization, same grid and same number of periods.
        excited: (F,), excited harmonics.

    Raises:
        InputError: fewer than two realizations.
    """
    count = len(spectra)
    if count < 2:
        raise InputError(
            f"The robust method needs two or more realizations and has {count}; record more, or "
            "use the fast method."
        )
    motor = _one_output(spectra, excited)
    torque, position = turned(spectra, excited)
    played = np.mean([np.abs(one.reference[excited]) for one in spectra], axis=0)
    found = sensitivity(motor.g, motor.radius_95, torque.mean(axis=0), played)
    motor = motor.model_copy(update={"sensitivity": found})
    if any(one.link is None for one in spectra):
        return motor
    of_link = [one.of_link() for one in spectra]
    link = _one_output(of_link, excited)
    error = position - motor.g * torque
    error_link = turned(of_link, excited)[1] - link.g * torque
    scale = 1.0 / (count * np.abs(torque.mean(axis=0)) ** 2)
    cov_total = (error_link * error.conj()).sum(axis=0) * scale / (count - 1)
    noise = sum(one.noise_of_both(motor.g, link.g, excited) for one in spectra)
    cov_noise = noise * scale / count
    return motor.model_copy(update={"link": LinkBla.of(link, cov_total, cov_noise)})


def _one_output(spectra: Sequence[RealizationSpectra], excited: np.ndarray) -> BlaEstimate:
    """Estimate the BLA of motor torque to position."""
    count, periods = len(spectra), spectra[0].periods
    torque, position = turned(spectra, excited)
    mean_torque, mean_position = torque.mean(axis=0), position.mean(axis=0)
    input_power = np.abs(mean_torque) ** 2
    g = mean_position / mean_torque
    scale = 1.0 / (count * (count - 1) * input_power)
    var_total = (np.abs(position - g * torque) ** 2).sum(axis=0) * scale
    var_input = (np.abs(torque - mean_torque) ** 2).sum(axis=0) * scale
    noise = sum(one.noise_of_residual(g, excited) for one in spectra)
    var_noise = noise / (count**2 * input_power)
    return BlaEstimate(
        method="robust",
        realizations=count,
        periods=periods,
        frequency_hz=spectra[0].frequency_hz[excited],
        g=g,
        var_total=var_total,
        var_noise=var_noise,
        var_nonlinear=count * (var_total - var_noise),
        nonlinear_p_value=f_test(var_total, var_noise, 2 * (count - 1), 2 * count * (periods - 1)),
        radius_95=confidence_radius(var_total, count - 1),
        coherence=coherence(g, count * var_total),
        input_relative_variance=var_input,
        reliable=var_input <= INPUT_VARIANCE_LIMIT,
    )


def turned(
    spectra: Sequence[RealizationSpectra], excited: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return U and Y turned by the phase of the reference, complex (realizations, F) each."""
    reference = np.array([one.reference[excited] for one in spectra])
    turn = np.exp(-1j * np.angle(reference))
    torque = np.array([one.torque[excited] for one in spectra])
    position = np.array([one.position[excited] for one in spectra])
    return torque * turn, position * turn


def confidence_radius(
    variance: np.ndarray, degrees: np.ndarray | float, level: float = 0.95
) -> np.ndarray:
    """Return the radius of the confidence disc of a circular complex estimate.

    |error|^2 / variance follows F(2, 2n) where `variance` estimates E|error|^2 from n complex
    degrees of freedom; that quantile has the closed form n ((1 - level)^(-1/n) - 1).

    Args:
        variance: any shape, estimated variance.
        degrees: n, complex degrees of freedom (M - 1 in the robust method).
        level: probability that the disc covers the truth.
    """
    return np.sqrt(variance * degrees * ((1.0 - level) ** (-1.0 / degrees) - 1.0))


def coherence(g: np.ndarray, var_one: np.ndarray) -> np.ndarray:
    """Return the squared coherence of Y and G U, `var_one` the variance of one Y/U, (F,)."""
    power = np.abs(g) ** 2
    return np.asarray(power / (power + var_one))


def f_test(
    numerator: np.ndarray,
    denominator: np.ndarray,
    degrees: np.ndarray | int,
    degrees_denominator: np.ndarray | int,
) -> np.ndarray:
    """Return the p-value of a ratio of variances against F(degrees, degrees_denominator).

    NaN where a variance is unknown or both are zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.divide(numerator, denominator)
    return fdtrc(degrees, degrees_denominator, ratio)
