"""Stamps in words of calendar and clock, as tables hold them: 2026-01-31 12:00:00.125."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date, timedelta

_DATE = r"(?P<y>\d{4})[-/](?P<m>\d\d?)[-/](?P<d>\d\d?)|(?P<d2>\d\d?)\.(?P<m2>\d\d?)\.(?P<y2>\d{4})"
_CLOCK = r"(?P<hour>\d\d?):(?P<minute>\d\d):(?P<second>\d\d(?:[.,]\d+)?)"
_ZONE = r"Z|UTC|(?P<sign>[+-])(?P<zh>\d\d):?(?P<zm>\d\d)"
_STAMP = re.compile(rf"(?:(?:{_DATE})(?:[T_ ]+))?{_CLOCK}\s*(?:{_ZONE})?", re.ASCII)
_DAY = re.compile(_DATE, re.ASCII)
_BEGINS = re.compile(r"\d\d?:\d\d:\d\d", re.ASCII)


def is_stamp(cell: str) -> bool:
    """Tell whether a cell holds a time of day, perhaps with a date before and a zone behind it."""
    return _STAMP.fullmatch(cell) is not None


def rejoined(cells: list[str]) -> list[str]:
    """Return cells that were parted at white space, each date with its time of day again."""
    if len(cells) < 2 or not any(map(_DAY.fullmatch, cells)):
        return cells
    found: list[str] = []
    for cell in cells:
        if found and _DAY.fullmatch(found[-1]) and _BEGINS.match(cell):
            found[-1] += f" {cell}"
        else:
            found.append(cell)
    return found


def since(first: str) -> Callable[[str], float]:
    """Return what tells the time from one stamp to another (s); both raise ValueError for none."""
    day, begun = _time(first)

    def elapsed(stamp: str) -> float:
        days, seconds = _time(stamp)
        return (days - day) * 86400.0 + seconds - begun

    return elapsed


def _time(stamp: str) -> tuple[int, float]:
    """Return days of the calendar and seconds of the day, of universal time where a zone stands."""
    found = _STAMP.fullmatch(stamp)
    if found is None:
        raise ValueError(stamp)
    parts = found.groupdict()
    year, month, day = (parts[name] or parts[f"{name}2"] for name in "ymd")
    days = date(int(year), int(month), int(day)).toordinal() if year else 0
    seconds = 60 * (60 * int(parts["hour"]) + int(parts["minute"]))
    if parts["sign"]:
        zone = timedelta(hours=int(parts["zh"]), minutes=int(parts["zm"])).total_seconds()
        seconds -= int(zone if parts["sign"] == "+" else -zone)
    return days, seconds + float(parts["second"].replace(",", "."))
