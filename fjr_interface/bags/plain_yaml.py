"""Loads YAML that a program wrote, in time linear in its length: mappings, sequences, scalars."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from yaml import (
    MappingEndEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from ..bounded_yaml import bounded_events

_DEEPEST = 32
_INTEGER = re.compile(r"-?[0-9]{1,20}")
_WORDS: dict[str, Any] = {"true": True, "false": False, "null": None, "~": None, "": None}


def load_plain_yaml(text: str) -> Any:
    """Return one document; unquoted integers, true, false and null become values, the rest str.

    Raises:
        ValueError: the text is not YAML, or holds more than a program would write.
    """
    events = bounded_events(text, deepest=_DEEPEST)
    next(events)  # the begin of the stream
    if isinstance(next(events), StreamEndEvent):
        return None
    document = _node(events, next(events))
    next(events)  # the end of the document
    if not isinstance(next(events), StreamEndEvent):
        raise ValueError("there is a second document")
    return document


def _node(events: Iterator[Any], event: Any) -> Any:
    if isinstance(event, ScalarEvent):
        return _scalar(event)
    if isinstance(event, SequenceStartEvent):
        items = []
        while not isinstance(event := next(events), SequenceEndEvent):
            items.append(_node(events, event))
        return items
    mapping: dict[str, Any] = {}
    while not isinstance(event := next(events), MappingEndEvent):
        if not isinstance(event, ScalarEvent) or event.value in mapping:
            raise ValueError("a key is no text, or is there twice")
        key: str = event.value
        mapping[key] = _node(events, next(events))
    return mapping


def _scalar(event: Any) -> Any:
    if event.style is not None and event.style != "":
        return event.value
    if _INTEGER.fullmatch(event.value):
        return int(event.value)
    return _WORDS.get(event.value, event.value)
