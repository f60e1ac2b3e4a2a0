"""Any linear law of one or two degrees of freedom, discrete, with a clamped torque.

    u = sat(C_r(z) r - C_y(z) y),   C_r = b_r / a,   C_y = b_y / a

with b and a in powers z^0, z^-1, ... at the rate of the experiment, r and y in rad, u in N m. A
law from r - y to u has b_r = b_y; a feed-forward of r is in b_r. There is one denominator and one
state, so that an integrator integrates r - y and not each of both. The torque is clamped to its
limit, the state is not: there is no anti-windup.

A law may run several times in one sample of a record, as that of a drive whose log is slow. Then
its powers are those of its own steps. Signals are given at the samples; between them the reference
is held or joined by a straight line, and a recorded position goes on as a cubic spline. The torque
of a sample is the mean until the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from fjr_kit.compiled import inlined
from fjr_kit.errors import InputError

from .polynomials import Ratio, added, together

_OUTSIDE = 1.0 + 1e-6  # poles on the unit circle integrate, rounding included


@dataclass(frozen=True)
class TransferFunction:
    """A discrete control law.

    Attributes:
        reference: numerator of C_r, float64 (n + 1,).
        position: numerator of C_y, of the same length.
        denominator: 1, a1...an of both, of the same length.
        limit_nm: the torque is clamped to +- this.
        steps: how often the law runs in one sample of a record.
        joins: whether a straight line joins two samples of the reference; else each is held.
    """

    reference: np.ndarray
    position: np.ndarray
    denominator: np.ndarray
    limit_nm: float = math.inf
    steps: int = 1
    joins: bool = False

    @classmethod
    def of(
        cls, numerator: Sequence[float], denominator: Sequence[float], limit_nm: float = math.inf
    ) -> TransferFunction:
        """Return the law from r - y to u."""
        b = np.asarray(numerator, float)
        return cls._padded(b, b, np.asarray(denominator, float), limit_nm)

    @classmethod
    def of_two(
        cls, reference: Ratio, position: Ratio, limit_nm: float = math.inf
    ) -> TransferFunction:
        """Return the law of two transfer functions, numerator and denominator each."""
        return cls._padded(*together(reference, position), limit_nm)

    @classmethod
    def of_pd(cls, coefficients: np.ndarray) -> TransferFunction:
        """Return the default law, from `pd_filtered.coefficients`, as a transfer function."""
        p, dn, decay, limit = coefficients.tolist()
        return cls.of([p + dn, -p * decay - dn], [1.0, -decay], limit)

    @classmethod
    def _padded(
        cls, reference: np.ndarray, position: np.ndarray, denominator: np.ndarray, limit_nm: float
    ) -> TransferFunction:
        zero = np.zeros(max(reference.size, position.size, denominator.size))
        a0 = denominator[0]
        b_r, b_y, a = (added(part, zero) / a0 for part in (reference, position, denominator))
        return cls(b_r, b_y, a, limit_nm)

    @property
    def one_degree(self) -> bool:
        """Whether the law is one from r - y to u."""
        return np.array_equal(self.reference, self.position)

    @property
    def states(self) -> int:
        """Length of the state."""
        return self.denominator.size - 1

    @cached_property
    def slowest_pole(self) -> float:
        """Greatest magnitude of a pole: how slowly the state is forgotten; 1 never."""
        return float(np.abs(np.roots(self.denominator)).max(initial=0.0))

    @cached_property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """What `step` takes: C_y, acting on r - y, C_r - C_y, acting on r, denominator, limit.

        Split so, a law of one degree computes with r - y alone, to the last bit.
        """
        return self.position, self.reference - self.position, self.denominator, self.limit_nm

    def checked(self, source: str) -> TransferFunction:
        """Return this law; raise InputError that begins with `source` if it cannot be one."""
        if not self.limit_nm > 0.0:
            raise InputError(f"{source}.torque_limit_nm must be greater than zero or null.")
        polynomials = (self.reference, self.position, self.denominator)
        if not np.isfinite(np.concatenate(polynomials)).all():
            raise InputError(f"{source} has coefficients that are not finite; correct its numbers.")
        if self.slowest_pole > _OUTSIDE:
            raise InputError(
                f"{source} has a pole of magnitude {self.slowest_pole:.6g} outside the unit "
                "circle; correct its denominator (discrete: powers z^0, z^-1, ...)."
            )
        return self

    def response(
        self, frequency_hz: np.ndarray, sample_rate_hz: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return C_r and C_y, complex of the shape of `frequency_hz`, N m/rad."""
        own_rate_hz = self.steps * sample_rate_hz
        delay = np.exp(-2j * np.pi * np.asarray(frequency_hz, float) / own_rate_hz)
        parts = (self.reference, self.position, self.denominator)
        r, y, a = (np.polynomial.polynomial.polyval(delay, part) for part in parts)
        with np.errstate(divide="ignore", invalid="ignore"):  # an integrator at frequency zero
            return r / a, y / a

    def unlimited(
        self, reference: np.ndarray, position: np.ndarray, state: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the torque of recorded signals without the limit, float64 (samples,) in N m.

        Args:
            reference: r, (samples,) in rad.
            position: y, likewise.
            state: state before the first sample, (n,); None for zero.

        Raises:
            InputError: r and y differ in length.
        """
        return self._mean(self._at_steps(reference, position, state))

    def torque(
        self, reference: np.ndarray, position: np.ndarray, state: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the torque of recorded signals within the limit; arguments as of `unlimited`."""
        return self._mean(self.clamped(self._at_steps(reference, position, state)))

    def _at_steps(
        self, reference: np.ndarray, position: np.ndarray, state: np.ndarray | None
    ) -> np.ndarray:
        if reference.shape != position.shape:
            raise InputError(
                f"The reference has {reference.size} samples and the position {position.size}; "
                "a control law needs both of one length."
            )
        b, forward, a, _ = self.coefficients
        zi = np.zeros(self.states) if state is None else state
        reference, position = self.between(reference), self._going_on(position)
        torque = scipy.signal.lfilter(b, a, reference - position, zi=zi)[0]
        return torque + scipy.signal.lfilter(forward, a, reference) if forward.any() else torque

    def _mean(self, signal: np.ndarray) -> np.ndarray:
        """Return the mean of a signal over the steps of each sample, along the last axis."""
        if self.steps == 1:
            return signal
        return signal.reshape(*signal.shape[:-1], -1, self.steps).mean(axis=-1)

    def between(self, reference: np.ndarray) -> np.ndarray:
        """Return a sampled reference at each step of the law, (steps x samples,)."""
        if self.steps == 1:
            return reference
        if not self.joins:
            return np.repeat(reference, self.steps)
        at = np.arange(self.steps * reference.size) / self.steps
        return np.interp(at, np.arange(reference.size), reference)

    def _going_on(self, position: np.ndarray) -> np.ndarray:
        """Return a recorded position at each step of the law, (steps x samples,)."""
        if self.steps == 1:
            return position
        at = np.arange(self.steps * position.size) / self.steps
        samples = np.arange(position.size)
        return scipy.interpolate.CubicSpline(samples, position)(np.minimum(at, samples[-1]))

    def clamped(self, torque: np.ndarray) -> np.ndarray:
        """Return a torque within the limit."""
        return np.clip(torque, -self.limit_nm, self.limit_nm)

    def entering_state(
        self,
        reference: np.ndarray,
        position: np.ndarray,
        torque: np.ndarray,
        free: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the state before the first sample that explains a recorded torque best.

        Args:
            reference: r, (samples,) in rad.
            position: y, likewise, as the controller saw it.
            torque: u, likewise in N m.
            free: bool (samples,), where u is not clamped; None takes it from the limit.

        Returns:
            float64 (n,), by least squares; exact where the torque follows the law.
        """
        free = np.abs(torque) < self.limit_nm if free is None else free
        left = torque - self.unlimited(reference, position)
        columns = self.free_responses(torque.size)
        return np.linalg.lstsq(columns[free], left[free], rcond=None)[0]

    def free_responses(self, samples: int) -> np.ndarray:
        """Return the torque that follows from each element of the state alone, (samples, n)."""
        nothing, one = np.zeros(self.steps * samples), np.ones(1)
        filtered = scipy.signal.lfilter
        columns = [filtered(one, self.denominator, nothing, zi=x)[0] for x in np.eye(self.states)]
        return self._mean(np.reshape(columns, (self.states, nothing.size))).T


@inlined
def step(x, reference, position, numerator, forward, denominator, limit):
    """Advance the controller by one sample (transposed direct form II, two inputs).

    Args:
        x: state, float64 (n + 1,), updated in place; its last element stays zero.
        reference: r (rad).
        position: y (rad).
        numerator: with `forward`, `denominator` and `limit` the coefficients of a TransferFunction.
        forward: see there.
        denominator: see there.
        limit: torque limit (N m).

    Returns:
        torque u (N m).
    """
    error = reference - position
    torque = numerator[0] * error + forward[0] * reference + x[0]
    for i in range(1, x.size):
        entered = numerator[i] * error + forward[i] * reference
        x[i - 1] = entered - denominator[i] * torque + x[i]
    return min(max(torque, -limit), limit)
