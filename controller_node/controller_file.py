"""What a user knows of a controller, read from a file and turned into a description.

The file is YAML or JSON. Its `kind` names the structure; every gain is a number, or `unknown`:

    kind: pid                       p, i, d; n (derivative filter, rad/s), derivative_on: error or
                                    measurement, setpoint_weight; pd is the same without i
    kind: p_pi                      k_position (1/s), k_velocity (N m s/rad), integral_time_s,
                                    velocity_filter_rad_s: P position loop around a PI velocity loop
    kind: transfer_function         numerator, denominator, from r - y to u
    kind: two_degrees_of_freedom    reference and position with numerator and denominator each,
                                    u = C_r r - C_y y
    kind: pd_filtered               p, d, n: the law of the controller node

Transfer functions are `domain: discrete` (powers z^0, z^-1, ...) or `continuous` (descending powers
of s, made discrete by Tustin's rule). Integrals are sums, (Ts/(1 - z^-1)); a derivative is a
difference, or the step-invariant one of `pd_filtered` where it has a filter. Any kind may have
`torque_limit_nm`, and `feed_forward` with `velocity` (N m s/rad) and `acceleration` (N m s^2/rad).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError
from scipy.signal import cont2discrete

from fjr_interface.bags.plain_yaml import load_plain_yaml
from fjr_kit.errors import InputError

from . import transfer_function

UNKNOWN = "unknown"
TWO_DEGREES = "two_degrees_of_freedom"
_LARGEST_FILE = 2**20
_MOST_COEFFICIENTS = 64


def _no_truth(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number, or unknown")
    return value


Number = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_no_truth)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), BeforeValidator(_no_truth)]
Gain = Number | Literal["unknown"]
Rate = Positive | Literal["unknown"]
Coefficients = Annotated[list[Gain], Field(min_length=1, max_length=_MOST_COEFFICIENTS)]
Polynomials = tuple[np.ndarray, np.ndarray]
"""Numerator and denominator in powers z^0, z^-1, ..."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class FeedForward(_Part):
    """Torque in proportion to velocity and acceleration of the reference."""

    velocity: Gain = 0.0
    acceleration: Gain = 0.0

    def polynomials(self, period_s: float) -> Polynomials:
        """Return it as a transfer function of the reference."""
        one = np.array([1.0])
        difference = np.array([1.0, -1.0]) / period_s
        velocity = (float(self.velocity) * difference, one)
        twice = np.convolve(difference, difference)
        return _sum(velocity, (float(self.acceleration) * twice, one))


class Ratio(_Part):
    """A transfer function."""

    numerator: Coefficients
    denominator: Coefficients


class _Law(_Part):
    torque_limit_nm: Rate | None = None
    feed_forward: FeedForward = FeedForward()


class Pid(_Law):
    """PD or PID, its derivative on the error or on the measurement."""

    kind: Literal["pd", "pid"]
    p: Gain
    i: Gain = 0.0
    d: Gain = 0.0
    n: Rate | None = None
    derivative_on: Literal["error", "measurement"] = "error"
    setpoint_weight: Gain = 1.0

    def polynomials(self, period_s: float) -> tuple[Polynomials, Polynomials]:
        """Return (C_r, C_y)."""
        one = np.array([1.0])
        integral = (float(self.i) * period_s * one, np.array([1.0, -1.0])) if self.i else None
        derivative = _scaled(self.d, _derivative(self.n, period_s)) if self.d else None
        both = [part for part in (integral,) if part is not None]
        position = [(float(self.p) * one, one), *both, *([derivative] if derivative else [])]
        reference = [(float(self.p) * float(self.setpoint_weight) * one, one), *both]
        if derivative and self.derivative_on == "error":
            reference.append(derivative)
        return _sum(*reference), _sum(*position)


class Cascade(_Law):
    """A P position loop around a PI velocity loop, the velocity taken from the position."""

    kind: Literal["p_pi"]
    k_position: Gain
    k_velocity: Gain
    integral_time_s: Rate | None = None
    velocity_filter_rad_s: Rate | None = None

    def polynomials(self, period_s: float) -> tuple[Polynomials, Polynomials]:
        """Return (C_r, C_y)."""
        one = np.array([1.0])
        inner: Polynomials = (float(self.k_velocity) * one, one)
        if self.integral_time_s is not None:
            share = period_s / float(self.integral_time_s)
            integrated = np.array([1.0 + share, -1.0])
            inner = (float(self.k_velocity) * integrated, np.array([1.0, -1.0]))
        outer: Polynomials = (float(self.k_position) * one, one)
        velocity = _derivative(self.velocity_filter_rad_s, period_s)
        return _product(inner, outer), _product(inner, _sum(outer, velocity))


class Error(_Law):
    """A transfer function from r - y to u."""

    kind: Literal["transfer_function"]
    numerator: Coefficients
    denominator: Coefficients
    domain: Literal["discrete", "continuous"] = "discrete"

    def polynomials(self, period_s: float) -> tuple[Polynomials, Polynomials]:
        """Return (C_r, C_y)."""
        law = _discrete(self.numerator, self.denominator, self.domain, period_s)
        return law, law


class TwoDegrees(_Law):
    """Transfer functions of the reference and of the position."""

    kind: Literal["two_degrees_of_freedom"]
    reference: Ratio
    position: Ratio
    domain: Literal["discrete", "continuous"] = "discrete"

    def polynomials(self, period_s: float) -> tuple[Polynomials, Polynomials]:
        """Return (C_r, C_y)."""
        r, y = (
            _discrete(part.numerator, part.denominator, self.domain, period_s)
            for part in (self.reference, self.position)
        )
        return r, y


class NodeLaw(_Law):
    """The law of the controller node."""

    kind: Literal["pd_filtered"]
    p: Gain
    d: Gain
    n: Rate

    def polynomials(self, period_s: float) -> tuple[Polynomials, Polynomials]:
        """Return (C_r, C_y)."""
        one = np.array([1.0])
        law = _sum((float(self.p) * one, one), _scaled(self.d, _derivative(self.n, period_s)))
        return law, law


Structure = Pid | Cascade | Error | TwoDegrees | NodeLaw
_ADAPTER: TypeAdapter[Structure] = TypeAdapter(Annotated[Structure, Field(discriminator="kind")])


def read_controller(path: Path) -> Structure:
    """Read the file; raise InputError that names the field."""
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise InputError(f"{path}: is larger than {_LARGEST_FILE} bytes; name another file.")
        content = load_plain_yaml(path.read_bytes().decode())
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except (ValueError, RecursionError):
        raise InputError(f"{path}: is neither YAML nor JSON; write the controller anew.") from None
    try:
        return _ADAPTER.validate_python(content)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        kinds = {"pd", "pid", "p_pi", "pd_filtered", transfer_function.KIND, TWO_DEGREES}
        where = [str(part) for part in problem["loc"] if part not in kinds]
        what = problem["msg"].removeprefix("Value error, ").replace("Input", "it", 1)
        field = ".".join(part for part in where if part.islower() and "[" not in part)
        raise InputError(f"{path}: controller{field and '.'}{field}: {what}.") from None


def describe(structure: Structure, sample_rate_hz: float, source: str) -> dict[str, Any]:
    """Return the `controller` entry of an experiment description.

    A structure whose gains are all known becomes `pd_filtered`, `transfer_function` or
    `two_degrees_of_freedom`, discrete at this rate, with what the user gave beside it. Otherwise it
    stays what it is: unknown gains are null, and listed in `unknown`.

    Raises:
        InputError: the law is not causal or not stable; names `source`.
    """
    given = structure.model_dump(exclude_defaults=True)
    unknown = _unknown(given)
    if unknown:
        return {**_nulled(given), "unknown": unknown}
    limit = structure.torque_limit_nm
    clamp = {"torque_limit_nm": None if limit is None else float(limit)}
    plain = structure.feed_forward == FeedForward()
    if isinstance(structure, NodeLaw) and plain:
        return {
            "kind": structure.kind,
            "p": structure.p,
            "d": structure.d,
            "n": structure.n,
            **clamp,
        }
    reference, position = structure.polynomials(1.0 / sample_rate_hz)
    if not plain:
        reference = _sum(reference, structure.feed_forward.polynomials(1.0 / sample_rate_hz))
    entries = [_checked(part, source) for part in (reference, position)]
    if entries[0] == entries[1]:
        return {"kind": transfer_function.KIND, **entries[0], **clamp, "given": given}
    parts = dict(zip(("reference", "position"), entries, strict=True))
    return {"kind": TWO_DEGREES, **parts, **clamp, "given": given}


def _checked(polynomials: Polynomials, source: str) -> dict[str, list[float]]:
    numerator, denominator = polynomials
    if denominator[0] == 0.0 or not np.isfinite(np.concatenate(polynomials)).all():
        raise InputError(f"{source}: controller: is not causal; correct its denominator.")
    entry = {
        "numerator": (numerator / denominator[0]).tolist(),
        "denominator": (denominator / denominator[0]).tolist(),
    }
    try:
        transfer_function.from_description(entry)
    except InputError as error:
        raise InputError(str(error).replace("experiment description", source, 1)) from None
    return entry


def _unknown(given: Any, prefix: str = "") -> list[str]:
    """Return the dotted names of all values that are unknown."""
    if given == UNKNOWN:
        return [prefix]
    inside: list[tuple[Any, Any]] = []
    if isinstance(given, dict):
        inside = list(given.items())
    elif isinstance(given, list):
        inside = list(enumerate(given))
    return [
        name
        for key, value in inside
        for name in _unknown(value, f"{prefix}.{key}" if prefix else str(key))
    ]


def _nulled(given: Any) -> Any:
    if isinstance(given, dict):
        return {key: _nulled(value) for key, value in given.items()}
    if isinstance(given, list):
        return [_nulled(value) for value in given]
    return None if given == UNKNOWN else given


def _discrete(
    numerator: list[Any], denominator: list[Any], domain: str, period_s: float
) -> Polynomials:
    b, a = np.array(numerator, float), np.array(denominator, float)
    if domain == "discrete":
        return b, a
    b, a = np.trim_zeros(b, "f"), np.trim_zeros(a, "f")
    if not a.size or b.size > a.size:
        return b, np.zeros(1)
    with np.errstate(all="ignore"):
        b, a, _ = cont2discrete((b if b.size else np.zeros(1), a), period_s, method="bilinear")
    return np.atleast_1d(np.squeeze(b)), np.atleast_1d(np.squeeze(a))


def _derivative(filter_rad_s: Any, period_s: float) -> Polynomials:
    """Return d/dt, behind a filter step-invariant as in `pd_filtered`, else a difference."""
    if filter_rad_s is None:
        return np.array([1.0, -1.0]) / period_s, np.array([1.0])
    decay = math.exp(-float(filter_rad_s) * period_s)
    return float(filter_rad_s) * np.array([1.0, -1.0]), np.array([1.0, -decay])


def _scaled(gain: Any, polynomials: Polynomials) -> Polynomials:
    return float(gain) * polynomials[0], polynomials[1]


def _product(one: Polynomials, other: Polynomials) -> Polynomials:
    return np.convolve(one[0], other[0]), np.convolve(one[1], other[1])


def _sum(*parts: Polynomials) -> Polynomials:
    """Return the sum; a denominator that two parts share is taken once."""
    numerator, denominator = parts[0]
    for b, a in parts[1:]:
        if np.array_equal(a, denominator):
            numerator = _added(numerator, b)
        else:
            numerator = _added(np.convolve(numerator, a), np.convolve(b, denominator))
            denominator = np.convolve(denominator, a)
    return numerator, denominator


def _added(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    size = max(one.size, other.size)
    return np.pad(one, (0, size - one.size)) + np.pad(other, (0, size - other.size))
