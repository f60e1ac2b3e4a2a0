"""Simulation control without ROS: when a lockstep may go on, what its services answer."""

from __future__ import annotations

import signal
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fjr_interface.real_time import MODE_PARAMETER
from fjr_interface.ros.messages import to_descriptor
from fjr_kit.errors import InputError
from fjr_sim_node.drive.control import SPEED, STEPS, SimulationControl, State
from fjr_sim_node.drive.control_services import ControlServices
from fjr_sim_node.drive.real_time import TORQUE_TIMEOUT
from fjr_sim_node.drive.simulation_interfaces import Adapter

MS = 1_000_000


class Lockstep:
    """A simulation of a thousand samples that are all played as soon as they may be."""

    def __init__(self, *, real_time: bool = False, excitation: bool = True) -> None:
        self.control = SimulationControl()
        self.real_time = real_time
        self.excitation = excitation
        self.finished: str | None = None
        self.now = 0
        self.starts = 0
        self.played: list[int] = []
        self._active = True

    @property
    def run(self) -> str | None:
        return f"sample {len(self.played)}" if self._active else None

    def go_on(self) -> None:
        while self._active and len(self.played) < 1000:
            stamp = (len(self.played) + 1) * MS
            if self.control.next_ns(self.now, stamp) > self.now:
                return
            self.control.begin_sample()
            self.played.append(self.now)

    def drop_run(self) -> None:
        self._active = False
        self.played = []

    def start_anew(self) -> None:
        if not self.excitation:
            raise InputError("Nobody offers excitation/start.")
        self.starts += 1

    def described(self) -> None:
        """The excitation has begun anew."""
        self._active = True
        self.go_on()


def test_it_plays_as_fast_as_possible_until_it_is_paused_and_then_by_steps():
    simulation = Lockstep()
    controls = ControlServices(simulation)
    over: list[bool] = []
    controls.on_steps_over.append(over.append)
    assert simulation.control.free
    assert controls.set_state(State.PAUSED) == "paused: sample 0; as fast as possible"
    assert not simulation.control.free and simulation.played == []
    controls.step(5)
    assert len(simulation.played) == 5 and not simulation.control.stepping
    with pytest.raises(InputError, match="The simulation is playing; pause it before it can step"):
        controls.set_state(State.PLAYING)
        controls.step(1)
    assert len(simulation.played) == 1000


@given(st.floats(0.01, 100.0), st.integers(0, 10**9))
def test_at_a_speed_every_sample_has_its_instant(speed, start):
    simulation = Lockstep()
    simulation.now = start
    simulation.control.set_speed(speed)
    simulation.go_on()
    for k in range(1, 20):
        simulation.now = due = simulation.control.next_ns(simulation.now, (k + 1) * MS)
        assert due == start + round(k * MS / speed) and len(simulation.played) >= k
        simulation.go_on()


def test_a_simulation_that_falls_behind_does_not_hurry_after_its_speed():
    simulation = Lockstep()
    simulation.control.set_speed(1.0)
    simulation.go_on()
    simulation.now += 500 * MS
    simulation.go_on()
    assert len(simulation.played) == 2
    simulation.now += 50 * MS
    simulation.go_on()
    assert len(simulation.played) == 52


def test_what_is_stopped_starts_anew_when_it_is_played_or_paused():
    for state in (State.PLAYING, State.PAUSED):
        simulation = Lockstep()
        controls = ControlServices(simulation)
        simulation.go_on()
        controls.set_state(State.STOPPED)
        assert simulation.run is None and simulation.starts == 0
        assert controls.status().startswith("stopped: no realization under way")
        controls.set_state(state)
        simulation.described()
        assert simulation.starts == 1
        assert len(simulation.played) == (1000 if state == State.PLAYING else 0)


def test_a_realization_that_comes_while_it_is_stopped_waits_for_play():
    simulation = Lockstep()
    controls = ControlServices(simulation)
    controls.set_state(State.STOPPED)
    simulation.described()
    assert simulation.played == []
    controls.set_state(State.PLAYING)
    assert simulation.starts == 0 and len(simulation.played) == 1000


def test_a_reset_starts_anew_in_the_same_state_and_gives_steps_up():
    simulation = Lockstep()
    controls = ControlServices(simulation)
    over: list[bool] = []
    controls.on_steps_over.append(over.append)
    controls.set_state(State.PAUSED)
    controls.step(5)
    assert controls.reset() == "paused: the realization starts anew"
    simulation.described()
    assert simulation.starts == 1 and simulation.played == [] and over[-1] is False
    with pytest.raises(InputError, match="Nobody offers excitation/start"):
        ControlServices(Lockstep(excitation=False)).reset()


def test_real_time_neither_pauses_nor_steps():
    controls = ControlServices(Lockstep(real_time=True))
    for act in (lambda: controls.set_state(State.PAUSED), lambda: controls.step(1)):
        with pytest.raises(InputError, match="Real time cannot"):
            act()
    assert controls.status() == "playing: sample 0; in real time"


def test_steps_need_a_realization():
    simulation = Lockstep()
    controls = ControlServices(simulation)
    controls.set_state(State.PAUSED)
    simulation.drop_run()
    with pytest.raises(InputError, match="No realization is under way; reset starts it anew"):
        controls.step(1)


@pytest.fixture
def package() -> tuple[ModuleType, ModuleType]:
    """Return msg and srv of a stand-in for simulation_interfaces, which has no wheel.

    Names and numbers are those of its definitions; ROS can't carry these types.
    """

    @dataclass
    class Result:
        result: int = 0
        error_message: str = ""
        RESULT_FEATURE_UNSUPPORTED = 0
        RESULT_OK = 1
        RESULT_OPERATION_FAILED = 4

    @dataclass
    class SimulationState:
        state: int = 0

    @dataclass
    class SimulatorFeatures:
        features: list[int] = field(default_factory=list)
        SIMULATION_RESET = 20
        SIMULATION_STATE_GETTING = 24
        SIMULATION_STATE_SETTING = 25
        SIMULATION_STATE_PAUSE = 26
        STEP_SIMULATION_SINGLE = 31
        STEP_SIMULATION_MULTIPLE = 32

    @dataclass
    class Response:
        state: Any = None
        result: Any = None
        features: Any = None
        ALREADY_IN_TARGET_STATE = 101
        STATE_TRANSITION_ERROR = 102

    messages = ModuleType("simulation_interfaces.msg")
    messages.__dict__.update(
        Result=Result, SimulationState=SimulationState, SimulatorFeatures=SimulatorFeatures
    )
    services = ModuleType("simulation_interfaces.srv")
    for name in ("GetSimulatorFeatures", "GetSimulationState", "SetSimulationState"):
        setattr(services, name, SimpleNamespace(Response=Response))
    for name in ("ResetSimulation", "StepSimulation"):
        setattr(services, name, SimpleNamespace(Response=Response))
    return messages, services


def test_simulation_interfaces_are_answered_by_the_same_control_services(package):
    simulation = Lockstep()
    controls = ControlServices(simulation)
    adapter = Adapter(*package, controls)

    def ask(name: str, **request: Any) -> Any:
        return adapter.services[name][1](SimpleNamespace(**request))

    def set_state(number: int) -> int:
        return ask("set_simulation_state", state=SimpleNamespace(state=number)).result.result

    assert {20, 25, 26, 31, 32} <= set(ask("get_simulator_features").features.features)
    assert ask("get_simulation_state").state.state == 1
    assert [set_state(2), set_state(2), ask("get_simulation_state").state.state] == [1, 101, 2]
    assert adapter.step(SimpleNamespace(steps=7)) is None and len(simulation.played) == 7
    assert adapter.stepped(True).result.result == 1
    assert adapter.stepped(False).result.result == 4
    assert ask("reset_simulation", scope=1).result.result == 0  # time alone
    assert simulation.starts == 0
    for scope in (0, 3, 255):
        assert ask("reset_simulation", scope=scope).result.result == 1
    assert simulation.starts == 3
    refused = adapter.step(SimpleNamespace(steps=1)).result
    assert refused.result == 4 and refused.error_message.startswith("No realization")
    simulation.excitation = False
    assert set_state(0) == 1 and set_state(1) == 102
    assert ask("reset_simulation", scope=0).result.result == 4


@pytest.mark.parametrize("parameter", [SPEED, STEPS, MODE_PARAMETER, TORQUE_TIMEOUT])
def test_parameters_can_be_described_to_ros(parameter):
    assert to_descriptor(parameter).description.startswith(parameter.description)


@pytest.fixture
def ctrl_c():
    """Let Ctrl-C interrupt the test, also where the suite was told to ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_quitting_stops_and_ends_the_process_as_ctrl_c_does(package, ctrl_c):
    simulation = Lockstep()
    adapter = Adapter(*package, ControlServices(simulation))
    request = SimpleNamespace(state=SimpleNamespace(state=3))
    with pytest.raises(KeyboardInterrupt):
        adapter.set_state(request)
    assert simulation.control.state == State.STOPPED
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
