"""Options that several commands have together, as the fields of one dataclass."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Any


def takes_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Decorate a command, so that a parameter that is a dataclass becomes an option for each field.

    The options stand in the place of the parameter; the command is given the dataclass, filled.
    """
    groups: dict[str, type] = {}
    options: list[inspect.Parameter] = []
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        own, kind = [parameter], parameter.annotation
        if isinstance(kind, type) and is_dataclass(kind):
            groups[parameter.name] = kind
            own = list(inspect.signature(kind, eval_str=True).parameters.values())
        options += [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in own]

    @functools.wraps(command)
    def called(**values: Any) -> None:
        for name, group in groups.items():
            own = {field: values.pop(field) for field in inspect.signature(group).parameters}
            values[name] = group(**own)
        command(**values)

    called.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    return called
