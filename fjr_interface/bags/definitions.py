"""Message types that a bag brings along, bounded before `rosbags` makes code of them.

The parsers of `rosbags` evaluate constant expressions of any size, and its decoders are unrolled:
a line of text can cost gigabytes. A signal is a number in a stamped message, so what is refused
here is far beyond any type that carries one.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import make_typesdict
from rosbags.typesys.idl import IDLParser, Reference, Value
from rosbags.typesys.peg import Success

from .blocks import Topic

MAX_DEFINITION = 2**16
MAX_FIELDS = 1000

_IDL = ("ros2idl", "omgidl")
# Lines of .msg that define no field: comments and constants.
_NO_FIELD = re.compile(r"^[ \t]*(?:#.*|[\w<=]+[ \t]+\w+[ \t]*=.*)(?:\n|\Z)", re.MULTILINE)
# Lines between the parts of IDL that are none of it.
_NO_IDL = re.compile(r"^[ \t]*(?:#|=====|IDL:).*(?:\n|\Z)", re.MULTILINE)


class DefinitionError(ValueError):
    """A message definition cannot be used; the text completes 'the definition of TYPE ...'."""


class _LiteralIdl(IDLParser):
    """IDL whose constants are literals and names of constants, as in all IDL made of .msg files.

    Expressions take the parser of `rosbags` time exponential in the depth of their parentheses,
    and have values of any size.
    """

    def const_expr(self, pos: int) -> Any:
        return self.unary_expr(pos)

    def primary_expr(self, pos: int) -> Any:
        if isinstance(name := self.scoped_name(pos), Success):
            return Success(name.pos, Reference(name.value))
        literal = self.literal_(pos)
        return (
            Success(literal.pos, Value(literal.value)) if isinstance(literal, Success) else literal
        )


@lru_cache(maxsize=16)
def typestore(topic: Topic) -> Any:
    """Return a `rosbags` typestore that can decode the messages of a topic.

    Raises:
        DefinitionError: the definition is damaged, or beyond the bounds.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    if topic.type not in store.types:
        types = _types(topic, store)
        try:
            store.register(types)
        except Exception:  # one of them is also a type of Jazzy, and another
            raise DefinitionError("cannot be understood") from None
    return store


def is_standard(topic: Topic) -> bool:
    """Tell whether the type of a topic is one that Jazzy brings along."""
    return topic.type in get_typestore(Stores.ROS2_JAZZY).types


def differs_from_standard(topic: Topic) -> bool:
    """Tell whether the bag's definition of a type of Jazzy, or of a part of it, is another.

    Raises:
        DefinitionError: the definition is damaged, or beyond the bounds.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    if topic.type not in store.types or not topic.definition.strip():
        return False
    types = _types(topic, store)
    return any(
        name in store.fielddefs and store.fielddefs[name][1] != definition[1]
        for name, definition in types.items()
    )


def _types(topic: Topic, store: Any) -> dict[str, Any]:
    """Return the types that a topic's definition defines, as `rosbags` has them."""
    idl = topic.definition_format in _IDL
    text = (_NO_IDL if idl else _NO_FIELD).sub("", topic.definition)
    if len(text) > MAX_DEFINITION:
        raise DefinitionError(f"is longer than {MAX_DEFINITION} characters")
    try:
        if idl:
            types = make_typesdict(_LiteralIdl(text).specification())
        else:
            types = get_types_from_msg(text, topic.type)
        if _fields(topic.type, {**store.fielddefs, **types}, {}) > MAX_FIELDS:
            raise DefinitionError(f"has more than {MAX_FIELDS} fields and array elements")
    except DefinitionError:
        raise
    except Exception:  # rosbags parses arbitrary text here: anything may go wrong
        raise DefinitionError("cannot be understood") from None
    return types


def _fields(name: str, types: dict[str, Any], known: dict[str, int]) -> int:
    """Return how many values a type has, arrays of texts and structures counted by elements."""
    if name not in known:
        known[name] = MAX_FIELDS + 1  # a type within itself has no end
        fields = types[name][1]
        if not fields:
            raise DefinitionError(f"has the part {name} without fields")
        known[name] = sum(_values(kind, types, known) for _, kind in fields)
    return known[name]


def _values(kind: Any, types: dict[str, Any], known: dict[str, int]) -> int:
    node, what = kind
    if node == Nodetype.BASE:
        return 1
    if node == Nodetype.NAME:
        return _fields(what, types, known)
    (element, detail), length = what
    one = 1 if element == Nodetype.BASE else _fields(detail, types, known)
    if node == Nodetype.SEQUENCE:
        return 1 + one
    if length < 1:
        raise DefinitionError("has an array without elements")
    numeric = element == Nodetype.BASE and detail[0] != "string"
    return 1 if numeric else length * one
