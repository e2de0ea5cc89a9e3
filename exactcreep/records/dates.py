"""Read dates and times of day: explicit formats, each an expression of the codes of `strptime`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError

FIRST_YEAR, LAST_YEAR = 1700, 2200
DAY = 86400  # seconds
_DAYS = ("%Y-%m-%d", "%d-%m-%Y", "%m-%d-%Y", "%d-%m-%y", "%m-%d-%y", "%y-%m-%d",
         "%d-%b-%Y", "%d-%b-%y", "%b-%d-%Y", "%Y-%b-%d", "%Y-%m", "%m-%Y", "%b-%Y")  # fmt: skip
_BETWEEN = ("-", "/", ".", " ")
_OTHERS = ("%b %d, %Y", "%b %d,%Y", "%b. %d, %Y", "%d. %m. %Y", "%d. %b %Y", "%d%b%Y", "%b-%y",
           "%Y年%m月%d日", "%Y年%m月")  # fmt: skip
_DIGITS = ("%Y%m%d", "%Y%m", "%d%m%Y", "%m%d%Y", "%y%m%d", "%d%m%y", "%m%d%y")
_CLOCKS = ("%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p", "%I:%M:%S%p", "%I:%M%p", "%I %p",
           "%H.%M.%S", "%H.%M", "%Hh%M", "%Hh", "%H時", "%H時%M分", "%H:%M:%S:%f")  # fmt: skip
_HOURS = ("%H", "%H%M", "%H%M%S")
_JOINTS = (" ", "T", " T", "-", ":", ".", "_", ", ", ",", "/", "")
_ZONED = ("", "%z", " %z")
_MONTHS = (
    "jan,ene,gen,sty,led,tam", "feb,fev,lut,uno", "mar,mae,mrz,mrt,maa,bre", "apr,avr,abr,kwi,dub",
    "may,mai,mag,maj,mei,kve", "jun,juin,giu,cze,cer,jui", "jul,juil,lug,lip,cec",
    "aug,aou,ago,sie,srp", "sep,set,wrz,zar", "oct,okt,out,ott,paz,rij", "nov,lis",
    "dec,dez,dic,gru,pro",
)  # fmt: skip
_MONTH_OF = {name: k for k, names in enumerate(_MONTHS, 1) for name in names.split(",")}
_ZONES = {"Z": 0, "UTC": 0, "GMT": 0, "UT": 0, "WET": 0, "WEST": 1, "CET": 1, "MEZ": 1, "CEST": 2,
          "MESZ": 2, "BST": 1, "EET": 2, "EEST": 3, "JST": 9, "EST": -5, "EDT": -4, "CST": -6,
          "CDT": -5, "MST": -7, "MDT": -6, "PST": -8, "PDT": -7}  # fmt: skip
_CODES = {
    "Y": r"(?P<Y>\d{4})", "y": r"(?P<y>\d\d)", "m": r"(?P<m>\d{1,2})", "d": r"(?P<d>\d{1,2})",
    "b": r"(?P<b>[^\W\d_]{3,10})\.?", "j": r"(?P<j>\d{1,3})", "H": r"(?P<H>\d{1,2})",
    "I": r"(?P<I>\d{1,2})", "M": r"(?P<M>\d{1,2})", "S": r"(?P<S>\d{1,2}(?:[.,]\d+)?)",
    "p": r"(?P<p>[AaPp])(?:\.?\s?[Mm]\.?)?", "f": r"(?P<f>\d+)",
    "z": rf"(?P<z>[+-]\d\d(?::?\d\d)?|{'|'.join(sorted(_ZONES, key=len, reverse=True))})",
    "s": r"(?P<s>-?\d{1,10}(?:\.\d*)?|\d{12,13})", "%": "%",
}  # fmt: skip
_WEEKDAY = (
    r"(?:(?:[Mm]o|[Tt]u|[Ww]e|[Tt]h|[Ff]r|[Ss][auo]|[Dd][io]|[Mm]i)[^\W\d_]{0,8}[.,]{0,2}\s)?"
)
_BESIDE = re.compile(r"%[YymdHMSj]")
_ACCENTS = str.maketrans("äáàâãåéèêëíïîóòôöõúùûüřžščçñł", "aaaaaaeeeeiiiooooouuuurzsccnl")


class Moments(NamedTuple):
    """Times in seconds since 1970, nan where a text is no date, and whether they have a zone."""

    seconds: NDArray[np.float64]
    zoned: bool


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


def moments_of(texts: Sequence[str], written: str) -> Moments:
    """Return the times of texts in a format; 24:00 is the midnight after the day."""
    expression = _expression(written)
    names = list(expression.groupindex)
    found = [match.groups() if match else None for match in map(expression.fullmatch, texts)]
    parts = {name: [row[k] if row else None for row in found] for k, name in enumerate(names)}
    values = {name: _numbers(name, column) for name, column in parts.items()}
    whole = np.array([row is not None for row in found], bool)
    if not written and whole.any():  # all have a time zone, or none
        zoned = np.array([text is not None for text in parts["z"]], bool)
        whole &= zoned == zoned[int(np.argmax(whole))]
        values = values if zoned.any() else {k: v for k, v in values.items() if k != "z"}
    seconds = np.zeros(len(texts))
    if "s" in values:
        seconds = np.where(np.abs(values["s"]) >= 1e11, values["s"] / 1000, values["s"])
    elif {"Y", "y"} & values.keys():
        years = values.get("Y")
        if years is None:
            years = values["y"] + np.where(values["y"] < 70, 2000, 1900)
        days = days_of(years, values.get("m", values.get("b")), values.get("d"), values.get("j"))
        seconds = days * DAY
    elif not {"H", "I"} & values.keys():
        seconds = np.full(len(texts), np.nan)
    seconds = seconds + clock_of(values, len(texts))
    if not {"Y", "y", "s"} & values.keys():
        return Moments(np.where(whole, seconds, np.nan), "z" in values)
    ends = (np.datetime64(f"{year}-01-01", "s") for year in (FIRST_YEAR, LAST_YEAR))
    low, high = (end.astype(int) for end in ends)
    inside = (seconds >= low) & (seconds < high)
    return Moments(np.where(whole & inside, seconds, np.nan), "z" in values or "s" in values)


def days_of(
    years: NDArray[np.float64], months: NDArray[np.float64] | None,
    days: NDArray[np.float64] | None, day_of_year: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:  # fmt: skip
    """Return days since 1970 of a calendar; nan where it has no such day."""
    one = np.ones(len(years))
    months = one if months is None or day_of_year is not None else months
    days = one if days is None else days
    days = days if day_of_year is None else day_of_year
    most = 31 if day_of_year is None else 366
    good = (months >= 1) & (months <= 12) & (days >= 1) & (days <= most)
    good &= (years >= FIRST_YEAR) & (years < LAST_YEAR)
    count = np.where(good, (years - 1970) * 12 + months - 1, 0).astype("datetime64[M]")
    found = count.astype("datetime64[D]") + (np.where(good, days, 1) - 1).astype("timedelta64[D]")
    unit = "M" if day_of_year is None else "Y"
    good &= found.astype(f"datetime64[{unit}]") == count.astype(f"datetime64[{unit}]")
    return np.where(good, found.astype(np.int64), np.nan)


def clock_of(values: dict[str, NDArray[np.float64]], count: int) -> NDArray[np.float64]:
    """Return the seconds of a day; nan where there is no such time."""
    zero = np.zeros(count)
    hours, minutes, seconds = (values.get(code, zero) for code in "HMS")
    if "I" in values:
        hours = np.where(
            (values["I"] >= 1) & (values["I"] <= 12), values["I"] % 12 + values["p"], np.nan
        )
    found = 3600 * hours + 60 * minutes + seconds - 3600 * values.get("z", zero)
    within = 3600 * hours + 60 * minutes + seconds
    good = (within >= 0) & (within <= DAY) & (minutes < 60) & (seconds < 60)
    return np.where(good, found, np.nan)


def _numbers(name: str, texts: Sequence[str | None]) -> NDArray[np.float64]:
    if name in "bpz":
        change = {"b": _month, "p": _half, "z": _zone}[name]
        known = {text: change(text) if text else 0.0 for text in {*texts}}
        return np.array([known[text] for text in texts], float)
    if name == "S":
        texts = [text and text.replace(",", ".") for text in texts]
    return np.array([float(text or 0) for text in texts], float)


def _month(text: str) -> float:
    letters = text.lower().translate(_ACCENTS)
    found = [_MONTH_OF[letters[:k]] for k in (4, 3) if letters[:k] in _MONTH_OF]
    return found[0] if found else np.nan


def _half(text: str) -> float:
    return 12.0 if text in "Pp" else 0.0


def _zone(text: str) -> float:
    if text in _ZONES:
        return _ZONES[text]
    digits = text[1:].replace(":", "").ljust(4, "0")
    return (int(digits[:2]) + int(digits[2:]) / 60) * (-1 if text[0] == "-" else 1)


@cache
def _formats(*, digits: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return formats of days, and of the time of day with what joins it to the day."""
    days = [day.replace("-", between) for between in _BETWEEN for day in _DAYS
            if between != "." or not day.startswith("%m-%d")]  # fmt: skip
    days += [*_OTHERS, *(_DIGITS if digits else ())]
    clocks = ["", *(f"{clock}{zone}" for clock in _CLOCKS for zone in _ZONED)]
    clocks += [f"{hour}{zone}" for hour in _HOURS for zone in _ZONED]
    return tuple(days), tuple(clocks)


def formats_of(text: str, *, digits: bool) -> Iterator[str]:
    """Yield the formats in which a text is a date; `digits` alone are a date only if so said."""
    if _expression("").fullmatch(text):
        yield ""
        return
    days, clocks = _formats(digits=digits or not text.isdigit())
    for day in days:
        begin = _expression(day).match(text)
        if begin is None:
            continue
        if begin.end() == len(text):
            yield day
            continue
        if "d" not in day:
            continue
        for joint, clock in product(_JOINTS, clocks):
            if not clock or (not joint and not (text.isdigit() or clock.startswith("%H時"))):
                continue
            if text.startswith(joint.strip() or " ", begin.end()) or not joint:
                written = f"{day}{joint}{clock}"
                if _expression(written).fullmatch(text):
                    yield written


def clock_formats_of(text: str, *, digits: bool) -> Iterator[str]:
    """Yield the formats in which a text is a time of day."""
    for clock in (*_CLOCKS, *(_HOURS if digits or not text.isdigit() else ())):
        for zone in _ZONED:
            if _expression(clock + zone).fullmatch(text):
                yield clock + zone
