"""``exactcreep record`` and ``roof``: read, check and use a file of temperatures."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import Answer, Drawing, put, say_written, shown
from exactcreep.commands.values import File, Name, Number, taken

_DRAWN = Drawing()


def record(
    file: Annotated[Path, Parameter(help="A CSV file, also packed by gzip (.gz).")],
    /,
    *,
    mend: File | None = None,
    output: Drawing = _DRAWN,
) -> None:
    """Guess the format of a file of temperatures, list its faults, and print lines for a scene.

    The lines give the delimiter, decimal comma, date format, encoding, and the columns of times and
    of temperatures (or of minima and maxima). An uncertain guess has a remark. T0 is the mean; set
    it to the temperature at which the solid was laid.

    Faults follow below: missing readings and outliers, gaps, rows out of order, minima above their
    maxima. A plot marks them. Exit status: 0 the record can be used as it is, or was mended, 2 it
    cannot.

    Parameters
    ----------
    mend : path
        Write a copy, CSV in degrees, in which the same hour of nearby days replaces gaps and
        suspect readings; the changes are printed.

    Examples
    --------
    exactcreep record station.csv --plot station.png
    exactcreep record station.csv --mend mended.csv
    """
    from exactcreep.model.record_format import guessed

    output.check(mend=mend)
    guess = guessed(file)
    readings = exactcreep.TemperatureRecord.readings(file, **guess.options)
    faults, about, done = readings.faults(), {"file": str(file), **guess.options}, list[str]()
    wrong = [str(readings.refusal(kind, places)) for kind, places in faults.items()]
    if mend is not None:
        about, done = _mended(readings, mend, force=output.force)
        wrong = []
    known = readings.temperatures
    about["T0"] = round(float(known.mean()), 1)
    remarks = {"T0": "the mean; at which temperature was it laid?"}
    lines = ["[drive]", 'kind = "record"']
    for name, value in about.items():
        remark = (remarks if mend else remarks | guess.doubts).get(name)
        lines.append(f"{name} = {_as_toml(value)}" + (f"  # {remark}" if remark else ""))
    first, last = (str(readings.times[k]).removesuffix(".000000") for k in (0, -1))
    summary: dict[str, Any] = {
        **about, "doubts": guess.doubts, "readings": len(readings.times), "first": first,
        "last": last, "lowest": float(known.min()), "highest": float(known.max()),
        "wrong": wrong, "mended": done,
    }  # fmt: skip

    def tell() -> None:
        many = "s" * (len(readings.times) > 1)
        put(f"# {len(readings.times)} reading{many} from {first} to {last}")
        put("\n".join([*(f"# {sentence}" for sentence in done), *lines]))

    def draw() -> Any:
        from exactcreep.figures.record import draw_record

        return draw_record(readings, file.name)

    remark = "; ".join([*wrong, *readings.doubts()])
    output.deliver(Answer(summary, tell, draw=draw, status=2 * bool(wrong), remark=remark))


def roof(
    file: Annotated[Path, Parameter(help="A CSV file of temperatures; see exactcreep record.")],
    /,
    *,
    length: Number,
    slope_degrees: Number,
    material: Name = "lead",
    friction: Annotated[str | None, taken("LOW,HIGH")] = None,
    output: Drawing = _DRAWN,
) -> None:
    """Say how far a roof creeps in the weather of a file, in millimetres a year, and how surely.

    The file is read as by `exactcreep record`. The rate is computed in the sliding limit, in which
    the static friction has no effect.

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
    exactcreep roof station.csv --length 8 --slope-degrees 30 --material lead --plot roof.png
    """
    from exactcreep.commands.answer import say_rows
    from exactcreep.model.numbers import exact_number
    from exactcreep.model.record_format import guessed

    output.check()
    angle = float(exact_number(slope_degrees, "slope_degrees"))
    if not 0 < angle < 60:
        raise exactcreep.InputError("slope_degrees", slope_degrees, "must lie between 0 and 60")
    slope = math.tan(math.radians(angle))
    ends = friction.split(",") if friction else [f"{1.02 * slope:.4f}", str(max(1, 2 * slope))]
    if len(ends) not in (1, 2):
        raise exactcreep.InputError("friction", friction, "must be a number, or LOW,HIGH")
    mu = ends if len(ends) == 2 else ends[0]
    sheet = exactcreep.physical(
        length=length, section="0.003", mu_d=mu, mu_s=mu, tan_alpha=f"{slope:.6f}",
        material=material,
    )  # fmt: skip
    options = guessed(file).options
    mean = exactcreep.TemperatureRecord.readings(file, **options).temperatures.mean()
    weather = exactcreep.TemperatureRecord(
        file, kappa=sheet.kappa, T0=round(float(mean), 1), **options
    )
    with shown(quiet=output.json):
        descent = sheet.creep(weather)
        summary, lines = descent.summary(), descent.lines()
    title = f"{file.name}: {material}, {length} m, {slope_degrees} degrees"

    def draw() -> Any:
        from exactcreep.figures.run import draw_descent

        return draw_descent(descent, title)

    output.deliver(Answer({"file": str(file), **summary}, lambda: say_rows(lines), draw=draw))


def _mended(readings: Any, to: Path, *, force: bool) -> tuple[dict[str, Any], list[str]]:
    """Write mended readings; return the settings with which a scene reads them, and the changes."""
    import numpy as np

    from exactcreep.quasistatic.writing import write_file

    table, done = readings.mended()
    unit: Any = "s" if readings.maximum is None else "D"
    table.insert(0, "time", np.datetime_as_string(table.index.to_numpy(), unit))
    write_file(to, table.to_csv(index=False, lineterminator="\n").encode(), "mend", force=force)
    say_written(to)
    about: dict[str, Any] = {"file": str(to)}
    if readings.maximum is not None:
        about |= {"minimum_column": "minimum", "maximum_column": "maximum"}
    return about | ({"unit": "K"} if readings.unit == "K" else {}), done


def _as_toml(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
