"""Descriptions of parameters: one place for name, default, unit, range and meaning.

ROS parameter descriptors, parameter files, `--help` and documents all read these descriptions.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fjr_kit.errors import InputError, shown

from .linear_axis import as_linear

if TYPE_CHECKING:
    from typing_extensions import Self

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
                raise InputError(f"{self.name} must be true or false, not {shown(value)}.")
            return value
        if isinstance(self.default, str):
            if not isinstance(value, str):
                raise InputError(f"{self.name} must be a text, not {shown(value)}.")
            if self.choices and value not in self.choices:
                raise InputError(
                    f"{self.name} must be one of {', '.join(self.choices)}, not {shown(value)}."
                )
            return value
        if isinstance(self.default, tuple):
            values = [value] if isinstance(value, (int, float)) else value
            try:
                if isinstance(values, str):
                    raise TypeError
                return tuple(float(self._number(item)) for item in values)
            except TypeError:
                raise InputError(
                    f"{self.name} must be a list of numbers, not {shown(value)}."
                ) from None
        number = self._number(value)
        if isinstance(self.default, int):
            if number % 1 != 0:
                raise InputError(f"{self.name} must be a whole number, not {shown(value)}.")
            return int(number)
        return float(number)

    def _number(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value:
            raise InputError(f"{self.name} must be a number{self._in_unit}, not {shown(value)}.")
        if not self.low <= value <= self.high:
            raise InputError(f"{self.name} must lie in {self.range_text}, not {shown(value)}.")
        return value

    def of_linear_axis(self) -> Self:
        """Return the parameter in its unit of a linear axis."""
        return replace(self, unit=as_linear(self.unit))

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


_NEAR = 0.6
"""Likeness of two words of which one is meant by the other, by `difflib`."""


def nearest(name: Any, names: Iterable[str]) -> str:
    """Return the name that is near to another one, or two where they are alike or none is near."""
    word, known = str(name)[:100], list(names)
    likeness = {each: difflib.SequenceMatcher(None, each, word).ratio() for each in known}
    two = sorted(known, key=lambda each: -likeness[each])[:2]
    alone = len(two) > 1 and likeness[two[0]] > max(_NEAR, likeness[two[1]])
    return two[0] if alone else " or ".join(two)


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
            raise InputError(
                f"There is no parameter {shown(name)}; did you mean {nearest(name, self.names)}?"
            ) from None

    def __contains__(self, name: str) -> bool:
        """Tell whether a parameter of this name exists."""
        return name in self._by_name

    @property
    def names(self) -> tuple[str, ...]:
        """All names in order."""
        return tuple(self._by_name)

    def of_linear_axis(self) -> ParameterGroup:
        """Return the group in the units of a linear axis."""
        return ParameterGroup(*(parameter.of_linear_axis() for parameter in self))

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
