"""The bridge to ros2_control: mapping, pairing, and real nodes with a stand-in controller manager.

ros2_control is not installed here. `ControllerManager` does what its hardware component
joint_state_topic_hardware_interface 0.2 and its predecessor topic_based_ros2_control do with the
topics: it keeps the newest state (best effort), and each cycle writes the efforts of all joints,
stamped with the present time, unless the threshold holds them back.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from bag_tools import serialize
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import Started, Starter
from ros_domain import Peer

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_bringup.bridge.mapping import Answers, Command, CommandReader, Observer, Sample
from fjr_interface.bags.reader import read_record
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

MS = 1_000_000
NAN = math.nan


@given(
    st.lists(st.sampled_from("abcdef"), min_size=1, max_size=6, unique=True),
    st.data(),
    st.integers(0, 2**31 * 10**9 - 1),
)
@settings(max_examples=60)
def test_the_effort_of_a_joint_is_found_in_any_order(names, data, stamp):
    efforts = data.draw(st.lists(st.floats(), min_size=len(names), max_size=len(names)))
    positions = [1.0] * data.draw(st.sampled_from([0, len(names)]))
    payload = serialize(stamp, "base", names, position=positions, effort=efforts)
    for joint, effort in zip(names, efforts, strict=True):
        command = CommandReader("/c", joint, echo_joint=names[0]).decode(payload)
        assert command.stamp_ns == stamp
        assert (command.effort, command.echo) == pytest.approx((effort, efforts[0]), nan_ok=True)


@pytest.mark.parametrize(
    ("names", "fields", "said"),
    [
        (["a", "b"], {"effort": [1.0, 2.0]}, "joint 'elbow' is not among a, b"),
        (["elbow", "b"], {"effort": [1.0]}, "1 efforts for the 2 joints elbow, b, so no effort"),
        (["elbow"], {"position": [1.0]}, "0 efforts for the 1 joints elbow"),
    ],
)
def test_a_command_without_the_effort_is_refused(names, fields, said):
    with pytest.raises(InputError, match=said):
        CommandReader("/c", "elbow").decode(serialize(MS, "", names, **fields))


def test_with_an_echo_only_the_command_of_the_sample_answers():
    answers = Answers(1, echo=True)
    assert answers.take(Command(1, 5.0, 1.0)) is None  # nothing was asked
    answers.ask(7 * MS, 3)
    for stale in (Command(1, 5.0, 2.0), Command(1, NAN, 3.0), Command(1, 5.0, NAN)):
        assert answers.take(stale) is None and answers.stamp_ns == 7 * MS
    assert answers.take(Command(1, 6.0, 3.0)) == 6.0
    assert answers.stamp_ns == 0 and answers.take(Command(1, 6.0, 3.0)) is None


def test_without_an_echo_the_nth_finite_command_answers():
    answers = Answers(2, echo=False)
    answers.ask(MS, 1)
    taken = [answers.take(Command(1, effort)) for effort in (NAN, 4.0, 5.0, 6.0)]
    assert taken == [None, None, 5.0, None]


def test_what_a_position_waits_for_is_said():
    answers = Answers(1, echo=True)
    assert answers.missing("/c", "elbow") is None
    answers.ask(MS, 1)
    assert "trigger_joint_command_threshold" in str(answers.missing("/c", "elbow"))
    answers.take(Command(1, NAN))
    assert "active controller: the effort command of elbow" in str(answers.missing("/c", "elbow"))
    answers.take(Command(1, 1.0, 0.0))
    assert "the echo of sample 1 on /c, where 0 is" in str(answers.missing("/c", "elbow"))


def observed(events: list[tuple[str, float, float]], referenced: bool = False) -> list[Sample]:
    """Return the samples of (kind, time in ms, value) in the order of arrival."""
    observer = Observer(("/states", "/commands"), 1000.0, referenced)
    add = {
        "y": observer.add_state,
        "u": lambda stamp, value: observer.add_command(Command(stamp, value)),
        "r": observer.add_reference,
    }
    return [sample for kind, ms, value in events for sample in add[kind](round(ms * MS), value)]


def steady(samples: int, delay: float = 0.3) -> list[tuple[str, float, float]]:
    return [
        event
        for k in range(samples)
        for event in (("y", 5000.0 + k, float(k)), ("u", 5000.0 + k + delay, 10.0 * k))
    ]


@given(st.integers(0, 10**6), st.floats(0.05, 0.5), st.floats(0.0, 0.1), st.floats(-1e-4, 1e-4))
@settings(max_examples=40)
def test_states_and_commands_are_paired_whatever_their_jitter_and_delay(seed, delay, jitter, drift):
    rng = np.random.default_rng(seed)
    times = 1e6 + (1.0 + drift) * np.arange(300) + jitter * rng.uniform(-1.0, 1.0, 300)
    events = [("y", at, float(k)) for k, at in enumerate(times)]
    events += [("u", at + delay, -float(k)) for k, at in enumerate(times)]
    arrival = [at + 1.5 * rng.random() for _, at, _ in events]  # topics overtake each other
    order = {
        kind: sorted(a for a, e in zip(arrival, events, strict=True) if e[0] == kind)
        for kind in "yu"
    }
    arrived = sorted(
        (when, event)
        for kind in "yu"
        for when, event in zip(order[kind], [e for e in events if e[0] == kind], strict=True)
    )
    samples = observed([event for _, event in arrived])
    assert samples == [Sample(k + 1, None, float(k), -float(k)) for k in range(300)]


def test_samples_count_from_the_first_finite_command():
    events = steady(5)
    events[1] = ("u", 5000.3, NAN)
    del events[3]
    assert [sample.position for sample in observed(events)] == [2.0, 3.0, 4.0]
    assert observed(events)[0].number == 1


def test_a_state_that_was_answered_by_nan_first_is_sample_one():
    events = steady(4)
    events[1:1] = [("u", 5000.1, NAN), ("u", 5000.2, NAN)]
    assert [sample.position for sample in observed(events)] == [0.0, 1.0, 2.0, 3.0]


def test_states_without_any_command_are_refused_in_the_end():
    silent = [("y", 5003.0 + k, 0.0) for k in range(1100)]
    assert observed(silent) == []
    with pytest.raises(InputError, match=r"no command answers the state of 5\.003000 s"):
        observed(steady(3) + silent)


def test_the_reference_of_a_sample_is_the_newest_at_its_command():
    events = [("r", 4999.9 + 0.5 * k, 0.5 * k) for k in range(20)] + steady(5)
    assert [s.reference for s in observed(events, referenced=True)] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_simulated_rig_that_begins_anew_is_followed():
    again = [(kind, ms - 4990.0, value) for kind, ms, value in steady(3)]
    assert [sample.number for sample in observed(steady(20) + again)] == [*range(1, 21), 1, 2, 3]


def change(at: int, event: tuple[str, float, float]) -> list[tuple[str, float, float]]:
    events = steady(6)
    events[at] = event
    return events


@pytest.mark.parametrize(
    ("events", "said"),
    [
        (change(5, ("u", 5002.3, NAN)), "/commands: nan at 5.002300 s; keep the controller active"),
        (steady(6)[:5] + steady(6)[6:], "no command answers the state of 5.002.*threshold.* to -1"),
        ([*steady(3), ("u", 5002.4, 1.0), *steady(6)[6:]], "a second command, of 5.002400 s"),
        ([*steady(3), *steady(6)[8:]], "state of 5.004000 s comes 0.002000 s after.*--resample"),
        ([*steady(3), ("y", 5002.5, 1.0)], "comes 0.000500 s after the one before it"),
        ([*steady(3), ("y", 5003.0, NAN)], "/states: nan at 5.003000 s"),
    ],
    ids=["deactivated", "threshold", "two commands", "lost state", "rate", "no position"],
)
def test_what_does_not_fit_the_grid_is_refused(events, said):
    with pytest.raises(InputError, match=said):
        observed(events)


EXCITATION = {"base_frequency_hz": 5.0, "f_min_hz": 5.0, "f_max_hz": 80.0, "periods": 1}


def described(**law: float) -> Experiment:
    law = pd_filtered.describe(pd_filtered.CONTROLLER.check(law))
    return multisine.describe(multisine.EXCITATION.check(EXCITATION), 0, 0, law)


class ControllerManager:
    """Reads, updates and writes as ros2_control does with this hardware component."""

    JOINTS = ("shoulder", "elbow", "sample")

    def __init__(self, peer: Peer, threshold: float = -1.0, **law: float) -> None:
        from rclpy.qos import QoSProfile, qos_profile_sensor_data
        from sensor_msgs.msg import JointState

        self.kind, self.threshold, self.active = JointState, threshold, False
        self._law = pd_filtered.coefficients(pd_filtered.CONTROLLER.check(law))
        self._filter, self.cycles = 0.0, 0
        self._states = peer.listen(JointState, "/robot_joint_states", qos_profile_sensor_data)
        self._commands = peer.node.create_publisher(
            JointState, "/robot_joint_commands", QoSProfile(depth=1)
        )

    def cycle_for_each_state(self) -> None:
        """Run a cycle where a state has come, as with simulated time."""
        if self._states:
            self.cycle()
            if self.active:
                del self._states[:]

    def cycle(self) -> None:
        """Read the newest state, update the controllers, write the commands."""
        positions = dict.fromkeys((*self.JOINTS, "reference"), 0.0)
        command = self.kind(name=list(self.JOINTS))
        if self._states:
            newest = self._states[-1]
            positions.update(zip(newest.name, newest.position, strict=True))
            command.header.stamp = newest.header.stamp
        self.cycles += 1
        efforts = [NAN, NAN, NAN]
        if self.active:
            error = positions["reference"] - positions["elbow"]
            self._filter, torque = pd_filtered.step(self._filter, error, self._law)
            efforts = [0.0, torque, positions["sample"]]
        # The hardware compares positions, and there is no position command: that stays zero.
        if sum(abs(positions[joint]) for joint in self.JOINTS) <= self.threshold:
            return
        command.effort = efforts
        self._commands.publish(command)


SERVED = {"joint": "elbow", "reference_joint": "reference", "readers": "simulator,peer"}


def start_excitation(start: Starter, readers: str = "bridge") -> None:
    excitation = {**EXCITATION, "readers": readers, "describe_controller": False}
    start.node("excitation_node", **excitation)


def start_simulator(start: Starter) -> None:
    start.node("fjr_sim_node", readers="bridge")


def bridge(start: Starter, direction: str, *more: str, **parameters: Any):
    settings = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    return start("fjr_bringup.bridge", direction, "--ros-args", *settings, *more)


def test_a_free_running_controller_manager_keeps_the_lockstep_by_its_echo(start, peer):
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    torques = peer.listen(JointState, "motor_torque", runtime.SIGNAL_QOS)
    manager = ControllerManager(peer, p=200.0, d=0.0)
    manager.active = True
    peer.after_each_look = manager.cycle
    serving = bridge(start, "serve", **SERVED, echo_joint="sample")
    start_excitation(start)
    start_simulator(start)
    batch = run_realization(SIMULATOR.defaults(), described(d=0.0))
    peer.spin_until(lambda: len(torques) == len(batch.torque), "all torques")
    assert [message.effort[0] for message in torques] == batch.torque.tolist()
    assert manager.cycles > len(torques) and torques[0].name == ["elbow"]
    assert serving.interrupt() == 0


def test_a_rig_under_ros2_control_is_recorded_as_the_rig_itself(start, peer, tmp_path):
    import rclpy

    from fjr_bringup.graph.recorder import Recorder

    arguments = ["--ros-args", "-r", "experiment:=/rig/experiment"]
    listener = rclpy.create_node(
        "recorder", namespace="/observed", context=peer.context, cli_args=arguments
    )
    recorder = Recorder(listener)
    manager = ControllerManager(peer)
    serving = bridge(start, "serve", **{**SERVED, "readers": "simulator"}, answer=1)
    observing = bridge(
        start,
        "observe",
        *("-r", "__ns:=/observed", "-r", "__node:=observer"),
        joint="elbow",
        reference_topic="/rig/reference",
        readers="recorder",
    )
    batch = run_realization(SIMULATOR.defaults(), described())
    experiment = multisine.describe(multisine.EXCITATION.check(EXCITATION), 0, 0, None)
    recorder.begin(tmp_path / "bag", experiment)

    def look() -> None:
        manager.cycle_for_each_state()
        recorder.poll()

    def said(text: str, started: Started) -> None:
        peer.spin_until(lambda: text in started.output, f"{text!r} in {started.output}")

    peer.after_each_look = look
    manager.cycle()  # the observer waits for somebody who commands
    start_excitation(start, readers="bridge,observer")
    said("Samples of elbow count", observing)
    listeners = peer.node.count_subscribers
    peer.spin_until(lambda: listeners("/robot_joint_states") == 2, "the observer's subscription")
    start_simulator(start)
    said("active controller: the effort command of elbow", serving)
    manager.active = True
    peer.spin_until(
        lambda: recorder.complete, f"the whole record {serving.output} {observing.output}"
    )
    recorder.finish()
    record = read_record(tmp_path / "bag")
    assert record.torque.tolist() == batch.torque.tolist()
    assert record.position.tolist() == batch.position.tolist()
    assert record.reference.tolist() == multisine.reference(described()).tolist()
    listener.destroy_node()


def test_a_threshold_that_holds_commands_back_is_named(start, peer):
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    torques = peer.listen(JointState, "motor_torque", runtime.SIGNAL_QOS)
    manager = ControllerManager(peer, threshold=1e-5)  # its default
    manager.active = True
    peer.after_each_look = manager.cycle
    serving = bridge(start, "serve", **SERVED)
    start_excitation(start)
    start_simulator(start)
    said = "the hardware's trigger_joint_command_threshold holds back commands"
    peer.spin_until(lambda: said in serving.output, f"{said!r} in {serving.output}")
    assert not torques and manager.cycles > 100
    manager.threshold = -1.0
    peer.spin_until(lambda: torques, "a torque")


def test_fjr_bridge_starts_the_node(start):
    serving = start("fjr_cli", "bridge", "serve", "--joint", "elbow", "--set", "answer=11")
    assert serving.exit_status() == 2 and "answer" in serving.output
    other = start("fjr_bringup.bridge", "sideways")
    assert other.exit_status() == 2 and "say serve or observe" in other.output
