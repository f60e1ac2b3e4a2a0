"""Ripples over the motor angle that could explain what a fit leaves of records.

A ripple acts as a torque along the model's own motion. What it does to the position is predicted
linearly, by the response of plant and controller (or observer), G/(1 + G C_y); so hundreds of
numbers of ripples can be tried at once, and only the best are simulated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from fjr_sim_node import effects as fx
from fjr_sim_node.theory.linear import g0

from ..model.evidence import Evidence
from ..model.simulated_rig import Model
from .least_squares import Solution

MOST_TRIED = 240
_FREE_HZ = 1e-3  # below, a free body has no response


class RecordRipples:
    """What ripples could do about the errors that a fit leaves."""

    def __init__(
        self,
        evidence: Evidence,
        parts: Sequence[int],
        model: Model,
        weight: np.ndarray,
        parent: Solution,
    ) -> None:
        """Simulate the model's motion once.

        Args:
            evidence: the records.
            parts: that are fitted.
            model: the parent's model.
            weight: (errors,), one over the standard deviation of each error.
            parent: where the parent's fit ended.
        """
        self._evidence, self._parts, self._weight = evidence, tuple(parts), weight
        self._runs = sorted({evidence.parts[i].record for i in parts})
        moved = evidence.simulator.run([model], self._runs)[0]
        self._motion = [run[[0, 2]] for run in moved]
        self._responses = [self._response(model, i, run.shape[1]) for i, run in
                           zip(self._runs, moved, strict=True)]  # fmt: skip
        self._basis = np.linalg.qr(parent.jacobian)[0]
        self._left = self._beyond(parent.residuals)
        self._stiffness = model.plant.get("k0", 0.0)

    def cycles(self, effect: str, tried: np.ndarray, most: int) -> list[float]:
        """Return the numbers of cycles per turn that promise most, best first.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            tried: numbers to try, ascending; thinned out to `MOST_TRIED`.
            most: how many to return, each a maximum of its own.
        """
        if len(tried) > MOST_TRIED:
            tried = tried[np.unique(np.linspace(0, len(tried) - 1, MOST_TRIED).astype(int))]
        gains = np.array([self._gain(effect, float(cycles)) for cycles in tried])
        padded = np.concatenate([[-1.0], gains, [-1.0]])
        peaks = np.flatnonzero((gains >= padded[:-2]) & (gains > padded[2:]))
        return [float(tried[i]) for i in peaks[np.argsort(-gains[peaks])][:most]]

    def _gain(self, effect: str, cycles: float) -> float:
        """Return the fall of the cost by sine and cosine of a ripple of the best size."""
        columns = []
        for quarter in (0.0, 0.5 * np.pi):
            changes = {
                index: self._moved(k, self._torque(effect, k, cycles, quarter))
                for k, index in enumerate(self._runs)
            }
            column = self._evidence.changes(changes, self._parts) * self._weight
            columns.append(self._beyond(column))
        own = np.array(columns)
        sizes = np.linalg.lstsq(own.T, -self._left, rcond=1e-6)[0]
        return -float(sizes @ (own @ self._left))

    def _torque(self, effect: str, k: int, cycles: float, quarter: float) -> np.ndarray:
        """Return the torque on the motor that a ripple of size 1 makes along the motion, (N,)."""
        motor, _ = self._motion[k]
        wave = np.sin(cycles * motor + quarter)
        acts_on = fx.EFFECTS[effect].acts_on
        if acts_on == "motor":
            return -wave * np.sign(np.gradient(motor))
        if acts_on == "transmission":
            return -self._stiffness * wave
        return wave

    def _moved(self, k: int, torque: np.ndarray) -> np.ndarray:
        response = self._responses[k]
        size = 2 * (response.size - 1)
        return irfft(rfft(torque, size) * response, size)[: torque.size]

    def _response(self, model: Model, index: int, samples: int) -> np.ndarray:
        """Return position per torque on the motor at the lines of a padded record, complex."""
        size = next_fast_len(2 * samples, real=True)
        size += size % 2
        rate = self._evidence.records.sample_rate_hz
        frequency = np.maximum(rfftfreq(size, 1.0 / rate), _FREE_HZ)
        plant = {"j": 0.0, "fs": 0.0, "fv": 0.0, "k0": np.inf, **model.plant}
        plant_response = g0(plant, frequency, rate)
        holds = np.nan_to_num(self._evidence.simulator.response(frequency, index))
        return plant_response / (1.0 + plant_response * holds)

    def _beyond(self, errors: np.ndarray) -> np.ndarray:
        """Return what the parent's parameters can't follow of errors, (errors,)."""
        return errors - self._basis @ (self._basis.T @ errors)
