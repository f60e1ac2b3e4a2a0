"""Simulation control: playing, paused, stopped, n steps, speed; named as in simulation_interfaces.

The states and what they mean are those of ros-simulation/simulation_interfaces (SimulationState,
SetSimulationState, StepSimulation). A lockstep is asked before each sample whether it may go on, so
that it stops between two samples, with every message of the one before on its topic.
"""

from __future__ import annotations

import math
from enum import IntEnum

from fjr_interface.parameters import Parameter
from fjr_interface.real_time import NEVER
from fjr_kit.errors import InputError

SPEED = Parameter(
    "speed",
    math.inf,
    "x real time",
    "Lockstep only: speed of the simulation, 1 for real time; .inf: as fast as possible. It may be "
    "changed at any time",
    0.01,
)
STEPS = Parameter(
    "steps",
    1,
    "samples",
    "Samples that the step service plays, as its type holds no number",
    1,
    1_000_000_000,
)
_BEHIND_NS = 100_000_000


class State(IntEnum):
    """State of a simulation, with the numbers of simulation_interfaces/msg/SimulationState."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


class SimulationControl:
    """When a lockstep may play its next sample.

    Attributes:
        state: what it was asked to be; while it steps it is paused.
        free: whether samples may follow one another without asking.
    """

    def __init__(self) -> None:
        """Play as fast as possible."""
        self.state = State.PLAYING
        self._speed = math.inf
        self._steps = 0
        self._from: tuple[int, int] | None = None
        self._set_free()

    def _set_free(self) -> None:
        self.free = self.state == State.PLAYING and math.isinf(self._speed)
        self._from = None

    def set_speed(self, speed: float) -> None:
        """Play at this many times real time from the next sample on; infinity for no limit."""
        if speed != self._speed:
            self._speed = speed
            self._set_free()

    def set_state(self, state: State) -> None:
        """Play, pause or stop; steps that are left are given up."""
        self.state = state
        self._steps = 0
        self._set_free()

    def step(self, steps: int) -> None:
        """Let a paused simulation play so many samples.

        Raises:
            InputError: it is not paused.
        """
        if self.state != State.PAUSED:
            raise InputError(
                f"The simulation is {self.state.name.lower()}; pause it before it can step."
            )
        self._steps = steps

    @property
    def stepping(self) -> bool:
        """Whether steps are left."""
        return self._steps > 0

    def next_ns(self, now_ns: int, stamp_ns: int) -> int:
        """Return the instant at which the sample of a stamp may be played; NEVER if it must wait.

        A simulation that can't keep its speed goes on from where it is, without hurrying after it.

        Args:
            now_ns: instant of the steady clock.
            stamp_ns: the sample's stamp.
        """
        if self.state != State.PLAYING:
            return now_ns if self._steps else NEVER
        if math.isinf(self._speed):
            return now_ns
        if self._from is None:
            self._from = now_ns, stamp_ns
        from_ns, first_ns = self._from
        due_ns = from_ns + round((stamp_ns - first_ns) / self._speed)
        if now_ns - due_ns > _BEHIND_NS:
            self._from, due_ns = (now_ns, stamp_ns), now_ns
        return due_ns

    def begin_sample(self) -> None:
        """Count a sample that begins, as a step if there are any."""
        if self._steps:
            self._steps -= 1

    def describe_speed(self) -> str:
        """Return the speed in words."""
        if math.isinf(self._speed):
            return "as fast as possible"
        return f"{self._speed:g} x real time"
