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
    "turn": "rev",
    "turns": "rev",
    "revs": "rev",
    "arcminute": "arcmin",
    "arcminutes": "arcmin",
    "arcsecond": "arcsec",
    "arcseconds": "arcsec",
    "µrad": "urad",
    "μrad": "urad",
    "hours": "h",
    "minutes": "min",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "millisec": "ms",
    "millis": "ms",
    "millisecond": "ms",
    "milliseconds": "ms",
    "usec": "us",
    "micros": "us",
    "microsec": "us",
    "microsecond": "us",
    "microseconds": "us",
    "nsec": "ns",
    "nanos": "ns",
    "nanosec": "ns",
    "nanoseconds": "ns",
    "µs": "us",
    "μs": "us",
    "µm": "um",
    "μm": "um",
}
"""Other spellings of units, in small letters, and the unit."""
_COUNTED = frozenset(
    {"count", "counts", "cnt", "cnts", "cts", "inc", "incr", "inkr", "tick", "ticks", "pulse",
     "pulses", "lsb"}
)  # fmt: skip
_ELECTRIC = frozenset({"ma", "mv", "arms", "apk"})
_OTHERS = _COUNTED | _ELECTRIC | {
    "a", "v", "%", "‰", "0.1%", "bit", "bits", "digit", "digits", "pwm", "duty", "raw", "volt",
    "ampere", "amp", "cycles", "samples", "grad", "gon", "in", "inch", "ft", "lb", "lbf", "lb-ft",
    "lbf-ft", "ft-lb", "lb-in", "oz-in", "kgcm", "kgfcm", "dan", "kg",
}  # fmt: skip
"""What a column may be in that is no unit of the rig, in small letters."""
_NONE = frozenset({"", "-", "--", "1", "[-]", "none", "n/a"})
"""What stands for no unit."""
_AMBIGUOUS = frozenset({"rev", "min", "h"})
"""Units that the end of a name does not state: `pos_rev` may be the reverse way."""
_BRACKETS = re.compile(r".*[\[({<]\s*(?P<unit>[^\[\](){}<>]+?)\s*[\])}>]\s*")
_SQUARE = re.compile(r".*[^\s\[][\s_]*\[\s*(?P<unit>[^\[\]\d][^\[\]]*?)\s*\]\s*")
"""Square brackets hold nothing but a unit or an index."""
_INDEX = re.compile(r"\[[0-9]+\]$")
_ENDING = re.compile(r".+?[_\s]/?\s*(?P<unit>(?:rad|deg|rev|mm)_s|[^\W_]+)")
_SLASH = re.compile(r"[^/]+?\s*/\s*(?P<unit>[^/\s]+(?:/(?:s|min))?)\s*")
"""A name, a slash and a unit, as standards write it: `phi/°`."""


def unit_of(text: str, units: Mapping[str, float]) -> str | None:
    """Return which of some units a text is, in any usual spelling; None if it is none of them."""
    text = text.strip().removesuffix(".")
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

    What stands in square brackets or in a row of units is a unit, known or not.

    Args:
        title: name of the column: `act [deg]`, `act (deg)`, `act_deg`, or one that states nothing.
        row: what stands in the row of units; empty if there is none.
        units: those of the quantity that the column is said to be.
    """
    in_brackets, in_square = _in(_BRACKETS, title), _in(_SQUARE, title)
    for text in (row, in_brackets, _in(_SLASH, title)):
        unit = unit_of(text, units)
        if unit is not None:
            return unit
        if text.strip().lower() in _OTHERS:
            return text.strip()
    for text in (row, in_square):
        if text.strip().lower() not in _NONE:
            return text.strip()
    small = title.lower() if title.isupper() else title
    ending = _in(_ENDING, _INDEX.sub("", small))
    if ending.lower() in _COUNTED | _ELECTRIC:
        return ending
    unit = unit_of(ending, units) if len(ending) > 1 else None
    return "" if unit is None or unit in _AMBIGUOUS else unit


def _in(pattern: re.Pattern[str], title: str) -> str:
    """Return the unit that a pattern finds in the name of a column; empty if it finds none."""
    found = pattern.fullmatch(title)
    return found["unit"] if found else ""
