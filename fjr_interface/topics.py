"""Names, types and time stamps of the rig's topics (no ROS import)."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fjr_kit.errors import InputError, shown

NAMESPACE = "/rig"
"""Where the rig is in bags and parameter files, and by default on the graph."""

JOINT = "joint"
JOINT_STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"

NODES = {
    "simulator": "fjr_sim_node",
    "controller": "controller_node",
    "excitation": "excitation_node",
}
"""Names of the rig's nodes and the program, also the module, that runs each."""

SIGNAL_DEPTH = 2000
"""History depth of the signal topics: more than a streamed window, so that no reader loses one."""

Field = Literal["position", "velocity", "effort"]


@dataclass(frozen=True)
class Signal:
    """One recorded signal: its short symbol, topic below the namespace, field and unit."""

    symbol: str
    topic: str
    field: Field
    unit: str

    @property
    def absolute_topic(self) -> str:
        """The topic in the default namespace, as it stands in a bag."""
        return f"{NAMESPACE}/{self.topic}"


REFERENCE = Signal("r", "reference", "position", "rad")
MOTOR_POSITION = Signal("y", "motor_position", "position", "rad")
MOTOR_TORQUE = Signal("u", "motor_torque", "effort", "N m")
LINK_POSITION = Signal("q", "link_position", "position", "rad")
SIGNALS = (REFERENCE, MOTOR_POSITION, MOTOR_TORQUE)
"""The three signals of every bag, in the order in which a sample is recorded."""

WRITERS = {"simulator": MOTOR_POSITION, "controller": MOTOR_TORQUE, "excitation": REFERENCE}
"""The signal that each of the rig's nodes, or what takes its place, publishes."""

EXPERIMENT_TOPIC = "experiment"
CONTROLLER_TOPIC = "controller"
"""Latched JSON: the `controller` entry of the experiment description, by the controller itself."""

STREAM_KEY = "reference_stream"
"""Number in that JSON, another one for each stream of references that the controller has begun. It
is not part of the experiment description; a controller that can't give it leaves it out."""

MODE_KEY = "mode"
"""Mode of the controller node in that JSON, lockstep or realtime: the drive must have the same. It
is not part of the experiment description either."""

RECORDED_TOPIC = "recorded"
"""Stamp up to which a recorder has everything; the excitation never streams further than a window
beyond it, so a slow recorder slows the lockstep instead of losing samples."""


def checked_namespace(text: str) -> str:
    """Return a namespace of the graph with its leading slash; raise InputError if it is none."""
    words = text.strip("/").split("/")
    if not all(re.fullmatch(r"[A-Za-z_]\w*", word, re.ASCII) for word in words):
        raise InputError(
            f"{shown(text)} is no ROS namespace: write words of letters, digits and underscores "
            "that begin with no digit, such as /cell/left."
        )
    return "/" + "/".join(words)


def moved_topic(topic: str, namespace: str) -> str:
    """Return where a topic of a bag is on the graph: those of `/rig` lie in the namespace."""
    return namespace + topic[len(NAMESPACE) :] if topic.startswith(f"{NAMESPACE}/") else topic


_CLOCK = struct.Struct("<4siI")
_CLOCK_SAYS = struct.Struct("<4xiI")
_CDR = b"\x00\x01\x00\x00"


def clock_message(stamp_ns: int) -> bytes:
    """Return the CDR bytes of a rosgraph_msgs/Clock that says a stamp (ns)."""
    return _CLOCK.pack(_CDR, *divmod(stamp_ns, 1_000_000_000))


def clock_ns(message: bytes) -> int:
    """Return the stamp (ns) that the CDR bytes of a rosgraph_msgs/Clock say."""
    seconds, nanoseconds = _CLOCK_SAYS.unpack_from(message)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def stamp_ns(sample: int, sample_rate_hz: float) -> int:
    """Return the stamp of sample k = 1, 2, ...: the instant k Ts in integer nanoseconds."""
    return round(sample * 1e9 / sample_rate_hz)


def stamps_ns(samples: int, sample_rate_hz: float) -> np.ndarray:
    """Return the stamps of samples 1..samples as int64 of shape (samples,), equal to `stamp_ns`."""
    return np.rint(np.arange(1, samples + 1) * 1e9 / sample_rate_hz).astype(np.int64)
