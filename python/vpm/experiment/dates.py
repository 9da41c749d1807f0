"""Dates and times of day of a text log, as its clock."""

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from vpm.numbers import Array

#: Year first (ISO 8601), day first with points, or slashes, of which only the order of day and month is unknown.
_DAY = r"(?P<iso>\d{4}-\d{1,2}-\d{1,2})|(?P<points>\d{1,2}\.\d{1,2}\.(?:\d{2}|\d{4}))|(?P<slashes>\d+/\d+/\d+)"
_TIME = r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,](?P<part>\d{1,9}))?"
_ZONE = r"(?P<zone>Z|[+-]\d{2}:?\d{2})?"
_STAMP = re.compile(rf"(?:(?:{_DAY})(?:[T ]|,? +))?{_TIME} ?{_ZONE}", re.ASCII)
#: Dates and times of day, whose points and commas say nothing of decimal commas.
STAMP_BYTES = re.compile(rb"\d+\.\d+\.\d+|\d+:\d+:\d+(?:[.,]\d+)?")
_DAY_LENGTH = 86400


def is_date(cell: str) -> bool:
    """Whether a cell is a date with its time of day, or the latter alone."""
    return _STAMP.fullmatch(cell.strip()) is not None


def seconds_of_dates(cells: Sequence[str]) -> Array:
    """Seconds of dates from the first of them.

    Nanoseconds are counted in whole numbers. A zone is taken off, so that an hour of summer time does not show.

    Raises `ValueError`: a cell is no date; its index is the first argument, and why the second. Dates with slashes may
    stay within one day only, because their day and month may stand in either order.
    """
    ticks, days = np.empty(len(cells), dtype=np.int64), set()
    for place, cell in enumerate(cells):
        match = _STAMP.fullmatch(cell.strip())
        if match is None:
            raise ValueError(place, "is no date with a time of day, such as 2026-03-14 09:26:53.120")
        found = match.groupdict()
        try:
            day = _day(found)
        except ValueError as error:
            raise ValueError(place, f"is no date ({error})") from error
        days.add(found["slashes"])
        if len(days) > 1 and any(days):
            raise ValueError(place, "is another day, and slashes do not tell its order; write dates as 2026-03-14")
        seconds = 3600 * int(found["hour"]) + 60 * int(found["minute"]) + int(found["second"])
        part = int((found["part"] or "0").ljust(9, "0"))
        ticks[place] = (day * _DAY_LENGTH + seconds - _zone(found["zone"])) * 10**9 + part
    return np.asarray(ticks - ticks[:1], dtype=np.float64) * 1e-9


def _day(found: dict[str, str | None]) -> int:
    """Number of the day of a date, of which only differences count; zero where it does not say."""
    if iso := found["iso"]:
        year, month, day = map(int, iso.split("-"))
    elif points := found["points"]:
        day, month, year = map(int, points.split("."))
        year += 2000 if year < 100 else 0
    else:
        return 0
    return date(year, month, day).toordinal() - date(2000, 1, 1).toordinal()


def _zone(zone: str | None) -> int:
    """Seconds by which a date's zone is ahead of Greenwich."""
    if zone is None or zone == "Z":
        return 0
    ahead = 3600 * int(zone[1:3]) + 60 * int(zone[-2:])
    return -ahead if zone.startswith("-") else ahead
