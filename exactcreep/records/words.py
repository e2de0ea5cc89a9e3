"""Words in the names of columns: which name a temperature, a time, a unit, or something else."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise


def words_of(text: str) -> list[str]:
    """Return the words of a name in small letters, without accents: AirTC_Avg is air, tc, avg."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", text)
    plain = unicodedata.normalize("NFKD", apart.replace("ł", "l").replace("ı", "i"))
    bare = "".join(sign for sign in plain if not unicodedata.combining(sign)).casefold()
    return [word for word in re.split(r"[\W_]+", bare) if word]


def _any(words: Iterable[str], pattern: re.Pattern[str]) -> bool:
    return any(map(pattern.fullmatch, words))


_TEMPERATURE = re.compile(
    r"temp|temper|temperat\w*|temp(c|f|k|m|\d+|avg|mean|med|min|max|out\w*|ext|air|\d+[cf])|tempmax|tempmin"
    r"|t|ta|tt|tmp[cf]?|tas(min|max)?|tair|airt[cf]?|airtemp\w*|t2m\w*|2t|tc|tf|dbt|drybulb|thermo\w*|ds18b20\w*|pt100\w*|thermistor\w*|ntc"
    r"|t(max|min|avg|mean|med|obs|moy|medi[ao]|mitt|out|ext|air|amb|dry)[cf]?|t[xngmk]|t[xnmg]k|t2|ttx|ttn"
    r"|\w*temperatur\w*|(max|min)tp"
    r"|tre2\w*|tasmean|(keski|ilman|maksimi|minimi)?lampotila|teplota|homerseklet|hitastig|hiti|sicaklik"
    r"|celsius|fahrenheit|.*(気温|温度|気溫|气温|기온|온도).*|ambient|bulb|t\d|tdb|tdry|tl(min|max|mittel)?|θερμοκρασ\w*|suhu|температур\w*"
)
_NEVER = re.compile(
    r"\w*dew\w*|dw?pt?[cf]?|dwp|dewp[cf]?|td|d2m|2d|t?dpt|tde2\w*|taupunkt\w*|rosee|rocio|orvalho|rugiada|kastepiste\w*"
    r"|da?ggpunkt\w*|duggpunkt\w*|rosny|rosneho|rosy|punktu|.*(露点|湿度|風|湿球|品質|均質|現象|体感).*"
    r"|hum\w*|rh\w*|rel\w*|\w*feucht\w*|\w*fukt\w*|vlhk\w*|wilg\w*|humedad|umid\w*|kosteus"
    r"|wind\w*|gust\w*|ws|wd|u10|v10|vind\w*|viento|vent\w*|vento|batt\w*|bat|volt\w*|mv|supply"
    r"|p?temp_?c_?panel|ptemp|panel|logger\w*|device|internal|cpu|board|case|enclosure|box|instrument|chip|body"
    r"|index|idx|heatindex|thw|thsw|qual\w*|kvalit\w*|qc|q|qn|qf|qt[xn]?|qa|flags?|status|attributes?|code|sources?|uncert\w*"
    r"|remark|notes?|feel\w*|apparent|\w*chill\w*|humidex|hmdx|gefuhlt\w*|ressentie|sensacion|sensation|utci|pet|wbgt"
    r"|indoors?|inside|innen\w*|interieure?|interior|intern[oa]?|tempin\w*|room|raum\w*|house|inne|server|attic"
    r"|wet\w*|zwilzon\w*|feuchtkugel|wb|twb|twet|bulbo_umido|bulbu|degreedays?|days|gdd|hdd|cdd|grad_?tage|gtz"
    r"|press\w*|druck|luftdruck|hpa|mbar|kpa|baro\w*|slp|mslp|qff|qnh|qfe|rain|precip\w*|prcp|snow|radiation|solar|evap\w*"
    r"|change|diff\w*|differenz|trend|std\w*|sd|sigma|var|stdev|dev|err\w*|anomaly|normal\w*|amplitude|tampli|count|samples?|range|sonic|globe|black|raw|adc"
    r"|departure|correction|offset|calib\w*|cal|soll\w*|setpoint|target|alarm|threshold|limit|hour|hora|horat\w*|record|serial|lapse"
    r"|virtual|potential|theta|equivalent|forecast|predicted|ceiling|cloud"
)
_TWO = re.compile("degdays|bulboumido|ptemp")
_LESS = re.compile(
    r"soil|ground|grass|grss|gras|boden|erdboden|sol|suelo|solo|suolo|jord|mark\w*|tnsol|skin|skt|sst|sea|water|wasser\w*"
    r"|agua|eau|road|pavement|leaf|snow|erd|depth|stl\d|t[gm]k|tgk|t(5|10|20|50|100|200)|tm5|tg_min|t10n|\d+cm"
    r"|(0|5|10|20|30|50|100|200)_?cm|cm|concrete|ref\w*|terre|terrain|chaussee|\w*boden\w*|puda|pudy|gruntu"
)
_LOW = re.compile(
    r"min\w*|tlmin|lo|low\w*|tn|tnk|ttn|tmin[cf]?|temp_?min|tempmin|tasmin|tief\w*|laveste|lagsta|alin|niedrigste"
    r"|.*最低.*|tre200\w*n|(min|tiefst|minimi)\w*"
)
_HIGH = re.compile(
    r"max\w*|tlmax|maks\w*|hi|high\w*|tx|txk|ttx|tmax[cf]?|tempmax|tasmax|hoch\w*|hogsta|hoyeste|ylin|.*最高.*"
    r"|tre200\w*x"
)
_MEAN = re.compile(
    r"avg|aver\w*|mean|tg|tm|tmk|tavg|tmean|tmed|tmoy|med|media|mittel\w*|moyenne|moy|middel\w*|keski\w*|tasmean|.*平均|smp|inst\w*"
)
_NEUTRAL = re.compile(
    r"values?|wert|valor|valeur|value\d|messwert|reading|readings|measurement|data|ch\d?|channel|0|1|x"
)
TIME = re.compile(
    r"date\w*|dat|datum\w*|dato|data|dia|day|fecha\w*|giorno|jour|dag|dzien|den|times?|timestamp\w*|tid\w*|zeit\w*"
    r"|uhrzeit|datetime\w*|dt|dttm|mess|valid\w*|tijd|hora\w*|heure|ora|orario|aika|klo|czas|cas|utc|gmt|local|ts|observed"
    r"|observation|yyyymmdd\w*|yyyymm|when|period|periode|horodat\w*|dh|ob|month|mois|mes|monat|.*(年月|日時|時刻|日付|时间|日期|일시|날짜).*|дата|время|ημερομην\w*|kell|moment|t|aaaammjj\w*"
)
_NO_TIME = re.compile(
    r"sunrise|sunset|moon\w*|receiv\w*|creat\w*|modif\w*|updat\w*|install\w*|max\w*|min\w*|high|low|peak|zone|timezone|jul|version"
    r"|meto|issued|end|ended"
)
_PARTS = {
    "Y": r"years?|yr|yyyy|yy|jahr|ano|anno|annee|an|rok|vuosi|ar|jaar|aar|aasta|ev|.*年",
    "m": r"months?|mon|mo|mm|m|monat|mes|mese|mois|miesiac|mesic|kk|kuu|maand|maned|manad"
         r"|kuukausi|honap|.*月",
    "d": r"days?|dd|d|dy|da|tag|dia|giorno|jour|dzien|den|pv|paev|paiva|dag|nap|mday|dom|.*日",
    "j": r"doy|yday|julian|jul|jday|dayofyear|jd",
    "H": r"hours?|hr|hrs|hh|hhmm|h|stunde|std|hora|ora|heure|godzina|godz|hodina|uur|tunti|klo|kell"
         r"|time|tid|zeit|uhrzeit|hh24|aika|clock|timme|hrmn|hour_?min|hhmi|czas|cas|.*時",
    "M": r"minutes?|min|mi|mn|nn|minuto|minuti|minuut",
    "S": r"seconds?|sec|ss|s|sekunde",
}  # fmt: skip
PARTS = {code: re.compile(pattern) for code, pattern in _PARTS.items()}
_ZONES = ("utc", "gmt", "lst", "lt", "local", "est", "cst", "mst", "pst", "met", "cet")
EPOCH = re.compile(r"unix\w*|epoch\w*|posix\w*|timestamp\w*|dt|ts|utime")

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
    return not is_other(about) and (_any(words, _TEMPERATURE) or bool(unit_of(about)))


def is_other(about: str) -> bool:
    """Return whether a name is that of another quantity: dew point, humidity, battery, quality."""
    words = words_of(about)
    two = [f"{a}{b}" for a, b in pairwise(words)]
    indoors = re.match(
        r"(in|.*\b(temp|t|temperature) in(?! (\d|c|f|k|deg|grad|celsius|fahr|tenth)))\b",
        " ".join(words),
    )
    return _any(words, _NEVER) or bool(indoors) or _any(two, _TWO)


def is_less(about: str) -> bool:
    """Return whether a name is that of the temperature of soil, of water or of a surface."""
    return _any(words_of(about), _LESS)


def is_neutral(name: str) -> bool:
    """Return whether a name says nothing about a quantity."""
    return _any([" ".join(words_of(name))], _NEUTRAL)


def is_time(name: str) -> bool:
    """Return whether a name may be that of a time."""
    words = words_of(name)
    return _any(words, TIME) and not _any(words, _NO_TIME)


def part_of(name: str, code: str) -> bool:
    """Return whether a name is that of a part of a date, e.g. "m" for the month."""
    words = words_of(name)
    if code == "H":
        words = [word for word in words if word not in _ZONES] or ["hour"] * bool(words)
    said = [words[0], "".join(words)] if words else []
    day = code == "j" and _any(said, PARTS["d"])  # the day of a year may be called day
    return (day or _any(said, PARTS[code])) and (code == "M" or not _any(words, _NO_TIME))


def statistic_of(name: str) -> tuple[str, str]:
    """Return "min", "max" or "", and the rest of a name."""
    words = words_of(name)
    low, high = ([word for word in words if each.fullmatch(word)] for each in (_LOW, _HIGH))
    if bool(low) == bool(high):
        return "", ""
    kind, own = ("min", low) if low else ("max", high)
    rest = " ".join(word for word in words if word not in own and not _MEAN.fullmatch(word))
    return kind, f"{rest} temp" if re.search("temp|気温", own[0]) else rest


def is_mean(name: str) -> bool:
    """Return whether a name is that of a mean."""
    return _any(words_of(name), _MEAN)


def unit_of(text: str) -> str:
    """Return the unit in a text: "C", "F", "K", "CF" if there are two, or ""."""
    found = "".join(unit for unit, each in (("C", _C), ("F", _F), ("K", _K)) if each.search(text))
    if not found:
        words = words_of(text)
        letters = [match[2] for match in map(_LETTER.fullmatch, words) if match]
        if _any(words, _TEMPERATURE):
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
