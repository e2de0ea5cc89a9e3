"""``exactcreep record`` and ``roof``: read, check and use a file of temperatures."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import Drawing, drawing, put, say_rows, shown
from exactcreep.commands.values import Name, Number, taken

_DRAWN = Drawing()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a file of temperatures is read, where its own words do not say it.

    Parameters
    ----------
    time_column
        Column of times, or several columns: date,hour or year,month,day,hour. A column has its
        name, or its number from 1.
    temperature_column
        Column of temperatures.
    minimum_column
        Column of the minimum of each day, instead of temperature_column.
    maximum_column
        Column of the maximum of each day.
    minimum_hour
        Hour of the day of the minimum; default 5.
    maximum_hour
        Hour of the day of the maximum; default 15.
    unit
        C, K or F.
    scale
        Factor on the numbers: 0.1 for tenths of a degree.
    date_format
        How dates are written, e.g. "%d.%m.%Y %H:%M"; "%s" for seconds since 1970.
    delimiter
        Character between columns; a blank for any number of blanks.
    decimal
        Decimal sign, a point or a comma.
    encoding
        Encoding of the file, e.g. latin-1.
    """

    time_column: Annotated[str | None, taken("NAMES")] = None
    temperature_column: Annotated[str | None, taken("NAME")] = None
    minimum_column: Annotated[str | None, taken("NAME")] = None
    maximum_column: Annotated[str | None, taken("NAME")] = None
    minimum_hour: Annotated[str | None, taken("X")] = None
    maximum_hour: Annotated[str | None, taken("X")] = None
    unit: Annotated[str | None, taken("UNIT")] = None
    scale: Annotated[str | None, taken("X")] = None
    date_format: Annotated[str | None, taken("FORMAT")] = None
    delimiter: Annotated[str | None, taken("SIGN")] = None
    decimal: Annotated[str | None, taken("SIGN")] = None
    encoding: Annotated[str | None, taken("NAME")] = None

    def options(self) -> dict[str, Any]:
        """Return the options that are given, for `TemperatureRecord`."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        if given.get("delimiter") in ("tab", "\\t"):
            given["delimiter"] = "\t"
        return given


_FOUND = Layout()
_USUAL = {"delimiter": ",", "decimal": ".", "date_format": "", "encoding": "utf-8", "unit": "C",
          "scale": Fraction(1)}  # fmt: skip
Table = Annotated[Path, Parameter(help="A table of text: CSV or aligned; also .gz and .zip.")]


def record(file: Table, /, *, layout: Layout = _FOUND, output: Drawing = _DRAWN) -> None:
    """Read a file of temperatures, say what was read, list its faults, print lines for a scene.

    The first line says which column was read, in which unit, from when to when, and the lowest and
    the highest temperature. The lines below are the table [drive] of a scene that reads the file in
    the same way. T0 is the mean; set it to the temperature at which the solid was laid. What the
    file does not say is never guessed: the command then names the option that is needed.

    Faults follow: missing readings, codes for missing readings and outliers, gaps, rows out of
    order, minima above their maxima. A plot marks them. Exit status: 0 the record can be used as it
    is, 2 it cannot.

    Examples
    --------
    exactcreep record station.csv --plot station.png
    exactcreep record station.csv --temperature-column Outside --unit F
    """
    output.check()
    given = layout.options()
    readings = exactcreep.TemperatureRecord.readings(file, **given)
    wrong = [str(readings.refusal(kind, places)) for kind, places in readings.faults().items()]
    hours = {name: value for name, value in given.items() if name.endswith("_hour")}
    about: dict[str, Any] = {"file": str(file), **_unusual(readings.options), **hours}
    known, (first, last) = readings.temperatures, readings.ends
    about["T0"] = _mean(readings)
    doubts = {"sampling": " ".join(readings.lacking()), "unit": "; ".join(readings.doubts())}
    summary: dict[str, Any] = {
        "read": readings.told(), **about, "doubts": {k: v for k, v in doubts.items() if v},
        "readings": len(readings.times), "first": first, "last": last,
        "lowest": float(known.min(initial=math.inf)), "wrong": wrong,
        "highest": float(known.max(initial=-math.inf)), "missing": readings.missing,
    }  # fmt: skip

    def tell() -> None:
        lines = ["[drive]", 'kind = "record"']
        lines += [f"{name} = {_as_toml(value)}" for name, value in about.items()]
        lines[-1] += "  # the mean; at which temperature was it laid?"
        remarks = [f"# {each}" for each in (readings.told(), *readings.lacking())]
        put("\n".join([*remarks, *lines]))

    remark = "; ".join([*wrong, *readings.doubts()])
    draw = drawing("record:draw_record", readings, file.name)
    output.deliver(summary, tell, draw=draw, status=2 * bool(wrong), remark=remark)


def roof(
    file: Table,
    /,
    *,
    length: Number,
    slope_degrees: Number,
    material: Name = "lead",
    friction: Annotated[str | None, taken("LOW,HIGH")] = None,
    layout: Layout = _FOUND,
    output: Drawing = _DRAWN,
) -> None:
    """Say how far a roof creeps in the weather of a file, in millimetres a year, and how surely.

    The first line is the range over the interval of friction, the second the rate with its middle.
    Then follow the material and what was read. The file is read as by `exactcreep record`. The rate
    is computed in the sliding limit, in which the static friction has no effect.

    Parameters
    ----------
    length : X
        Length of the sheet along the slope, in m.
    slope_degrees : X
        Pitch of the roof.
    material : NAME
        lead, copper, zinc or steel.
    friction : LOW,HIGH
        Least and largest dynamical friction coefficient. Default: from 2 % more than holds the
        sheet to 1, or to twice the least.

    Examples
    --------
    exactcreep roof station.csv --length 8 --slope-degrees 30 --plot roof.png
    """
    from exactcreep.model.numbers import exact_number
    from exactcreep.records.table import RECIPE

    output.check()
    angle = float(exact_number(slope_degrees, "slope_degrees"))
    if not 0 < angle < 60:
        raise exactcreep.InputError("slope_degrees", slope_degrees, "must lie between 0 and 60")
    slope = math.tan(math.radians(angle))
    ends = friction.split(",") if friction else [f"{1.02 * slope:.4f}", str(max(1, 2 * slope))]
    if len(ends) not in (1, 2):
        raise exactcreep.InputError("friction", friction, "must be a number, or LOW,HIGH")
    least = exact_number(ends[0], "friction")
    if least <= slope:
        allowed = f"must be above {slope:.4g}, the slope: less friction does not hold the roof"
        raise exactcreep.InputError("friction", friction, allowed)
    mu = ends if len(ends) == 2 else ends[0]
    sheet = exactcreep.physical(
        length=length, section=_THICKNESS, mu_d=mu, mu_s=mu, tan_alpha=f"{slope:.6f}",
        material=material,
    )  # fmt: skip
    readings = exactcreep.TemperatureRecord.readings(file, **layout.options())
    if not readings.dated:
        name = readings.options["time_column"]
        allowed = f"must hold dates in {file}: {RECIPE}, or date_format = %s reads seconds"
        raise exactcreep.InputError("time_column", name, f"{allowed} since 1970")
    T0 = _mean(readings)
    weather = exactcreep.TemperatureRecord(file, kappa=sheet.kappa, T0=str(T0), **layout.options())
    with shown(quiet=output.json):
        descent = sheet.creep(weather)
        summary, lines = descent.summary(), dict(descent.lines())
    of_sheet = f"{material}: {lines.pop('solid')}, thickness {_THICKNESS} m (without effect)"
    of_sheet += f", T0 = {T0} {'°' * (readings.unit != 'K')}{readings.unit} (the mean)"
    first = {name: lines.pop(name) for name in ("descent", "middle") if name in lines}
    rows = {**first, "material": of_sheet, "weather file": readings.told(), **lines}
    rows |= {"lacking" if k == 0 else " ": said for k, said in enumerate(readings.lacking())}
    title = f"{file.name}: {material}, {length} m, {slope_degrees} degrees"

    about = {
        "file": str(file), **summary, "read": readings.told(), "T0": T0, "material": of_sheet,
        "doubts": {"sampling": " ".join(readings.lacking())} if readings.lacking() else {},
    }  # fmt: skip
    draw = drawing("walk:draw_walk", descent, title)
    output.deliver(about, lambda: say_rows(rows.items()), draw=draw)


_THICKNESS = "0.003"  # m, of one metre of width; the descent does not depend on it


def _unusual(options: Any) -> dict[str, Any]:
    """Return the options of a scene without defaults of the most usual file."""
    kept = {name: value for name, value in options.items() if _USUAL.get(name) != value}
    return {name: float(value) if isinstance(value, Fraction) else list(value)
            if isinstance(value, tuple) else value for name, value in kept.items()}  # fmt: skip


def _mean(readings: Any) -> float:
    known = readings.temperatures
    return round(float(known.mean()), 1) if known.size else math.nan


def _as_toml(value: Any) -> str:
    return str(value) if isinstance(value, float) else json.dumps(value)
