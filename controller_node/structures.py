"""The structures of controllers, each with its gains, and the discrete law that they make.

Their fields are those of a controller file (`controller_file`) and of the `controller` entry of an
experiment description. A gain is a number or `unknown`; a law is made once all are numbers.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError

from fjr_kit.errors import InputError
from fjr_kit.result_types import what_is_wrong

from . import polynomials
from .polynomials import ONE, Ratio
from .transfer_function import TransferFunction

UNKNOWN = "unknown"
ONE_DEGREE, TWO_DEGREES = "transfer_function", "two_degrees_of_freedom"
_MOST_COEFFICIENTS = 128
FASTEST_HZ = 1e5
"""Highest rate of a law."""
_SAME_RATE, _MOST_STEPS = 1e-3, 1000


def _no_truth(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number, or unknown")
    return value


def _known(value: Any) -> Any:
    if isinstance(value, bool) or value in (UNKNOWN, None):
        raise ValueError("must be a number; only coefficients of a numerator may be unknown")
    return value


Number = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_no_truth)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), BeforeValidator(_no_truth)]
Gain = Number | Literal["unknown"]
Rate = Positive | Literal["unknown"]
Known = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_known)]
Numerator = Annotated[list[Gain], Field(min_length=1, max_length=_MOST_COEFFICIENTS)]
Denominator = Annotated[list[Known], Field(min_length=1, max_length=_MOST_COEFFICIENTS)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class FeedForward(_Part):
    """Torque in proportion to velocity and acceleration of the reference."""

    velocity: Gain = 0.0
    acceleration: Gain = 0.0

    def of_reference(self, period_s: float) -> Ratio:
        """Return it as a transfer function of the reference."""
        speed = polynomials.derivative(None, period_s)
        return polynomials.total(
            polynomials.scaled(float(self.velocity), speed),
            polynomials.scaled(float(self.acceleration), polynomials.product(speed, speed)),
        )


class Ratios(_Part):
    """A transfer function."""

    numerator: Numerator
    denominator: Denominator


class Structure(_Part):
    """What all controllers have."""

    torque_limit_nm: Rate | None = None
    feed_forward: FeedForward = FeedForward()
    rate_hz: Annotated[float, Field(gt=0, le=FASTEST_HZ), BeforeValidator(_known)] | None = None
    between_samples: Literal["held", "joined"] = "held"

    @abstractmethod
    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return C_r without feed-forward, and C_y; all gains must be numbers."""

    def law(self, sample_rate_hz: float, source: str) -> TransferFunction:
        """Return the law at a rate.

        Raises:
            InputError: a gain is unknown, or it is not causal or not stable; names `source`.
        """
        if unknown := unknown_names(self.model_dump()):
            raise InputError(f"{source}.{unknown[0]} is unknown; give its value.")
        period_s = 1.0 / sample_rate_hz
        limit = math.inf if self.torque_limit_nm is None else float(self.torque_limit_nm)
        with np.errstate(all="ignore"):
            reference, position = self.ratios(period_s)
            if self.feed_forward != FeedForward():
                forward = self.feed_forward.of_reference(period_s)
                reference = polynomials.total(reference, forward)
            both = _causal(reference, source), _causal(position, source)
            law = TransferFunction.of_two(*both, limit)
        if law.denominator.size > _MOST_COEFFICIENTS:
            raise InputError(f"{source} has more than {_MOST_COEFFICIENTS} coefficients.")
        return law.checked(source)

    def law_as_run(self, sample_rate_hz: float, source: str) -> TransferFunction:
        """Return the law at its own rate, the multiple of a slower one that comes nearest to it.

        Raises:
            InputError: as `law` and `steps`; names `source`.
        """
        steps = self.steps(sample_rate_hz, source)
        law = self.law(steps * sample_rate_hz, source)
        return replace(law, steps=steps, joins=self.between_samples == "joined")

    def steps(self, sample_rate_hz: float, source: str) -> int:
        """Return how often the law runs in one sample.

        Raises:
            InputError: it runs slower than the samples come, or so fast as no log calls for.
        """
        rate_hz = sample_rate_hz if self.rate_hz is None else self.rate_hz
        if rate_hz < sample_rate_hz * (1.0 - _SAME_RATE):
            raise InputError(
                f"{source}.rate_hz is {rate_hz:g} Hz, but the samples come at {sample_rate_hz:g} "
                "Hz; a law that runs slower than its record cannot be played."
            )
        if rate_hz > _MOST_STEPS * sample_rate_hz:
            raise InputError(
                f"{source}.rate_hz is {rate_hz:g} Hz, more than {_MOST_STEPS} times the "
                f"{sample_rate_hz:g} Hz of the samples; sample faster, or correct it."
            )
        return round(rate_hz / sample_rate_hz)


def unknown_names(given: Any, prefix: str = "") -> list[str]:
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
        for name in unknown_names(value, f"{prefix}.{key}" if prefix else str(key))
    ]


def _causal(ratio: Ratio, source: str) -> Ratio:
    """Return the ratio with a0 = 1."""
    b, a = ratio
    if a[0] == 0.0:
        raise InputError(f"{source} is not causal; correct its denominator.")
    b, a = b / a[0], a / a[0]
    if not np.isfinite(np.concatenate([b, a])).all():
        raise InputError(f"{source} has coefficients that are not finite; correct its numbers.")
    return b, a


class Pid(Structure):
    """PD or PID, its derivative on the error or on the measurement."""

    kind: Literal["pd", "pid"]
    p: Gain
    i: Gain = 0.0
    d: Gain = 0.0
    n: Rate | None = None
    derivative_on: Literal["error", "measurement"] = "error"
    setpoint_weight: Gain = 1.0

    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return (C_r, C_y)."""
        p, weight = float(self.p), float(self.setpoint_weight)
        others: list[Ratio] = []
        of_position: list[Ratio] = []
        if self.i:
            others.append(polynomials.scaled(float(self.i), polynomials.integral(period_s)))
        if self.d:
            n = None if self.n is None else float(self.n)
            part = polynomials.scaled(float(self.d), polynomials.derivative(n, period_s))
            (others if self.derivative_on == "error" else of_position).append(part)
        reference = polynomials.total(polynomials.scaled(p * weight, ONE), *others)
        position = polynomials.total(polynomials.scaled(p, ONE), *others, *of_position)
        return reference, position


class Cascade(Structure):
    """A P position loop around a PI velocity loop, the velocity taken from the position."""

    kind: Literal["p_pi"]
    k_position: Gain
    k_velocity: Gain
    integral_time_s: Rate | None = None
    velocity_filter_rad_s: Rate | None = None

    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return (C_r, C_y)."""
        inner = ONE
        if self.integral_time_s is not None:
            share = 1.0 / float(self.integral_time_s)
            inner = polynomials.total(
                ONE, polynomials.scaled(share, polynomials.integral(period_s))
            )
        inner = polynomials.scaled(float(self.k_velocity), inner)
        outer = polynomials.scaled(float(self.k_position), ONE)
        n = None if self.velocity_filter_rad_s is None else float(self.velocity_filter_rad_s)
        velocity = polynomials.derivative(n, period_s)
        return (
            polynomials.product(inner, outer),
            polynomials.product(inner, polynomials.total(outer, velocity)),
        )


class Error(Structure):
    """A transfer function from r - y to u."""

    kind: Literal["transfer_function"]
    numerator: Numerator
    denominator: Denominator
    domain: Literal["discrete", "continuous"] = "discrete"

    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return (C_r, C_y)."""
        b = [float(each) for each in self.numerator]
        law = polynomials.discrete(b, self.denominator, self.domain, period_s)
        return law, law


class TwoDegrees(Structure):
    """Transfer functions of the reference and of the position."""

    kind: Literal["two_degrees_of_freedom"]
    reference: Ratios
    position: Ratios
    domain: Literal["discrete", "continuous"] = "discrete"

    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return (C_r, C_y)."""
        r, y = (
            polynomials.discrete(
                [float(each) for each in part.numerator], part.denominator, self.domain, period_s
            )
            for part in (self.reference, self.position)
        )
        return r, y


class NodeLaw(Structure):
    """The law of the controller node."""

    kind: Literal["pd_filtered"]
    p: Gain
    d: Gain
    n: Rate

    def ratios(self, period_s: float) -> tuple[Ratio, Ratio]:
        """Return (C_r, C_y)."""
        filtered = polynomials.step_invariant_derivative(float(self.n), period_s)
        law = polynomials.total(
            polynomials.scaled(float(self.p), ONE), polynomials.scaled(float(self.d), filtered)
        )
        return law, law


AnyStructure = Pid | Cascade | Error | TwoDegrees | NodeLaw
KINDS: dict[str, type[Structure]] = {
    "pd": Pid,
    "pid": Pid,
    "p_pi": Cascade,
    ONE_DEGREE: Error,
    TWO_DEGREES: TwoDegrees,
    "pd_filtered": NodeLaw,
}
_ADAPTER: TypeAdapter[AnyStructure] = TypeAdapter(
    Annotated[AnyStructure, Field(discriminator="kind")]
)


def structure_of(content: Any, source: str) -> AnyStructure:
    """Return the structure that a mapping describes; raise InputError that names the field."""
    try:
        return _ADAPTER.validate_python(content)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        what = what_is_wrong(problem)
        where = [str(part) for part in problem["loc"] if part not in KINDS]
        named = (part for part in where if part.isdigit() or part.islower())
        field = ".".join(part for part in named if "[" not in part)
        raise InputError(f"{source}{field and '.'}{field}: {what}.") from None


def known_fields(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the structure of this kind knows of a description; more is allowed there."""
    kind = KINDS.get(str(content.get("kind")))
    names = () if kind is None else kind.model_fields
    return {name: content[name] for name in names if name in content}
