"""Fast method: BLA and distortion of one realization, by its detection lines."""

from __future__ import annotations

import numpy as np

from fjr_kit.errors import InputError
from fjr_records.lines import Lines, interpolate_frf, nearest
from fjr_records.spectra import RealizationSpectra

from ..distortion.levels import corrected_position
from ..distortion.local_power import local_power
from ..distortion.resonant_poles import resonant_poles, resonant_power
from ..distortion.third_order import third_order_power
from ..results.result import BlaEstimate, LinkBla
from .robust import INPUT_VARIANCE_LIMIT, coherence, confidence_radius, f_test
from .sensitivity import sensitivity

NEIGHBOURS = 8
"""Odd detection lines that tell the distortion at an excited line: some sixteen degrees of freedom,
within 2.4 Hz on each side on the paper's grid. docs/paper.md compares estimators over 22 rigs; this
one's variance is off by 8 % rms over lines in the median, most of it chance."""


def fast_bla(
    spectra: RealizationSpectra, lines: Lines, neighbours: int = NEIGHBOURS
) -> BlaEstimate:
    """Estimate the BLA from one realization, its variances from odd detection lines and periods.

    The total variance at an excited line is the expected power of Yc = Y - G U there, told by the K
    nearest odd detection lines (`_expected_power`), over |U|^2, with about 2 K degrees of freedom;
    NaN without odd detection lines. The test of nonlinearity compares the mean power of these lines
    with the mean noise there, F(2 K, 2 K (P-1)). Var(U) is the mean power of U at them. A link
    position is estimated likewise, with the covariance of both errors.

    Args:
        spectra: one realization.
        lines: its grid.
        neighbours: K, or fewer if there are not that many.

    Raises:
        InputError: fewer than two periods.
    """
    if spectra.periods < 2:
        raise InputError(
            "The fast method needs two or more periods after the transient and has "
            f"{spectra.periods}; record more periods, or use the robust method."
        )
    motor, excited = _one_output(spectra, lines, neighbours), lines.excited
    torque, reference = spectra.torque[excited], spectra.reference[excited]
    found = sensitivity(motor.g, motor.radius_95, torque, reference)
    motor = motor.model_copy(update={"sensitivity": found})
    if spectra.link is None:
        return motor
    of_link = spectra.of_link()
    link = _one_output(of_link, lines, neighbours)
    power = np.abs(torque) ** 2
    cov_noise = spectra.noise_of_both(motor.g, link.g, excited) / power
    cov_total = np.full(link.g.shape, complex(np.nan, np.nan))
    if lines.odd.size:
        shape = _correlation(spectra, of_link, motor.g, link.g, lines, neighbours)
        cov_total = shape * np.sqrt(motor.var_total * link.var_total)
    return motor.model_copy(update={"link": LinkBla.of(link, cov_total, cov_noise)})


def _correlation(
    spectra: RealizationSpectra,
    of_link: RealizationSpectra,
    g: np.ndarray,
    g_link: np.ndarray,
    lines: Lines,
    neighbours: int,
) -> np.ndarray:
    """Return the correlation of the errors of both outputs, complex (F,), from detection lines.

    Errors relative to G are alike from line to line where a disturbance acts as the torque does.
    """
    odd, excited = lines.odd, lines.excited
    near = nearest(excited, odd, min(neighbours, odd.size))
    one, two = (
        corrected_position(s, each, lines, odd) / interpolate_frf(odd, excited, each)
        for s, each in ((spectra, g), (of_link, g_link))
    )
    cross = (two * one.conj())[near].mean(axis=1)
    powers = [(np.abs(each) ** 2)[near].mean(axis=1) for each in (one, two)]
    turn = g_link * g.conj() / np.abs(g_link * g)
    return cross / np.maximum(np.sqrt(powers[0] * powers[1]), 1e-300) * turn


def _one_output(spectra: RealizationSpectra, lines: Lines, neighbours: int) -> BlaEstimate:
    """Estimate the BLA of motor torque to position."""
    excited = lines.excited
    torque = spectra.torque[excited]
    input_power = np.abs(torque) ** 2
    g = spectra.position[excited] / torque
    var_noise = spectra.noise_of_residual(g, excited) / input_power
    count = min(neighbours, lines.odd.size)
    unknown = np.full(g.shape, np.nan)
    var_total = p_value = radius = unknown
    var_input = spectra.var_torque[excited] / input_power
    if count:
        near = nearest(excited, lines.odd, count)
        power = np.abs(corrected_position(spectra, g, lines, lines.odd)) ** 2
        g_odd = interpolate_frf(lines.odd, excited, g)
        noise = spectra.noise_of_residual(g_odd, lines.odd)
        mean, mean_noise = power[near].mean(axis=1), noise[near].mean(axis=1)
        noise_share = np.minimum(mean_noise / np.where(mean > 0, mean, np.inf), 1.0)
        expected, degrees = _expected_power(spectra, g, lines, power, noise_share, count)
        var_total = expected / input_power
        p_value = f_test(mean, mean_noise, 2 * count, 2 * count * (spectra.periods - 1))
        radius = confidence_radius(var_total, degrees)
        var_input = (np.abs(spectra.torque[lines.odd]) ** 2)[near].mean(axis=1) / input_power
    return BlaEstimate(
        method="fast",
        realizations=1,
        periods=spectra.periods,
        frequency_hz=spectra.frequency_hz[excited],
        g=g,
        var_total=var_total,
        var_noise=var_noise,
        var_nonlinear=var_total - var_noise,
        nonlinear_p_value=p_value,
        radius_95=radius,
        coherence=coherence(g, var_total),
        input_relative_variance=var_input,
        reliable=var_input <= INPUT_VARIANCE_LIMIT,
    )


def _expected_power(
    spectra: RealizationSpectra,
    g: np.ndarray,
    lines: Lines,
    power: np.ndarray,
    noise_share: np.ndarray,
    count: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the expected power of Yc at excited lines, and the complex degrees of freedom, (F,).

    The spectrum of distortion bends within the reach of the neighbours where the plant resonates,
    and detection lines carry more of it than excited ones (`third_order`). So it is prewhitened by
    the resonances of G, which all distortion torques pass through (zeros and integrators they need
    not), and by the third-order spectrum of the measured velocity. Noise has neither shape: Yc is
    taken as it is to the extent that it is noise.

    Args:
        spectra: one realization.
        g: complex (F,), G at the excited lines.
        lines: its grid.
        power: (K,), of Yc at the odd detection lines.
        noise_share: (F,), noise over power of Yc around each excited line.
        count: number of neighbours.
    """
    odd, excited = lines.odd, lines.excited
    plain, degrees = local_power(power, odd, excited, count)
    at = np.concatenate([odd, excited])
    frequency_hz = spectra.frequency_hz
    velocity = np.abs(frequency_hz[excited] * spectra.position[excited]) ** 2
    poles = resonant_poles(frequency_hz[excited], g)
    shape = resonant_power(frequency_hz[at], poles) * third_order_power(excited, velocity, at)
    whitened, _ = local_power(power / shape[: odd.size], odd, excited, count)
    distortion = whitened * shape[odd.size :]
    return noise_share * plain + (1.0 - noise_share) * distortion, degrees
