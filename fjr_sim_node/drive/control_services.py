"""Actions of the services of simulation control, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from fjr_kit.errors import InputError

from .control import SimulationControl, State


class Simulation(Protocol):
    """What is controlled."""

    control: SimulationControl
    real_time: bool
    finished: str | None

    @property
    def run(self) -> str | None:
        """The realization under way and how far it is, in words; None without one."""
        ...

    def go_on(self) -> None:
        """Play the next sample if it may be played now."""
        ...

    def drop_run(self) -> None:
        """Give the realization up: plant at rest."""
        ...

    def start_anew(self) -> None:
        """Ask for the realization from its beginning; raise InputError if nobody can give it."""
        ...


class ControlServices:
    """Plays, pauses, steps, stops and resets a simulation, however that is asked for.

    Attributes:
        on_steps_over: called when steps are done (True) or given up (False).
    """

    def __init__(self, simulation: Simulation) -> None:
        """Take the simulation that is controlled."""
        self._simulation = simulation
        self.on_steps_over: list[Callable[[bool], None]] = []

    @property
    def state(self) -> State:
        """State of the simulation."""
        return self._simulation.control.state

    def status(self) -> str:
        """Return the state of the simulation, a colon, and how far it is."""
        control = self._simulation.control
        run = self._simulation.run or self._simulation.finished
        pace = "in real time" if self._simulation.real_time else control.describe_speed()
        return f"{self.state.name.lower()}: {run or 'no realization under way'}; {pace}"

    def set_state(self, state: State) -> str:
        """Play, pause or stop; return the status.

        What was stopped starts anew when it is played or paused.

        Raises:
            InputError: real time can't pause, or there is nobody to start anew.
        """
        if state == State.PAUSED:
            self._refuse_real_time("pause")
        if self.state == State.STOPPED != state and self._simulation.run is None:
            self._simulation.start_anew()
        self._simulation.control.set_state(state)
        if state == State.STOPPED:
            self._simulation.drop_run()
        self.steps_over(done=False)
        self._simulation.go_on()
        return self.status()

    def reset(self) -> str:
        """Play the realization from its beginning, with the plant at rest; return what happens.

        Raises:
            InputError: nobody can give it.
        """
        self._simulation.start_anew()
        self._simulation.drop_run()
        self.steps_over(done=False)
        return f"{self.state.name.lower()}: the realization starts anew"

    def step(self, steps: int) -> None:
        """Play so many samples of a paused simulation; `on_steps_over` tells when they are done.

        Raises:
            InputError: it is not paused, or no realization is under way.
        """
        self._refuse_real_time("step")
        if self._simulation.run is None:
            raise InputError("No realization is under way; reset starts it anew.")
        self._simulation.control.step(steps)
        self._simulation.go_on()

    def steps_over(self, *, done: bool) -> None:
        """Tell those who wait for steps that these are done, or given up."""
        for tell in self.on_steps_over:
            tell(done)

    def _refuse_real_time(self, what: str) -> None:
        if self._simulation.real_time:
            raise InputError(f"Real time cannot {what}; stop it, or use the emergency stop.")
