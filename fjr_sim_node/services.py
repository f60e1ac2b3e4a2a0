"""Services of simulation control, of type std_srvs/Trigger with numbers as parameters.

Where the package simulation_interfaces is installed, its own services are offered beside them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from std_srvs.srv import Trigger

from fjr_interface.errors import InputError
from fjr_interface.later import LaterService
from fjr_interface.ros import RigNode

from . import simulation_interfaces
from .control import State
from .desk import Desk


def offer(node: RigNode, desk: Desk) -> None:
    """Offer play, pause, stop, reset, status and step; a parameter `steps` says how many."""
    actions: dict[str, Callable[[], str]] = {
        "play": lambda: desk.set_state(State.PLAYING),
        "pause": lambda: desk.set_state(State.PAUSED),
        "stop": lambda: desk.set_state(State.STOPPED),
        "reset": desk.reset,
        "status": desk.status,
    }
    for name, act in actions.items():
        node.create_trigger(f"~/{name}", partial(_done, act))
    _offer_step(node, desk)
    simulation_interfaces.offer(node, desk)


def _done(act: Callable[[], str]) -> tuple[bool, str]:
    return True, act()


def _offer_step(node: RigNode, desk: Desk) -> None:
    def begin(_request: Trigger.Request) -> Trigger.Response | None:
        try:
            desk.step(node.values["steps"])
        except InputError as error:
            return Trigger.Response(success=False, message=str(error))
        return None

    service = LaterService(node, Trigger, "~/step", begin)
    desk.on_steps_over.append(
        lambda done: service.answer(Trigger.Response(success=done, message=desk.status()))
    )
