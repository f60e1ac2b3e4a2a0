"""The simulated drive in lockstep: a sample waits for the torque of the one before."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from typing import Any

from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError

from .. import effects, plant
from ..simulation import rig
from ..simulation.simulator import encoder_noise


class LockstepDrive:
    """One realization of the simulated drive, sample by sample.

    Attributes:
        stamp: stamp (ns) of the sample that waits for its torque; 0 if none does.
        samples: samples that are over.
        total: samples of the realization.
    """

    def __init__(self, values: Mapping[str, Any], experiment: Experiment) -> None:
        """Switch the drive on: plant at rest, noise seeded.

        Args:
            values: checked SIMULATOR values.
            experiment: what is played.
        """
        self._stamps = array("q", experiment.stamps_ns.tobytes())
        self._noise = array("d", encoder_noise(values, experiment).tobytes())
        self._period_s = 1.0 / experiment.sample_rate_hz
        self._plant = plant.coefficients(values)
        self._link_side = rig.MOTOR if plant.moves_as_one(values) else rig.LINK
        self._effects = effects.coefficients(values)
        self._state = rig.at_rest(experiment.elapsed_s)
        rig.hold(rig.at_rest(), 0.0, self._period_s, self._plant, self._effects)  # compiles it
        self._stuck_motor = self._stuck_link = 0
        self.stamp = self.samples = 0
        self.total = len(self._stamps)

    @property
    def next_stamp(self) -> int:
        """Stamp of the next sample (ns)."""
        return self._stamps[self.samples]

    @property
    def over(self) -> bool:
        """Whether all samples are over."""
        return self.samples == self.total

    @property
    def link(self) -> float:
        """Link position (rad)."""
        return self._state[self._link_side]

    def measure(self) -> float:
        """Return the motor position of the next sample (rad), which then waits for its torque."""
        self.stamp = self._stamps[self.samples]
        return rig.measure(self._state, self._noise[self.samples], self._effects)

    def hold(self, torque: float) -> None:
        """Hold a torque (N m) to the end of the sample.

        Raises:
            InputError: it is no number, or the motion diverges.
        """
        at_s = self.stamp * 1e-9
        if not math.isfinite(torque):
            raise InputError(f"Topic motor_torque: {torque} at {at_s:.6f} s.")
        state = self._state
        rig.hold(state, torque, self._period_s, self._plant, self._effects)
        if not math.isfinite(state[rig.MOTOR]):
            raise InputError(
                f"The simulated motion diverges at {at_s:.3f} s; raise sample_rate_hz or lower the "
                "controller gains or the amplitude."
            )
        self._stuck_motor += state[rig.MOTOR + 1] == 0.0
        self._stuck_link += state[rig.LINK + 1] == 0.0
        self.samples += 1
        self.stamp = 0

    def describe(self) -> str:
        """Return in one sentence how the realization went."""
        return f"{self.samples} samples."

    def figures(self) -> dict[str, float | int]:
        """Return the counts so far by name, with the unit in the name."""
        samples = max(self.samples, 1)
        return {
            "samples": self.samples,
            "motor sticking (fraction)": self._stuck_motor / samples,
            "link sticking (fraction)": self._stuck_link / samples,
        }
