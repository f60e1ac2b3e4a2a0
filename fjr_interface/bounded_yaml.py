"""The events of a YAML text by libyaml, in bounds: what is read of parameter files and of bags.

Aliases, thousands of brackets and endless lists are how a short file can mean a huge one, or take
long to read; neither people who write parameters nor recorders need them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import yaml

Loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""libyaml, where it is there, without YAML's own rules on what type a scalar has."""


class YamlProblem(ValueError):
    """A text that is not YAML, or out of bounds; the message is a clause that says why.

    Attributes:
        line: where, counted from 1; None if it is not known or the whole text is meant.
    """

    def __init__(self, problem: str, line: int | None = None) -> None:
        """Say why, and in which line."""
        super().__init__(problem)
        self.line = line


@contextmanager
def yaml_problems(text: str) -> Iterator[None]:
    """Turn an error of the YAML library in the body, which reads `text`, into a YamlProblem."""
    try:
        yield
    except (yaml.YAMLError, UnicodeEncodeError) as error:
        mark = getattr(error, "problem_mark", None)
        last = max(len(text.splitlines()), 1)
        why = getattr(error, "problem", None) or str(error).splitlines()[0]
        line = min(mark.line + 1, last) if mark else None
        raise YamlProblem(f"this is not YAML ({why})", line) from None


def bounded_events(text: str, *, deepest: int, most_scalars: int | None = None) -> Iterator[Any]:
    """Yield the parse events of a text.

    Args:
        text: the YAML text.
        deepest: most levels of mappings and sequences in each other.
        most_scalars: most names and values; None for any number.

    Raises:
        YamlProblem: no YAML, an alias, or more than the bounds allow.
    """
    depth = scalars = 0
    with yaml_problems(text):
        for event in yaml.parse(text, Loader=Loader):
            if isinstance(event, yaml.ScalarEvent):
                scalars += 1
                if most_scalars is not None and scalars > most_scalars:
                    raise YamlProblem(f"holds more than {most_scalars} names and values")
            elif isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > deepest:
                    raise YamlProblem("is nested too deeply")
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
            elif isinstance(event, yaml.AliasEvent):
                line = event.start_mark.line + 1
                raise YamlProblem("YAML aliases (*) are not read: write the value out", line)
            yield event
