"""BLAs drawn from a known response with complex normal errors, as the robust method estimates."""

from __future__ import annotations

import numpy as np

from bla_analyzer.bla.robust import confidence_radius, f_test
from bla_analyzer.results.result import BlaEstimate, LinkBla
from fjr_sim_node.plant import PLANT
from fjr_sim_node.theory.linear import zoh_states

RATE_HZ = 1000.0
FREQUENCY_HZ = np.arange(0.5, 30.0, 0.5)
LINEAR = PLANT.defaults() | {"fs": 0.0, "fsm": 0.0, "k1": 0.0, "fv": 0.5, "fvm": 0.5}
"""The paper's joint without friction and cubic stiffness, lightly damped."""


def linear_response(outputs: int = 1, values: dict = LINEAR) -> np.ndarray:
    """Return torque to motor and link position at the lines, complex (F, O)."""
    states = zoh_states(values, FREQUENCY_HZ, RATE_HZ)
    return states[:, [2, 0]][:, :outputs]


def complex_normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


def draw(
    g: np.ndarray,
    realizations: int,
    rng: np.random.Generator,
    *,
    relative: float = 0.05,
    noise_share: float = 0.5,
) -> BlaEstimate:
    """Return a BLA of realizations whose errors are correlated between the outputs.

    Args:
        g: complex (F, O), the truth.
        realizations: M.
        rng: of the errors.
        relative: standard deviation of one realization over |g|; it rises with frequency.
        noise_share: share of the variance that is said to be noise.
    """
    shape = relative * (0.5 + FREQUENCY_HZ / 20.0)
    common = complex_normal(rng, realizations, FREQUENCY_HZ.size, 1)
    own = complex_normal(rng, realizations, FREQUENCY_HZ.size, g.shape[1])
    each = g * (1.0 + shape[:, None] * (0.8 * common + 0.6 * own))
    mean = each.mean(axis=0)
    off = each - mean
    scale = 1.0 / (realizations * (realizations - 1))
    covariance = scale * np.einsum("mfa,mfb->fab", off, off.conj())
    made = [
        _estimate(mean[:, o], covariance[:, o, o].real, realizations, noise_share)
        for o in range(g.shape[1])
    ]
    if len(made) < 2:
        return made[0]
    cross = covariance[:, 1, 0]
    link = LinkBla.of(made[1], cross, noise_share * cross)
    return made[0].model_copy(update={"link": link})


def _estimate(
    g: np.ndarray, variance: np.ndarray, realizations: int, noise_share: float
) -> BlaEstimate:
    noise = noise_share * variance
    degrees = realizations - 1
    return BlaEstimate(
        method="robust",
        realizations=realizations,
        periods=2,
        frequency_hz=FREQUENCY_HZ,
        g=g,
        var_total=variance,
        var_noise=noise,
        var_nonlinear=realizations * (variance - noise),
        nonlinear_p_value=f_test(variance, noise, 2 * degrees, 2 * realizations),
        radius_95=confidence_radius(variance, degrees),
        coherence=np.abs(g) ** 2 / (np.abs(g) ** 2 + realizations * variance),
        input_relative_variance=np.zeros(g.size),
        reliable=np.ones(g.size, bool),
    )
