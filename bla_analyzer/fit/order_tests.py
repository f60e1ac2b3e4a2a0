"""Whether a model explains the BLA: its cost beside what is expected, and a white residual.

Under the true model the cost sum e^H C^-1 e has the mean that the covariances of the lines give,
less what the fit takes, and is distributed as chi-square; as covariances are estimates, as F
(Pintelon and Schoukens, System Identification, 2nd ed. 2012, ch. 11).
"""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from .fit_types import OrderTest, Whiteness
from .samples import Samples
from .uncertainty import LEVEL, Uncertainty

MOST_LAGS = 20


def order_test(
    name: str, samples: Samples, model: np.ndarray, uncertainty: Uncertainty
) -> OrderTest:
    """Return the cost of a model beside its expected value.

    Args:
        name: of the order.
        samples: the lines.
        model: complex (F, O).
        uncertainty: of its parameters, not widened.
    """
    white = samples.white_covariance
    count = uncertainty.bread.shape[0]
    cost = samples.cost(model)
    shares = np.einsum("faa->f", white).real
    squares = np.einsum("fab,fba->f", white, white).real / (1.0 + 1.0 / samples.degrees)
    total = float(shares.sum())
    expected = max(total - uncertainty.lost, 1e-3 * total)
    degrees = max(2.0 * total**2 / float(squares.sum()) - count, 1.0)
    known = 2.0 * total**2 / float((squares / samples.degrees).sum())
    low, high = (
        expected * float(f_distribution.ppf(p, degrees, known))
        for p in (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL)
    )
    fit = 2.0 * cost * samples.g.size / total
    return OrderTest(
        name=name,
        parameters=count,
        cost=cost,
        expected=expected,
        low=low,
        high=high,
        aic=fit + 2.0 * count,
        mdl=fit + count * float(np.log(2.0 * samples.g.size)),
    )


def whiteness(samples: Samples, model: np.ndarray) -> Whiteness:
    """Return the autocorrelation over lines of the normalised residual.

    Args:
        samples: the lines.
        model: complex (F, O).
    """
    white = samples.whitened(samples.g - model)
    lines = white.shape[0]
    count = max(1, min(MOST_LAGS, lines // 3))
    power = max(float((np.abs(white) ** 2).sum()), 1e-300)
    found = np.array(
        [
            np.vdot(white[:-lag], white[lag:]) / power * np.sqrt(lines / (lines - lag))
            for lag in range(1, count + 1)
        ]
    )
    size = np.abs(found) * np.sqrt(white.size)
    bound = float(np.sqrt(-np.log(1.0 - LEVEL)))
    return Whiteness(
        correlation=found,
        bound=bound / float(np.sqrt(white.size)),
        outside=int((size > bound).sum()),
        p_value=float(chi2.sf(2.0 * (size**2).sum(), 2 * count)),
    )
