"""Our bags by the rules of rosbag2 and with readers that are not ours: `ros2 bag play` takes them.

The rules are those of rosbag2's C++ for metadata version 9 (rosbag2_storage: yaml.hpp, qos.cpp;
rosbag2_storage_mcap: mcap_storage.cpp): what its YAML conversion asks for, type by type, and where
its storage looks for QoS, definitions and its own copy of the metadata.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from bag_tools import experiment, write_bag
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from fjr_interface.topics import LINK_POSITION, SIGNALS

UNSIGNED = range(2**64)
INFINITE = {"sec": 9223372036, "nsec": 854775807}  # RMW_DURATION_INFINITE
POLICIES = {
    "history": {"keep_last", "keep_all", "system_default", "unknown"},
    "reliability": {"reliable", "best_effort", "system_default", "unknown", "best_available"},
    "durability": {"transient_local", "volatile", "system_default", "unknown", "best_available"},
    "liveliness": {"automatic", "manual_by_topic", "system_default", "unknown", "best_available"},
}
JS = Path(__file__).parent / "mcap_js"


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rules") / "bag"
    write_bag(folder, experiment(samples_per_period=4000), signals=(*SIGNALS, LINK_POSITION))
    return folder


@pytest.fixture(scope="module")
def information(bag) -> dict[str, Any]:
    return yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def is_unsigned(value: Any) -> bool:
    return type(value) is int and value in UNSIGNED


def assert_qos(profile: dict[str, Any]) -> None:
    for policy, words in POLICIES.items():
        assert profile[policy] in words
    assert is_unsigned(profile["depth"])
    assert type(profile["avoid_ros_namespace_conventions"]) is bool
    for duration in ("deadline", "lifespan", "liveliness_lease_duration"):
        assert profile[duration] == INFINITE
    assert len(profile) == len(POLICIES) + 5


def test_metadata_has_every_field_in_its_type(information):
    assert information["version"] == 9 and information["storage_identifier"] == "mcap"
    assert list(information["duration"]) == ["nanoseconds"]
    assert is_unsigned(information["duration"]["nanoseconds"])
    assert list(information["starting_time"]) == ["nanoseconds_since_epoch"]
    assert is_unsigned(information["starting_time"]["nanoseconds_since_epoch"])
    assert is_unsigned(information["message_count"])
    for name in ("compression_format", "compression_mode", "ros_distro"):
        assert isinstance(information[name], str)
    data = information["custom_data"]
    assert all(isinstance(key, str) and isinstance(data[key], str) for key in data)
    for entry in information["topics_with_message_count"]:
        assert is_unsigned(entry["message_count"])
        topic = entry["topic_metadata"]
        assert re.fullmatch(r"(/[a-z_]+)+", topic["name"])
        assert re.fullmatch(r"\w+/msg/\w+", topic["type"])
        assert topic["serialization_format"] == "cdr"
        assert re.fullmatch(r"RIHS01_[0-9a-f]{64}", topic["type_description_hash"])
        assert len(topic["offered_qos_profiles"]) == 1
        for profile in topic["offered_qos_profiles"]:
            assert_qos(profile)


def test_metadata_names_the_files_and_their_messages(bag, information):
    assert information["relative_file_paths"] == [f["path"] for f in information["files"]]
    assert all((bag / path).is_file() for path in information["relative_file_paths"])
    topics = information["topics_with_message_count"]
    total = information["message_count"]
    assert total == sum(topic["message_count"] for topic in topics)
    assert total == sum(file["message_count"] for file in information["files"])
    (file,) = information["files"]
    assert file["starting_time"] == information["starting_time"]
    assert file["duration"] == information["duration"]


def test_the_storage_is_not_said_to_be_compressed(information):
    """Else rosbag2 looks for a decompressor of files or messages; the chunks are its own matter."""
    assert information["compression_format"] == information["compression_mode"] == ""


def test_mcap_finds_everything_by_the_index(bag, information):
    with (bag / "bag.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        messages = [
            (channel.topic, message.log_time, message.publish_time)
            for _, channel, message in reader.iter_messages()
        ]
        torques = list(reader.iter_messages("/rig/motor_torque"))
        (record,) = list(reader.iter_metadata())
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 1
    assert all(set(chunk.message_index_offsets) for chunk in summary.chunk_indexes)
    assert summary.statistics.message_count == len(messages) == information["message_count"]
    assert [time for _, time, _ in messages] == sorted(time for _, _, time in messages)
    assert len(torques) == experiment(samples_per_period=4000).samples
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    assert record.name == "rosbag2"
    assert yaml.safe_load(record.metadata["serialized_metadata"]) == information
    for channel in summary.channels.values():
        assert channel.message_encoding == "cdr"
        (mine,) = (
            each["topic_metadata"]
            for each in information["topics_with_message_count"]
            if each["topic_metadata"]["name"] == channel.topic
        )
        assert (
            yaml.safe_load(channel.metadata["offered_qos_profiles"])
            == (mine["offered_qos_profiles"])
        )
        assert summary.schemas[channel.schema_id].name == mine["type"]


@pytest.fixture(scope="module")
def javascript() -> Path:
    """Return a folder with `@mcap/core`, installed from its lock into the user's cache, once."""
    if not shutil.which("node") or not shutil.which("npm"):
        pytest.skip("node and npm are not installed")
    digest = hashlib.sha256(
        b"".join((JS / name).read_bytes() for name in ("package-lock.json", "read.mjs"))
    ).hexdigest()[:16]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fjr-rig"
    folder = cache / f"mcap_js-{digest}"
    if not folder.is_dir():
        fresh = cache / f"mcap_js-{os.getpid()}"
        shutil.copytree(JS, fresh, ignore=shutil.ignore_patterns("node_modules"))
        command = [
            "npm",
            "ci",
            "--fetch-retries=0",
            "--ignore-scripts",
            "--no-audit",
            "--no-fund",
            "--silent",
        ]
        done = subprocess.run(command, cwd=fresh, capture_output=True, text=True, check=False)
        if done.returncode:
            shutil.rmtree(fresh)
            pytest.skip(f"npm cannot install @mcap/core: {(done.stdout + done.stderr)[-200:]}")
        with contextlib.suppress(OSError):  # another job was quicker
            fresh.rename(folder)
        shutil.rmtree(fresh, ignore_errors=True)
    return folder


def test_mcap_core_of_npm_reads_the_same(bag, information, javascript):
    command = ["node", "read.mjs", str(bag / "bag.mcap")]
    done = subprocess.run(command, cwd=javascript, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["profile"] == "ros2" and said["chunkCount"] > 1
    total = information["message_count"]
    assert int(said["messageCount"]) == said["streamed"] == total
    digests: dict[str, Any] = {}
    times: dict[str, list[int]] = {}
    with Reader(bag) as reader:
        for connection, time, data in reader.messages():
            digests.setdefault(connection.topic, hashlib.sha256()).update(data)
            times.setdefault(connection.topic, []).append(time)
    assert said["topics"] == {
        topic: {
            "messages": len(times[topic]),
            "first": str(times[topic][0]),
            "last": str(times[topic][-1]),
            "sha256": digest.hexdigest(),
        }
        for topic, digest in digests.items()
    }
    (metadata,) = said["metadata"]
    assert metadata["name"] == "rosbag2"
    assert yaml.safe_load(metadata["entries"]["serialized_metadata"]) == information
    for channel in said["channels"]:
        assert channel["encoding"] == "cdr" and channel["schemaEncoding"] == "ros2msg"
        assert_qos(*yaml.safe_load(channel["metadata"]["offered_qos_profiles"]))
