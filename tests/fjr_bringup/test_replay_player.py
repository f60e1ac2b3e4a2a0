"""Bags published by `fjr replay`: what readers get, in which order, with which QoS and clock."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from bag_tools import MS, STORE, Stream, experiment, foreign_bag, rig_streams, write_bag
from by_hand import stamp_ns
from processes import Started, Starter, marked_processes
from ros_domain import Peer
from rosbags.interfaces import QosHistory, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin

from fjr_interface.bags.writer import EXPERIMENT_QOS, SIGNAL_QOS
from fjr_interface.experiment import Experiment
from fjr_interface.topics import SIGNALS

DESCRIBED = experiment(samples_per_period=1000)
SAMPLES = DESCRIBED.samples


class Ears:
    """Hears everything that a bag may publish."""

    def __init__(self, peer: Peer, topics: tuple[str, ...] = ("r", "y", "u")) -> None:
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String

        from fjr_interface.ros import runtime

        self.peer = peer
        self.signals = {
            signal.symbol: peer.listen(JointState, signal.absolute_topic, runtime.SIGNAL_QOS)
            for signal in SIGNALS
            if signal.symbol in topics
        }
        self.clock = peer.listen(Clock, "/clock", runtime.CLOCK_QOS)
        self._string, self._latched = String, runtime.EXPERIMENT_QOS
        self.experiment = peer.listen(String, "experiment", runtime.EXPERIMENT_QOS)

    def hear_out(self, started: Started) -> int:
        """Listen until the process has ended; return its exit status."""
        self.peer.spin_until(lambda: started.process.poll() is not None, "the end of the replay")
        return started.exit_status()

    def hear_all(self, samples: int) -> None:
        """Listen until every signal has come whole; if it does not, say what of it came."""
        heard = self.signals

        def came() -> str:
            return ", ".join(
                f"{symbol}: {len(messages)} from {stamp_ns(messages[0]) if messages else None} on"
                for symbol, messages in heard.items()
            )

        try:
            self.peer.spin_until(
                lambda: all(len(messages) == samples for messages in heard.values()), "samples"
            )
        except AssertionError as error:
            raise AssertionError(f"{error}; of {samples} came {came()}") from None

    def description_for_a_late_comer(self) -> str:
        late = self.peer.listen(self._string, "experiment", self._latched)
        self.peer.spin_until(lambda: late, "the experiment, joining late")
        return late[0].data

    @property
    def ticks(self) -> list[int]:
        return [tick.clock.sec * 10**9 + tick.clock.nanosec for tick in self.clock]


def replay(start: Starter, bag: Path, *options: str) -> Started:
    return start("fjr_cli", "replay", str(bag), "--wait-for", "peer", *options)


def table(output: str) -> dict[str, list[str]]:
    """Return the cells of the summary by topic."""
    rows = [line.split() for line in output.splitlines() if line.lstrip().startswith("/")]
    return {row[0]: row[1:] for row in rows}


def test_readers_get_the_whole_bag_as_fast_as_they_take_it(start, peer, tmp_path):
    values = write_bag(tmp_path / "bag", DESCRIBED)
    ears = Ears(peer)
    replayed = replay(start, tmp_path / "bag", "--rate", "max")
    assert ears.hear_out(replayed) == 0, replayed.output
    ears.hear_all(SAMPLES)
    for signal in SIGNALS:
        messages = ears.signals[signal.symbol]
        assert [stamp_ns(message) for message in messages] == DESCRIBED.stamps_ns.tolist()
        heard = [getattr(message, signal.field)[0] for message in messages]
        np.testing.assert_array_equal(heard, values[signal.symbol])
    assert Experiment.from_json(ears.experiment[0].data, "topic") == DESCRIBED
    ticks = ears.ticks
    assert ticks and set(ticks) <= set(DESCRIBED.stamps_ns.tolist()) and ticks == sorted(ticks)
    cells = table(replayed.output)
    assert cells["/rig/motor_torque"] == [str(SAMPLES), "1", "reliable"]
    assert cells["/rig/experiment"] == ["1", "1", "reliable,", "latched"]
    assert cells["/clock"] == [str(SAMPLES), "1", "best", "effort"]
    assert re.search(r"2\.999 s played in \d+\.\d+ s", replayed.output)


def test_chosen_topics_from_an_offset_again_and_again_until_ctrl_c(start, mark, peer, tmp_path):
    write_bag(tmp_path / "bag", DESCRIBED)
    ears = Ears(peer)
    # what is late goes out at once: on a busy machine a higher rate would push out what is unread
    options = ["--topic", "reference", "--start-offset", "2.5", "--rate", "0.9", "--loop"]
    replayed = replay(start, tmp_path / "bag", *options)
    reference = ears.signals["r"]
    peer.spin_until(lambda: len(reference) > 1100, "the third time")
    assert Experiment.from_json(ears.description_for_a_late_comer(), "topic") == DESCRIBED
    profiles = peer.node.get_publishers_info_by_topic("/rig/reference")
    assert [profile.node_name for profile in profiles] == ["replay"]
    assert replayed.interrupt() == 130
    assert "Interrupted: nothing is left of the replay." in replayed.output
    assert marked_processes(mark) == []
    expected = DESCRIBED.stamps_ns[2500:].tolist()
    stamps = [stamp_ns(message) for message in reference]
    assert stamps[:1000] == expected * 2 and stamps[1000:] == (expected * 99)[: len(stamps) - 1000]
    assert not ears.signals["y"] and not ears.signals["u"]
    cells = table(replayed.output)
    assert sorted(cells) == ["/clock", "/rig/experiment", "/rig/reference"]
    played, took = re.search(r"([\d.]+) s played in ([\d.]+) s", replayed.output).groups()
    assert float(took) > float(played) / 0.9 - 0.01


def foreign(folder: Path) -> Path:
    """Write a bag of another recorder: own clock, best effort, a type that is not installed."""
    offered = SIGNAL_QOS._replace(
        history=QosHistory.UNKNOWN, depth=0, reliability=QosReliability.BEST_EFFORT
    )
    whole = rig_streams({symbol: list(range(1, 61)) for symbol in "ryu"})
    streams: dict[str, Stream] = {
        topic: [(10**18 + k * 1000, data) for k, (_, data) in enumerate(items)]
        for topic, items in whole.items()
    }
    kind = "visualization_msgs/msg/ImageMarker"
    streams["/marker"] = [(10**18 + 5, b"\0" * 60)]
    return foreign_bag(
        folder, streams, types={"/marker": kind}, custom=experiment().to_json(), qos=[offered]
    )


def test_a_foreign_bag_keeps_its_qos_and_gets_description_and_clock(start, peer, tmp_path):
    from rclpy.qos import ReliabilityPolicy

    bag = foreign(tmp_path / "bag")
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    torque = peer.listen(JointState, "/rig/motor_torque", runtime.CLOCK_QOS)
    ears = Ears(peer, ())
    replayed = replay(start, bag, "--loop", "--rate", "max")
    description = ears.description_for_a_late_comer()
    assert Experiment.from_json(description, "topic") == experiment()
    (profile,) = peer.node.get_publishers_info_by_topic("/rig/motor_torque")
    assert profile.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    peer.spin_until(lambda: torque and ears.clock, "torque and time")
    assert replayed.interrupt() == 130
    assert {stamp_ns(message) for message in torque} <= {k * MS for k in range(1, 61)}
    assert set(ears.ticks) <= {k * MS for k in range(1, 61)}
    note = "/marker is left out: the type visualization_msgs/msg/ImageMarker is not installed."
    assert (note in replayed.output) != ("/marker" in table(replayed.output))


def test_another_namespace_gets_what_the_bag_has_in_that_of_the_rig(start, peer, tmp_path):
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    write_bag(tmp_path / "bag", experiment())
    ears = Ears(peer)
    torque = peer.listen(JointState, "/cell/motor_torque", runtime.SIGNAL_QOS)
    told = peer.listen(String, "/cell/experiment", runtime.EXPERIMENT_QOS)
    replayed = replay(start, tmp_path / "bag", "--namespace", "/cell")
    assert ears.hear_out(replayed) == 0, replayed.output
    peer.spin_until(lambda: len(torque) == 60, "all torques")
    assert Experiment.from_json(told[0].data, "topic") == experiment()
    assert len(ears.ticks) > 0 and not any(ears.signals.values()) and not ears.experiment


def test_a_reader_that_is_wanted_is_waited_for_by_name(start, peer, tmp_path):
    write_bag(tmp_path / "bag", experiment())
    replayed = start("fjr_cli", "replay", str(tmp_path / "bag"), "--wait-for", "peer")
    replayed.wait_for_text("Waiting for peer to subscribe.")
    ears = Ears(peer)
    assert ears.hear_out(replayed) == 0
    assert [len(heard) for heard in ears.signals.values()] == [60, 60, 60]


def test_a_topic_that_another_node_publishes_is_refused(start, peer, tmp_path):
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    write_bag(tmp_path / "bag", experiment())
    ears = Ears(peer)
    peer.node.create_publisher(JointState, "motor_torque", runtime.SIGNAL_QOS)
    replayed = replay(start, tmp_path / "bag")
    assert ears.hear_out(replayed) == 2
    assert "/rig/peer publishes on /rig/motor_torque too; stop it, choose" in replayed.output
    assert not any(ears.signals.values())
    only = replay(start, tmp_path / "bag", "--topic", "reference")
    assert ears.hear_out(only) == 0, only.output


def test_what_cannot_be_published_is_refused(start, tmp_path, monkeypatch):
    write_bag(tmp_path / "bag", experiment())
    there = "/rig/experiment, /rig/motor_position, /rig/motor_torque, /rig/reference"
    replayed = start("fjr_cli", "replay", str(tmp_path / "bag"), "--topic", "/torque")
    assert replayed.exit_status() == 2
    assert f"holds no topic /torque; there are: {there}." in replayed.output
    beyond = start("fjr_cli", "replay", str(tmp_path / "bag"), "--start-offset", "9", "--loop")
    assert beyond.exit_status() == 2
    assert "--start-offset 9: the bag ends before; give less than 0.059." in beyond.output
    monkeypatch.setenv("ROS_DOMAIN_ID", "abc")
    nowhere = start("fjr_cli", "replay", str(tmp_path / "bag"))
    assert nowhere.exit_status() == 2
    assert "ROS_DOMAIN_ID is 'abc'; it must be a number from 0 to 232." in nowhere.output
    mcap = tmp_path / "bag" / "bag.mcap"
    mcap.write_bytes(mcap.read_bytes()[:-300])
    monkeypatch.delenv("ROS_DOMAIN_ID")
    damaged = start("fjr_cli", "replay", str(tmp_path / "bag"))
    assert damaged.exit_status() == 2
    assert "the file ends early: it was cut off; record it again." in damaged.output


def test_time_is_that_of_the_signal_that_keeps_it_or_of_the_recording(tmp_path):
    from fjr_bringup.replay.messages import Messages

    streams = rig_streams({"r": [1, 2, 3], "y": [2, 3], "u": [2, 3]})
    ahead = {"/rig/reference": [(t - 5 * MS + 10 * MS, d) for t, d in streams["/rig/reference"]]}
    later = {topic: [(t + 20 * MS, d) for t, d in streams[topic]] for topic in list(streams)[1:]}
    bag = foreign_bag(tmp_path / "bag", {**ahead, **later})
    times = [(each.topic.name, each.offset_ns, each.clock_ns) for each in Messages(bag)]
    assert times[:3] == [("/rig/reference", 0, -1)] * 3  # before the first position
    assert times[3:] == [
        ("/rig/motor_position", 0, 2 * MS),
        ("/rig/motor_torque", 0, 2 * MS),
        ("/rig/motor_position", MS, 3 * MS),
        ("/rig/motor_torque", MS, 3 * MS),
    ]
    text = STORE.types["std_msgs/msg/String"]("hello")
    data = bytes(STORE.serialize_cdr(text, "std_msgs/msg/String"))
    said = {"/said": [(7 * MS, data), (9 * MS, data)]}
    plain = foreign_bag(tmp_path / "plain", said, types={"/said": "std_msgs/msg/String"})
    messages = Messages(plain)
    assert [(each.offset_ns, each.clock_ns) for each in messages] == [(0, 7 * MS), (2 * MS, 9 * MS)]
    assert len(list(messages)) == 2  # and once more


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_without_metadata_is_published_with_its_qos(tmp_path, plugin):
    from fjr_bringup.replay.messages import Messages

    streams = rig_streams({symbol: [1, 2, 3] for symbol in "ryu"})
    bag = foreign_bag(tmp_path / "bag", streams, plugin=plugin, qos=[EXPERIMENT_QOS])
    whole = Messages(bag)
    (bag / "metadata.yaml").unlink()
    bare = Messages(bag)
    assert bare.notes[0].startswith("bag: metadata.yaml is missing")
    assert {topic.name: topic.latched for topic in bare.topics} == dict.fromkeys(streams, True)
    assert bare.duration_s == pytest.approx(whole.duration_s, abs=1e-8) == pytest.approx(0.002)
    assert [each.data for each in bare] == [each.data for each in whole]
    assert sorted(each.data for each in bare) == sorted(d for s in streams.values() for _, d in s)


def test_recorded_offers_become_publishers_as_in_rosbag2():
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy

    from fjr_bringup.replay.messages import to_offer

    latched = to_offer([EXPERIMENT_QOS])
    assert latched.durability == DurabilityPolicy.TRANSIENT_LOCAL and latched.depth == 1
    assert to_offer([SIGNAL_QOS]).depth == SIGNAL_QOS.depth
    unknown = SIGNAL_QOS._replace(history=QosHistory.UNKNOWN, depth=0)
    assert (to_offer([unknown]).history, to_offer([unknown]).depth) == (HistoryPolicy.KEEP_LAST, 10)
    quick = SIGNAL_QOS._replace(reliability=QosReliability.BEST_EFFORT, deadline=QosTime(1, 500))
    assert to_offer([quick, quick]).reliability == ReliabilityPolicy.BEST_EFFORT
    assert to_offer([quick]).deadline.nanoseconds == 1_000_000_500
    for mixed in ([], [quick, SIGNAL_QOS]):
        default = to_offer(mixed)
        assert (default.reliability, default.depth) == (ReliabilityPolicy.RELIABLE, 10)
        assert default.durability == DurabilityPolicy.VOLATILE


def test_another_programs_clock_keeps_the_time(start, peer, tmp_path):
    from rosgraph_msgs.msg import Clock

    write_bag(tmp_path / "bag", DESCRIBED)
    clock = peer.node.create_publisher(Clock, "/clock", 10)
    ears = Ears(peer)
    heard = ears.signals["y"]
    replayed = replay(start, tmp_path / "bag", "--follow-clock")
    replayed.wait_for_text("Waiting for /clock, which nobody publishes.")
    assert not heard

    def tick(stamp_ns: int) -> None:
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(stamp_ns, 10**9)
        clock.publish(message)

    begin_ns = 7_000_000_000
    peer.spin_until(lambda: tick(begin_ns) or heard, "the first sample")
    tick(begin_ns + 500 * MS)
    peer.spin_until(lambda: len(heard) >= 501, "what is due by then")
    for _ in range(20):
        peer.spin_until(lambda: True, "a moment")
    assert len(heard) == 501  # the clock stands, and so does the replay
    peer.after_each_look = lambda: tick(begin_ns + 60_000 * MS)
    assert ears.hear_out(replayed) == 0, replayed.output
    peer.spin_until(lambda: len(heard) >= SAMPLES, "what the replay has left to be taken")
    assert [stamp_ns(message) for message in heard] == [k * MS for k in range(1, SAMPLES + 1)]


def test_a_speed_without_bound_has_no_clock_to_follow(run, tmp_path):
    done = run("replay", tmp_path / "bag", "--follow-clock", "--rate", "max")
    assert done.exit_code == 2 and "does not go with --follow-clock" in done.stderr
