from __future__ import annotations

import struct
import subprocess
import sys

import numpy as np
import pytest
from bag_tools import STORE, serialize
from hypothesis import given
from hypothesis import strategies as st

from fjr_interface.bags.joint_state import (
    FIELDS,
    JointStateReader,
    JointStateWriter,
    Layout,
    LayoutError,
)
from fjr_interface.topics import JOINT_STATE, MOTOR_TORQUE, SIGNALS

stamps = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)
doubles = st.floats(width=64)
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=12)
arrays = st.lists(doubles, max_size=4)


def same_bits(first: float, second: float) -> bool:
    return struct.pack("<d", first) == struct.pack("<d", second)


def as_block(*payloads: bytes) -> np.ndarray:
    return np.frombuffer(b"".join(payloads), np.uint8).reshape(len(payloads), -1)


@given(stamps, doubles, texts, st.sampled_from(FIELDS))
def test_writer_makes_the_bytes_of_rosbags(stamp, value, joint, field):
    expected = serialize(stamp, "", [joint], **{field: [value]})
    payload = JointStateWriter(field, joint).encode(stamp, value)
    assert payload == expected[: len(payload)]
    assert not any(expected[len(payload) :])


@given(stamps, doubles, texts, st.sampled_from(FIELDS))
def test_rosbags_reads_what_the_writer_makes(stamp, value, joint, field):
    payload = JointStateWriter(field, joint).encode(stamp, value)
    message = STORE.deserialize_cdr(payload, JOINT_STATE)
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
    assert message.name == [joint]
    assert [len(getattr(message, name)) for name in FIELDS] == [name == field for name in FIELDS]
    assert same_bits(getattr(message, field)[0], value)


@given(st.lists(st.tuples(stamps, doubles), max_size=8), st.sampled_from(SIGNALS))
def test_many_equals_one_by_one(samples, signal):
    writer = JointStateWriter(signal.field, "joint")
    times = np.array([stamp for stamp, _ in samples], np.int64)
    values = np.array([value for _, value in samples], np.float64)
    rows = writer.encode_many(times, values)
    assert [row.tobytes() for row in rows] == [writer.encode(t, v) for t, v in samples]


@given(stamps, texts, st.lists(texts, max_size=4), arrays, arrays, arrays)
def test_layout_finds_every_value_of_any_joint_state(stamp, frame, names, pos, vel, eff):
    fields = {"position": pos, "velocity": vel, "effort": eff}
    payload = serialize(stamp, frame, names, **fields)
    layout = Layout.of(payload)
    assert layout.names == tuple(names)
    assert layout.size <= len(payload) < layout.size + 8
    for field, values in fields.items():
        assert layout.counts[field] == len(values)
        for index, name in enumerate(names[: len(values)]):
            expected = values[names.index(name)]
            times, found = layout.decode(as_block(payload, payload), field, name)
            assert times.tolist() == [stamp, stamp]
            assert same_bits(found[1], expected)
            assert JointStateReader(field, name).decode(payload)[0] == stamp
            assert index < len(values)
        if not values:
            with pytest.raises(LayoutError, match="is empty"):
                layout.decode(as_block(payload), field)


@given(st.lists(st.tuples(stamps, doubles, st.integers(1, 3), st.booleans()), max_size=8))
def test_reader_follows_layouts_that_change(samples):
    reader = JointStateReader("effort", "b")
    for stamp, value, others, long_names in samples:
        names = ["aaaaa" if long_names else "a"] * others + ["b"]
        payload = serialize(stamp, "f" * others, names, effort=[0.5] * others + [value])
        time, found = reader.decode(payload)
        assert time == stamp
        assert same_bits(found, value)


@given(st.binary(max_size=120))
def test_any_bytes_are_a_layout_or_refused(payload):
    try:
        layout = Layout.of(payload)
    except LayoutError:
        return
    assert layout.size <= len(payload)
    message = STORE.deserialize_cdr(payload[: layout.size], JOINT_STATE)
    assert tuple(message.name) == layout.names


@given(arrays, arrays, st.data())
def test_every_cut_is_refused(pos, eff, data):
    payload = serialize(1, "frame", ["a", "b"], position=pos, effort=eff)
    cut = data.draw(st.integers(0, Layout.of(payload).size - 1))
    with pytest.raises(LayoutError):
        Layout.of(payload[:cut])
    with pytest.raises(LayoutError):
        JointStateReader("position").decode(payload[:cut])


def test_a_block_with_another_layout_is_refused():
    one = serialize(1, "x", ["a"], position=[1.0])
    other = serialize(1, "x", ["b"], position=[1.0])
    assert len(one) == len(other)
    with pytest.raises(LayoutError, match="differently"):
        Layout.of(one).decode(as_block(one, other), "position")


def test_rubbish_in_the_padding_does_not_matter():
    clean = serialize(5, "x", ["a"], effort=[2.5])
    layout = Layout.of(clean)
    dirty = bytearray(clean)
    for start, end in layout.padding:
        dirty[start:end] = b"\xaa" * (end - start)
    assert bytes(dirty) != clean
    times, values = layout.decode(as_block(clean, bytes(dirty)), "effort")
    assert (times.tolist(), values.tolist()) == ([5, 5], [2.5, 2.5])
    assert JointStateReader("effort").decode(bytes(dirty)) == (5, 2.5)


def test_an_unknown_joint_is_refused():
    payload = serialize(1, "", ["a"], position=[1.0])
    with pytest.raises(LayoutError, match="joint 'z' is not among a"):
        Layout.of(payload).decode(as_block(payload), "position", "z")


ROS = """
import sys
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, Layout
payload = JointStateWriter("effort", "joint").encode(1_234_567_890, -0.1)
message = deserialize_message(payload, JointState)
assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 234_567_890)
assert (list(message.name), list(message.effort)) == (["joint"], [-0.1])
assert not message.position and not message.velocity
again = bytearray(serialize_message(message))[: len(payload)]
for start, end in Layout.of(payload).padding:
    again[start:end] = bytes(end - start)  # Fast CDR leaves rubbish there
assert again == payload, (again, payload)
message.header.frame_id = "base"
message.name, message.position = ["a", "joint"], [1.0, 2.0]
assert JointStateReader("position", "joint").decode(serialize_message(message))[1] == 2.0
assert JointStateReader("effort").decode(serialize_message(message))[1] == -0.1
"""


def test_rclpy_agrees():
    found = [sys.executable, "-c", "import rclpy, sensor_msgs.msg"]
    if subprocess.run(found, capture_output=True, check=False).returncode:
        pytest.skip("rclpy is not installed")
    run = subprocess.run([sys.executable, "-c", ROS], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert MOTOR_TORQUE.field == "effort"
