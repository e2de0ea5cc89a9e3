"""What a command says: one JSON object, or sentences and tables for the eye; and how it leaves."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any

import typer

from exactcreep.commands.options import DataFile, Force, Json, Plot
from exactcreep.display import Display

FAILED, LIMIT, STALE, INTERRUPTED = 1, 3, 4, 130
"""Exit statuses: a promise is broken, a limit was reached, the checkpoint is stale, Ctrl-C."""
_JSON_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?")

Rows = list[tuple[str, Any]]
"""What is said line by line: a name and its value."""


def as_json(value: Any, indent: str = "") -> str:
    """Return `value` as JSON; a decimal of a scene keeps every digit that was written."""
    from exactcreep.scene import Literal

    inner = indent + "  "
    if isinstance(value, Mapping):
        items = [f"{json.dumps(str(key))}: {as_json(part, inner)}" for key, part in value.items()]
        return _bracketed(items, "{}", indent)
    if isinstance(value, (list, tuple)):
        return _bracketed([as_json(part, inner) for part in value], "[]", indent)
    if isinstance(value, Literal) and _JSON_NUMBER.fullmatch(value):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return "null"
    return json.dumps(value)


def _bracketed(items: list[str], brackets: str, indent: str) -> str:
    if not items:
        return brackets
    lines = f",\n{indent}  ".join(items)
    return f"{brackets[0]}\n{indent}  {lines}\n{indent}{brackets[1]}"


def of_members(
    scene: str, settings: Sequence[Mapping[str, Any]], summaries: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return what ``--json`` prints of a scene: what it came to, or every member, and what it sets.

    The last members may have no summary.
    """
    if len(settings) == 1 and not settings[0] and summaries:
        return {"scene": scene, **summaries[0]}
    told = zip(settings, summaries, strict=False)
    return {"scene": scene, "members": [{"set": dict(each), **known} for each, known in told]}


def complain(sentence: str) -> None:
    """Print a sentence on standard error."""
    with suppress(OSError):  # a full device: the status says it all the same
        typer.echo(f"exactcreep: {' '.join(sentence.split())}", err=True)


def say(words: Any, *, width: int | None = None, soft_wrap: bool = True, **style: Any) -> None:
    """Print words with rich's markup, or a table; a terminal wraps their lines by default."""
    from rich.console import Console

    Console(highlight=False, width=width).print(words, soft_wrap=soft_wrap, **style)


def say_heading(scene: str, title: str) -> None:
    """Print which scene it is."""
    from rich.markup import escape

    say(f"[bold]{escape(scene)}[/bold]" + (f": {escape(title)}" if title else ""))


def say_rows(rows: Rows, *, soft_wrap: bool = True) -> None:
    """Print names and what they stand for, in two columns."""
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    for name, said in rows:
        table.add_row(name, str(said))
    say(table, soft_wrap=soft_wrap)


def say_table(
    names: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    right: Collection[str] = (),
    folded: Collection[str] = (),
    width: int | None = None,
    **style: Any,
) -> None:
    """Print rows under the names of their columns, which stand to the right, or may be folded."""
    from rich.table import Table

    table = Table(**{"box": None, "padding": (0, 1), "header_style": "bold"} | style)
    for name in names:
        side: Any = "right" if name in right else "left"
        table.add_column(name, justify=side, no_wrap=name not in folded, overflow="fold")
    for row in rows:
        table.add_row(*row)
    say(table, width=width, soft_wrap=False)


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return what a member sets, as a line of a summary."""
    return ", ".join(f"{key} = {value}" for key, value in settings.items())


def counted(words: Iterable[str] | Mapping[str, int]) -> str:
    """Return how often each word occurs, the most frequent first."""
    return ", ".join(f"{count} {word}" for word, count in Counter(words).most_common())


def duration(seconds: float) -> str:
    """Return a time for the eye: ``35 us``, ``1.2 s``, ``3.5 h``; ``-`` if it is not known."""
    if math.isnan(seconds):
        return "-"
    for unit, size in (("us", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if seconds < 1000 * size and (unit != "s" or seconds < 100):
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 60:.3g} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"


def drawing(name: str, **about: Any) -> Callable[[Any, Path], None]:
    """Return a function of `exactcreep.figures`, which is imported when it is called."""
    return lambda found, plot: resolve_name(f"exactcreep.figures.{name}")(found, plot, **about)


@dataclass(frozen=True)
class Output:
    """Where the answer of a study goes."""

    out: DataFile = None
    json: Json = False
    plot: Plot = None
    force: Force = False

    def answer(
        self,
        study: Callable[..., Any],
        rows: Callable[[Any], Rows],
        draw: Callable[[Any, Path], None],
        about: Mapping[str, Any] | None = None,
    ) -> Any:
        """Carry out a study, save its dataset, draw it, and print one JSON object, or the rows.

        The files are checked before: nothing is computed that could not be kept. The object begins
        with what it is `about`; what prints tables by itself returns no rows.
        """
        from exactcreep.quasistatic.files import check_output, check_plot, write_file
        from exactcreep.quasistatic.netcdf import netcdf

        if self.plot is not None:
            check_plot(self.plot, force=self.force)
        if self.out is not None:
            check_output(self.out, "out", force=self.force)
        with Display(quiet=self.json) as display:
            found = study(progress=display.show)
        if self.out is not None:
            write_file(self.out, netcdf({None: found.dataset()}), "out")
        if self.plot is not None:
            draw(found, self.plot)
        if self.json:
            typer.echo(as_json({**(about or {})} | found.summary()))
            return found
        if said := rows(found):
            say_rows(said)
        for path in (self.out, self.plot):
            if path is not None:
                typer.echo(f"written: {path}")
        return found


def without_data(json: Json = False, plot: Plot = None, force: Force = False) -> Output:
    """Return the output of a study that has no dataset."""
    return Output(None, json, plot, force)


OfOutput = Annotated[Output, without_data]


def grouped(
    settings: Sequence[Mapping[str, Any]], told: Sequence[Any]
) -> list[tuple[list[str], list[int]]]:
    """Return groups of members with equal results whose settings are neighbours.

    Parameters
    ----------
    settings : sequence of mapping
        Keys and values of each member.
    told : sequence
        What is printed of each member; it is compared by ``==``.

    Returns
    -------
    list of (list of str, list of int)
        Of each group the values of every key, a range as ``first … last``, and its members.
    """
    rows: list[tuple[list[list[Any]], list[int]]] = []
    for number, (setting, _) in enumerate(zip(settings, told, strict=False)):
        rows.append(([[value] for value in setting.values()], [number]))
    for column in reversed(range(len(settings[0]) if settings else 0)):
        kept: list[tuple[list[list[Any]], list[int]]] = []
        for values, members in rows:
            if kept and told[kept[-1][1][0]] == told[members[0]]:
                before = kept[-1][0]
                same = [one == other for one, other in zip(before, values, strict=True)]
                if all(same[:column]) and all(same[column + 1 :]):
                    before[column] += values[column]
                    kept[-1][1].extend(members)
                    continue
            kept.append((values, members))
        rows = kept
    return [([_range(values) for values in row], members) for row, members in rows]


def _range(values: Sequence[Any]) -> str:
    first = _setting_text(values[0])
    return first if len(values) == 1 else f"{first} … {_setting_text(values[-1])}"


def _setting_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_setting_text(part)}" for key, part in value.items())
    if isinstance(value, list):
        return f"({len(value)} values)"
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError):
        return str(value)
