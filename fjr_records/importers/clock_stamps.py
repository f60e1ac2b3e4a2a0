"""Stamps in words of calendar and clock, as tables hold them: 2026-01-31 12:00:00.125."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date, timedelta

_DATE = (
    r"(?P<y>\d{4})[-/](?P<m>\d\d?)[-/](?P<d>\d\d?)|(?P<d2>\d\d?)\.(?P<m2>\d\d?)\.(?P<y2>\d{4})"
    r"|(?P<one>\d\d?)[/-](?P<other>\d\d?)[/-](?P<y3>\d{4})"
)
_CLOCK = (
    r"(?P<hour>\d\d?):(?P<minute>\d\d):(?P<second>\d\d(?:[.,]\d+)?)(?:\s*(?P<half>[AaPp])[Mm])?"
)
_ZONE = r"Z|UTC|(?P<sign>[+-])(?P<zh>\d\d):?(?P<zm>\d\d)"
_STAMP = re.compile(rf"(?:(?:{_DATE})(?:[T_ ]+))?{_CLOCK}\s*(?:{_ZONE})?", re.ASCII)
_DAY = re.compile(_DATE, re.ASCII)
_BEGINS = re.compile(r"\d\d?:\d\d:\d\d", re.ASCII)
_HALF = re.compile(r"[AP]M", re.I)
STAMPS_READ = (
    "write it as 2026-01-31 12:00:00.125, 31.01.2026 12:00:00.125, 01/31/2026 12:00:00 PM (if a "
    "number above 12 tells day from month) or 12:00:00.125"
)
"""What helps where a stamp is in a form that is not read, a clause."""


def is_stamp(cell: str) -> bool:
    """Tell whether a cell holds a time of day, perhaps with a date before and a zone behind it."""
    return _STAMP.fullmatch(cell) is not None


def has_clock(cell: str) -> bool:
    """Tell whether a cell holds a time of day, whatever else."""
    return _BEGINS.search(cell) is not None


def rejoined(cells: list[str]) -> list[str]:
    """Return cells that were parted at white space, each date with its time of day again.

    Behind the time of day there may be AM or PM.
    """
    if len(cells) < 2 or not (any(map(_DAY.fullmatch, cells)) or any(map(_HALF.fullmatch, cells))):
        return cells
    found: list[str] = []
    for cell in cells:
        dated = found and _DAY.fullmatch(found[-1]) and _BEGINS.match(cell)
        if dated or (found and _HALF.fullmatch(cell) and is_stamp(found[-1])):
            found[-1] += f" {cell}"
        else:
            found.append(cell)
    return found


def since(first: str) -> Callable[[str], float]:
    """Return what tells the time from one stamp to another (s); both raise ValueError for none.

    Of dates such as 01/02/2026 it is not known which number is the month, unless one is above 12:
    two that differ are then no stamps.
    """
    begin = _parts(first)

    def elapsed(stamp: str) -> float:
        parts = _parts(stamp)
        days = _day(parts, begin) - _day(begin, parts)
        return days * 86400.0 + _seconds(parts) - _seconds(begin)

    return elapsed


def _parts(stamp: str) -> dict[str, str]:
    """Return what stands in a stamp, empty where there is nothing; raise ValueError for none."""
    found = _STAMP.fullmatch(stamp)
    if found is None:
        raise ValueError(stamp)
    return {name: text or "" for name, text in found.groupdict().items()}


def _day(parts: dict[str, str], beside: dict[str, str]) -> int:
    """Return the day of the calendar, 0 without a date; raise ValueError if it is not told.

    Args:
        parts: of a stamp.
        beside: of a stamp of the same clock, which may tell day from month, or have the same date.
    """
    year, month, day = (parts[name] or parts[f"{name}2"] for name in "ymd")
    if parts["y3"]:
        year, month, day = parts["y3"], parts["one"], parts["other"]
        dates = [(int(each["one"] or 0), int(each["other"] or 0)) for each in (parts, beside)]
        if max(map(max, dates)) <= 12 and dates[0] != dates[1]:
            raise ValueError(parts["y3"])
        if any(one > 12 for one, _ in dates):
            month, day = day, month
    return date(int(year), int(month), int(day)).toordinal() if year else 0


def _seconds(parts: dict[str, str]) -> float:
    """Return the seconds of the day, of universal time where a zone stands."""
    hour = int(parts["hour"])
    if parts["half"]:
        hour = hour % 12 + 12 * (parts["half"] in "Pp")
    seconds = 60 * (60 * hour + int(parts["minute"]))
    if parts["sign"]:
        zone = timedelta(hours=int(parts["zh"]), minutes=int(parts["zm"])).total_seconds()
        seconds -= int(zone if parts["sign"] == "+" else -zone)
    return seconds + float(parts["second"].replace(",", "."))
