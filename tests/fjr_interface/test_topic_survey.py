"""What a bag's topics are like: losses, stamps, rates, QoS, definitions, as they were put in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bag_tools import MS, STORE, WHOLE, experiment, foreign_bag, rig_streams, stream, write_bag
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer as LibraryWriter

from fjr_interface.bags.topic_survey import TopicSurvey, survey_bag
from fjr_interface.topics import JOINT_STATE, MOTOR_POSITION


def surveyed(folder: Path, stamps_ms, **options) -> TopicSurvey:
    """Return what is found of one topic with these stamps."""
    stamps = [round(each * MS) for each in stamps_ms]
    payloads = [each for _, each in stream(MOTOR_POSITION, stamps, np.zeros(len(stamps)))]
    streams = {"/arm/state": list(enumerate(payloads, MS))}
    (topic,) = survey_bag(foreign_bag(folder / "bag", streams, **options)).topics
    return topic


def test_a_whole_bag_has_no_problem(tmp_path):
    write_bag(tmp_path / "bag", experiment())
    survey = survey_bag(tmp_path / "bag")
    by_name = {topic.name: topic for topic in survey.topics}
    assert set(by_name) == {
        "/rig/experiment",
        "/rig/motor_position",
        "/rig/motor_torque",
        "/rig/reference",
    }
    assert not any(topic.problems for topic in survey.topics)
    position = by_name["/rig/motor_position"]
    assert (position.messages, position.rate_hz, position.lost) == (60, 1000.0, 0)
    assert (position.jitter_s, position.worst_jitter_s) == (0.0, 0.0)
    assert (position.qos, position.definition) == ("reliable, last 2000", "Jazzy")
    latched = by_name["/rig/experiment"]
    assert (latched.qos, latched.rate_hz) == ("reliable, latched, last 1", None)


@pytest.mark.parametrize(
    ("stamps", "lost", "twice", "back", "says"),
    [
        (sorted({*WHOLE} - {30}), 1, 0, 0, "1 message is missing between the others"),
        (sorted({*WHOLE} - {20, 40, 41}), 3, 0, 0, "3 messages are missing between the others"),
        (sorted([*WHOLE, 17]), 0, 1, 0, "1 stamp is there twice"),
        ([*WHOLE[:30], 5, *WHOLE[30:]], 0, 0, 1, "1 stamp is earlier than the one before"),
    ],
)
def test_what_is_wrong_is_counted(tmp_path, stamps, lost, twice, back, says):
    topic = surveyed(tmp_path, stamps)
    assert (topic.lost, topic.duplicates, topic.backward) == (lost, twice, back)
    assert topic.messages == len(stamps) and says in topic.problems


@given(
    dropped=st.sets(st.integers(2, 199), max_size=15),
    jitter=st.lists(st.floats(-0.2, 0.2), min_size=200, max_size=200),
)
def test_losses_are_counted_whatever_the_jitter(tmp_path_factory, dropped, jitter):
    kept = [k + shift for k, shift in enumerate(jitter, 1) if k not in dropped]
    topic = surveyed(tmp_path_factory.mktemp("jittered"), kept)
    steps = np.diff([round(each * MS) for each in kept])
    assert topic.rate_hz == pytest.approx(1e9 / np.median(steps))
    assert topic.backward == topic.duplicates == 0
    whole = 200 - len(dropped)
    assert topic.messages == whole
    if topic.lost is not None and topic.rate_hz == pytest.approx(1000.0, rel=0.1):
        assert abs(topic.lost - len(dropped)) <= 3  # a gap of 2.5 steps may be either


def test_jitter_is_the_rms_of_the_steps(tmp_path):
    stamps = np.arange(1, 401) + np.where(np.arange(400) % 2, 0.1, -0.1)
    topic = surveyed(tmp_path, stamps)
    steps = np.diff(np.rint(stamps * MS))
    deviations = np.abs(steps - np.median(steps))
    assert topic.jitter_s == pytest.approx(np.sqrt(np.mean(deviations**2)) * 1e-9)
    assert topic.worst_jitter_s == pytest.approx(deviations.max() * 1e-9)


def test_a_topic_without_rhythm_has_no_losses(tmp_path):
    topic = surveyed(tmp_path, np.cumsum(np.random.default_rng(0).exponential(20.0, 300)) + 1)
    assert not topic.regular and topic.lost is None and topic.problems == ()


def test_messages_without_a_stamp_go_by_the_times_of_recording(tmp_path):
    kind = "std_msgs/msg/Float64"
    payload = bytes(STORE.serialize_cdr(STORE.types[kind](1.5), kind))
    streams = {
        **rig_streams(dict.fromkeys("ryu", WHOLE)),
        "/load": [(k * 10 * MS, payload) for k in WHOLE if k != 30],
    }
    survey = survey_bag(foreign_bag(tmp_path / "bag", streams, types={"/load": kind}))
    load = next(topic for topic in survey.topics if topic.name == "/load")
    assert (load.stamped, load.rate_hz, load.lost) == (False, 100.0, None)
    assert not load.problems  # a busy machine makes such gaps too


def test_more_blocks_than_the_first_go_on_where_it_ended(tmp_path):
    stamps = [k for k in range(1, 9001) if k != 8500]
    topic = surveyed(tmp_path, stamps)
    assert (topic.messages, topic.lost) == (8999, 1)


def library_bag(file: Path, definition: str, kind: str = JOINT_STATE) -> Path:
    """Write an MCAP file whose schema holds any text."""
    with file.open("wb") as out:
        writer = LibraryWriter(out)
        writer.start("ros2", "test")
        schema = writer.register_schema(kind, "ros2msg", definition.encode())
        channel = writer.register_channel("/arm/state", "cdr", schema)
        for stamp, payload in stream(MOTOR_POSITION, [k * MS for k in WHOLE], np.zeros(60)):
            writer.add_message(channel, stamp, payload, stamp)
        writer.finish()
    return file


@pytest.mark.parametrize(
    ("definition", "kind", "stands", "says"),
    [
        ("float64[] position\n", JOINT_STATE, "differs", "differs from Jazzy's"),
        ("float64 value\n", "my_rig/msg/Load", "bag", None),
        ("no message[ at all\n", "my_rig/msg/Load", "unusable", "cannot be understood"),
        ("", JOINT_STATE, "Jazzy", None),
    ],
)
def test_definitions_are_compared_with_those_of_jazzy(tmp_path, definition, kind, stands, says):
    (topic,) = survey_bag(library_bag(tmp_path / "bag.mcap", definition, kind)).topics
    assert topic.definition == stands
    assert (says is None) == (topic.problems == ())
    assert says is None or says in topic.problems[0]
