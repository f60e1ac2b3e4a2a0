"""Which columns of a file are likely time, reference, torque and position, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .import_map import UNITS
from .split_stamps import is_seconds, nanoseconds_beside
from .stated_units import stated_unit

_TIME = {"t", "time", "timestamp", "stamp", "zeit", "temps"}
_ASKED = {
    "r", "ref", "reference", "cmd", "command", "commanded", "des", "desired", "goal", "target",
    "set", "setpoint", "soll", "sollwert", "consigne",
}  # fmt: skip
_TORQUE = {
    "tau", "torque", "trq", "u", "i", "iq", "current", "effort", "load", "force", "moment",
    "voltage", "pwm", "drehmoment", "kraft", "strom", "couple", "courant",
}  # fmt: skip
_ANGLE = {"pos", "position", "angle", "theta", "winkel", "weg"}
_MOTION = _ANGLE | {
    "q",
    "y",
    "enc",
    "encoder",
    "act",
    "actual",
    "meas",
    "measured",
    "ist",
    "istwert",
}
_OTHER = {
    "vel", "velocity", "speed", "acc", "acceleration", "dq", "ddq", "qd", "qdd", "temp", "error",
    "err", "enable", "enabled", "init", "supply", "status",
}  # fmt: skip
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


def likely_map(names: Sequence[str]) -> dict[str, str]:
    """Return {quantity: `column` or `column:FACTOR`} where just one column's name suggests it.

    Args:
        names: of the columns, in the file's order. A name that cannot stand in a map is no column.
    """
    found: dict[str, list[str]] = {"time": [], "reference": [], "torque": [], "position": []}
    for name in names:
        quantity = _quantity(name)
        if quantity is not None and not set(",:=") & set(name):
            found[quantity].append(name)
    parts = {nanoseconds_beside(name, names) for name in names}
    found["time"] = [name for name in found["time"] if name not in parts] or [
        name for name in names if is_seconds(name)
    ]
    return {
        quantity: f"{each[0]}{_factor(quantity, each[0])}"
        for quantity, each in found.items()
        if len(each) == 1
    }


def _quantity(name: str) -> str | None:
    """Return what a name says that its column is: `goal_position` a reference; None for nothing."""
    found = _WORD.findall(re.sub(r"[\[({].*", "", name.rpartition(".")[2]))
    words = {word.lower() for at, word in enumerate(found) if at == 0 or len(word) > 1}
    if words & _OTHER:
        return None
    if words & _TIME:
        return "time"
    asked, torque = bool(words & _ASKED), bool(words & _TORQUE) and not words & _ANGLE
    if asked or torque:
        return None if asked and torque else "reference" if asked else "torque"
    return "position" if words & _MOTION else None


def _factor(quantity: str, name: str) -> str:
    stated = stated_unit(name, "", UNITS[quantity])
    return ":FACTOR" if stated and stated not in UNITS[quantity] else ""
