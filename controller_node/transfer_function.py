"""A controller given as a discrete transfer function, for rigs whose law is not the default one.

    C(z) = (b0 + b1 z^-1 + ... + bn z^-n) / (a0 + a1 z^-1 + ... + an z^-n)

from e = r - y (rad) to u (N m), at the sample rate of the experiment, as `scipy.signal.lfilter`
takes it. Written in descending powers of z with lists of the same length, the coefficients are the
same. The state is zero at the start; the output is clamped to the torque limit, the state is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fjr_kit.compiled import inlined
from fjr_kit.errors import InputError

from . import pd_filtered

KIND = "transfer_function"
_OUTSIDE = 1.0 + 1e-6  # poles on the unit circle integrate, rounding included


@dataclass(frozen=True)
class TransferFunction:
    """A discrete control law.

    Attributes:
        numerator: b0...bn, float64 (n + 1,).
        denominator: 1, a1...an, of the same length.
        limit_nm: the torque is clamped to +- this.
    """

    numerator: np.ndarray
    denominator: np.ndarray
    limit_nm: float = math.inf

    @classmethod
    def of(
        cls, numerator: Sequence[float], denominator: Sequence[float], limit_nm: float = math.inf
    ) -> TransferFunction:
        """Return the law with both polynomials of one length and a0 = 1."""
        b, a = np.zeros((2, max(len(numerator), len(denominator))))
        b[: len(numerator)] = numerator
        a[: len(denominator)] = denominator
        return cls(b / a[0], a / a[0], limit_nm)

    @classmethod
    def of_pd(cls, coefficients: np.ndarray) -> TransferFunction:
        """Return the default law, from `pd_filtered.coefficients`, as a transfer function."""
        p, dn, decay, limit = coefficients.tolist()
        return cls.of([p + dn, -p * decay - dn], [1.0, -decay], limit)

    @property
    def slowest_pole(self) -> float:
        """Greatest magnitude of a pole: how slowly the state is forgotten; 1 never."""
        return float(np.abs(np.roots(self.denominator)).max(initial=0.0))


@inlined
def step(x, error, numerator, denominator, limit):
    """Advance the controller by one sample (transposed direct form II).

    Args:
        x: state, float64 (n + 1,), updated in place; its last element stays zero.
        error: e = r - y (rad).
        numerator: of a TransferFunction.
        denominator: of the same.
        limit: torque limit (N m).

    Returns:
        torque u (N m).
    """
    torque = numerator[0] * error + x[0]
    for i in range(1, x.size):
        x[i - 1] = numerator[i] * error - denominator[i] * torque + x[i]
    return min(max(torque, -limit), limit)


def from_description(controller: Mapping[str, Any]) -> TransferFunction:
    """Return the law of a `controller` entry of kind transfer_function.

    Raises:
        InputError: a coefficient that is missing or not a number, or a law that is unstable.
    """
    source = "experiment description: controller"
    b, a = (_coefficients(controller, name, source) for name in ("numerator", "denominator"))
    if a[0] == 0.0:
        raise InputError(
            f"{source}.denominator begins with 0; give it in powers z^0, z^-1, ... as of now."
        )
    limit = controller.get("torque_limit_nm")
    if limit is not None and not (_is_number(limit) and limit > 0.0):
        raise InputError(f"{source}.torque_limit_nm must be greater than zero or null.")
    law = TransferFunction.of(b, a, math.inf if limit is None else float(limit))
    if law.slowest_pole > _OUTSIDE:
        raise InputError(
            f"{source}.denominator has a pole of magnitude {law.slowest_pole:.6g} outside the unit "
            "circle; give both lists in powers z^0, z^-1, ... of the discrete controller."
        )
    return law


def _coefficients(controller: Mapping[str, Any], name: str, source: str) -> list[float]:
    values = controller.get(name)
    if not isinstance(values, (list, tuple)) or not values or not all(map(_is_number, values)):
        raise InputError(f"{source}.{name} must be a list of finite numbers.")
    return [float(value) for value in values]


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return math.isfinite(value)


Law = np.ndarray | TransferFunction
"""A control law that can be simulated: coefficients of `pd_filtered`, or a transfer function."""


def law_of(controller: Mapping[str, Any] | None, sample_rate_hz: float) -> Law:
    """Return the law of the `controller` entry of an experiment description, of any known kind.

    Raises:
        InputError: there is no such entry, it is of no known kind, or its values are bad.
    """
    controller = controller or {}
    kind = controller.get("kind")
    if controller.get("unknown"):
        raise InputError(
            f"experiment description: controller: {controller['unknown'][0]} is unknown, so the "
            "law cannot be simulated; give its value."
        )
    if kind == KIND:
        return from_description(controller)
    if kind == "two_degrees_of_freedom":
        raise InputError(
            "experiment description: controller: a law of two degrees of freedom is described but "
            "not simulated yet; give one from r - y to u."
        )
    return pd_filtered.coefficients(pd_filtered.from_description(controller, sample_rate_hz))


def as_transfer_function(law: Law) -> TransferFunction:
    """Return any law as a transfer function."""
    return law if isinstance(law, TransferFunction) else TransferFunction.of_pd(law)
