"""Services of the package simulation_interfaces, offered where it is installed.

They do what the services of std_srvs do, with the types of
https://github.com/ros-simulation/simulation_interfaces (1.0 and later).
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

from rclpy.node import Node

from fjr_interface.ros.deferred_service import DeferredService
from fjr_kit.errors import InputError

from .control import State
from .control_services import ControlServices

_TIME, _STATE = 1, 2  # bits of ResetSimulation's scope; 0 stands for all


def offer(node: Node, controls: ControlServices) -> None:
    """Offer the services whose types can be imported: none without the package."""
    try:
        import simulation_interfaces.msg as messages
        import simulation_interfaces.srv as services
    except ImportError:
        return
    adapter = Adapter(messages, services, controls)
    for name, (kind, answer) in adapter.services.items():
        node.create_service(kind, f"~/{name}", partial(_answer, answer))
    steps = DeferredService(node, services.StepSimulation, "~/step_simulation", adapter.step)
    controls.on_steps_over.append(lambda done: steps.answer(adapter.stepped(done)))


def _answer(answer: Callable[[Any], Any], request: Any, _response: Any) -> Any:
    return answer(request)


class Adapter:
    """Requests of simulation_interfaces, answered by the control services.

    Attributes:
        services: {name: (type, answer to a request)} of all but the step service.
    """

    def __init__(
        self, messages: ModuleType, services: ModuleType, controls: ControlServices
    ) -> None:
        """Take the package's modules msg and srv."""
        self._messages, self._types, self._controls = messages, services, controls
        self.services: dict[str, tuple[type, Callable[[Any], Any]]] = {
            "get_simulator_features": (services.GetSimulatorFeatures, self.features),
            "get_simulation_state": (services.GetSimulationState, self.state),
            "set_simulation_state": (services.SetSimulationState, self.set_state),
            "reset_simulation": (services.ResetSimulation, self.reset),
        }

    def _result(self, code: int, error: str = "") -> Any:
        return self._messages.Result(result=code, error_message=error)

    @property
    def _ok(self) -> Any:
        return self._result(self._messages.Result.RESULT_OK)

    def features(self, _request: Any) -> Any:
        """Say what the simulator can do."""
        kinds = self._messages.SimulatorFeatures
        features = [
            kinds.SIMULATION_RESET,
            kinds.SIMULATION_STATE_GETTING,
            kinds.SIMULATION_STATE_SETTING,
            kinds.SIMULATION_STATE_PAUSE,
            kinds.STEP_SIMULATION_SINGLE,
            kinds.STEP_SIMULATION_MULTIPLE,
        ]
        return self._types.GetSimulatorFeatures.Response(features=kinds(features=features))

    def state(self, _request: Any) -> Any:
        """Say whether the simulation is stopped, playing or paused."""
        state = self._messages.SimulationState(state=int(self._controls.state))
        return self._types.GetSimulationState.Response(state=state, result=self._ok)

    def set_state(self, request: Any) -> Any:
        """Play, pause, stop or quit."""
        kind = self._types.SetSimulationState.Response
        state = State(request.state.state)
        if state == State.QUITTING:
            self._controls.set_state(State.STOPPED)
            signal.raise_signal(signal.SIGINT)
            return kind(result=self._ok)
        if state == self._controls.state:
            already = f"it is {state.name.lower()} already"
            return kind(result=self._result(kind.ALREADY_IN_TARGET_STATE, already))
        try:
            self._controls.set_state(state)
        except InputError as error:
            return kind(result=self._result(kind.STATE_TRANSITION_ERROR, str(error)))
        return kind(result=self._ok)

    def reset(self, request: Any) -> Any:
        """Play the realization from its beginning; time and state go back together."""
        kind = self._types.ResetSimulation.Response
        codes = self._messages.Result
        wanted = request.scope & (_TIME | _STATE)
        if request.scope and wanted != _TIME | _STATE:
            error = "Time and state can only be reset together."
            return kind(result=self._result(codes.RESULT_FEATURE_UNSUPPORTED, error))
        try:
            self._controls.reset()
        except InputError as error:
            return kind(result=self._result(codes.RESULT_OPERATION_FAILED, str(error)))
        return kind(result=self._ok)

    def step(self, request: Any) -> Any | None:
        """Begin to step; None if it has begun."""
        try:
            self._controls.step(request.steps)
        except InputError as error:
            code = self._messages.Result.RESULT_OPERATION_FAILED
            return self._types.StepSimulation.Response(result=self._result(code, str(error)))
        return None

    def stepped(self, done: bool) -> Any:
        """Return the answer to those who wait for their steps."""
        result = self._ok
        if not done:
            code = self._messages.Result.RESULT_OPERATION_FAILED
            result = self._result(code, "The steps were given up.")
        return self._types.StepSimulation.Response(result=result)
