"""The life of nodes in one process: started, spun until somebody wants them to stop, and left."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any

from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from fjr_kit.errors import InputError
from fjr_kit.stopping import NodeInterruption

from ..real_time import NEVER
from .program import Program, refuse
from .runtime import RigNode
from .session import ros_session

_IDLE_S = 0.2  # between two looks for Ctrl-C where nothing happens


def run(
    *factories: Callable[[], RigNode], program: Program, arguments: Sequence[str] | None = None
) -> int:
    """Spin the nodes that the factories make, in this process, until shutdown; return exit status.

    Ctrl-C and SIGTERM end it quietly with 0; an InputError, at start or later, is printed as one
    sentence and gives 2. However it ends, each node says its last word before it leaves.

    Args:
        factories: of the nodes.
        program: what the process is, for `--help`.
        arguments: of the command line; those of this process if not given.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if program.wants_help(arguments):
        print(program.help())
        return 0
    nodes: list[RigNode] = []
    with NodeInterruption() as interruption, ExitStack() as ros:
        try:
            _start_ros(ros, program, arguments)
            executor = EventsExecutor()
            for factory in factories:
                nodes.append(factory())
                executor.add_node(nodes[-1])
            for node in nodes:
                node.get_logger().info(f"Ready, in ROS domain {node.context.get_domain_id()}.")
            _spin(executor, nodes, interruption)
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
        except InputError as error:
            return refuse(error)
        finally:
            interruption.only_asks()
            for node in nodes:
                node.leave()
            for node in nodes:
                node.destroy_node()
    return 0


def _start_ros(ros: ExitStack, program: Program, arguments: Sequence[str]) -> None:
    """Start ROS; raise InputError if it, or the program, does not take the arguments."""
    program.refuse(arguments)
    named = [program.name, *arguments]
    try:
        remove_ros_args(named)  # refuses what rclpy.init would refuse after a line in the log
        ros.enter_context(ros_session(named))
    except rclpy_implementation.UnknownROSArgsError as error:
        raise InputError(
            f"ROS does not know the arguments {error} behind --ros-args; {program.name} --help "
            "tells what it takes."
        ) from None
    except (rclpy_implementation.RCLError, rclpy_implementation.RCLInvalidROSArgsError) as error:
        raise InputError(f"ROS refuses the arguments: {error}") from None


def _spin(executor: Any, nodes: Sequence[RigNode], interruption: NodeInterruption) -> None:
    """Spin until somebody wants it to stop; raise the first failure of a node.

    What is due by the steady clock is served between two events: a timer of ROS would be later.
    """
    interruption.only_asks()
    while not interruption.asked:
        wait_s = _IDLE_S
        if (due_ns := min([node.due_ns for node in nodes])) != NEVER:
            wait_s = min(max(due_ns - time.monotonic_ns(), 0) * 1e-9, wait_s)
        executor.spin_once(timeout_sec=wait_s)  # EventsExecutor.spin() serves no timer, no signal
        for node in nodes:
            if node.due_ns != NEVER and node.due_ns <= (now_ns := time.monotonic_ns()):
                node.on_time(now_ns)
            if node.failure is not None:
                raise node.failure
