"""The types of fit.json: a parametric model of each level's BLA, with its uncertainty and tests."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from fjr_kit.result_types import Array, Document, EqualArrays, Number, ResultModel, Unit

ModelName = Literal["rational", "rigid", "two-inertia", "extra-mode"]
Output = Literal["motor_position", "link_position"]


class Interval(ResultModel):
    """A quantity with its 95 % interval.

    Attributes:
        value: the estimate.
        std: its standard deviation.
        low, high: the interval.
        unit: of all four.
    """

    value: Number
    std: Number
    low: Number
    high: Number
    unit: str

    def holds(self, value: float) -> bool:
        """Tell whether a value lies in the interval."""
        return self.low <= value <= self.high


class Root(ResultModel):
    """A pole or zero in s (rad/s) or z, with its 95 % ellipse.

    Attributes:
        re, im: of the root.
        std_re, std_im: standard deviations.
        ellipse_major, ellipse_minor: half axes of the 95 % ellipse; a real root has no minor one.
        ellipse_angle_deg: angle of the major axis from the real axis.
        unit: of the six above, but the angle: rad/s, or 1 in z.
        frequency_hz: natural frequency |s|/(2 pi).
        damping_ratio: -Re s/|s|, 1 of a stable real root; negative if it is not stable.
    """

    re: Number
    im: Number
    std_re: Number
    std_im: Number
    ellipse_major: Number
    ellipse_minor: Number
    ellipse_angle_deg: Annotated[Number, Unit("deg")]
    unit: str
    frequency_hz: Interval
    damping_ratio: Interval


class Curve(EqualArrays):
    """The model between the lines: complex g, (C,), at frequency_hz."""

    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    g: Annotated[np.ndarray, Array("rad/(N m)", complex)]


class OutputFit(EqualArrays):
    """What belongs to one output.

    Attributes:
        output: motor_position or link_position.
        gain: ratio of the leading coefficients of numerator and denominator.
        zeros: of the numerator.
        numerator: coefficients, highest power first.
        frequency_hz: (F,), lines that were used.
        g, model: complex (F,), the BLA there and the model, hold and delay in it.
        radius_95: (F,), radius of the 95 % disc of g.
        p_value: (F,), of the distance of g from the model under the disc's distribution.
        nonlinear_dominates: (F,), whether nonlinear distortion is significant and outweighs noise.
        curve: the model between the lines.
    """

    output: Output
    gain: Interval
    zeros: tuple[Root, ...]
    numerator: tuple[Number, ...]
    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    g: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    model: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    radius_95: Annotated[np.ndarray, Array("rad/(N m)")]
    p_value: Annotated[np.ndarray, Array("1")]
    nonlinear_dominates: Annotated[np.ndarray, Array("bool", bool)]
    curve: Curve


class OrderTest(ResultModel):
    """How well a model of one order explains the BLA.

    Attributes:
        name: such as 2/4, degrees of numerator and denominator, or the name of a physical model.
        parameters: how many were fitted.
        cost: sum over lines of e^H C^-1 e, e the residual.
        expected: what variances alone make of the cost.
        low, high: 95 % interval of the cost if the model is true.
        aic, mdl: criteria of Akaike and of minimum description length; the least is best.
    """

    name: str
    parameters: int
    cost: Number
    expected: Number
    low: Number
    high: Number
    aic: Number
    mdl: Number

    @property
    def passed(self) -> bool:
        """Whether the cost is no greater than variances explain."""
        return self.cost <= self.high


class Whiteness(ResultModel):
    """Autocorrelation of the normalised residual over lines.

    Attributes:
        correlation: complex (L,), at lags of 1 to L lines.
        bound: 95 % bound of its magnitude if the residual is white.
        outside: how many lags lie beyond.
        p_value: of all lags together, under a white residual.
    """

    correlation: Annotated[np.ndarray, Array("1", complex)]
    bound: Annotated[Number, Unit("1")]
    outside: Annotated[int, Unit("1")]
    p_value: Annotated[Number, Unit("1")]


class LevelFit(ResultModel):
    """The model of one level.

    Attributes:
        level: index of the level.
        name: of the level, in words.
        test: cost of this model.
        orders: the same of all orders that were tried, in the order of their parameters.
        widening: of all intervals, where the model does not explain the BLA; else 1.
        parameters: of a physical model by the simulator's names; else empty.
        delay_s: the delay; of no width if it was fixed.
        denominator: coefficients, highest power first.
        poles: its roots.
        outputs: motor position, then link position if there is one.
        whiteness: of the residual.
        left_out_hz: (L,), unreliable lines, which were not used.
        noise_only: whether intervals are those of noise alone, as distortion is not known.
        findings: what a reader must see.
    """

    level: Annotated[int, Unit("1")]
    name: str
    test: OrderTest
    orders: tuple[OrderTest, ...]
    widening: Annotated[Number, Unit("1")]
    parameters: dict[str, Interval]
    delay_s: Interval
    denominator: tuple[Number, ...]
    poles: tuple[Root, ...]
    outputs: tuple[OutputFit, ...]
    whiteness: Whiteness
    left_out_hz: Annotated[np.ndarray, Array("Hz")]
    noise_only: bool
    findings: tuple[str, ...]


class Fit(Document):
    """Parametric models of the BLAs of an experiment.

    Attributes:
        source: what was fitted, as the user gave it.
        model: rational, rigid, two-inertia or extra-mode.
        domain: s (continuous) or z (discrete).
        hold: zoh if the torque was held over each sample, as the model counts; none if not.
        sample_rate_hz: rate of the samples.
        levels: one entry each level that has a BLA.
        between_levels: what the levels say together.
    """

    schema_name: Literal["fjr_rig/fit/1"] = Field("fjr_rig/fit/1", alias="schema")
    source: str
    model: ModelName
    domain: Literal["s", "z"]
    hold: Literal["zoh", "none"]
    sample_rate_hz: Annotated[Number, Unit("Hz")]
    levels: tuple[LevelFit, ...]
    between_levels: tuple[str, ...] = ()
