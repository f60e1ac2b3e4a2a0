"""Physical models of a joint: rigid, two-inertia and with an extra mode, as polynomials in s.

    Jm th'' + fvm th' + k0 (th - q) = u
    J  q''  + fv  q'  + k0 (q - th) = 0       two-inertia: both angles
    and on the link a third mass behind a spring and a damper of its own: extra mode

Both outputs, motor angle th and link angle q, follow from the same parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

Physical = Literal["rigid", "two-inertia", "extra-mode"]
Polynomials = tuple[tuple[np.ndarray, np.ndarray], np.ndarray]
"""Numerators of motor and link, and the denominator: coefficients, highest power first."""

UNITS = {
    "jm": "kg m2",
    "j": "kg m2",
    "k0": "N m/rad",
    "fvm": "N m s/rad",
    "fv": "N m s/rad",
    "extra_mode.inertia_kg_m2": "kg m2",
    "extra_mode.frequency_hz": "Hz",
    "extra_mode.damping_ratio": "",
    "delay_s": "s",
}
"""Every parameter by the simulator's name, with its unit."""
MEANINGS = {
    "jm": "motor inertia",
    "j": "link inertia",
    "k0": "stiffness",
    "fvm": "motor damping",
    "fv": "link damping",
    "extra_mode.inertia_kg_m2": "third mass",
    "extra_mode.frequency_hz": "its frequency",
    "extra_mode.damping_ratio": "its damping ratio",
}
"""What a reader takes the parameters for, the delay left out."""
NAMES: dict[Physical, tuple[str, ...]] = {
    "rigid": ("jm", "fvm"),
    "two-inertia": ("jm", "j", "k0", "fvm", "fv"),
    "extra-mode": (
        *("jm", "j", "k0", "fvm", "fv", "extra_mode.inertia_kg_m2"),
        *("extra_mode.frequency_hz", "extra_mode.damping_ratio"),
    ),
}
POSITIVE = {"jm", "j", "k0", "extra_mode.inertia_kg_m2", "extra_mode.frequency_hz"}
"""Fitted as logarithms; damping and delay are not, so that their interval may hold zero."""


def polynomials(model: Physical, p: Mapping[str, float]) -> Polynomials:
    """Return the transfer functions from torque to motor and link angle, rad/(N m)."""
    motor = np.array([p["jm"], p["fvm"], 0.0])
    if model == "rigid":
        return (np.ones(1), np.ones(1)), motor
    link, k = np.array([p["j"], p["fv"], 0.0]), p["k0"]
    apart = np.ones(1)
    if model == "extra-mode":
        mass, w = p["extra_mode.inertia_kg_m2"], 2.0 * np.pi * p["extra_mode.frequency_hz"]
        loss = 2.0 * p["extra_mode.damping_ratio"] * w
        apart = np.array([1.0, loss, w * w])
        link = _sum(np.convolve(link, apart), mass * np.array([loss, w * w, 0.0, 0.0]))
    held = _sum(link, k * apart)  # the link against a motor that stands still
    lower = _sum(np.convolve(motor, held), k * link)
    return (held, k * apart), lower


def _sum(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Return the sum of two polynomials, the first of which may be of lower degree."""
    total = np.zeros(max(one.size, two.size))
    total[total.size - one.size :] = one
    total[total.size - two.size :] += two
    return total


@dataclass(frozen=True)
class Scaled:
    """Parameters as a fit moves them: each of the size of one, logarithms where positive.

    Attributes:
        names: of the parameters; `delay_s` comes last if it is free.
        scales: (p,), what one unit of a parameter that is no logarithm is.
    """

    names: tuple[str, ...]
    scales: np.ndarray

    @classmethod
    def of(
        cls, model: Physical, start: Mapping[str, float], w: float, rate_hz: float, free_delay: bool
    ) -> Scaled:
        """Return the scales.

        Args:
            model: which model.
            start: parameters to begin with.
            w: a frequency of the band, rad/s.
            rate_hz: rate of the samples.
            free_delay: whether the delay is fitted.
        """
        names = (*NAMES[model], *(["delay_s"] if free_delay else []))
        inertia = start["jm"] + start.get("j", 0.0)
        by_name = {"fvm": 0.1 * inertia * w, "fv": 0.1 * inertia * w}
        by_name |= {"delay_s": 1.0 / rate_hz, "extra_mode.damping_ratio": 0.1}
        return cls(names, np.array([by_name.get(name, 1.0) for name in names]))

    def values(self, parameters: Mapping[str, float]) -> np.ndarray:
        """Return the moved values of parameters, (p,)."""
        return np.array(
            [
                np.log(parameters[name]) if name in POSITIVE else parameters[name] / scale
                for name, scale in zip(self.names, self.scales, strict=True)
            ]
        )

    def parameters(self, values: np.ndarray, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the parameters of moved values, with those that are fixed."""
        moved = {
            name: float(np.exp(np.clip(v, -50, 50))) if name in POSITIVE else float(v * scale)
            for name, scale, v in zip(self.names, self.scales, values.tolist(), strict=True)
        }
        return {**fixed, **moved}


def starts(
    model: Physical, frequency_hz: np.ndarray, g: np.ndarray, found: Mapping[str, float] | None
) -> list[dict[str, float]]:
    """Return parameters to begin with, the nearest to the BLA first.

    Args:
        model: which model.
        frequency_hz: (F,).
        g: complex (F, O), without hold and delay.
        found: parameters of the two-inertia model, to which the extra mode is added.
    """
    tried = []
    for candidate in _candidates(model, frequency_hz, found):
        upper, lower = polynomials(model, candidate)
        s = 2j * np.pi * frequency_hz
        shape = np.stack([np.polyval(each, s) for each in upper[: g.shape[1]]], axis=1)
        ratio = shape / np.polyval(lower, s)[:, None] / g
        size = float(ratio.real.sum() / (np.abs(ratio) ** 2).sum())
        if found is None and size > 0:  # all inertias, dampings and the stiffness alike
            extensive = {name: v / size for name, v in candidate.items() if "." not in name}
            tried.append((float((np.abs(size * ratio - 1.0) ** 2).mean()), extensive))
        elif found is not None:
            tried.append((float((np.abs(ratio - 1.0) ** 2).mean()), candidate))
    return [parameters for _, parameters in sorted(tried, key=lambda pair: pair[0])]


def _candidates(
    model: Physical, frequency_hz: np.ndarray, found: Mapping[str, float] | None
) -> list[dict[str, float]]:
    low, high = float(frequency_hz[0]), float(frequency_hz[-1])
    w = 2.0 * np.pi * np.sqrt(low * high)
    losses = (0.01, 0.1, 0.5, 2.0)
    if model == "rigid":
        return [{"jm": 1.0, "fvm": loss * w} for loss in (0.0, *losses)]
    if found is not None:
        return [
            {
                **found,
                "j": found["j"] * (1.0 - share),
                "extra_mode.inertia_kg_m2": found["j"] * share,
                "extra_mode.frequency_hz": f,
                "extra_mode.damping_ratio": loss,
            }
            for f in np.geomspace(0.7 * low, 1.5 * high, 40).tolist()
            for share in (0.02, 0.1, 0.3)
            for loss in (0.02, 0.1)
        ]
    made = []
    for anti in np.geomspace(max(low, 0.05 * high), 1.5 * high, 30).tolist():
        for ratio in (1.1, 1.3, 1.7, 2.5, 4.0):
            j, jm, at = 1.0 - ratio**-2, ratio**-2, 2.0 * np.pi * anti
            for loss in (0.03, 0.3):
                k = j * at**2
                made.append({"jm": jm, "j": j, "k0": k, "fvm": loss * jm * at, "fv": loss * j * at})
    return made
