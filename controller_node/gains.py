"""The gains of a described controller that are unknown: their names, ranges and natural starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fjr_kit.errors import InputError, shown

SOURCE = "experiment description: controller"
_MOST_UNKNOWN = 200
_DECADES = 1e5


@dataclass(frozen=True)
class FreeGain:
    """A gain that is unknown.

    Attributes:
        name: where it stands in the description, as in `feed_forward.velocity`.
        unit: its unit.
        low: least value that it may have.
        high: greatest value.
        logarithmic: whether it is positive and known to an order of magnitude at best, so that
            its logarithm is what to search over.
        start: a value to begin at.
    """

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool
    start: float


def unknown_gains(controller: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Return the dotted names of all gains of a `controller` entry that are unknown.

    Raises:
        InputError: the entry does not list them as the importer does.
    """
    names = (controller or {}).get("unknown") or ()
    sound = isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names)
    if not sound or len(set(names)) != len(names) or len(names) > _MOST_UNKNOWN:
        raise InputError(f"{SOURCE}.unknown must be a list of different names of gains.")
    return tuple(names)


def free_gains(
    controller: Mapping[str, Any],
    sample_rate_hz: float,
    torque_nm: float = 1.0,
    angle_rad: float = 0.1,
) -> tuple[FreeGain, ...]:
    """Return the unknown gains of a `controller` entry with their ranges.

    Args:
        controller: the entry.
        sample_rate_hz: rate of the record: times lie between a sample and a thousand seconds.
        torque_nm: rms of the torque.
        angle_rad: rms of what the torque answers to, such as the control error.

    Raises:
        InputError: see `unknown_gains`.
    """
    stiffness = torque_nm / angle_rad
    return tuple(
        _free(name, sample_rate_hz, stiffness, torque_nm) for name in unknown_gains(controller)
    )


def _free(name: str, rate: float, stiffness: float, torque_nm: float) -> FreeGain:
    corner = math.sqrt(rate)  # rad/s, between the slowest motion of a record and its rate
    starts = {
        "p": ("N m/rad", stiffness),
        "i": ("N m/(rad s)", stiffness),
        "d": ("N m s/rad", stiffness / corner),
        "k_position": ("1/s", corner),
        "k_velocity": ("N m s/rad", stiffness / corner),
        "torque_limit_nm": ("N m", 2.0 * torque_nm),
    }
    if name in starts:
        unit, start = starts[name]
        return FreeGain(name, unit, start / _DECADES, start * _DECADES, True, start)
    if name in ("n", "velocity_filter_rad_s"):
        return FreeGain(name, "rad/s", 1e-3, min(10.0 * rate, 1e5), True, 0.2 * rate)
    if name == "integral_time_s":
        return FreeGain(name, "s", 0.1 / rate, 1e3, True, 10.0 / corner)
    if name == "setpoint_weight":
        return FreeGain(name, "", 0.0, 2.0, False, 1.0)
    if name == "feed_forward.velocity":
        most = _DECADES * stiffness / corner
        return FreeGain(name, "N m s/rad", -most, most, False, 0.0)
    if name == "feed_forward.acceleration":
        most = _DECADES * stiffness / corner**2
        return FreeGain(name, "N m s^2/rad", -most, most, False, 0.0)
    if "numerator." in name:
        most = _DECADES * stiffness
        return FreeGain(name, "N m/rad", -most, most, False, 0.0)
    raise InputError(f"{SOURCE}.unknown: {shown(name)} is no gain of a controller.")


def with_gains(controller: Mapping[str, Any], gains: Mapping[str, float]) -> dict[str, Any]:
    """Return the entry with values given for unknown gains; nothing is unknown then.

    A torque limit of infinity is none.

    Raises:
        InputError: a gain is left unknown, or a value is given for one that is not.
    """
    unknown = unknown_gains(controller)
    for name in unknown:
        if name not in gains:
            raise InputError(
                f"{SOURCE}: {name} is unknown, so the law cannot be simulated; give its value."
            )
    for name in gains:
        if name not in unknown:
            raise InputError(f"{SOURCE}: {shown(name)} is not among the gains that are unknown.")
    filled = {key: value for key, value in controller.items() if key != "unknown"}
    for name in unknown:
        value = float(gains[name])
        none = name == "torque_limit_nm" and math.isinf(value)
        filled = _set(filled, name.split("."), None if none else value, name)
    return filled


def _set(content: Any, path: list[str], value: float | None, name: str) -> Any:
    if not path:
        return value
    first, rest = path[0], path[1:]
    if isinstance(content, Mapping) and first in content:
        return {**content, first: _set(content[first], rest, value, name)}
    if isinstance(content, (list, tuple)) and first.isdigit() and int(first) < len(content):
        number = int(first)
        return [*content[:number], _set(content[number], rest, value, name), *content[number + 1 :]]
    raise InputError(f"{SOURCE}.unknown: there is no {shown(name)} in this controller.")
