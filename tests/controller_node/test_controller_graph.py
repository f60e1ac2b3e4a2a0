"""The controller in real time on the graph: what is hostile trips, and never ends its process."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest
from by_hand import described, joint_state, stamp_ns
from processes import Started, Starter
from ros_domain import Peer

MS = 1_000_000
PATIENT = {"position_timeout_s": 5.0, "reference_timeout_s": 5.0, "torque_soft_start_s": 0.0}
"""Watchdogs that a busy machine does not wake."""
GAIN = 200.0 + 60.0 * 24.0


class Joint:
    """The test as drive and excitation of a controller."""

    def __init__(self, start: Starter, peer: Peer, **parameters: Any) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from sensor_msgs.msg import JointState

        from fjr_interface.ros import runtime

        self.peer, self.sample = peer, 0
        peer.look_s = 0.001  # each sample waits for a look
        self.torque = peer.listen(JointState, "motor_torque", runtime.SIGNAL_QOS)
        self.said = peer.listen(DiagnosticArray, "/diagnostics", 100)
        create = peer.node.create_publisher
        self.reference = create(JointState, "reference", runtime.SIGNAL_QOS)
        self.position = create(JointState, "motor_position", runtime.SIGNAL_QOS)
        self.controller: Started = start.node(
            "controller_node", readers="peer", **{"mode": "realtime", **PATIENT, **parameters}
        )
        for publisher in (self.reference, self.position):
            peer.spin_until(publisher.get_subscription_count, "the controller")

    def play(self, samples: int) -> list[float]:
        """Publish samples; return their torques."""
        torques = []
        for _ in range(samples):
            self.sample += 1
            self.reference.publish(joint_state(self.sample * MS, position=0.01))
            self.position.publish(joint_state(self.sample * MS, position=0.0))
            self.peer.spin_until(
                lambda: self.torque and stamp_ns(self.torque[-1]) >= self.sample * MS, "the torque"
            )
            torques.append(self.torque[-1].effort[0])
        return torques

    def ask(self, service: str) -> str:
        from std_srvs.srv import Trigger

        answer = self.peer.call(Trigger, f"controller/{service}", Trigger.Request())
        return str(answer.message)

    def trips(self) -> list[str]:
        """Return what /diagnostics has said of trips so far."""
        each = (status for array in self.said for status in array.status)
        return [s.message for s in each if s.message.startswith("tripped: ")]

    def tripped(self) -> str:
        """Wait for a trip; return what /diagnostics says of it."""
        return str(self.peer.spin_until(self.trips, "a trip on /diagnostics")[-1])

    def rests(self) -> None:
        """See the torque go to zero and stay there, in a process that lives."""
        assert self.play(200)[-1] == 0.0
        assert "zero torque until released" in self.ask("status")
        assert self.controller.process.poll() is None, self.controller.output
        assert self.controller.interrupt() == 0


def test_an_unreadable_reference_trips(start, peer):
    joint = Joint(start, peer)
    # A position is answered at once: that of the first reference, or of one that came just before.
    assert next(filter(None, joint.play(3))) == pytest.approx(0.01 * GAIN)
    joint.reference.publish(joint_state(4 * MS))
    assert "a message of reference is unreadable: position[0] is empty" in joint.tripped()
    joint.rests()


def test_a_malformed_latched_experiment_trips_and_can_be_released(start, peer):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    latched = peer.node.create_publisher(String, "experiment", runtime.EXPERIMENT_QOS)
    latched.publish(String(data='{"schema": "fjr_rig/experiment/1"}'))
    joint = Joint(start, peer)
    assert "topic experiment: experiment description: sample_rate_hz: " in joint.tripped()
    assert joint.play(3) == [0.0] * 3
    latched.publish(String(data=described().to_json()))
    assert joint.ask("release") == "ready"
    assert joint.play(3)[-1] > 0.0


def test_an_experiment_at_another_rate_trips(start, peer):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    latched = peer.node.create_publisher(String, "experiment", runtime.EXPERIMENT_QOS)
    latched.publish(String(data=described(sample_rate_hz=500.0).to_json()))
    joint = Joint(start, peer)
    assert "the experiment has sample_rate_hz 500, the controller 1000" in joint.tripped()


@pytest.mark.parametrize("topic", ["reference", "motor_position"])
def test_a_second_publisher_trips_and_is_named(start, peer, topic):
    import rclpy
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    joint = Joint(start, peer)
    joint.play(3)
    other = rclpy.create_node("intruder", namespace="/rig", context=peer.context)
    publisher = other.create_publisher(JointState, topic, runtime.SIGNAL_QOS)
    peer.spin_until(publisher.get_subscription_count, "the controller")
    said = joint.tripped()
    assert f"/rig/{topic} has 2 publishers" in said
    joint.rests()
    other.destroy_node()


@pytest.mark.parametrize("topic", ["reference", "motor_position"])
def test_a_publisher_that_takes_the_place_of_the_first_one_in_a_run_trips(start, peer, topic):
    import rclpy
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    joint = Joint(start, peer)
    until = time.monotonic() + 1.5  # the controller looks twice a second who publishes
    while time.monotonic() < until:
        joint.play(1)
    own = "reference" if topic == "reference" else "position"
    peer.node.destroy_publisher(getattr(joint, own))
    other = rclpy.create_node("intruder", namespace="/rig", context=peer.context)
    publisher = other.create_publisher(JointState, topic, runtime.SIGNAL_QOS)
    peer.spin_until(publisher.get_subscription_count, "the controller")
    setattr(joint, own, publisher)
    said = peer.spin_until(lambda: joint.play(1) and joint.trips(), "a trip")[-1]
    assert f"/rig/{topic} comes from /rig/intruder now, not from /rig/peer" in said
    joint.rests()
    other.destroy_node()


def test_a_position_ahead_of_the_clock_trips(start, peer):
    joint = Joint(start, peer)
    (*_, before) = joint.play(5)
    joint.position.publish(joint_state(100_000 * MS, position=0.0))
    assert "the stamps jumped by " in joint.tripped()
    heard = joint.torque
    peer.spin_until(lambda: heard[-1].effort[0] == 0.0, "zero torque by the controller's clock")
    fallen = [message.effort[0] for message in heard if stamp_ns(message) > 5 * MS]
    assert all(0.0 <= torque <= before for torque in fallen)
    assert max(map(stamp_ns, heard)) < 100_000 * MS


@pytest.mark.parametrize("absurd", [1e300, -1e308, math.nan])
def test_an_absurd_reference_trips(start, peer, absurd):
    joint = Joint(start, peer)
    joint.play(5)
    joint.reference.publish(joint_state(6 * MS, position=absurd))
    joint.position.publish(joint_state(6 * MS, position=0.0))
    assert "reference" in joint.tripped()
    joint.sample = 6
    joint.rests()


def test_a_lockstep_with_a_second_drive_of_another_name_ends_with_a_sentence(start, peer):
    import rclpy
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    joint = Joint(start, peer, mode="lockstep")
    other = rclpy.create_node("intruder", namespace="/rig", context=peer.context)
    other.create_publisher(JointState, "motor_position", runtime.SIGNAL_QOS)
    assert joint.controller.exit_status() == 2
    sentence = "error: Topic /rig/motor_position has publishers of different nodes (/rig/intruder"
    assert sentence in joint.controller.output
    other.destroy_node()
