"""Nodes and commands as a person starts them, and what a test hears of the rig that they make."""

from __future__ import annotations

from typing import Any

import numpy as np
from processes import Starter
from ros_domain import Peer

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_interface.experiment import Experiment

SIMULATOR_NODE, CONTROLLER_NODE, EXCITATION_NODE = (
    "fjr_sim_node",
    "controller_node",
    "excitation_node",
)
EXCITATION = {"base_frequency_hz": 1.0, "f_min_hz": 1.0, "f_max_hz": 40.0, "realizations": 3}


def described(realization: int = 0, **more: Any) -> Experiment:
    values = multisine.EXCITATION.check({**EXCITATION, **more})
    controller = pd_filtered.describe(pd_filtered.CONTROLLER.defaults())
    return multisine.describe(values, 0, realization, controller)


def stamp_ns(message: Any) -> int:
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def joint_state(stamp: int, **field: float) -> Any:
    from sensor_msgs.msg import JointState

    message = JointState(name=["joint"], **{name: [value] for name, value in field.items()})
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    return message


class Rig:
    """What a test hears of a run, as a recorder that paces it, and what it says itself.

    Attributes:
        step_ns: how far it lets the run go on at each look, by the stamps; as far as it got, if
            None.
    """

    def __init__(self, peer: Peer) -> None:
        from builtin_interfaces.msg import Time
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import JointState

        from fjr_interface.ros import runtime

        self.peer, self.kind, self.qos = peer, JointState, runtime.SIGNAL_QOS
        self.torque = peer.listen(JointState, "motor_torque", runtime.SIGNAL_QOS)
        self.link = peer.listen(JointState, "link_position", runtime.SIGNAL_QOS)
        self.clock = peer.listen(Clock, "/clock", runtime.CLOCK_QOS)
        recorded = peer.node.create_publisher(Time, "recorded", runtime.EXPERIMENT_QOS)
        self.step_ns: int | None = None
        paced = 0

        def pace() -> None:
            nonlocal paced
            if self.torque:
                newest = stamp_ns(self.torque[-1])
                paced = newest if self.step_ns is None else min(newest, paced + self.step_ns)
                recorded.publish(Time(sec=paced // 10**9, nanosec=paced % 10**9))

        peer.after_each_look = pace

    def hear_all_of(self, experiment: Experiment) -> np.ndarray:
        """Wait for the last torque of a run; return the torques of its last samples."""
        last = int(experiment.stamps_ns[-1])
        heard = self.torque
        self.peer.spin_until(lambda: heard and stamp_ns(heard[-1]) == last, "the last torque")
        first = max(k for k, message in enumerate(heard) if stamp_ns(message) == 1_000_000)
        run = heard[first:]
        np.testing.assert_array_equal([stamp_ns(m) for m in run], experiment.stamps_ns)
        return np.array([message.effort[0] for message in run])

    def say(self, topic: str, *messages: Any, readers: int = 1) -> None:
        """Publish on a topic once it is read."""
        publisher = self.peer.node.create_publisher(self.kind, topic, self.qos)
        self.peer.spin_until(
            lambda: publisher.get_subscription_count() >= readers, f"a reader of {topic}"
        )
        for message in messages:
            publisher.publish(message)


def by_hand(start: Starter, **more: Any) -> dict[str, Any]:
    """Return what starts each node; readers includes the test's own, so that it hears all."""
    return {
        "s": lambda: start.node(SIMULATOR_NODE),
        "c": lambda: start.node(CONTROLLER_NODE, readers="simulator,peer"),
        "e": lambda: start.node(EXCITATION_NODE, **{**EXCITATION, "pace": "recorded", **more}),
    }


REAL_TIME = {"mode": "realtime", "sample_rate_hz": 200.0}
SLOW_LOOP = {"p": 20.0, "d": 2.0}  # stable with whatever delay a busy machine makes


def in_real_time(start: Starter, **excitation: Any) -> dict[str, Any]:
    given = {**EXCITATION, "sample_rate_hz": 200.0, **excitation}
    return {
        "s": lambda: start.node("fjr_sim_node", **REAL_TIME),
        "c": lambda: start.node("controller_node", **REAL_TIME, **SLOW_LOOP),
        "e": lambda: start.node("excitation_node", **given),
    }


def fjr(start: Starter, *arguments: str, status: int = 0) -> str:
    """Run a command of fjr; return what it says."""
    command = start("fjr_cli", *arguments)
    assert command.exit_status() == status, command.output
    return command.output.strip()
