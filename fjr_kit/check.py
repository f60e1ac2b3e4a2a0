"""The outcome of one test of data, of a record or of a run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from .result_types import Number, ResultModel

AnyCheck = TypeVar("AnyCheck", bound="Check")


class Check(ResultModel):
    """The outcome of one test.

    Attributes:
        name: identifier, such as periodicity, transient, jitter.
        level: level index; None if it concerns all.
        realization: realization index; None if it concerns all of a level.
        passed: whether the data passed.
        value: the measured figure; NaN if there is none.
        limit: the figure that it must not exceed.
        sentence: what was found, for a person.
    """

    name: str
    level: int | None = None
    realization: int | None = None
    passed: bool
    value: Number
    limit: Number
    sentence: str


def failed(checks: Iterable[AnyCheck]) -> tuple[AnyCheck, ...]:
    """Return the checks that did not pass."""
    return tuple(check for check in checks if not check.passed)
