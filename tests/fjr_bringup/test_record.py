"""`fjr record`: nodes started by hand and topics of any rig, as bags that pass the audit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_tools import experiment, write_bag
from by_hand import EXCITATION, described, fjr, joint_state
from processes import wait_for

from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.bags.topic_survey import survey_bag
from fjr_interface.bags.writer import keep_whole_periods
from fjr_interface.ros.runtime import EXPERIMENT_QOS, SIGNAL_QOS
from fjr_interface.topics import EXPERIMENT_TOPIC, SIGNALS
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

BAG = "level_0_realization_000"


def rig(
    start, speed: float | str = ".inf", namespace: str | None = None, **excitation: Any
) -> None:
    """Start the nodes so that the recorder misses no first sample and none that follows."""
    start.node("fjr_sim_node", namespace=namespace, speed=speed, readers="controller,recorder")
    start.node("controller_node", namespace=namespace, readers="simulator,recorder")
    paced = {"readers": "controller,recorder", "pace": "recorded"}
    start.node("excitation_node", namespace=namespace, **EXCITATION, **excitation, **paced)


def test_a_rig_by_hand_is_recorded_sample_for_sample(start, domain: int, tmp_path: Path):
    recorder = start("fjr_cli", "record", "--out", str(tmp_path / "rig"))
    recorder.wait_for_text("Waiting for a publisher of /rig/")
    rig(start, periods=2)
    assert recorder.exit_status() == 0, recorder.output
    assert "Nothing is wrong." in recorder.output
    whole = described(periods=2)
    record = read_record(tmp_path / "rig" / BAG)
    np.testing.assert_array_equal(
        record.torque, run_realization(SIMULATOR.defaults(), whole).torque
    )
    again = start("fjr_cli", "record", "--out", str(tmp_path / "rig"))
    assert again.exit_status() == 2 and f"{BAG}: exists already" in again.output


def test_two_rigs_of_one_domain_are_told_apart_by_their_namespaces(
    start, domain: int, tmp_path: Path
):
    """The bag of one in another namespace is that of any: its topics lie in /rig."""
    recorder = start(
        "fjr_cli", "record", "--out", str(tmp_path / "cell"), "--namespace", "/cell/a", "--link"
    )
    recorder.wait_for_text("Waiting for a publisher of /cell/a/")
    rig(start, namespace="/cell/a", periods=2)
    start.node("controller_node")
    assert recorder.exit_status() == 0, recorder.output
    record = read_record(tmp_path / "cell" / BAG)
    expected = run_realization(SIMULATOR.defaults(), described(periods=2))
    np.testing.assert_array_equal(record.torque, expected.torque)
    np.testing.assert_array_equal(record.link, expected.link)
    told = fjr(start, "status", "--namespace", "cell/a")
    assert told.count("level 0, realization 0") >= 2 and "MISSING" not in told, told
    assert "simulator: MISSING, nobody publishes /rig/motor_position" in fjr(start, "status")
    refused = fjr(start, "pause", "--namespace", "/my-cell", status=2)
    assert refused.startswith("'/my-cell' is no ROS namespace: write words of letters")


def test_ctrl_c_keeps_whole_periods_and_a_late_recorder_waits(start, domain: int, tmp_path: Path):
    recorder = start("fjr_cli", "record", "--out", str(tmp_path / "cut"))
    recorder.wait_for_text("Recording in ROS domain")
    rig(start, speed=2.0, periods=9)
    wait_for((tmp_path / f"cut/.{BAG}.partial").exists, "the beginning of the bag")

    def has_played() -> bool:
        told = re.search(r"(\d+) of \d+ samples", fjr(start, "speed"))
        return told is not None and int(told[1]) >= 2500

    wait_for(has_played, "2500 samples")
    assert recorder.interrupt() == 130
    assert "whole periods, which are kept" in recorder.output, recorder.output
    kept = BagReader(tmp_path / "cut" / BAG).experiment
    assert kept.transient_periods == 1 and 1 <= kept.periods < 9
    expected = run_realization(SIMULATOR.defaults(), described(periods=kept.periods))
    np.testing.assert_array_equal(read_record(tmp_path / "cut" / BAG).torque, expected.torque)

    fjr(start, "speed", "0.2")
    late = start("fjr_cli", "record", "--out", str(tmp_path / "late"))
    late.wait_for_text("`fjr reset` plays it from its beginning")
    fjr(start, "speed", "max")
    fjr(start, "reset")
    assert late.exit_status() == 0, late.output
    assert BagReader(tmp_path / "late" / BAG).experiment == described(periods=9)


@pytest.mark.parametrize("missed", ["reference", "motor_position"])
def test_a_run_of_which_one_signal_lacks_its_first_sample_is_passed_over_in_all(
    start, peer, tmp_path: Path, missed: str
):
    """As where the recorder got to know one node a moment later than the others."""
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    described = experiment()
    signals = {
        signal.topic: peer.node.create_publisher(JointState, f"/rig/{signal.topic}", SIGNAL_QOS)
        for signal in SIGNALS
    }
    about = peer.node.create_publisher(String, f"/rig/{EXPERIMENT_TOPIC}", EXPERIMENT_QOS)
    recorder = start("fjr_cli", "record", "--out", str(tmp_path / "rig"))
    known = (*signals.values(), about)
    peer.spin_until(lambda: all(p.get_subscription_count() for p in known), "the recorder")

    def play(value: float, lost: str = "") -> None:
        about.publish(String(data=described.to_json()))
        for k, stamp in enumerate(described.stamps_ns.tolist()):
            for signal in SIGNALS:
                if k or signal.topic != lost:
                    fields = dict.fromkeys(["position", "effort"], value + k)
                    signals[signal.topic].publish(joint_state(stamp, **fields))

    play(0.0, missed)
    recorder.wait_for_text("readers:=controller,recorder")
    play(100.0)
    assert recorder.exit_status() == 0, recorder.output
    record = read_record(tmp_path / "rig" / BAG)
    for values in (record.reference, record.torque, record.position):
        assert values.tolist() == [100.0 + k for k in range(described.samples)]


def test_topics_of_another_rig_are_recorded_with_their_qos(start, peer, tmp_path: Path):
    from rclpy.duration import Duration
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64

    lossy = QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT)
    states = peer.node.create_publisher(JointState, "/joint_states", lossy)
    loads = peer.node.create_publisher(Float64, "/load", 10)
    bag = tmp_path / "bag"
    topics = ("--topic", "/joint_states", "--topic", "/load")
    recorder = start("fjr_cli", "record", "--out", str(bag), *topics)
    peer.spin_until(
        lambda: states.get_subscription_count() and loads.get_subscription_count(), "the recorder"
    )
    recorder.wait_for_text("Ctrl-C ends the bag")
    for k in range(1, 101):
        states.publish(joint_state(k * 2_000_000, position=k / 8, effort=-1.0))
        loads.publish(Float64(data=float(k)))
    assert loads.wait_for_all_acked(Duration(seconds=30))
    peer.spin_until(lambda: (bag.parent / ".bag.partial").exists(), "the bag")
    assert recorder.interrupt() == 0, recorder.output
    assert recorder.output.splitlines()[-1] == str(bag)
    by_name = {topic.name: topic for topic in survey_bag(bag).topics}
    assert by_name["/load"].messages == 100 and not by_name["/load"].stamped
    found = by_name["/joint_states"]
    assert found.stamped and found.rate_hz == pytest.approx(500.0)
    assert found.qos.startswith("best effort") and found.duplicates == found.backward == 0


@pytest.mark.parametrize(("samples", "periods"), [(60, 2), (59, 1), (40, 1), (39, 0), (0, 0)])
def test_a_bag_is_cut_after_its_last_whole_period(tmp_path, samples: int, periods: int):
    description = experiment()
    values = write_bag(tmp_path / "bag", description)
    assert keep_whole_periods(tmp_path / "bag", description, samples) == periods
    assert (tmp_path / "bag").exists() == bool(periods)
    if periods:
        record = read_record(tmp_path / "bag")
        assert record.torque.tolist() == values["u"][: 20 * (1 + periods)].tolist()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--topic", "joint_states"), "write the whole name, such as /joint_states"),
        (("--duration", "3"), "--duration is for topics"),
        (("--all", "--count", "2"), "--count is for realizations"),
        (("--all", "--topic", "/x"), "exclude each other"),
    ],
)
def test_options_that_do_not_go_together_are_refused(run, tmp_path, arguments, says):
    done = run("record", "--out", tmp_path / "bag", *arguments)
    assert done.exit_code == 2 and says in done.stderr and not (tmp_path / "bag").exists()
