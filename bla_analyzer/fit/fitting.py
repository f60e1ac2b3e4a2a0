"""From the BLA of each level to its parametric model."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from scipy.special import fdtrc

from fjr_kit.errors import InputError
from fjr_kit.telling import Progress

from ..results.result import BlaEstimate, LevelResult, Result
from ..results.summary import SIGNIFICANCE, level_name
from .described_model import Described, described
from .fit_types import Curve, Fit, LevelFit, ModelName, Output, OutputFit, Root
from .fit_words import between_levels, findings
from .likelihood import Task
from .order_search import Order, Tried, fit_order, search, tried
from .order_tests import whiteness
from .physical_fit import fit_physical
from .sampled import Domain, Hold, Sampled
from .samples import Samples, samples_of
from .uncertainty import Uncertainty

OUTPUTS: tuple[Output, ...] = ("motor_position", "link_position")
HIGHEST_ORDER = 20
CURVE_POINTS = 400


def fit_bla(
    result: Result,
    *,
    model: ModelName = "rational",
    order: Order | None = None,
    domain: Domain = "s",
    hold: Hold = "zoh",
    delay: float | Literal["free"] = 0.0,
    level: int | None = None,
    link: bool = True,
    progress: Progress | None = None,
) -> Fit:
    """Fit a parametric model to the BLA of each level by maximum likelihood.

    The cost is sum_k e_k^H C_k^-1 e_k over the reliable lines, e the distance of the BLA from the
    model and C its total covariance (ELiS; Pintelon and Schoukens, System Identification, 2nd ed.
    2012, ch. 9).

    Args:
        result: the analysis.
        model: rational, rigid, two-inertia or extra-mode.
        order: degrees of numerator and denominator of a rational model, nb and na; None searches.
        domain: s for a continuous model, z for a discrete one (rational models only).
        hold: zoh if the torque is held over each sample; none if the recorded torque is that of
            all times, as a measured current is. Continuous models only.
        delay: in s, or free to fit it.
        level: the only level to fit; None for all.
        link: whether to fit the link position together with the motor's, where it was recorded.
        progress: called with what is being fitted.

    Returns:
        The models, with poles, zeros and parameters in SI units.

    Raises:
        InputError: no such level, no BLA or variance, or options that do not fit together.
    """
    _check(model, order, domain, hold, delay)
    levels = _levels(result, level)
    tell = progress or (lambda _: None)
    fits = tuple(
        _fit_level(one, bla, result, model, order, domain, hold, delay, link, tell)
        for one, bla in levels
    )
    return Fit(
        source=result.source,
        model=model,
        domain=domain,
        hold="none" if domain == "z" else hold,
        sample_rate_hz=result.sample_rate_hz,
        levels=fits,
        between_levels=tuple(between_levels(fits)),
    )


def _check(
    model: ModelName,
    order: Order | None,
    domain: Domain,
    hold: Hold,
    delay: float | Literal["free"],
) -> None:
    for name, value, kind in (
        ("model", model, ModelName),
        ("domain", domain, Domain),
        ("hold", hold, Hold),
    ):
        if value not in get_args(kind):
            raise InputError(f"{name} must be one of {', '.join(get_args(kind))}, not {value!r}.")
    if model != "rational" and (order is not None or domain == "z"):
        raise InputError(
            f"model {model} is continuous and its order is known; leave order and domain out."
        )
    if delay != "free" and not np.isfinite(delay):
        raise InputError(f"delay must be free or a number of seconds, not {delay}.")
    if order is None:
        return
    nb, na = order
    strict = domain == "s" and hold == "zoh"
    if not (0 <= nb <= na - strict and 1 <= na <= HIGHEST_ORDER):
        raise InputError(
            f"order {nb}/{na} is not possible: nb must be {'below' if strict else 'at most'} na"
            f"{' where the torque is held' if strict else ''}, and na 1 to {HIGHEST_ORDER}."
        )


def _levels(result: Result, level: int | None) -> list[tuple[LevelResult, BlaEstimate]]:
    known = [(one, one.bla) for one in result.levels if one.bla is not None]
    chosen = [(one, bla) for one, bla in known if level in (None, one.level)]
    if not chosen:
        there = ", ".join(str(one.level) for one, _ in known) or "none"
        what = "No level" if level is None else f"Level {level}"
        have = "has a BLA" if level is None else f"has no BLA; those that have one: {there}"
        raise InputError(f"{result.source}: {what} {have}.")
    return chosen


def _fit_level(
    level: LevelResult,
    bla: BlaEstimate,
    result: Result,
    model: ModelName,
    order: Order | None,
    domain: Domain,
    hold: Hold,
    delay: float | Literal["free"],
    link: bool,
    tell: Progress,
) -> LevelFit:
    name = level_name(level)
    samples = samples_of(bla, level.odd.frequency_hz.size, f"{result.source}: {name}", link=link)
    rate, free = result.sample_rate_hz, delay == "free"
    start = 0.0 if delay == "free" else float(delay)
    tell(name)
    if model != "rational":
        seen = Sampled.of(samples.frequency_hz, rate, "s", hold)
        all_tried = [tried(model, samples, fit_physical(Task(samples, seen, start, free), model))]
    elif order is not None:
        all_tried = [fit_order(samples, rate, order, domain, hold, start, free)]
    else:
        all_tried = search(
            samples, rate, domain, hold, start, free, lambda what: tell(f"{name}, {what}")
        )
    shared = bla.method == "local" and result.excitation == "periodic"
    return _level_fit(level, bla, samples, all_tried, name, shared)


def _level_fit(
    level: LevelResult,
    bla: BlaEstimate,
    samples: Samples,
    all_tried: list[Tried],
    name: str,
    shared: bool,
) -> LevelFit:
    chosen = all_tried[0]
    g, jacobian = chosen.model.response()
    test = chosen.test
    widening = 1.0 if test.passed else float(np.sqrt(test.cost / test.expected))
    uncertainty = Uncertainty.of(samples, jacobian, widening)
    found = described(chosen.model, uncertainty)
    low, high = samples.frequency_hz[0], samples.frequency_hz[-1]
    between = np.geomspace(low, high, CURVE_POINTS)
    seen = replace(chosen.model, sampled=chosen.model.sampled.at(between)).response()[0]
    curves = [Curve(frequency_hz=between, g=seen[:, o]) for o in range(samples.outputs)]
    outputs = tuple(_output(o, bla, samples, g, found, curve) for o, curve in enumerate(curves))
    fit = LevelFit(
        level=level.level,
        name=name,
        test=test,
        orders=tuple(sorted((one.test for one in all_tried), key=lambda t: t.parameters)),
        widening=widening,
        parameters=found.parameters,
        delay_s=found.delay_s,
        denominator=found.denominator,
        poles=found.poles,
        outputs=outputs,
        whiteness=whiteness(samples, g),
        left_out_hz=samples.left_out_hz,
        noise_only=samples.of_noise_only,
        findings=(),
    )
    return fit.model_copy(update={"findings": tuple(findings(fit, shared))})


def _output(
    o: int, bla: BlaEstimate, samples: Samples, model: np.ndarray, found: Described, curve: Curve
) -> OutputFit:
    kept = np.isin(bla.frequency_hz, samples.frequency_hz)
    variance = samples.covariance[:, o, o].real
    distance = np.abs(samples.g[:, o] - model[:, o]) ** 2
    own = bla.link if o else bla
    assert own is not None
    share = own.var_nonlinear[kept] / bla.realizations
    with np.errstate(invalid="ignore"):
        nonlinear = (own.nonlinear_p_value[kept] < SIGNIFICANCE) & (share > own.var_noise[kept])
    n = samples.line_degrees
    zeros: tuple[Root, ...] = found.zeros[o]
    return OutputFit(
        output=OUTPUTS[o],
        gain=found.gains[o],
        zeros=zeros,
        numerator=found.numerators[o],
        frequency_hz=samples.frequency_hz,
        g=samples.g[:, o],
        model=model[:, o],
        radius_95=np.sqrt(variance * n * (20.0 ** (1.0 / n) - 1.0)),
        p_value=fdtrc(2, 2 * n, distance / variance),
        nonlinear_dominates=nonlinear,
        curve=curve,
    )
