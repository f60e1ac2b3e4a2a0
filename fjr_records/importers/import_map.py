"""The map of `fjr import`: which column is which quantity, in which unit, and which lines."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fjr_interface.bags.signals import GREATEST_FACTOR
from fjr_kit.errors import InputError

from .known_torque import KNOWN
from .source import Heading
from .stated_units import stated_unit, unit_of

_DEGREE = math.pi / 180.0
_ANGLE = {
    "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": _DEGREE, "mdeg": 1e-3 * _DEGREE,
    "arcmin": _DEGREE / 60.0, "arcsec": _DEGREE / 3600.0, "rev": 2.0 * math.pi,
}  # fmt: skip
_TORQUE = {
    "N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "mNm": 1e-3, "kN m": 1e3, "kNm": 1e3,
    "N cm": 1e-2, "Ncm": 1e-2, "N mm": 1e-3, "Nmm": 1e-3,
}  # fmt: skip
_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
_FORCE = {"N": 1.0, "kN": 1e3}
_TURNING = {"rad/s": 1.0, "deg/s": _DEGREE, "rpm": math.pi / 30.0, "rev/s": 2.0 * math.pi}
_SLIDING = {"m/s": 1.0, "mm/s": 1e-3}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
UNITS: Mapping[str, Mapping[str, float]] = {
    "reference": _ANGLE | _LENGTH | _TURNING | _SLIDING,
    "torque": _TORQUE | _FORCE,
    "position": _ANGLE | _LENGTH | _TURNING | _SLIDING,
    "link": _ANGLE | _LENGTH | _TURNING | _SLIDING,
    KNOWN: _TORQUE | _FORCE,
    "time": _TIME,
    "reference_time": _TIME,
    "torque_time": _TIME,
    "position_time": _TIME,
    "link_time": _TIME,
    f"{KNOWN}_time": _TIME,
}
"""Units of each quantity with their factors to rad, N m and s, or to m and N of a linear axis; the
first is the default."""
TIME, OWN_TIME = "time", "_time"
"""The stamps of all signals, and the end of the name of those of a single one."""
LINEAR = frozenset({*_LENGTH, *_FORCE, *_SLIDING})
"""Units of a linear axis."""
SPEEDS = frozenset({*_TURNING, *_SLIDING})
"""Units of a speed, whose integral is the angle."""
REQUIRED = ("torque", "position")


@dataclass(frozen=True)
class Column:
    """Where a quantity stands in a file, and the factor from there to SI.

    Attributes:
        name: of the column.
        factor: to SI, with the sign.
        by_factor: whether the factor was given as a number, so that the column may be anything: a
            current that stands for the torque, a voltage that stands for the reference.
        unit: in which it was given to be, or else the file states it to be; empty if neither.
        stated: whether the unit is the one that the file states.
    """

    name: str
    factor: float = 1.0
    by_factor: bool = False
    unit: str = ""
    stated: bool = False

    @property
    def is_speed(self) -> bool:
        """Whether it holds the speed of what it stands for."""
        return self.unit in SPEEDS

    @classmethod
    def parse(cls, quantity: str, text: str) -> Column:
        """Parse `[-]column[:unit or factor]`; raise InputError on anything else."""
        name, _, unit = text.partition(":")
        sign, name = (-1.0, name[1:]) if name.startswith("-") else (1.0, name)
        units = UNITS[quantity]
        known = unit_of(unit, units) or "" if unit else next(iter(units))
        factor = units.get(known)
        if factor is None:
            try:
                factor = float(unit) if unit.isascii() else math.nan
            except ValueError:
                factor = math.nan
        if not name or not 1.0 / GREATEST_FACTOR <= abs(factor) <= GREATEST_FACTOR:
            raise InputError(
                f"{quantity}={text} is not understood; write {quantity}=[-]column[:unit] with one "
                f"of the units {', '.join(units)}, or with a factor to {next(iter(units))}"
                f"{_by_number('colon' if unit else '')}."
            )
        return cls(name.strip(), sign * factor, not known, known if unit else "")

    def read_as(self, path: Path, quantity: str, heading: Heading) -> Column:
        """Return the column in the unit that a file states of it, where the map gave none.

        Raises:
            InputError: the file states a unit that is none of the quantity.
        """
        units = UNITS[quantity]
        stated = stated_unit(heading.title, heading.unit, units)
        if not stated or self.unit or self.by_factor:
            return self
        if stated not in units:
            default = next(iter(units))
            raise InputError(
                f"{path}: {quantity} is mapped to {heading.title}, which the file says to be in "
                f"{stated}; give the unit, or the factor that leads to {default}, as in "
                f"{quantity}={self.name}:0.25, or map another column."
            )
        return replace(self, factor=self.factor * units[stated], unit=stated, stated=True)

    def contradiction(self, quantity: str, heading: Heading) -> str | None:
        """Return what a file states against the unit that the map gave; None if nothing."""
        units = UNITS[quantity]
        stated = stated_unit(heading.title, heading.unit, units)
        if not self.unit or not stated or units.get(stated) == units[self.unit]:
            return None
        return f"{quantity} is taken in {self.unit}, though its column says {stated}"


def _by_number(mark: str) -> str:
    """Return how a column is named whose name holds a mark that parts the map; empty without."""
    return mark and f"; give a column with a {mark} in its name by its number, counted from 0"


def parse_map(
    specs: Sequence[str], *, described: bool = False, swings_free: bool = False
) -> dict[str, Column]:
    """Parse `quantity=[-]column[:unit]` of all quantities of `UNITS`.

    Args:
        specs: one for each quantity.
        described: whether the controller is described, which then makes a torque that is missing.
        swings_free: whether no torque acts, so that none is to be mapped.

    Raises:
        InputError: a quantity or unit is unknown, named twice, or position or torque is missing; a
            torque is mapped where none acts, or a known one where none is recorded or a controller
            makes it.
    """
    columns: dict[str, Column] = {}
    for spec in specs:
        quantity, equals, source = spec.strip().partition("=")
        if quantity in ("speed", "velocity") and equals:
            raise InputError(
                f"the map {spec!r} is not understood: a speed stands for an angle, as in "
                "position=v:rpm or reference=v:rad/s."
            )
        if not equals or quantity not in UNITS or quantity in columns:
            raise InputError(
                f"the map {spec!r} is not understood; give each of {', '.join(UNITS)} at most "
                f"once, as quantity=column{_by_number('' if equals else 'comma')}."
            )
        columns[quantity] = Column.parse(quantity, source)
    missing = [quantity for quantity in REQUIRED if quantity not in columns]
    if swings_free and "torque" in columns:
        raise InputError(
            "the map has a torque, though no torque is said to act; leave out torque=..., or "
            "--swings-free."
        )
    if KNOWN in columns and ("torque" not in columns or described):
        raise InputError(
            f"the map has {KNOWN}, which is taken off a recorded torque that then drives the "
            f"model: map torque=COLUMN{' and leave out --controller' if described else ''}."
        )
    if missing == ["torque"] and (swings_free or (described and "reference" in columns)):
        missing = []
    if missing:
        made = ""
        if missing == ["torque"]:
            made = (
                ", or, where reference and position were logged alone, describe the whole "
                "controller that made it (--controller), or, where no torque acts, say "
                "--swings-free"
            )
        raise InputError(f"the map lacks {' and '.join(missing)}; add {missing[0]}=column{made}.")
    for quantity in columns:
        signal = quantity.removesuffix(OWN_TIME)
        if signal not in columns:
            raise InputError(f"the map has {quantity} but no {signal}; add {signal}=COLUMN.")
    refuse_both_axes("the map", columns)
    _refuse_one_for_two(columns)
    return columns


def _refuse_one_for_two(columns: Mapping[str, Column]) -> None:
    """Raise InputError if one column is mapped to two signals."""
    first: dict[str, str] = {}
    for quantity, column in columns.items():
        if is_time(quantity):
            continue
        other = first.setdefault(column.name, quantity)
        if other != quantity:
            raise InputError(
                f"the map has {other} and {quantity} in one column, {column.name}; map the column "
                f"of each, or leave {quantity} out."
            )


def is_time(quantity: str) -> bool:
    """Tell whether a quantity of a map is stamps, of all signals or of one."""
    return quantity == TIME or quantity.endswith(OWN_TIME)


def is_linear(columns: Mapping[str, Column]) -> bool:
    """Tell whether the units of a map are those of a linear axis."""
    return any(column.unit in LINEAR for column in columns.values())


def refuse_both_axes(source: str, columns: Mapping[str, Column]) -> None:
    """Raise InputError if some units are those of a linear axis and others of a rotary one.

    Args:
        source: what gives or states the units.
        columns: the column of each quantity.
    """
    given = {q: c.unit for q, c in columns.items() if c.unit and not is_time(q)}
    linear = [f"{quantity} in {unit}" for quantity, unit in given.items() if unit in LINEAR]
    rotary = [f"{quantity} in {unit}" for quantity, unit in given.items() if unit not in LINEAR]
    if linear and rotary:
        raise InputError(
            f"{source} has {linear[0]}, as of a linear axis, and {rotary[0]}, as of a rotary one; "
            "give m and N, or rad and N m."
        )


def parse_harmonics(text: str) -> list[int]:
    """Parse `13:249:4,300` (first:last:step, both ends included); raise InputError otherwise."""
    harmonics: set[int] = set()
    for part in text.split(","):
        try:
            if not part.isascii():
                raise ValueError
            first, *rest = (int(number) for number in part.split(":"))
            last, step = (*rest, 1)[:2] if rest else (first, 1)
            if len(rest) > 2 or first < 1 or step < 1 or last < first or last > 10**8:
                raise ValueError
        except ValueError:
            raise InputError(
                f"the harmonics {text!r} are not understood; write 1,3,7 or first:last:step."
            ) from None
        harmonics.update(range(first, last + 1, step))
    return sorted(harmonics)
