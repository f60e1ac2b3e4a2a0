from __future__ import annotations

import numpy as np
import pytest
from bag_tools import (
    MS,
    STORE,
    WHOLE,
    foreign_bag,
    refusal,
    rig_streams,
    serialize,
    stream,
)

from fjr_interface.bags.audit import regular_rate_hz
from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.bags.signals import SignalMap, SignalSource
from fjr_interface.topics import SIGNALS
from fjr_kit.errors import InputError


def joint_states(stamps, frames=("",), names=("elbow", "shoulder")) -> list[tuple[int, bytes]]:
    return [
        (
            int(stamp),
            serialize(
                int(stamp),
                frames[i % len(frames)],
                list(names),
                position=[-1.0, i / 8],
                velocity=[0.0, 0.0],
                effort=[7.0, -float(i)],
            ),
        )
        for i, stamp in enumerate(stamps)
    ]


FOREIGN = SignalMap.parse(
    [
        "position=/joint_states:position[shoulder]",
        "torque=/joint_states:effort[shoulder]",
        "reference=none",
    ]
)


@pytest.mark.parametrize("frames", [("",), ("a", "bcdef", "gh")], ids=["fixed", "varying"])
def test_joint_states_of_a_named_joint(tmp_path, frames):
    stamps = 1_700_000_000_000_000_000 + np.arange(50) * 2 * MS
    streams = {"/joint_states": joint_states(stamps, frames)}
    reader = BagReader(foreign_bag(tmp_path / "bag", streams), FOREIGN)
    (record,) = reader.blocks(100)
    assert reader.experiment is None and reader.sample_rate_hz == 500.0
    assert record.stamps_ns.tolist() == stamps.tolist()
    assert record.position.tolist() == [i / 8 for i in range(50)]
    assert record.torque.tolist() == [-float(i) for i in range(50)]
    assert record.reference is None and record.link is None


@pytest.mark.parametrize("factor", [12.0, -0.5, 1.7453292519943295e-2])
def test_a_factor_leads_to_si_as_from_a_current_or_from_degrees(tmp_path, factor):
    stamps = np.arange(1, 51) * 2 * MS
    bag = foreign_bag(tmp_path / "bag", {"/joint_states": joint_states(stamps)})
    maps = ["position=/joint_states:position[shoulder]", "reference=none"]
    mapped = SignalMap.parse([*maps, f"torque=/joint_states:effort[shoulder]:{factor!r}"])
    (record,) = BagReader(bag, mapped).blocks(100)
    assert record.torque.tolist() == [factor * -float(i) for i in range(50)]
    assert record.position.tolist() == [i / 8 for i in range(50)]


@pytest.mark.parametrize("factor", ["0", "nan", "1e999", "1e-300", "-", "1.2.3"])
def test_a_factor_that_leads_nowhere_is_refused(factor):
    with pytest.raises(InputError, match=r"factor to SI|not understood"):
        SignalMap.parse([f"torque=/joint_states:effort[elbow]:{factor}"])


def test_other_message_types_by_dotted_field(tmp_path):
    kind = "geometry_msgs/msg/WrenchStamped"
    types = STORE.types
    wrenches = []
    for k in range(1, 21):
        vectors = [types["geometry_msgs/msg/Vector3"](0.0, 0.0, z) for z in (0.0, k / 4)]
        stamp = types["builtin_interfaces/msg/Time"](0, k * MS)
        header = types["std_msgs/msg/Header"](stamp, "tool")
        message = types[kind](header, types["geometry_msgs/msg/Wrench"](*vectors))
        wrenches.append((k * MS, bytes(STORE.serialize_cdr(message, kind))))
    stamps = np.arange(1, 21) * MS
    streams = {"/joint_states": joint_states(stamps), "/wrench": wrenches}
    folder = foreign_bag(tmp_path / "bag", streams, types={"/wrench": kind})
    chosen = SignalMap.parse(
        [
            "position=/joint_states:position[1]",
            "torque=/wrench:wrench.torque.z",
            "reference=/joint_states:velocity",
        ]
    )
    record = read_record(folder, chosen)
    assert record.torque.tolist() == [k / 4 for k in range(1, 21)]
    assert record.position.tolist() == [k / 8 for k in range(20)]
    assert record.reference.tolist() == [0.0] * 20
    for field, said in (("wrench.mass", "no field 'wrench.mass'"), ("wrench", "not a number")):
        wrong = SignalMap.parse([*MAPPED[:2], f"torque=/wrench:{field}"])
        assert said in refusal(folder, wrong)


MAPPED = ("position=/joint_states:position[shoulder]", "reference=none")


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("torque=/joint_states:effort[wrist]", "joint 'wrist' is not among elbow, shoulder"),
        ("torque=/joint_states:effort[5]", "effort[5] is empty"),
        ("torque=/wrench:effort", "the topic /wrench is missing (there are: /joint_states)"),
    ],
)
def test_a_wrong_map_is_refused(tmp_path, spec, said):
    folder = foreign_bag(tmp_path / "bag", {"/joint_states": joint_states(np.arange(1, 9) * MS)})
    assert said in refusal(folder, SignalMap.parse([*MAPPED, spec]))


def test_a_stamp_is_needed(tmp_path):
    message = STORE.types["std_msgs/msg/Float64"](1.0)
    data = bytes(STORE.serialize_cdr(message, "std_msgs/msg/Float64"))
    streams = {"/joint_states": joint_states([MS, 2 * MS]), "/u": [(MS, data), (2 * MS, data)]}
    folder = foreign_bag(tmp_path / "bag", streams, types={"/u": "std_msgs/msg/Float64"})
    assert "no header stamp" in refusal(folder, SignalMap.parse([*MAPPED, "torque=/u:data"]))


def test_maps_are_parsed():
    chosen = SignalMap.parse(["torque=/a/b:effort[left_arm.j1]", "link=none"])
    assert chosen.torque == SignalSource("/a/b", "effort", "left_arm.j1")
    assert chosen.link is None and chosen.position == SignalMap().position
    assert SignalMap.parse(["torque=/a"]).torque.field == "effort"
    for wrong in ("torque", "speed=/a:position", "torque=", "torque=none x", "position=/a:[j]"):
        with pytest.raises(InputError, match="is not understood"):
            SignalMap.parse([wrong])


def test_any_namespace_is_found_but_not_guessed(tmp_path):
    def renamed(*namespaces: str) -> dict:
        return {
            f"/{space}{topic.removeprefix('/rig')}": items
            for space in namespaces
            for topic, items in rig_streams(dict.fromkeys("ryu", WHOLE)).items()
        }

    assert read_record(foreign_bag(tmp_path / "one", renamed("left"))).torque.tolist() == WHOLE
    preferred = foreign_bag(tmp_path / "rig", renamed("left", "rig"))
    assert BagReader(preferred).topics["torque"] == "/rig/motor_torque"
    several = foreign_bag(tmp_path / "two", renamed("left", "right"))
    assert "several topics end in /reference (/left/reference, /right/" in refusal(several)


@pytest.mark.parametrize("rate", [1000.0, 3000.0, 1e9 / 2048, 250.5])
def test_the_rate_is_found_from_the_stamps(rate):
    stamps = 12345 + np.rint(np.arange(2000) * 1e9 / rate).astype(np.int64)
    assert regular_rate_hz(stamps) == pytest.approx(rate, rel=2e-9)
    if rate == round(rate):
        assert regular_rate_hz(stamps) == rate


def test_irregular_stamps_without_description_are_refused(tmp_path):
    stamps = np.arange(1, 100) * MS
    jitter = np.random.default_rng(1).integers(-4000, 4000, 99)
    fine = foreign_bag(tmp_path / "fine", {"/joint_states": joint_states(stamps + jitter)})
    assert len(read_record(fine, FOREIGN).torque) == 99
    rough = foreign_bag(tmp_path / "rough", {"/joint_states": joint_states(stamps + 20 * jitter)})
    assert "is off the regular grid: it should be at" in refusal(rough, FOREIGN)
    gap = foreign_bag(
        tmp_path / "gap", {"/joint_states": joint_states(np.delete(stamps, [20, 21]))}
    )
    assert refusal(gap, FOREIGN) == (
        "BAG: /joint_states: sample 21 at 0.021 s is missing and so are the 1 after it; record it "
        "again."
    )


def test_different_stamps_without_description_are_refused(tmp_path):
    timelines = {"r": WHOLE, "y": WHOLE, "u": WHOLE}
    streams = rig_streams(timelines)
    late = [stamp * MS + 5 for stamp in WHOLE]
    streams["/rig/motor_torque"] = stream(SIGNALS[2], late, WHOLE)
    assert "sample 1 of /rig/motor_position is at 0.001 s but of /rig/motor_torque at" in refusal(
        foreign_bag(tmp_path / "late", streams)
    )
    short = rig_streams({**timelines, "u": WHOLE[:-1]})
    assert "/rig/motor_torque: sample 60 and later ones are missing where other" in refusal(
        foreign_bag(tmp_path / "short", short)
    )


@pytest.mark.parametrize("stamps", [[1], [5, 5, 5]])
def test_too_little_to_find_a_rate(tmp_path, stamps):
    folder = foreign_bag(tmp_path / "bag", rig_streams(dict.fromkeys("ryu", stamps)))
    assert "fewer than two samples" in refusal(folder) or "do not rise" in refusal(folder)
