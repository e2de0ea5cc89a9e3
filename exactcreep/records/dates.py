"""Read dates and times of day: explicit formats, each an expression of the codes of `strptime`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from functools import cache, lru_cache
from itertools import product
from math import nan

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.records.words import MONTHS, ZONES

FIRST_YEAR, LAST_YEAR = 1700, 2200
DAY = 86400  # seconds
_ORDERS = ("%Y-%m-%d", "%d-%m-%Y", "%m-%d-%Y", "%d-%m-%y", "%m-%d-%y", "%y-%m-%d", "%d-%b-%Y",
           "%d-%b-%y", "%b-%d-%Y", "%Y-%b-%d", "%Y-%m", "%m-%Y", "%b-%Y")  # fmt: skip
DAYS = tuple(day.replace("-", sign) for sign in "-/. " for day in _ORDERS if sign != "."
             or not day.startswith("%m-%d"))  # fmt: skip
DAYS += ("%b %d, %Y", "%b %d,%Y", "%b. %d, %Y", "%d. %m. %Y", "%d. %b %Y", "%d%b%Y", "%b-%y",
         "%Y %j", "%Y年%m月%d日", "%Y年%m月")  # fmt: skip
_DIGITS = ("%Y%m%d", "%Y%m", "%d%m%Y", "%m%d%Y", "%y%m%d", "%d%m%y", "%m%d%y")
_JOINTS = (" ", "T", " T", "-", ":", ".", "_", ", ", ",", "/", "")
CLOCKS = tuple(f"{clock}{zone}" for clock in (
    "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p", "%I:%M:%S%p", "%I:%M%p", "%I %p", "%H.%M.%S",
    "%H.%M", "%Hh%M", "%Hh", "%H時", "%H時%M分", "%H", "%H%M", "%H%M%S", "%H %M", "%H %M %S",
) for zone in ("", "%z", " %z"))  # fmt: skip
_MONTH_OF = {name: k for k, names in enumerate(MONTHS, 1) for name in names}
_CODES = {
    "Y": r"(?P<Y>\d{4})", "y": r"(?P<y>\d\d)", "m": r"(?P<m>\d{1,2})", "d": r"(?P<d>\d{1,2})",
    "b": r"(?P<b>[^\W\d_]{3,10})\.?", "j": r"(?P<j>\d{1,3})", "H": r"(?P<H>\d{1,2})",
    "I": r"(?P<I>\d{1,2})", "M": r"(?P<M>\d{1,2})", "S": r"(?P<S>\d{1,2}(?:[.,]\d+)?)",
    "p": r"(?P<p>[AaPp])(?:\.?\s?[Mm]\.?)?",
    "z": rf"(?P<z>[+-]\d\d(?::?\d\d)?|{'|'.join(sorted(ZONES, key=len, reverse=True))})",
    "s": r"(?P<s>-?\d{1,10}(?:\.\d*)?|\d{12,13})", "%": "%",
}  # fmt: skip
_DAY, _CLOCK = "Yymbdj", "HIpMSz"
_WEEKDAY = (
    r"(?:(?:[Mm]o|[Tt]u|[Ww]e|[Tt]h|[Ff]r|[Ss][auo]|[Dd][io]|[Mm]i)[^\W\d_]{0,8}[.,]{0,2}\s)?"
)
_BESIDE = re.compile(r"%[YymdHMSj]")
_ACCENTS = str.maketrans("äáàâãåéèêëíïîóòôöõúùûüřžščçñł", "aaaaaaeeeeiiiooooouuuurzsccnl")


@cache
def _expression(written: str) -> re.Pattern[str]:
    """Return the regular expression of a format; "" is ISO 8601."""
    if not written:
        clock = rf"{_CODES['H']}:{_CODES['M']}(?::{_CODES['S']})?\s?{_CODES['z']}?"
        return re.compile(rf"{_CODES['Y']}-{_CODES['m']}-{_CODES['d']}(?:[T ]\s?{clock})?")
    out, k = "", 0
    while k < len(written):
        if written[k] != "%":
            out += r"\s+" if written[k] == " " else re.escape(written[k])
            k += 1
            continue
        code = written[k + 1 : k + 2]
        if code not in _CODES:
            known = " ".join(f"%{each}" for each in _CODES)
            raise InputError("date_format", written, f"must have codes among {known}")
        part = _CODES[code]
        digits = _BESIDE.match(written, k) and code not in "Yy"
        if digits and (_BESIDE.match(written, k + 2) or (k > 1 and _BESIDE.match(written, k - 2))):
            part = f"(?P<{code}>" + r"\d" * (3 if code == "j" else 2) + ")"
        out, k = out + part, k + 2
    return re.compile(_WEEKDAY + out if "%d" in written and not written[:1].isspace() else out)


def moments_of(texts: Sequence[str], written: str) -> NDArray[np.float64]:
    """Return the times of texts in a format, in seconds since 1970 (or 0:00); nan for no time.

    24:00 is the midnight after the day. Texts in ISO 8601 have all a time zone, or none.
    """
    expression = _expression(written)
    known = expression.groupindex
    where = [[known.get(code, 0) for code in codes] for codes in ("s", _DAY, _CLOCK)]
    found = [match and (match[0], *match.groups()) for match in map(expression.fullmatch, texts)]
    out = np.full(len(texts), nan)
    zoned = None
    for k, parts in enumerate(found):
        if parts is None:
            continue
        if not written:
            zone = parts[known["z"]] is not None
            zoned = zone if zoned is None else zoned
            if zone is not zoned:
                continue
        (epoch, days, clock) = ([place and parts[place] for place in each] for each in where)
        if epoch[0]:
            seconds = float(epoch[0])
            out[k] = seconds / 1000 if abs(seconds) >= 1e11 else seconds
        else:
            out[k] = _days(*days) * DAY + _clock(*clock)
    return out


@lru_cache(2**16)
def _days(year: str, short: str, month: str, name: str, day: str, of_year: str) -> float:
    """Return the days since 1970; 0 without a date; nan if the calendar has no such day."""
    if not (year or short):
        return nan if month or name or day or of_year else 0.0
    number = int(year or short) + (0 if year else 2000 if int(short) < 70 else 1900)
    try:
        begin = datetime(number, int(month or 0) or (_month(name) if name else 1), int(day or 1))
    except ValueError:
        return nan
    found = begin + timedelta(int(of_year or 1) - 1)
    inside = FIRST_YEAR <= number < LAST_YEAR and found.year == number and of_year != "0"
    return (found - datetime(1970, 1, 1)).days if inside else nan


def _month(name: str) -> int:
    letters = name.lower().translate(_ACCENTS)
    return _MONTH_OF.get(letters[:4], _MONTH_OF.get(letters[:3], 0))


@lru_cache(2**16)
def _clock(hour: str, twelve: str, half: str, minute: str, second: str, zone: str) -> float:
    """Return the seconds of a day, in UTC if there is a time zone; nan if there is no such time."""
    hours = int(hour or 0)
    if twelve:
        hours = int(twelve) % 12 + 12 * (half in ("P", "p"))
    minutes, seconds = int(minute or 0), float((second or "0").replace(",", "."))
    found = 3600 * hours + 60 * minutes + seconds
    good = found <= DAY and minutes < 60 and seconds < 60 and (not twelve or 1 <= int(twelve) <= 12)
    return found - 3600 * _zone(zone) if good else nan


def _zone(text: str) -> float:
    """Return the hours that a time zone is before UTC."""
    if not text or text in ZONES:
        return float(ZONES.get(text, 0))
    digits = text[1:].replace(":", "").ljust(4, "0")
    return (int(digits[:2]) + int(digits[2:]) / 60) * (-1 if text[0] == "-" else 1)


def formats_of(text: str, *, digits: bool) -> Iterator[str]:
    """Yield the formats in which a text is a date; `digits` alone are a date only if so said."""
    if _expression("").fullmatch(text):
        yield ""
        return
    for day in (*DAYS, *(_DIGITS if digits or not text.isdigit() else ())):
        begin = _expression(day).match(text)
        if begin is None:
            continue
        if begin.end() == len(text):
            yield day
            continue
        if not {"d", "j"} & {*day}:
            continue
        for joint, clock in product(_JOINTS, CLOCKS):
            if not joint and not (text.isdigit() or clock.startswith("%H時")):
                continue
            if text.startswith(joint.strip() or " ", begin.end()) or not joint:
                written = f"{day}{joint}{clock}"
                if _expression(written).fullmatch(text):
                    yield written
