"""Descriptions of parameters: one place for name, default, unit, range and meaning.

ROS parameter descriptors, parameter files, `--help` and documents all read these descriptions.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from .errors import InputError

Value = Any
"""A float, int, bool, str or tuple of floats: which one, the default in the description decides."""


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    Attributes:
        name: identifier, the same in ROS, files and documents.
        default: default value; its type is the parameter's type (a tuple is a list of floats).
        unit: SI unit, empty if it has none.
        description: what it is, one sentence.
        low: least value allowed (of each element).
        high: greatest value allowed (of each element).
        choices: allowed words of a string.
        symbol: symbol in the paper or the field.
        source: paper equation or reference.
    """

    name: str
    default: Value
    unit: str
    description: str
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    symbol: str = ""
    source: str = ""

    def check(self, value: Any) -> Value:
        """Return the value in the parameter's type; raise InputError with one sentence."""
        if isinstance(self.default, bool):
            if not isinstance(value, bool):
                raise InputError(f"{self.name} must be true or false, not {value!r}.")
            return value
        if isinstance(self.default, str):
            if not isinstance(value, str):
                raise InputError(f"{self.name} must be a text, not {value!r}.")
            if self.choices and value not in self.choices:
                raise InputError(
                    f"{self.name} must be one of {', '.join(self.choices)}, not {value!r}."
                )
            return value
        if isinstance(self.default, tuple):
            values = [value] if isinstance(value, (int, float)) else value
            try:
                return tuple(float(self._number(item)) for item in values)
            except TypeError:
                raise InputError(f"{self.name} must be a list of numbers, not {value!r}.") from None
        number = self._number(value)
        if isinstance(self.default, int):
            if number != int(number):
                raise InputError(f"{self.name} must be a whole number, not {value!r}.")
            return int(number)
        return float(number)

    def _number(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            raise InputError(f"{self.name} must be a number{self._in_unit}, not {value!r}.")
        if not self.low <= value <= self.high:
            raise InputError(f"{self.name} must lie in {self.range_text}, not {value!r}.")
        return value

    @property
    def _in_unit(self) -> str:
        return f" in {self.unit}" if self.unit else ""

    @property
    def range_text(self) -> str:
        """The allowed range with its unit, such as '[0, 1e+06] N m'."""
        return f"[{self.low:g}, {self.high:g}]" + (f" {self.unit}" if self.unit else "")

    @property
    def help(self) -> str:
        """Description with unit and range, for descriptors and `--help`."""
        text = self.description + (f" [{self.unit}]" if self.unit else "")
        if self.choices:
            return f"{text}; one of {', '.join(self.choices)}"
        bounded = math.isfinite(self.low) or math.isfinite(self.high)
        return f"{text}; range {self.range_text}" if bounded else text


class ParameterGroup:
    """An ordered set of parameters, indexed by name."""

    def __init__(self, *parameters: Parameter) -> None:
        """Take the parameters in the order in which they are shown."""
        self._by_name = {parameter.name: parameter for parameter in parameters}

    def __iter__(self) -> Iterator[Parameter]:
        """Iterate over the parameters."""
        return iter(self._by_name.values())

    def __getitem__(self, name: str) -> Parameter:
        """Return the named parameter; raise InputError if there is none."""
        try:
            return self._by_name[name]
        except KeyError:
            near = difflib.get_close_matches(str(name), self._by_name, 1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(self.names)}."
            raise InputError(f"There is no parameter {name!r}; {hint}") from None

    def __contains__(self, name: str) -> bool:
        """Tell whether a parameter of this name exists."""
        return name in self._by_name

    @property
    def names(self) -> tuple[str, ...]:
        """All names in order."""
        return tuple(self._by_name)

    def defaults(self) -> dict[str, Value]:
        """Return all defaults by name."""
        return {parameter.name: parameter.default for parameter in self}

    def check(self, values: Mapping[str, Any], source: str = "") -> dict[str, Value]:
        """Return defaults overridden by checked values.

        Raises:
            InputError: an unknown name or a bad value; the sentence starts with `source`.
        """
        checked = self.defaults()
        for name, value in values.items():
            try:
                checked[name] = self[name].check(value)
            except InputError as error:
                raise InputError(f"{source}: {error}" if source else str(error)) from None
        return checked
