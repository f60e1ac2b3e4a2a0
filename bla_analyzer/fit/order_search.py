"""Rational models of several orders, of which the least description length chooses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fjr_kit.errors import InputError

from .described_model import Fitted
from .fit_types import OrderTest
from .likelihood import Task
from .order_tests import order_test
from .rational import fit_rational
from .sampled import Domain, Hold, Sampled
from .samples import Samples
from .uncertainty import Uncertainty

HIGHEST = 8
"""Greatest degree of the denominator that is tried."""
IN_VAIN = 2
"""Degrees in a row that may bring nothing before the search ends."""

Order = tuple[int, int]
"""Degrees of numerator and denominator, nb and na."""
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Tried:
    """A fitted model beside its test."""

    model: Fitted
    test: OrderTest


def tried(name: str, samples: Samples, model: Fitted) -> Tried:
    """Return a fitted model with the test of its order."""
    g, jacobian = model.response()
    return Tried(model, order_test(name, samples, g, Uncertainty.of(samples, jacobian)))


def fit_order(
    samples: Samples,
    rate_hz: float,
    order: Order,
    domain: Domain,
    hold: Hold,
    delay_s: float,
    free_delay: bool,
) -> Tried:
    """Fit one order.

    Raises:
        InputError: the order is too high for so few lines.
    """
    nb, na = order
    count = samples.outputs * (nb + 1) + na + free_delay
    if 2 * samples.g.size <= count:
        raise InputError(
            f"Order {nb}/{na} has {count} parameters, but {samples.g.shape[0]} lines tell "
            f"{2 * samples.g.size} numbers; choose a lower order."
        )
    seen = Sampled.of(samples.frequency_hz, rate_hz, domain, hold, na - nb)
    model = fit_rational(Task(samples, seen, delay_s, free_delay), nb, na)
    return tried(f"{nb}/{na}", samples, model)


def search(
    samples: Samples,
    rate_hz: float,
    domain: Domain,
    hold: Hold,
    delay_s: float,
    free_delay: bool,
    tell: Tell,
) -> list[Tried]:
    """Return the models of all orders that were tried, the best first.

    Raises:
        InputError: the lines are too few for any order.
    """
    made: list[Tried] = []
    best, in_vain = np.inf, 0
    for na, orders in _orders(domain):
        for order in orders:
            tell(f"order {order[0]}/{order[1]}")
            try:
                made.append(fit_order(samples, rate_hz, order, domain, hold, delay_s, free_delay))
            except (InputError, np.linalg.LinAlgError, ValueError):
                continue  # more parameters than the lines tell
        least = min((one.test.mdl for one in made), default=np.inf)
        in_vain = 0 if least < best else in_vain + 1
        best = least
        if in_vain >= IN_VAIN and na >= 4:
            break
    if not made:
        raise InputError("The lines are too few for any order; excite more.")
    return sorted(made, key=lambda one: one.test.mdl)


def _orders(domain: Domain) -> Iterator[tuple[int, list[Order]]]:
    """Yield the orders of each degree: a torque moves a mass, so a position falls as 1/s^2."""
    gaps = (2, 3) if domain == "s" else (1, 2)
    for na in range(1, HIGHEST + 1):
        yield na, [(na - gap, na) for gap in gaps if na >= gap]
