"""Ripples over the motor angle that could explain a model's remainder: hundreds tried at once.

A ripple acts as a torque on the motor. What it does to the position is predicted linearly: the
torque along the model's own motion, times the response of the closed loop to a torque,
Y/(R C) = G/(1 + G C), which the model's simulation gives at the excited lines. Only the best go on
to be simulated, so that this may be rough.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from controller_node.law import as_transfer_function, law_of
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum
from fjr_sim_node import effects as fx

from ..model.misfit import Misfit
from ..model.rig_model import Model
from ..model.simulated_rig import Simulator
from .least_squares import Solution


@dataclass(frozen=True)
class _Motion:
    """One period of a model's motion, (realizations, N) each, and the loop's response to torque.

    Attributes:
        motor: rad.
        velocity, torque, transmitted: rad/s, N m, N m, in single precision.
        response: complex (realizations, lines), position per torque on the motor, rad/(N m).
        both: the same of a torque between link and motor.
    """

    motor: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray
    transmitted: np.ndarray
    response: np.ndarray
    both: np.ndarray


class RippleSearch:
    """What ripples of one effect could do about the errors that a fit leaves."""

    def __init__(
        self,
        effect: str,
        recorded: RecordedExperiment,
        simulator: Simulator,
        misfit: Misfit,
        model: Model,
        parent: Solution,
        tried: np.ndarray,
    ) -> None:
        """Simulate the model's motion once.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            recorded: the experiment; its loop can be repeated.
            simulator: repeats it.
            misfit: of the realizations that count.
            model: the parent's model.
            parent: where the parent's fit ended.
            tried: numbers of ripples per turn to look at, float64 (n,), ascending; between them
                the response hardly changes.
        """
        self._effect, self._misfit, self._plant = effect, misfit, model.plant
        self._tried = tried
        self._motion = _motion(recorded, simulator, misfit, model)
        self._basis = np.linalg.qr(parent.jacobian)[0]
        self._left = self._beyond(parent.residuals)

    def cycles(self, most: int) -> list[float]:
        """Return the numbers of cycles per turn that promise most, best first.

        Args:
            most: how many to return, each a maximum of its own.
        """
        gains = np.array([self._best_sizes((cycles,))[1] for cycles in self._tried.tolist()])
        return [float(self._tried[i]) for i in _peaks(gains)[:most]]

    def harmonics(self, most: int) -> list[tuple[float, float, float, float, float]]:
        """Return the ripples with a second harmonic that promise most, best first.

        Returns:
            (size, cycles per turn, phase (rad), second harmonic over the first, its phase (rad)),
            at the most `most`.
        """
        tried = [self._best_sizes((cycles, 2.0 * cycles)) for cycles in self._tried.tolist()]
        found = []
        for i in _peaks(np.array([gain for _, gain in tried]))[:most]:
            weights = tried[i][0]
            first, second = complex(*weights[:2]), complex(*weights[2:])
            phase, size = cmath.phase(first), max(abs(first), 0.1 * abs(second))
            bend = math.remainder(cmath.phase(second) - 2.0 * phase, 2.0 * math.pi)
            found.append((size, float(self._tried[i]), phase, abs(second) / size, bend))
        return found

    def _best_sizes(self, cycles: Sequence[float]) -> tuple[np.ndarray, float]:
        """Return sizes of sine and cosine of each number of cycles, and the chi-square's fall."""
        changes = [_of_ripple(self._effect, n, self._motion, self._plant) for n in cycles]
        own = self._beyond(self._misfit.errors_of(np.concatenate(changes)))
        weights = np.linalg.lstsq(own.T, -self._left, rcond=1e-6)[0]
        return weights, -float(weights @ (own @ self._left))

    def _beyond(self, errors: np.ndarray) -> np.ndarray:
        """Return what the parent's parameters can't follow of error vectors (..., errors)."""
        return errors - (errors @ self._basis) @ self._basis.T


def _peaks(gains: np.ndarray) -> np.ndarray:
    """Return the indices of the maxima, greatest first."""
    padded = np.concatenate([[-1.0], gains, [-1.0]])
    peaks = np.flatnonzero((gains >= padded[:-2]) & (gains > padded[2:]))
    return peaks[np.argsort(-gains[peaks])]


def _motion(
    recorded: RecordedExperiment, simulator: Simulator, misfit: Misfit, model: Model
) -> _Motion:
    description = recorded.experiment
    y, u, q = simulator.motion(model, misfit.which)
    lines = np.arange(recorded.lines)
    excited = np.array(description.excited_harmonics)
    rate = description.sample_rate_hz
    law = as_transfer_function(law_of(description.controller, rate))
    forward, _ = law.response(lines * description.base_frequency_hz, rate)
    r = [recorded.realizations[i].played[-1] for i in misfit.which]
    loop = line_spectrum(y, lines.size) / (line_spectrum(np.array(r), lines.size) + 1e-300)
    response = np.array([_between(lines, excited, row[excited]) for row in loop]) / forward
    p, twist = model.plant, q - y
    return _Motion(
        motor=y,
        velocity=(np.gradient(y, axis=1) * description.sample_rate_hz).astype(np.float32),
        torque=u.astype(np.float32),
        transmitted=(p.get("k0", 0.0) * twist).astype(np.float32),
        response=response,
        both=response * of_pair(p, lines * description.base_frequency_hz),
    )


def waves(cycles: float, angle: np.ndarray) -> np.ndarray:
    """Return sine and cosine of some cycles a turn along an angle (rad), float32 (2, ...).

    They are off by 6e-8 times the phase: by half a percent at a thousand turns of a ripple.
    """
    turned = (cycles * angle).astype(np.float32)
    return np.array([np.sin(turned), np.cos(turned)])


def of_pair(p: Mapping[str, float], frequency_hz: np.ndarray) -> np.ndarray:
    """Return the motor torque that acts as 1 N m on the motor against the link does, complex.

    Args:
        p: the plant's parameters by name; without k0 the transmission is rigid, without j the link
            is held.
        frequency_hz: float64 (n,).
    """
    if "k0" not in p or "j" not in p:
        return np.ones(frequency_hz.size)
    s = 2j * np.pi * frequency_hz
    free = p["j"] * s**2 + p["fv"] * s
    return free / (free + p["k0"])


def _between(lines: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate a response in magnitude and phase."""
    size = np.interp(lines, known, np.log(np.abs(values)))
    return np.exp(size + 1j * np.interp(lines, known, np.unwrap(np.angle(values))))


def _of_ripple(
    effect: str, cycles: float, motion: _Motion, plant: Mapping[str, float]
) -> np.ndarray:
    """Return the changes by the sine and the cosine of a ripple of size 1."""
    turns = waves(cycles, motion.motor)
    lines = motion.response.shape[-1]
    acts_on = fx.EFFECTS[effect].acts_on
    if acts_on == "motor":
        changes = line_spectrum(-turns * np.sign(motion.velocity), lines) * motion.response
    elif acts_on == "drive":
        if not fx.EFFECTS[effect].full_parameters[0].unit:  # a share of the torque, not a torque
            turns = turns * motion.torque
        changes = line_spectrum(turns, lines) * motion.response
    else:
        slopes = np.float32(cycles) * np.array([turns[1], -turns[0]])
        changes = line_spectrum(turns, lines) * plant["k0"] * motion.both
        changes -= line_spectrum(slopes * motion.transmitted, lines) * motion.response
    return changes
