"""``exactcreep record``: how a file of temperatures is written, as the lines of a scene."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import Answer, Drawing, as_json, put

_DRAWN = Drawing()


def record(
    file: Annotated[Path, Parameter(help="A CSV file, also packed by gzip (.gz).")],
    /,
    *,
    output: Drawing = _DRAWN,
) -> None:
    """Guess how a file of temperatures is written, and print the lines for a scene.

    Delimiter, decimal comma, date format, encoding, and the columns: of times, and of temperatures
    or of minima and maxima. A guess that may be wrong has a remark. T0 is the mean: set it to the
    temperature at which the solid was laid.

    What is wrong with the record is said below the lines: a reading that is missing, a gap, minima
    above their maxima. Exit status: 0 it can be used as it is, 2 it cannot.

    Examples
    --------
    exactcreep record station.csv --plot station.png
    """
    from exactcreep.model.record_format import guessed

    output.check()
    guess = guessed(file)
    about = {"file": str(file), **guess.options}
    try:
        read, refused = exactcreep.TemperatureRecord(**about, kappa=1, T0=0), None
    except exactcreep.InputError as error:
        read, refused = None, error
    if read is not None:
        about["T0"] = round(float(read.temperatures.mean()), 1)
    remarks = {"T0": "the mean; at which temperature was it laid?", **guess.doubts}
    lines = ["[drive]", 'kind = "record"']
    for name, value in about.items():
        remark = f"  # {remarks[name]}" if name in remarks else ""
        lines.append(f"{name} = {_as_toml(value)}{remark}")
    summary: dict[str, Any] = {**about, "doubts": guess.doubts, "readings": 0}
    if read is not None:
        summary |= _in_short(read)

    def tell() -> None:
        if read is not None:
            first, last = summary["first"], summary["last"]
            between = f"{summary['lowest']:g} to {summary['highest']:g} {read.unit}"
            put(f"# {summary['readings']} readings from {first} to {last}, {between}")
        put("\n".join(lines))

    if refused is not None:  # what was guessed is told all the same
        put(as_json(summary)) if output.json else tell()
        raise refused
    output.deliver(Answer(summary, tell, draw=lambda: _drawn(read, file.name)))


def _drawn(read: Any, title: str) -> Any:
    from exactcreep.figures.record import draw_record

    return draw_record(read, title)


def _as_toml(value: Any) -> str:
    """Return a text or a number as TOML has it."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)


def _in_short(read: exactcreep.TemperatureRecord) -> dict[str, Any]:
    """Return how many readings a record has, the first and last time, and its extremes."""
    times = read.dates if read.dates is not None else read.times
    first, last = (str(times[k]).removesuffix(".000000000") for k in (0, -1))
    known = read.temperatures
    return {
        "readings": len(read.times),
        "first": first,
        "last": last,
        "lowest": float(known.min()),
        "highest": float(known.max()),
    }
