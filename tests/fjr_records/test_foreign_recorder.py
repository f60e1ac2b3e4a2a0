"""Bags as `ros2 bag record -a` leaves them beside a running rig: read, or refused by a sentence.

Such a recorder stamps with its own clock, keeps what the publishers offered (the history unknown),
records whatever else is published, gets /clock best effort with ticks missing, starts late, stops
early, and may lose samples where its queue of ten overflows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bag_tools import MS, STORE, Stream, experiment, foreign_bag, refusal, signals, stream
from rosbags.interfaces import QosHistory, QosReliability

from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.bags.writer import SIGNAL_QOS
from fjr_interface.topics import SIGNALS

WALL_NS = 1_790_000_000_123_456_789
QUEUE_OF_TEN = SIGNAL_QOS._replace(
    history=QosHistory.UNKNOWN, depth=0, reliability=QosReliability.BEST_EFFORT
)
DESCRIBED = experiment()
SAMPLES = DESCRIBED.samples
EXTRA = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/rig/recorded": "builtin_interfaces/msg/Time",
    "/rig/controller": "std_msgs/msg/String",
}


def serialized(kind: str, *values) -> bytes:
    return bytes(STORE.serialize_cdr(STORE.types[kind](*values), kind))


def extra_streams(samples: list[int]) -> dict[str, Stream]:
    """Return what else is published, with most ticks of the clock lost."""
    time = STORE.types["builtin_interfaces/msg/Time"]
    ticks = [(k, divmod(k * MS, 10**9)) for k in samples[::7]]
    clock = [(WALL_NS + k, serialized(EXTRA["/clock"], time(*t))) for k, t in ticks]
    recorded = [(WALL_NS + k, serialized(EXTRA["/rig/recorded"], *t)) for k, t in ticks[::2]]
    controller = [(WALL_NS, serialized(EXTRA["/rig/controller"], '{"kind": "pd_filtered"}'))]
    return {"/clock": clock, "/rig/recorded": recorded, "/rig/controller": controller}


def recorded_beside_the_rig(
    folder: Path, heard: dict[str, list[int]], descriptions: tuple[str, ...]
) -> Path:
    """Write such a bag: the samples (from 1) that were heard of each signal, by its symbol.

    The reference comes ahead of time, torque after position, all on the recorder's own clock.
    """
    values = signals(DESCRIBED)
    streams: dict[str, Stream] = {}
    for number, signal in enumerate(SIGNALS):
        samples = np.array(heard[signal.symbol])
        pairs = stream(signal, samples * MS, values[signal.symbol][samples - 1])
        ahead = 20 * 50_000 if signal.symbol == "r" else 0
        streams[signal.absolute_topic] = [
            (WALL_NS + 1000 + int(k) * 50_000 - ahead + number, data)
            for k, (_, data) in zip(samples, pairs, strict=True)
        ]
    latched = [(WALL_NS, serialized("std_msgs/msg/String", text)) for text in descriptions]
    streams = {**extra_streams(heard["y"]), "/rig/experiment": latched, **streams}
    kinds = {**EXTRA, "/rig/experiment": "std_msgs/msg/String"}
    return foreign_bag(folder, streams, types=kinds, qos=[QUEUE_OF_TEN])


def heard(**changes: list[int]) -> dict[str, list[int]]:
    return {**{symbol: list(range(1, SAMPLES + 1)) for symbol in "ryu"}, **changes}


JSON = DESCRIBED.to_json()


@pytest.mark.parametrize("times", [1, 3], ids=["described once", "described again"])
def test_a_recorder_that_heard_everything_gives_a_whole_bag(tmp_path, times):
    bag = recorded_beside_the_rig(tmp_path / "bag", heard(), (JSON,) * times)
    values = signals(DESCRIBED)
    record = read_record(bag)
    assert BagReader(bag).experiment == DESCRIBED
    assert record.stamps_ns.tolist() == DESCRIBED.stamps_ns.tolist()
    for symbol, column in zip(
        "ryu", (record.reference, record.position, record.torque), strict=True
    ):
        np.testing.assert_array_equal(column, values[symbol])


LATE = list(range(14, SAMPLES + 1))
LOST = [k for k in range(1, SAMPLES + 1) if k not in (30, 31, 32)]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"y": LATE, "u": LATE},
            "BAG: /rig/motor_position: sample 1 at 0.001 s is missing and so are the 12 after it; "
            "record it again.",
        ),
        (
            {"u": LOST},
            "BAG: /rig/motor_torque: sample 30 at 0.03 s is missing and so are the 2 after it; "
            "record it again.",
        ),
        (
            dict.fromkeys("ryu", LATE[:-5]),
            "BAG: /rig/reference: sample 1 at 0.001 s is missing and so are the 12 after it; "
            "record it again.",
        ),
        (
            {"y": list(range(1, SAMPLES + 1)), "u": list(range(1, 20))},
            "BAG: /rig/motor_torque: sample 20 at 0.02 s and all later ones of the 60 are missing; "
            "record it again.",
        ),
    ],
    ids=["started late", "queue overflowed", "late and early", "stopped early"],
)
def test_what_a_recorder_missed_is_named(tmp_path, changes, sentence):
    bag = recorded_beside_the_rig(tmp_path / "bag", heard(**changes), (JSON,))
    assert refusal(bag) == sentence


def test_a_late_recorder_without_the_description_is_not_taken_for_whole(tmp_path):
    """The reference was ahead when the recorder came, so its first samples are later ones."""
    changes = {"r": LATE[10:], "y": LATE, "u": LATE}
    bag = recorded_beside_the_rig(tmp_path / "bag", heard(**changes), ())
    assert refusal(bag) == (
        "BAG: sample 1 of /rig/motor_position is at 0.014 s but of /rig/reference at 0.024 s; "
        "record them with the same stamps, or use --resample auto."
    )


def test_a_recorder_that_heard_two_experiments_is_refused(tmp_path):
    other = experiment(realization=0, phase_seed=8).to_json()
    bag = recorded_beside_the_rig(tmp_path / "bag", heard(), (JSON, other))
    assert "two different experiment descriptions are in the bag" in refusal(bag)
