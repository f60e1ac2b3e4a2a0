"""Poles, zeros, gains and coefficients of a fitted model, with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fit_types import Interval, Root
from .physical import POSITIVE, UNITS, polynomials
from .physical_fit import STEP, PhysicalModel
from .rational import RationalModel
from .sampled import Sampled
from .uncertainty import Uncertainty

Fitted = RationalModel | PhysicalModel


@dataclass(frozen=True)
class Described:
    """A model in words of poles and zeros.

    Attributes:
        poles: of all outputs.
        denominator: coefficients, highest power first, monic.
        zeros, gains, numerators: of each output.
        parameters: of a physical model.
        delay_s: the delay.
    """

    poles: tuple[Root, ...]
    denominator: tuple[float, ...]
    zeros: tuple[tuple[Root, ...], ...]
    gains: tuple[Interval, ...]
    numerators: tuple[tuple[float, ...], ...]
    parameters: dict[str, Interval]
    delay_s: Interval


def described(model: Fitted, uncertainty: Uncertainty) -> Described:
    """Return a model's poles, zeros and gains with their uncertainty."""
    if isinstance(model, RationalModel):
        return _rational(model, uncertainty)
    return _physical(model, uncertainty)


def _roots(
    roots: np.ndarray, slopes: np.ndarray, seen: Sampled, uncertainty: Uncertainty
) -> tuple[Root, ...]:
    """Return roots in s or z, (n,), with their gradients, (n, p), in order of frequency."""
    in_s = seen.laplace(roots)
    by_root = np.ones(roots.size) if seen.domain == "s" else seen.rate_hz / roots
    unit = "rad/s" if seen.domain == "s" else "1"
    order = np.lexsort((-roots.imag, np.abs(in_s)))
    return tuple(
        uncertainty.root(roots[i], slopes[i], in_s[i], by_root[i] * slopes[i], unit) for i in order
    )


def _rational(model: RationalModel, uncertainty: Uncertainty) -> Described:
    seen, size = model.sampled, model.b.size
    free = slice(size, size + model.along.shape[1])
    terms = model.b.shape[1]
    poles, pole_slopes = _basis_roots(model.lower, model.a, model.along, uncertainty, free)
    shape = seen.root_slope ** (model.a.size - terms)  # B/A in s or z is that in x times this
    leading = model.lower.leading()[-1]
    zeros, gains, numerators = [], [], []
    for o, basis in enumerate(model.upper):
        own = slice(o * terms, (o + 1) * terms)
        found, slopes = _basis_roots(basis, model.b[o], np.eye(terms), uncertainty, own)
        at = seen.roots(found)
        zeros.append(_roots(at, slopes * seen.root_slope, seen, uncertainty))
        gain = model.b[o, -1] * basis.leading()[-1] / (model.a[-1] * leading) * shape
        gradient = np.zeros(uncertainty.bread.shape[0])
        gradient[own.stop - 1] = 1.0 / model.b[o, -1]
        gradient[free] = -model.along[-1] / model.a[-1]
        unit = _gain_unit(seen.domain, model.a.size - terms)
        gains.append(uncertainty.interval(gain, gain * gradient, unit))
        numerators.append(tuple((gain * np.poly(at).real).tolist()))
    at = seen.roots(poles)
    return Described(
        _roots(at, pole_slopes * seen.root_slope, seen, uncertainty),
        tuple(np.poly(at).real.tolist()),
        tuple(zeros),
        tuple(gains),
        tuple(numerators),
        {},
        _delay(model.delay_s, model.free_delay, 1.0, uncertainty),
    )


def _basis_roots(basis, coefficients, along, uncertainty: Uncertainty, free: slice):
    """Return roots in x, complex (n,), and their gradients by all free parameters, (n, p)."""
    roots = basis.roots(coefficients)
    values, slopes = basis.with_slope(roots)
    gradients = np.zeros((roots.size, uncertainty.bread.shape[0]), complex)
    with np.errstate(divide="ignore", invalid="ignore"):
        gradients[:, free] = -(values @ along) / (slopes @ coefficients)[:, None]
    return roots, np.nan_to_num(gradients, nan=0.0)


def _gain_unit(domain: str, relative_degree: int) -> str:
    if domain == "z" or relative_degree < 1:
        return "rad/(N m)"
    power = "" if relative_degree == 1 else str(relative_degree)
    return f"rad/(N m s{power})"


def _delay(value: float, free: bool, scale: float, uncertainty: Uncertainty) -> Interval:
    if not free:
        return Interval(value=value, std=0.0, low=value, high=value, unit="s")
    gradient = np.zeros(uncertainty.bread.shape[0])
    gradient[-1] = scale
    return uncertainty.interval(value, gradient, "s")


def _physical(model: PhysicalModel, uncertainty: Uncertainty) -> Described:
    scaled, count = model.scaled, model.values.size
    upper, lower = polynomials(model.kind, model.parameters)
    steps = STEP * np.eye(count)
    both = [
        [
            polynomials(model.kind, scaled.parameters(model.values + sign * step, model.fixed))
            for step in steps
        ]
        for sign in (1, -1)
    ]
    parameters = {}
    for i, (name, scale) in enumerate(zip(scaled.names, scaled.scales, strict=True)):
        value, unit_step = model.parameters[name], np.eye(count)[i]
        if name == "delay_s":
            continue
        make = uncertainty.log_interval if name in POSITIVE else uncertainty.interval
        gradient = unit_step if name in POSITIVE else unit_step * scale
        parameters[name] = make(value, gradient, UNITS[name])

    def found(polynomial: np.ndarray, pick) -> tuple[Root, ...]:
        """Return the roots of one polynomial; `pick` takes it out of `polynomials`."""
        slope = np.stack(
            [(pick(a) - pick(b)) / (2.0 * STEP) for a, b in zip(*both, strict=True)], axis=1
        )
        roots = np.roots(polynomial)
        powers = roots[:, None] ** np.arange(polynomial.size - 1, -1, -1)
        bend = np.polyval(np.polyder(polynomial), roots)
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = np.nan_to_num(-(powers @ slope) / bend[:, None], nan=0.0, posinf=0, neginf=0)
        return _roots(roots, slopes, model.sampled, uncertainty)

    def gain_of(o: int) -> Interval:
        ratio = [[np.log(p[0][o][0] / p[1][0]) for p in each] for each in both]
        slope = (np.array(ratio[0]) - np.array(ratio[1])) / (2.0 * STEP)
        value = float(upper[o][0] / lower[0])
        unit = _gain_unit("s", lower.size - upper[o].size)
        return uncertainty.interval(value, value * slope, unit)

    outputs = range(model.outputs)
    return Described(
        found(lower, lambda p: p[1]),
        tuple((lower / lower[0]).tolist()),
        tuple(found(upper[o], lambda p, o=o: p[0][o]) for o in outputs),
        tuple(gain_of(o) for o in outputs),
        tuple(tuple((upper[o] / lower[0]).tolist()) for o in outputs),
        parameters,
        _delay(model.delay_s, "delay_s" in scaled.names, float(scaled.scales[-1]), uncertainty),
    )
