"""Services of simulation control, of type std_srvs/Trigger with numbers as parameters.

Where the package simulation_interfaces is installed, its own services are offered beside them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from std_srvs.srv import Trigger

from fjr_interface.ros.deferred_service import DeferredService
from fjr_interface.ros.runtime import RigNode
from fjr_kit.errors import InputError

from . import simulation_interfaces
from .control import State
from .control_services import ControlServices


def offer(node: RigNode, controls: ControlServices) -> None:
    """Offer play, pause, stop, reset, status and step; a parameter `steps` says how many."""
    actions: dict[str, Callable[[], str]] = {
        "play": lambda: controls.set_state(State.PLAYING),
        "pause": lambda: controls.set_state(State.PAUSED),
        "stop": lambda: controls.set_state(State.STOPPED),
        "reset": controls.reset,
        "status": controls.status,
    }
    for name, act in actions.items():
        node.create_trigger(f"~/{name}", partial(_done, act))
    _offer_step(node, controls)
    simulation_interfaces.offer(node, controls)


def _done(act: Callable[[], str]) -> tuple[bool, str]:
    return True, act()


def _offer_step(node: RigNode, controls: ControlServices) -> None:
    def begin(_request: Trigger.Request) -> Trigger.Response | None:
        try:
            controls.step(node.values["steps"])
        except InputError as error:
            return Trigger.Response(success=False, message=str(error))
        return None

    service = DeferredService(node, Trigger, "~/step", begin)
    controls.on_steps_over.append(
        lambda done: service.answer(Trigger.Response(success=done, message=controls.status()))
    )
