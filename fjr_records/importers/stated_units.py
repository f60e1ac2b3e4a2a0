"""Units that a file states itself, in the name of a column or in a row of units below the names."""

from __future__ import annotations

import re
from collections.abc import Mapping

_ALIASES: Mapping[str, str] = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "°/s": "deg/s",
    "deg_s": "deg/s",
    "dps": "deg/s",
    "rad_s": "rad/s",
    "rev_s": "rev/s",
    "mm_s": "mm/s",
    "1/min": "rpm",
    "min-1": "rpm",
    "u/min": "rpm",
    "n*m": "N m",
    "n.m": "N m",
    "n·m": "N m",
    "n-m": "N m",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "millisec": "ms",
    "µs": "us",
    "μs": "us",
    "µm": "um",
    "μm": "um",
}
"""Other spellings of units, in small letters, and the unit."""
_OTHERS = frozenset(
    {"a", "ma", "v", "mv", "%", "count", "counts", "cnt", "inc", "tick", "ticks", "pulse", "pulses"}
)
"""What a column may be in that is no unit of the rig, in small letters."""
_AMBIGUOUS = frozenset({"rev"})
"""Units that the end of a name does not state: `pos_rev` may be the reverse way."""
_BRACKETS = re.compile(r".*[\[({<]\s*(?P<unit>[^\[\](){}<>]+?)\s*[\])}>]\s*")
_INDEX = re.compile(r"\[[0-9]+\]$")
_ENDING = re.compile(r".+?[_\s]/?\s*(?P<unit>(?:rad|deg|rev|mm)_s|[^\W_]+)")


def unit_of(text: str, units: Mapping[str, float]) -> str | None:
    """Return which of some units a text is, in any usual spelling; None if it is none of them."""
    text = text.strip()
    if text in units:
        return text
    alias = _ALIASES.get(text.lower())
    if alias in units:
        return alias
    by_small = {unit.lower(): unit for unit in units}
    # A large M is mega, which no rig needs, and no milli.
    return None if text.startswith("M") else by_small.get(text.lower())


def stated_unit(title: str, row: str, units: Mapping[str, float]) -> str:
    """Return the unit that a file states of a column: one of those given, or another; else "".

    Args:
        title: name of the column: `act [deg]`, `act (deg)`, `act_deg`, or one that states nothing.
        row: what stands in the row of units; empty if there is none.
        units: those of the quantity that the column is said to be.
    """
    for text in (row, _in_brackets(title)):
        unit = unit_of(text, units)
        if unit is not None:
            return unit
        if text.strip().lower() in _OTHERS:
            return text.strip()
    ending = _ENDING.fullmatch(_INDEX.sub("", title))
    unit = unit_of(ending["unit"], units) if ending and len(ending["unit"]) > 1 else None
    return "" if unit is None or unit in _AMBIGUOUS else unit


def _in_brackets(title: str) -> str:
    found = _BRACKETS.fullmatch(title)
    return found["unit"] if found else ""
