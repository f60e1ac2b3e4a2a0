"""A bag of ROS 1: every command names the way to ROS 2, and that way works."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.signals import SignalMap
from fjr_kit.errors import InputError
from fjr_records.records import read_records

SAMPLES, RATE_HZ = 2000, 500
TIME = np.arange(SAMPLES) / RATE_HZ
POSITION, EFFORT = np.sin(7.0 * TIME), np.cos(5.0 * TIME)


@pytest.fixture
def old_bag(tmp_path) -> Path:
    types = get_typestore(Stores.ROS1_NOETIC)
    state, header = types.types["sensor_msgs/msg/JointState"], types.types["std_msgs/msg/Header"]
    stamp = types.types["builtin_interfaces/msg/Time"]
    with Writer(tmp_path / "old run.bag") as bag:
        topic = bag.add_connection("/joint_states", state.__msgtype__, typestore=types)
        for k in range(SAMPLES):
            ns = 1_500_000_000 * 10**9 + k * 10**9 // RATE_HZ
            at = header(k, stamp(ns // 10**9, ns % 10**9), "")
            values = np.array([POSITION[k]]), np.zeros(1), np.array([EFFORT[k]])
            message = state(at, ["knee"], *values)
            bag.write(topic, ns, types.serialize_ros1(message, state.__msgtype__))
    return tmp_path / "old run.bag"


def test_the_way_that_the_sentence_names_leads_to_the_signals(old_bag, tmp_path):
    with pytest.raises(InputError, match="is a bag of ROS 1") as refused:
        find_bags(old_bag)
    with pytest.raises(InputError, match=re.escape(str(refused.value))):
        find_bags(tmp_path)
    command = re.search(r"(rosbags-convert .*) FOLDER", str(refused.value))
    assert command is not None
    program, *words = shlex.split(command[1])
    new = tmp_path / "new"
    subprocess.run([Path(sys.executable).with_name(program), *words, new], check=True)
    sources = {"position": "position[knee]", "torque": "effort[knee]"}
    specs = [f"{signal}=/joint_states:{field}" for signal, field in sources.items()]
    signals = SignalMap.parse([*specs, "reference=none"])
    (record,) = read_records(new, signals).records
    np.testing.assert_array_equal(record.position, POSITION)
    np.testing.assert_array_equal(record.torque, EFFORT)
