"""``exactcreep record``: how a file of temperatures is written, and what is wrong with it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import Answer, Drawing, put, say_written
from exactcreep.commands.values import File

_DRAWN = Drawing()


def record(
    file: Annotated[Path, Parameter(help="A CSV file, also packed by gzip (.gz).")],
    /,
    *,
    mend: File | None = None,
    output: Drawing = _DRAWN,
) -> None:
    """Guess how a file of temperatures is written, and print the lines for a scene.

    Delimiter, decimal comma, date format, encoding, and the columns: of times, and of temperatures
    or of minima and maxima. A guess that may be wrong has a remark. T0 is the mean: set it to the
    temperature at which the solid was laid.

    What is wrong with the record is said below the lines: readings that are missing or far from
    their neighbours, gaps, rows out of order, minima above their maxima. A plot marks it. Exit
    status: 0 the record can be used as it is, or was mended, 2 it cannot.

    Parameters
    ----------
    mend : path
        Write a copy, CSV in degrees, whose gaps are filled and whose suspect readings are replaced
        from the same hour of the days around; what was done is printed.

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
        put(f"# {len(readings.times)} readings from {first} to {last}")
        put("\n".join([*(f"# {sentence}" for sentence in done), *lines]))

    def draw() -> Any:
        from exactcreep.figures.record import draw_record

        return draw_record(readings, file.name)

    remark = "; ".join([*wrong, *readings.doubts()])
    output.deliver(Answer(summary, tell, draw=draw, status=2 * bool(wrong), remark=remark))


def _mended(readings: Any, to: Path, *, force: bool) -> tuple[dict[str, Any], list[str]]:
    """Write mended readings, and return how a scene reads them and what was done."""
    import numpy as np

    from exactcreep.quasistatic.writing import write_file

    table, done = readings.mended()
    times = table.index.to_numpy()
    if readings.dated:
        whole = readings.maximum is not None
        times = np.datetime_as_string(times, "D" if whole else "s")
    table.insert(0, "time", times)
    write_file(to, table.to_csv(index=False, lineterminator="\n").encode(), "mend", force=force)
    say_written(to)
    about: dict[str, Any] = {"file": str(to)}
    if readings.maximum is not None:
        about |= {"minimum_column": "minimum", "maximum_column": "maximum"}
    return about | ({"unit": "K"} if readings.unit == "K" else {}), done


def _as_toml(value: Any) -> str:
    """Return a text or a number as TOML has it."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
