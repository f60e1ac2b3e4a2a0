"""ROS in this process, from its start to its end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.signals import SignalHandlerOptions

from . import runtime  # noqa: F401 - sets the environment that rclpy.init reads


@contextmanager
def ros_session(arguments: Sequence[str] = ()) -> Iterator[None]:
    """Keep ROS started while the body runs, and end it after that if nobody has ended it.

    Signals stay with the caller: ROS would end the communication at once, before a controller
    takes its torque down and before a recorder keeps what has come.

    Args:
        arguments: of the command line, the name of the program first.

    Raises:
        RuntimeError: of rclpy, at arguments that ROS does not take.
    """
    rclpy.init(args=list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()
