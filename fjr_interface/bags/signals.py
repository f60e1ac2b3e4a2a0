"""Which topic and field of a bag is which signal, and how its messages become numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fjr_kit.errors import InputError

from ..topics import JOINT_STATE, LINK_POSITION, MOTOR_POSITION, MOTOR_TORQUE, NAMESPACE, REFERENCE
from .blocks import MEND, Block
from .definitions import DefinitionError, typestore
from .joint_state import FIELDS, Layout, LayoutError
from .mcap_index import gather

_SPEC = re.compile(
    r"(?P<topic>[\w/~]+)(:(?P<field>[A-Za-z_][\w.]*)(\[(?P<joint>[^\[\]]+)\])?)?"
    r"(:(?P<factor>[-+.\deE]+))?\Z"
)
_NONE = "none"

GREATEST_FACTOR = 1e12
"""A factor to SI lies between this and its inverse."""
MAX_MESSAGE = 2**20
"""Greatest size in bytes of a message that carries a signal."""


@dataclass(frozen=True)
class SignalSource:
    """Where a signal stands in a bag.

    Attributes:
        topic: absolute topic; without a leading slash, that topic in any one namespace.
        field: field of the message, dotted if nested (`position`, `wrench.torque.z`).
        joint: joint name (or index) in an array field; None takes the first value.
        required: whether a bag without the topic is refused.
        factor: from its numbers to SI, with the sign.
    """

    topic: str
    field: str
    joint: str | None = None
    required: bool = True
    factor: float = 1.0

    @classmethod
    def parse(cls, text: str, default_field: str) -> SignalSource:
        """Parse `topic[:field[[joint]]][:factor]`; raise InputError on anything else."""
        match = _SPEC.match(text)
        if match is None:
            raise InputError(
                f"signal source {text!r} is not understood; write it as /topic:field[joint], or "
                "with a factor to SI as /topic:field[joint]:factor."
            )
        source = cls(match["topic"], match["field"] or default_field, match["joint"])
        if match["factor"] is None:
            return source
        try:
            factor = float(match["factor"])
        except ValueError:
            factor = math.nan
        if not 1.0 / GREATEST_FACTOR <= abs(factor) <= GREATEST_FACTOR:
            raise InputError(
                f"signal source {text!r}: its factor to SI is not understood; give a number other "
                "than zero, as in effort[elbow]:12 for 12 N m/A."
            )
        return replace(source, factor=factor)

    def find(self, topics: Iterable[str], bag: str) -> str | None:
        """Return the bag's topic that this source means; None if absent and not required.

        Raises:
            InputError: a required topic is absent, or several could be meant.
        """
        topics = list(topics)
        exact = self.topic if self.topic.startswith("/") else f"{NAMESPACE}/{self.topic}"
        if exact in topics:
            return exact
        near = [] if exact == self.topic else [t for t in topics if t.endswith(f"/{self.topic}")]
        if len(near) == 1:
            return near[0]
        if near:
            raise InputError(
                f"{bag}: several topics end in /{self.topic} ({', '.join(near)}); name the one to "
                "use in the signal map."
            )
        if not self.required:
            return None
        raise InputError(
            f"{bag}: the topic {exact} is missing (there are: "
            f"{', '.join(topics[:20]) or 'none'}); name the one to use in the signal map or record "
            "it again."
        )


_REFERENCE = SignalSource(REFERENCE.topic, REFERENCE.field)
_TORQUE = SignalSource(MOTOR_TORQUE.topic, MOTOR_TORQUE.field)
_POSITION = SignalSource(MOTOR_POSITION.topic, MOTOR_POSITION.field)
_LINK = SignalSource(LINK_POSITION.topic, LINK_POSITION.field, required=False)


@dataclass(frozen=True)
class SignalMap:
    """Sources of the signals; reference and link may be None: not to be read."""

    reference: SignalSource | None = _REFERENCE
    torque: SignalSource = _TORQUE
    position: SignalSource = _POSITION
    link: SignalSource | None = _LINK

    @classmethod
    def parse(cls, specs: Iterable[str]) -> SignalMap:
        """Parse `signal=/topic:field[joint][:factor]` of reference, torque, position and link.

        What is not named keeps its default; `reference=none` and `link=none` leave it out.

        Raises:
            InputError: a name or source is not understood.
        """
        changes: dict[str, Any] = {}
        for spec in specs:
            name, equals, source = spec.partition("=")
            if not equals or name not in ("reference", "torque", "position", "link"):
                raise InputError(
                    f"signal map {spec!r} is not understood; write reference=, torque=, position= "
                    "or link= and then /topic:field[joint]."
                )
            if source == _NONE and name in ("reference", "link"):
                changes[name] = None
            else:
                field = "effort" if name == "torque" else "position"
                changes[name] = SignalSource.parse(source, field)
        return replace(cls(), **changes)

    def sources(self) -> dict[str, SignalSource]:
        """Return the sources that are to be read, by name."""
        named = {
            "reference": self.reference,
            "torque": self.torque,
            "position": self.position,
            "link": self.link,
        }
        return {name: source for name, source in named.items() if source is not None}


class _NoSuchValue(Exception):
    """The messages do not hold what the signal map asks for."""


DEFAULT = SignalMap()
"""The topics of the interface, under any namespace."""


def decode(block: Block, source: SignalSource, bag: str) -> tuple[np.ndarray, np.ndarray]:
    """Decode one signal of a block of messages.

    Returns:
        (stamps, values): int64 nanoseconds and float64 in SI, both of shape (messages,).

    Raises:
        InputError: the messages have no such field or joint, no header stamp, or are corrupted.
    """
    if block.topic.encoding != "cdr":
        raise InputError(
            f"{bag}: {block.topic.name}: the encoding {block.topic.encoding!r} is not supported; "
            "record it as cdr."
        )
    if (block.sizes > MAX_MESSAGE).any():
        raise InputError(
            f"{bag}: {block.topic.name}: has messages of {block.sizes.max()} bytes, more than the "
            f"{MAX_MESSAGE} allowed of a signal; map another topic."
        )
    stamps, values = _decoded(block, source, bag)
    return stamps, values if source.factor == 1.0 else source.factor * values


def _decoded(block: Block, source: SignalSource, bag: str) -> tuple[np.ndarray, np.ndarray]:
    if block.topic.type == JOINT_STATE and source.field in FIELDS and len(block.starts):
        try:
            return _decode_joint_states(block, source)
        except LayoutError:
            pass  # layouts differ from message to message, or something is wrong: look at each
    return _decode_each(block, source, bag)


def _decode_joint_states(block: Block, source: SignalSource) -> tuple[np.ndarray, np.ndarray]:
    size = int(block.sizes[0])
    if (block.sizes != size).any():
        raise LayoutError("messages differ in length")
    layout = Layout.of(block.payload(0))
    rows = gather(block.data, block.starts, f"V{size}").view(np.uint8).reshape(-1, size)
    return layout.decode(rows, source.field, source.joint)


def _decode_each(block: Block, source: SignalSource, bag: str) -> tuple[np.ndarray, np.ndarray]:
    """Decode message by message: slow, but right for any type with a header."""
    where = f"{bag}: {block.topic.name}"
    stamps = np.empty(len(block.starts), np.int64)
    values = np.empty(len(block.starts))
    try:
        store = typestore(block.topic)
    except DefinitionError as error:
        raise InputError(
            f"{where}: the definition of {block.topic.type} {error}; map another topic."
        ) from None
    for i in range(len(block.starts)):
        try:
            message = store.deserialize_cdr(block.payload(i), block.topic.type)
            stamps[i] = _stamp(message)
            values[i] = _value(message, source)
        except _NoSuchValue as error:
            raise InputError(f"{where}: {error.args[0]}.") from None
        except Exception:  # rosbags unpacks arbitrary bytes here: anything may go wrong
            raise InputError(
                f"{where}: a message cannot be decoded as {block.topic.type}; {MEND}."
            ) from None
    return stamps, values


def _stamp(message: Any) -> int:
    try:
        stamp = message.header.stamp
    except AttributeError:
        raise _NoSuchValue("the messages have no header stamp; map a stamped topic") from None
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def _value(message: Any, source: SignalSource) -> float:
    value = message
    for name in source.field.split("."):
        if not hasattr(value, name):
            raise _NoSuchValue(f"there is no field {source.field!r}; correct the signal map")
        value = getattr(value, name)
    if isinstance(value, (bool, int, float)):
        return float(value)
    if not isinstance(value, (np.ndarray, list)):
        raise _NoSuchValue(f"{source.field} is not a number; correct the signal map")
    index = _index(message, source)
    if index >= len(value):
        raise _NoSuchValue(f"{source.field}[{index}] is empty; correct the signal map")
    return float(value[index])


def _index(message: Any, source: SignalSource) -> int:
    if source.joint is None:
        return 0
    names = list(getattr(message, "name", ()))
    if source.joint in names:
        return names.index(source.joint)
    if source.joint.isdecimal():
        return int(source.joint)
    raise _NoSuchValue(
        f"joint {source.joint!r} is not among {', '.join(names) or 'no names'}; correct the "
        "signal map"
    )
