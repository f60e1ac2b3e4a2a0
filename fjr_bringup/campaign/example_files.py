"""Files as other rigs have them, from a simulated rig: `fjr example` (bags, MATLAB, CSV, YAML)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

from fjr_interface.bags.joint_state import FIELDS, Layout
from fjr_interface.bags.storage import ChecksummedWriter
from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.topics import JOINT_STATE, Field
from fjr_kit.atomic import new_folder
from fjr_sim_node.simulation.simulator import run_realization

from .plan import GROUPS, Campaign

NM_PER_A = 0.25
"""Torque constant of the example's drive: its logs have the current."""

RIG: dict[str, dict[str, Any]] = {
    "excitation": {
        "amplitudes_rad": (7e-3,),
        "realizations": 3,
        "periods": 3,
        "transient_periods": 2,
        "base_frequency_hz": 1.0,
        "f_min_hz": 1.0,
    },
    "simulator": {"noise_std_rad": 2e-5, "backlash.half_gap_rad": 1e-3, "k0": 1420.0},
}
"""The rig of the examples: backlash of 1 mrad (half the gap), and a softer spring than expected."""

DATASHEET = {
    **{"jm": 0.2, "j": 0.3, "fs": 5.0, "fsm": 6.0, "fv": 4.0, "fvm": 2.0, "k0": 1500.0},
    "k1": 3000.0,
}
CASCADE = """\
kind: p_pi              # P position loop around a PI velocity loop
k_position: 12          # 1/s
k_velocity: 40          # N m s/rad
integral_time_s: 0.4
torque_limit_nm: 20
"""
_BAG_RATE_HZ, _LOG_RATE_HZ = 500.0, 2500.0
_JOINT = "elbow"
_OTHERS = {"/joint_states": ("shoulder",)}
"""Joints that stand before ours in the messages of a topic, and stay at zero."""
_BEGIN_NS = 1_767_225_600_000_000_000
_LATER_NS = {"/robot_joint_commands": 300_000, "/elbow/setpoint": 1_500_000}
"""By how much the stamps of topics with a clock of their own come after those of the states."""


def write_example(folder: Path) -> None:
    """Simulate a small rig and write what other recorders would have kept of it.

    Args:
        folder: a new one. It gets `recorded` (three bags with `/joint_states`, `/command`,
            `/robot_joint_commands` and `/elbow/setpoint`), `log.mat`, `run1.csv`, `run2.csv`,
            `rig.yaml`, `datasheet.yaml` and `cascade.yaml`.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    slow, quick = _campaign(_BAG_RATE_HZ), _campaign(_LOG_RATE_HZ)
    with new_folder(folder) as place:
        for number in range(3):
            run = _signals(slow, number)
            _write_bag(place / "recorded" / f"run_{number + 1}", run)
            if number:
                _write_csv(place / f"run{number}.csv", run)
        log = _signals(quick, 0)
        columns = {"r": log["r"], "iq": log["u"] / NM_PER_A, "theta": np.degrees(log["y"])}
        savemat(place / "log.mat", columns)
        save_parameter_file(place / "rig.yaml", quick.values, GROUPS)
        save_parameter_file(place / "datasheet.yaml", {"simulator": DATASHEET}, GROUPS)
        (place / "cascade.yaml").write_text(CASCADE, encoding="utf-8")


def _campaign(rate_hz: float) -> Campaign:
    rate = {"sample_rate_hz": rate_hz}
    return Campaign.create(None, {node: {**RIG.get(node, {}), **rate} for node in GROUPS})


def _signals(campaign: Campaign, realization: int) -> dict[str, np.ndarray]:
    """Return time in s, reference and position in rad, torque in N m, each (samples,)."""
    experiment = campaign.experiment(0, realization)
    motion = run_realization(campaign.values["simulator"], experiment)
    return {
        "t": experiment.stamps_ns * 1e-9,
        "r": motion.reference,
        "y": motion.position,
        "u": motion.torque,
    }


def _write_csv(file: Path, run: Mapping[str, np.ndarray]) -> None:
    """Write time in ms, angles in degrees and the current in A."""
    degrees = np.degrees(run["r"]), np.degrees(run["y"])
    table = np.column_stack((1e3 * run["t"], degrees[0], run["u"] / NM_PER_A, degrees[1]))
    np.savetxt(file, table, "%.9g", delimiter=",", header="t,cmd,iq,enc", comments="")


def _write_bag(bag: Path, run: Mapping[str, np.ndarray]) -> None:
    """Write the topics of a rig whose joint is one of two, with stamps since the epoch."""
    bag.parent.mkdir(exist_ok=True)
    store = get_typestore(Stores.ROS2_JAZZY)
    r, y, u = run["r"], run["y"], run["u"]
    topics: dict[str, dict[Field, np.ndarray]] = {
        "/joint_states": {"position": y, "effort": u},
        "/command": {"position": r},
        "/robot_joint_commands": {"effort": u},
        "/elbow/setpoint": {"position": r},
    }
    stamps = _BEGIN_NS + np.rint(run["t"] * 1e9).astype(np.int64)
    with ChecksummedWriter(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        channels = {
            topic: writer.add_connection(topic, JOINT_STATE, typestore=store) for topic in topics
        }
        streams = {
            topic: _joint_states(store, topic, stamps + _LATER_NS.get(topic, 0), values)
            for topic, values in topics.items()
        }
        for k, stamp in enumerate(stamps.tolist()):
            for topic, payloads in streams.items():
                later = _LATER_NS.get(topic, 0)
                writer.write(channels[topic], stamp + later, payloads[k].tobytes())


def _joint_states(
    store: Any, topic: str, stamps_ns: np.ndarray, values: Mapping[Field, np.ndarray]
) -> np.ndarray:
    """Return the CDR of a message for each stamp, uint8 (messages, bytes)."""
    types = store.types
    joints = [*_OTHERS.get(topic, ()), _JOINT]
    zeros = {name: np.zeros(len(joints) if name in values else 0) for name in FIELDS}
    stamp = types["builtin_interfaces/msg/Time"](0, 0)
    header = types["std_msgs/msg/Header"](stamp, "")
    message = types[JOINT_STATE](header=header, name=joints, **zeros)
    template = bytes(store.serialize_cdr(message, JOINT_STATE))
    rows = np.tile(np.frombuffer(template, np.uint8), (len(stamps_ns), 1))
    seconds, nanoseconds = np.divmod(stamps_ns, 1_000_000_000)
    rows[:, 4:8] = seconds.astype("<i4").view(np.uint8).reshape(-1, 4)
    rows[:, 8:12] = nanoseconds.astype("<u4").view(np.uint8).reshape(-1, 4)
    layout = Layout.of(template)
    for name, column in values.items():
        at = layout.value_offset(name, _JOINT)
        rows[:, at : at + 8] = column.astype("<f8").view(np.uint8).reshape(-1, 8)
    return rows
