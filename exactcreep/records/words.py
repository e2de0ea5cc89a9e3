"""Words in the names of columns: which name a temperature, a time, a unit, or something else.

The words are in ``words.toml``, to which another language can be added.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

_LISTS = tomllib.loads(Path(__file__).with_name("words.toml").read_text("utf-8"))


def _pattern(words: list[str]) -> re.Pattern[str]:
    return re.compile("|".join(words))


MONTHS, ZONES = _LISTS.pop("months"), _LISTS.pop("zones")
PARTS = {code: _pattern(words) for code, words in _LISTS.pop("parts").items()}
_OF = {kind: _pattern(words) for kind, words in _LISTS.items()}
EPOCH = _OF["epoch"]
_TWO = re.compile("degdays|bulboumido|ptemp")
_ZONES = ("utc", "gmt", "lst", "lt", "local", "est", "cst", "mst", "pst", "met", "cet")


def words_of(text: str) -> list[str]:
    """Return the words of a name in small letters, without accents: AirTC_Avg is air, tc, avg."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", text)
    plain = unicodedata.normalize("NFKD", apart.replace("ł", "l").replace("ı", "i"))
    bare = "".join(sign for sign in plain if not unicodedata.combining(sign)).casefold()
    return [word for word in re.split(r"[\W_]+", bare) if word]


def _any(words: Iterable[str], pattern: re.Pattern[str]) -> bool:
    return any(map(pattern.fullmatch, words))


_F = re.compile(r"°\s*F\b|℉|\bdeg(rees?)?\.?[\s_]*F\b|fahrenheit|[(\[]\s*F\s*[)\]]", re.I)
_K = re.compile(r"°\s*K\b|\bkelvin\b|[(\[]\s*K\s*[)\]]|deg[\s_]?K\b", re.I)
_C = re.compile(
    r"°\s*C\b|℃|\b(in|of)?degC\b|\bdeg(rees?)?\.?[\s_]*C\b|celsius|[(\[]\s*C\s*[)\]]"
    r"|grad\w*\s*C\b|centigrad|ºC|\bdegC\b|(?<=_)degC\b", re.I)  # fmt: skip
_LETTER = re.compile(
    r"(temp|tmp|airt|tair|t|outtemp|tempout|tmin|tmax|tavg|tempmin|tempmax)([cfk])"
)
_DEGREE = r"\s*(°|º|deg|grad|grau|oc\b|c\b|k\b|f\b|celsius|kelvin|graden)"
_TENTHS = re.compile(
    rf"0[.,]1{_DEGREE}|1/10{_DEGREE}|\btenths?\b|(?<=_)tenths?(?=_)|zehntel|dixiemes?|dixièmes?|d[eé]cimas?|tiendelar"
    r"|\*\s*0[.,]1|[x×]\s*0[.,]1\b|x10\b|\(?\*\s*10\b", re.I)  # fmt: skip
_HUNDREDTHS = re.compile(
    rf"0[.,]01{_DEGREE}|1/100{_DEGREE}|\bhundredths?\b|hundertstel|centiemes?", re.I
)
_TEMPERATURES = re.compile(r"temp|°|celsius|fahrenheit|kelvin", re.I)


def is_temperature(about: str) -> bool:
    """Return whether a name with its unit is that of an air temperature or one like it."""
    words = words_of(about)
    return not is_other(about) and (_any(words, _OF["temperature"]) or bool(unit_of(about)))


def is_other(about: str) -> bool:
    """Return whether a name is that of another quantity: dew point, humidity, battery, quality."""
    words = words_of(about)
    two = [f"{a}{b}" for a, b in pairwise(words)]
    indoors = re.match(
        r"(in|.*\b(temp|t|temperature) in(?! (\d|c|f|k|deg|grad|celsius|fahr|tenth)))\b",
        " ".join(words),
    )
    return _any(words, _OF["never"]) or bool(indoors) or _any(two, _TWO)


def is_less(about: str) -> bool:
    """Return whether a name is that of the temperature of soil, of water or of a surface."""
    return _any(words_of(about), _OF["less"])


def is_neutral(name: str) -> bool:
    """Return whether a name says nothing about a quantity."""
    return _any([" ".join(words_of(name))], _OF["neutral"])


def is_time(name: str) -> bool:
    """Return whether a name may be that of a time."""
    words = words_of(name)
    return _any(words, _OF["time"]) and not _any(words, _OF["no_time"])


def part_of(name: str, code: str) -> bool:
    """Return whether a name is that of a part of a date, e.g. "m" for the month."""
    words = words_of(name)
    if code == "H":
        words = [word for word in words if word not in _ZONES] or ["hour"] * bool(words)
    said = [words[0], "".join(words)] if words else []
    day = code == "j" and _any(said, PARTS["d"])  # the day of a year may be called day
    return (day or _any(said, PARTS[code])) and (code == "M" or not _any(words, _OF["no_time"]))


def statistic_of(name: str) -> tuple[str, str]:
    """Return "min", "max" or "", and the rest of a name."""
    words = words_of(name)
    low, high = (
        [word for word in words if each.fullmatch(word)] for each in (_OF["low"], _OF["high"])
    )
    if bool(low) == bool(high):
        return "", ""
    kind, own = ("min", low) if low else ("max", high)
    rest = " ".join(word for word in words if word not in own and not _OF["mean"].fullmatch(word))
    return kind, f"{rest} temp" if re.search("temp|気温", own[0]) else rest


def unit_of(text: str) -> str:
    """Return the unit in a text: "C", "F", "K", "CF" if there are two, or ""."""
    found = "".join(unit for unit, each in (("C", _C), ("F", _F), ("K", _K)) if each.search(text))
    if not found:
        words = words_of(text)
        letters = [match[2] for match in map(_LETTER.fullmatch, words) if match]
        if _any(words, _OF["temperature"]):
            letters += [word for word in words[1:] if word in ("c", "f", "k")]
        found = "".join(dict.fromkeys(letters)).upper()
    return found


def scale_of(text: str) -> Fraction | None:
    """Return the scale in a text: a tenth, a hundredth, or None."""
    if _HUNDREDTHS.search(text):
        return Fraction(1, 100)
    return Fraction(1, 10) if _TENTHS.search(text) else None


def told_above(notes: Iterable[str], name: str) -> str:
    """Return what the lines above a table say of a column: lines with its name, else in general."""
    own = re.compile(rf"(?<![\w]){re.escape(name)}(?![\w])\s*(?:[:=;,(\t-]|\s\s|in\b)")
    lines = [line for line in notes if unit_of(line) or scale_of(line)]
    mine = [line[found.start() :] for line in lines if (found := own.search(line))]
    general = [line for line in lines if _TEMPERATURES.search(line) and not is_other(line)
               and not re.match(r"\W*\w{1,12}\s*[:=(]", line)]  # fmt: skip
    general += [
        line for line in lines if re.match(r"\W*(units?|temp\w*)\b[^:=,;]*[:=,;]", line, re.I)
    ]
    return " ".join(dict.fromkeys(mine or general))
