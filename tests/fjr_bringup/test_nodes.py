"""Nodes started by hand: order, waiting, parameters, bad messages, restarts, what they publish."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from by_hand import (
    CONTROLLER_NODE,
    EXCITATION,
    EXCITATION_NODE,
    SIMULATOR_NODE,
    by_hand,
    described,
    joint_state,
    stamp_ns,
)
from processes import Started, wait_for

from fjr_interface import topics
from fjr_interface.experiment import Experiment
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization


@pytest.mark.parametrize("order", ["sce", "ces", "esc"])
def test_nodes_started_in_any_order_play_the_experiment(start, rig, order):
    """Of these orders each node is the first, the second and the last, and before each other."""
    nodes = by_hand(start)
    started = [nodes[letter]() for letter in order]
    torque = rig.hear_all_of(described())
    batch = run_realization(SIMULATOR.defaults(), described())
    np.testing.assert_array_equal(torque, batch.torque)
    for node in started:
        assert node.interrupt() == 0


def test_a_late_controller_is_waited_for_and_named(start, rig):
    nodes = by_hand(start, pace="clock")
    simulator, excitation = nodes["s"](), nodes["e"]()
    excitation.wait_for_text("Waiting for controller to subscribe to /rig/reference.")
    controller = nodes["c"]()
    last = described().stamps_ns[-1]
    rig.peer.spin_until(lambda: rig.torque and stamp_ns(rig.torque[-1]) == last, "the last torque")
    controller.interrupt(), excitation.interrupt(), simulator.interrupt()
    assert "Waiting" not in controller.output


def test_a_controller_that_ends_mid_run_is_waited_for(start, rig):
    nodes = by_hand(start, periods=500, pace="clock")
    simulator, controller, _ = nodes["s"](), nodes["c"](), nodes["e"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 100, "torques")
    controller.interrupt()
    simulator.wait_for_text("Waiting for the torque of ")


def test_what_a_run_publishes_beside_the_signals(start, rig):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    nodes = by_hand(start)
    rig.step_ns = 50_000_000  # of the clock's ticks the last one waits for each look, no more
    nodes["s"]()
    writers = rig.peer.node.count_publishers
    rig.peer.spin_until(lambda: writers("link_position"), "the simulator")
    nodes["c"](), nodes["e"]()
    rig.hear_all_of(described())
    batch = run_realization(SIMULATOR.defaults(), described())
    stamps = described().stamps_ns
    rig.peer.spin_until(lambda: rig.link and stamp_ns(rig.link[-1]) == stamps[-1], "the last link")
    assert len(rig.link) == len(stamps)
    np.testing.assert_array_equal([m.position[0] for m in rig.link], batch.link)
    ticks = [tick.clock.sec * 10**9 + tick.clock.nanosec for tick in rig.clock]
    assert len(ticks) > 10 and set(ticks) <= set(stamps.tolist()) and ticks == sorted(ticks)
    late = rig.peer.listen(String, "experiment", runtime.EXPERIMENT_QOS)
    rig.peer.spin_until(lambda: late, "the experiment, joining late")
    assert Experiment.from_json(late[0].data, "topic") == described()


def test_a_stream_goes_on_by_the_newest_tick_alone(start, rig):
    """An excitation that got no processor for long hears of no other tick than the last one.

    The simulator has then begun the sample after the last one that has a reference.
    """
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    rig.peer.listen(String, "experiment", runtime.EXPERIMENT_QOS)
    reference = rig.peer.listen(rig.kind, "reference", rig.qos)
    ticks = rig.peer.node.create_publisher(Clock, "/clock", runtime.CLOCK_QOS)
    more = {"describe_controller": False, "periods": 3}
    start.node(EXCITATION_NODE, readers="peer", **EXCITATION, **more)
    rig.peer.spin_until(lambda: len(reference) == 1000, "the first window")
    own = 1  # reader of the clock
    rig.peer.spin_until(lambda: ticks.get_subscription_count() > own, "its reader of the clock")
    due = int(described(periods=3).stamps_ns[1000])
    ticks.publish(topics.clock_message(due))
    rig.peer.spin_until(lambda: len(reference) == 2000, "the next window")


def test_start_mid_run_replaces_the_run(start, rig):
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParameters
    from std_srvs.srv import Trigger

    nodes = by_hand(start, periods=5)
    for letter in "sce":
        nodes[letter]()
    for realization in (1, 2, 1):
        before = len(rig.torque)
        rig.peer.spin_until(lambda: len(rig.torque) > before + 700, "torques")  # noqa: B023
        number = ParameterValue(type=2, integer_value=realization)
        request = SetParameters.Request(parameters=[Parameter(name="realization", value=number)])
        answer = rig.peer.call(SetParameters, "excitation/set_parameters", request)
        assert answer.results[0].successful
        answer = rig.peer.call(Trigger, "excitation/start", Trigger.Request())
        assert answer.success and answer.message == f"level 0, realization {realization}"
    experiment = described(periods=5, realization=1)
    torque = rig.hear_all_of(experiment)
    np.testing.assert_array_equal(torque, run_realization(SIMULATOR.defaults(), experiment).torque)


def test_the_simulator_is_started_only_when_the_controller_has_taken_the_new_reference(start, rig):
    from rcl_interfaces.srv import GetParameters
    from std_msgs.msg import String
    from std_srvs.srv import Trigger

    from fjr_interface.ros import runtime

    controller = rig.peer.node.create_publisher(String, "controller", runtime.EXPERIMENT_QOS)
    description = described().controller

    def take(stream: int) -> None:
        controller.publish(String(data=json.dumps({**description, topics.STREAM_KEY: stream})))

    take(1)
    reference = rig.peer.listen(rig.kind, "reference", rig.qos)
    started = rig.peer.listen(String, "experiment", runtime.EXPERIMENT_QOS)
    start.node(EXCITATION_NODE, readers="peer", pace="recorded", **EXCITATION)
    rig.peer.spin_until(lambda: len(reference) == 1000, "the first window")
    take(1)  # a changed gain is no answer
    rig.peer.call(Trigger, "excitation/start", Trigger.Request())
    rig.peer.call(Trigger, "excitation/start", Trigger.Request())
    assert len(reference) == 1000 and not started
    take(2)
    rig.peer.spin_until(lambda: len(reference) == 2000, "the first window of the last start")
    rig.peer.call(GetParameters, "excitation/get_parameters", GetParameters.Request())
    assert not started
    take(3)
    rig.peer.spin_until(lambda: started, "the experiment")
    assert Experiment.from_json(started[0].data, "topic").controller == description


def test_a_controller_answers_each_stream_of_references_with_its_own(start, rig):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    descriptions = rig.peer.listen(String, "controller", runtime.EXPERIMENT_QOS)
    start.node(CONTROLLER_NODE, readers="peer")
    rig.peer.spin_until(lambda: descriptions, "the controller")
    streams = [json.loads(descriptions[-1].data)[topics.STREAM_KEY]]
    position = joint_state(1_000_000, position=0.0)
    for run, value in enumerate((0.01, 0.02, 0.03), 1):
        rig.say("reference", *(joint_state(k * 1_000_000, position=value) for k in (1, 2)))
        rig.peer.spin_until(lambda: len(descriptions) == run + 1, "the new stream")  # noqa: B023
        streams.append(json.loads(descriptions[-1].data)[topics.STREAM_KEY])
        rig.say("motor_position", position)
        rig.peer.spin_until(lambda: len(rig.torque) == run, "the torque")  # noqa: B023
    gain = 200.0 + 60.0 * 24.0
    np.testing.assert_allclose([m.effort[0] / gain for m in rig.torque], [0.01, 0.02, 0.03])
    assert len(set(streams)) == 4


def test_a_controller_describes_a_changed_gain_at_once(start, peer):
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParameters
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    descriptions = peer.listen(String, "controller", runtime.EXPERIMENT_QOS)
    start.node(CONTROLLER_NODE)
    peer.spin_until(lambda: descriptions, "the controller")
    value = ParameterValue(type=3, double_value=123.0)
    request = SetParameters.Request(parameters=[Parameter(name="p", value=value)])
    assert peer.call(SetParameters, "controller/set_parameters", request).results[0].successful
    peer.spin_until(lambda: len(descriptions) > 1, "the new description")
    assert json.loads(descriptions[-1].data)["p"] == 123.0


def test_a_first_position_may_overtake_its_reference(start, rig):
    controller = start.node(CONTROLLER_NODE, readers="peer")
    rig.say("motor_position", joint_state(1_000_000, position=0.0))
    controller.wait_for_text("Waiting for a publisher of /rig/reference.")
    rig.say("reference", joint_state(1_000_000, position=0.01))
    rig.peer.spin_until(lambda: rig.torque, "the torque")
    assert rig.torque[0].effort[0] == pytest.approx(0.01 * (200.0 + 60.0 * 24.0))


def test_a_simulator_started_again_plays_the_next_start(start, rig):
    from std_srvs.srv import Trigger

    nodes = by_hand(start)
    simulator, controller, _ = [nodes[letter]() for letter in "sce"]
    first = rig.hear_all_of(described())
    assert simulator.interrupt() == 0
    nodes["s"]()  # it gets the latched experiment and starts, but no reference comes
    controller.wait_for_text("Waiting for the reference of 0.001000 s.")
    rig.torque.clear()
    assert rig.peer.call(Trigger, "excitation/start", Trigger.Request()).success
    np.testing.assert_array_equal(rig.hear_all_of(described()), first)


@pytest.mark.parametrize(
    ("module", "parameters", "sentence"),
    [
        (SIMULATOR_NODE, {"jm": -1.0}, "error: jm must lie in"),
        (SIMULATOR_NODE, {"k1": "stiff"}, "error: k1 must be a number in N m/rad3, not 'stiff'."),
        (SIMULATOR_NODE, {"noise_seed": 1.5}, "error: noise_seed must be a whole number, not 1.5."),
        (CONTROLLER_NODE, {"gain": 1.0}, "error: There is no parameter 'gain'"),
        (CONTROLLER_NODE, {"hardware": True}, "error: hardware needs finite limits; give torque_"),
        (EXCITATION_NODE, {"grid": "even"}, "error: grid must be one of odd_random, odd, full"),
        (EXCITATION_NODE, {"realization": 7}, "error: There is no level 0, realization 7;"),
        (EXCITATION_NODE, {"amplitudes_rad": "[]"}, "error: "),
    ],
)
def test_bad_parameters_are_refused_at_the_start(start, module, parameters, sentence):
    node = start.node(module, **parameters)
    assert node.exit_status() == 2
    assert node.output.startswith(sentence) and node.output.count("\n") == 1, node.output


def test_arguments_that_ros_does_not_know_are_refused(start):
    node = start(CONTROLLER_NODE, "--ros-args", "-p", "nonsense")
    assert node.exit_status() == 2
    assert node.output.startswith("error: ROS refuses the arguments: "), node.output


def test_parameters_are_described_and_checked_at_run_time(start, peer):
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters

    start.node(SIMULATOR_NODE, k1=0)
    request = DescribeParameters.Request(names=["jm", "noise_seed", "k1"])
    described = peer.call(DescribeParameters, "simulator/describe_parameters", request).descriptors
    inertia, seed, _ = described
    assert "[kg m2]" in inertia.description and "range" in inertia.description
    (span,) = inertia.floating_point_range
    assert (span.from_value, span.to_value) == (SIMULATOR["jm"].low, SIMULATOR["jm"].high)
    assert seed.integer_range[0].to_value == SIMULATOR["noise_seed"].high

    def set_to(name: str, **value: Any) -> Any:
        kind = {"double_value": ParameterType.PARAMETER_DOUBLE, "integer_value": 2}
        value["type"] = next(kind.get(field, 4) for field in value)
        parameters = [Parameter(name=name, value=ParameterValue(**value))]
        request = SetParameters.Request(parameters=parameters)
        return peer.call(SetParameters, "simulator/set_parameters", request).results[0]

    assert set_to("jm", double_value=0.3).successful
    assert set_to("k1", integer_value=0).successful
    for refused in (
        set_to("fs", double_value=-1.0),
        set_to("fs", double_value=float("nan")),
        set_to("fs", string_value="much"),
    ):
        assert not refused.successful and "fs" in refused.reason
    names = GetParameters.Request(names=["jm", "fs"])
    values = peer.call(GetParameters, "simulator/get_parameters", names).values
    assert [value.double_value for value in values] == [0.3, SIMULATOR["fs"].default]


def ended(node: Started) -> str:
    assert node.exit_status() == 2
    errors = [line for line in node.output.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1, node.output
    return errors[0]


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_position_that_is_no_number_becomes_no_torque(start, rig, value):
    controller = start.node(CONTROLLER_NODE, readers="peer")
    rig.say("reference", *(joint_state(k * 1_000_000, position=0.01) for k in range(1, 10)))
    first, second = joint_state(1_000_000, position=0.0), joint_state(2_000_000, position=value)
    rig.say("motor_position", first)
    rig.peer.spin_until(lambda: rig.torque, "the first torque")
    rig.say("motor_position", second)
    assert f"Topic motor_position: {value} at 0.002000 s; no torque from that." in ended(controller)
    assert len(rig.torque) == 1


def test_a_torque_that_is_no_number_ends_the_simulator(start, rig):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    simulator = start.node(SIMULATOR_NODE, readers="peer")
    position = rig.peer.listen(rig.kind, "motor_position", rig.qos)
    experiment = rig.peer.node.create_publisher(String, "experiment", runtime.EXPERIMENT_QOS)
    experiment.publish(String(data=described().to_json()))
    rig.say("motor_torque", readers=2)
    rig.peer.spin_until(lambda: position, "the first position")
    rig.say("motor_torque", joint_state(1_000_000, effort=float("nan")), readers=2)
    assert "Topic motor_torque: nan at 0.001000 s" in ended(simulator)
    assert len(position) == 1


def test_a_message_without_a_value_ends_the_controller(start, rig):
    controller = start.node(CONTROLLER_NODE, readers="peer")
    rig.say("motor_position", joint_state(1_000_000))
    assert "Topic motor_position: position[0] is empty; publish JointState" in ended(controller)


@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_a_controller_at_another_rate_says_so(start, rig, rate):
    nodes = by_hand(start)
    nodes["s"](), nodes["e"]()
    controller = start.node(CONTROLLER_NODE, sample_rate_hz=rate)
    sentence = f"was due at sample_rate_hz {rate:g}; give all nodes the same rate"
    assert sentence in ended(controller)
    assert not rig.torque


def test_a_simulator_at_another_rate_says_so(start, rig):
    nodes = by_hand(start)
    simulator = start.node(SIMULATOR_NODE, sample_rate_hz=2000.0)
    nodes["c"](), nodes["e"]()
    sentence = "The experiment has sample_rate_hz 1000, the simulator 2000; give both the same."
    assert sentence in ended(simulator)


def test_a_controller_of_another_mode_is_refused(start):
    simulator = start.node(SIMULATOR_NODE)
    start.node(CONTROLLER_NODE, mode="realtime")
    sentence = "The controller has mode realtime, the simulator lockstep; give both the same."
    assert sentence in ended(simulator)


def test_noise_given_twice_ends_the_simulator(start, rig):
    nodes = by_hand(start)
    simulator = start.node(SIMULATOR_NODE, noise_std_rad=1e-4, noise_snr_db=20.0)
    nodes["c"](), nodes["e"]()
    assert "noise_std_rad and noise_snr_db exclude each other" in ended(simulator)


@pytest.mark.parametrize(
    ("topic", "reader", "text", "sentence"),
    [
        ("experiment", SIMULATOR_NODE, "{}", "topic experiment: experiment description: "),
        ("controller", EXCITATION_NODE, "no JSON", "Topic controller: 'no JSON' is no JSON"),
        ("controller", SIMULATOR_NODE, "no JSON", "Topic controller: 'no JSON' is no JSON"),
    ],
)
def test_a_description_that_is_none_ends_its_reader(start, peer, topic, reader, text, sentence):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    node = start.node(reader)
    publisher = peer.node.create_publisher(String, topic, runtime.EXPERIMENT_QOS)
    publisher.publish(String(data=text))
    wait_for(lambda: node.process.poll() is not None, "the end of the node")
    assert sentence in ended(node)


def test_signals_are_lossless_by_their_profile():
    from fjr_interface.ros import runtime

    assert runtime.SIGNAL_QOS.depth == topics.SIGNAL_DEPTH >= 10
