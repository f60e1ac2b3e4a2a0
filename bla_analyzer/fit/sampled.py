"""What a sampled loop measures of a continuous plant: held input, delay, and their aliases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Hold = Literal["zoh", "none"]
Domain = Literal["s", "z"]

ALIASES, ALIASES_OF_STEPS = 24, 128
"""Aliases on each side that are summed. What is left out of a plant that falls as 1/s^2 is below
2e-3 (f/fs)^3 of it; one that falls as 1/s only (its step response has a slope) needs more."""


@dataclass(frozen=True)
class Sampled:
    """How a model is seen at F frequencies: in x = s / scale, or x = (z - 1) fs / scale.

    The sampled response to a torque held over each sample is the sum over its aliases,
    G(f) = sum_m G_c(s_m) (1 - exp(-s_0 T)) / (s_m T) exp(-s_m delay), s_m = 2 pi j (f + m fs)
    (Astrom and Wittenmark, Computer-Controlled Systems, ch. 7), which holds for any delay.

    Attributes:
        domain: s or z.
        rate_hz: rate of the samples.
        scale: rad/s.
        s: complex (F, A), rad/s, the frequencies and their aliases; A = 1 without hold.
        held: complex (F, A), what the hold makes of each.
    """

    domain: Domain
    rate_hz: float
    scale: float
    s: np.ndarray
    held: np.ndarray

    @classmethod
    def of(
        cls,
        frequency_hz: np.ndarray,
        rate_hz: float,
        domain: Domain = "s",
        hold: Hold = "zoh",
        relative_degree: int = 2,
    ) -> Sampled:
        """Return how a model is seen.

        Args:
            frequency_hz: (F,).
            rate_hz: rate of the samples.
            domain: s or z; in z the model is that of the samples and nothing is held.
            hold: zoh, or none for an input that was measured as it is.
            relative_degree: of the model, 1 or more with a hold.
        """
        s0 = 2j * np.pi * frequency_hz[:, None]
        scale = 2.0 * np.pi * float(np.abs(frequency_hz).max())
        if domain == "z" or hold == "none":
            return cls(domain, rate_hz, scale, s0, np.ones_like(s0))
        count = ALIASES if relative_degree > 1 else ALIASES_OF_STEPS
        return cls._with_aliases(rate_hz, scale, s0, count)

    @classmethod
    def _with_aliases(cls, rate_hz: float, scale: float, s0: np.ndarray, count: int) -> Sampled:
        s = s0 + 2j * np.pi * rate_hz * np.arange(-count, count + 1)
        return cls("s", rate_hz, scale, s, (1.0 - np.exp(-s0 / rate_hz)) * rate_hz / s)

    def at(self, frequency_hz: np.ndarray) -> Sampled:
        """Return how the same model is seen at other frequencies, (F,)."""
        s0, count = 2j * np.pi * frequency_hz[:, None], self.s.shape[1] // 2
        if count:
            return self._with_aliases(self.rate_hz, self.scale, s0, count)
        return Sampled(self.domain, self.rate_hz, self.scale, s0, np.ones_like(s0))

    @property
    def x(self) -> np.ndarray:
        """The variable of the polynomials, complex (F, A)."""
        if self.domain == "s":
            return self.s / self.scale
        return (np.exp(self.s / self.rate_hz) - 1.0) * self.rate_hz / self.scale

    def delayed(self, delay_s: float) -> np.ndarray:
        """Return what hold and delay make of each frequency and alias, complex (F, A)."""
        return self.held * np.exp(-self.s * delay_s)

    def main(self, delay_s: float) -> np.ndarray:
        """Return the same of the frequencies themselves, complex (F,)."""
        return self.delayed(delay_s)[:, self.s.shape[1] // 2]

    @property
    def main_x(self) -> np.ndarray:
        """The variable at the frequencies themselves, complex (F,)."""
        return self.x[:, self.s.shape[1] // 2]

    def roots(self, x: np.ndarray) -> np.ndarray:
        """Return roots in x as those in s (rad/s) or z."""
        return x * self.scale if self.domain == "s" else 1.0 + x * self.root_slope

    @property
    def root_slope(self) -> float:
        """The derivative of s or z with respect to x."""
        return self.scale if self.domain == "s" else self.scale / self.rate_hz

    def laplace(self, roots: np.ndarray) -> np.ndarray:
        """Return roots as those in s, rad/s, complex; z = 0 is minus infinity."""
        if self.domain == "s":
            return roots
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.log(np.asarray(roots, complex)) * self.rate_hz
