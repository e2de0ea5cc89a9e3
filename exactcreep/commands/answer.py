"""What commands print: one JSON object, or a summary and tables for the eye; and how they leave."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import typer

from exactcreep import interrupts
from exactcreep.commands.options import GROUPS
from exactcreep.display import Display

FAILED, LIMIT, STALE, INTERRUPTED = 1, 3, 4, 130
"""Exit statuses: a promise is broken, a limit was reached, the checkpoint is stale, Ctrl-C."""
_JSON_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?")
_MOST_LINES, _MOST_WORDS = 12, 6  # of a list that are printed
_FOR_EVER = "1e9"  # seconds: a study that looks at the clock looks for Ctrl-C, too
_LABELS = {
    "law_seuil": "paper, Eq. (seuil)",
    "law_corrected": "corrected, (N m + D)/(2 l0)",
    "law_two_sliders": "two sliders, (mu_s c - s)/l0",
    "lower": "below the edge",
    "upper": "above the edge",
    "compare": "to be compared with",
    "velocity": "velocity per half-cycle",
}
"""What the keys of summaries are called where their own words do not tell."""

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
    """Return what ``--json`` prints of a scene: its summary, or every member and what it sets.

    The last members may have no summary.
    """
    if len(settings) == 1 and not settings[0] and summaries:
        return {"scene": scene, **summaries[0]}
    pairs = zip(settings, summaries, strict=False)
    return {"scene": scene, "members": [{"set": dict(each), **known} for each, known in pairs]}


# --- words ----------------------------------------------------------------------------------------


def complain(sentence: str) -> None:
    """Print a sentence on standard error."""
    with suppress(OSError):  # a full device: the status says it all the same
        typer.echo(f"exactcreep: {' '.join(sentence.split())}", err=True)


def say(words: Any, *, soft_wrap: bool = True, **style: Any) -> None:
    """Print words with rich's markup, or a table; a terminal wraps their lines by default."""
    from rich.console import Console

    Console(highlight=False).print(words, soft_wrap=soft_wrap, **style)


def say_heading(scene: str, title: str) -> None:
    """Print which scene it is."""
    from rich.markup import escape

    say(f"[bold]{escape(scene)}[/bold]" + (f": {escape(title)}" if title else ""))


def say_rows(rows: Rows) -> None:
    """Print names and what they stand for, in two columns."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2))
    for name, value in rows:
        table.add_row(name, Text(str(value)))
    say(table, soft_wrap=False)


def say_summary(summary: Mapping[str, Any]) -> None:
    """Print the summary of a result: a line for each key that has something to tell."""
    rows = [(key, _worded(value)) for key, value in summary.items()]
    say_rows([(_LABELS.get(key, key.replace("_", " ")), text) for key, text in rows if text])


def _worded(value: Any) -> str:
    """Return one value of a summary for the eye; "" if there is none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, Mapping):
        several = any(isinstance(part, Mapping) for part in value.values())
        between, colon = ("\n", ":") if several else (", ", "")
        parts = [(f"{key}{colon}".replace("_", " "), _worded(part)) for key, part in value.items()]
        return between.join(f"{name} {text}" for name, text in parts if text)
    if isinstance(value, (list, tuple)):
        several = any(isinstance(part, (Mapping, list)) for part in value)
        most, between = (_MOST_LINES, "\n") if several else (_MOST_WORDS, ", ")
        said = [_worded(part) for part in value[:most]]
        if len(value) > most:
            said.append(f"and {len(value) - most} more")
        return between.join(said)
    return str(value)


def say_table(
    names: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    right: Collection[str] = (),
    folded: Collection[str] = (),
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
    say(table, soft_wrap=False)


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return what a member sets, as a line of a summary."""
    return ", ".join(f"{key} = {value}" for key, value in settings.items())


def counted(words: Iterable[str] | Mapping[str, int]) -> str:
    """Return how often each word occurs, the most frequent first."""
    return ", ".join(f"{count} {word}" for word, count in Counter(words).most_common())


# --- what a study answers -------------------------------------------------------------------------


@contextmanager
def shown(name: str = "", *, quiet: bool = False, hint: str = "") -> Iterator[Display]:
    """Show how far a command has come; on Ctrl-C say it, with a hint, and leave with status 130."""
    with Display(name, quiet=quiet) as display:
        try:
            yield display
        except KeyboardInterrupt:
            display.stop()
            complain(f"interrupted{display.reached}{hint}")
            raise typer.Exit(INTERRUPTED) from None


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """Where the answer of a study goes.
    """

    plot: Path | None = None
    json: bool = False
    force: bool = False
    @property
    def data(self) -> Path | None:
        """Where the dataset goes, of a study that has one."""
        return None

    def answer(
        self,
        study: Callable[..., Any],
        draw: str,
        rows: Callable[[Any], object] | None = None,
        about: Mapping[str, Any] | None = None,
        **pictured: Any,
    ) -> Any:
        """Carry out a study, save its dataset, draw it, and print one JSON object, or a summary.

        The files are checked before: nothing is computed that could not be kept. After Ctrl-C a
        study that takes `max_seconds` comes back with what is known, as at the end of its time.

        Parameters
        ----------
        study : callable
            Called with `progress`, and with `max_seconds` if it is a keyword of it.
        draw : str
            A function of `exactcreep.figures`, as ``module:name``.
        rows : callable, optional
            Prints the answer by itself.
        about : mapping, optional
            What the JSON object begins with.
        **pictured
            Further arguments of `draw`.
        """
        from exactcreep.quasistatic.files import check_output, check_plot, write_file
        from exactcreep.quasistatic.netcdf import netcdf

        if self.plot is not None:
            check_plot(self.plot, force=self.force)
        if self.data is not None:
            check_output(self.data, "out", force=self.force)
        given = getattr(study, "keywords", {})
        timed = "max_seconds" in given
        words = {"max_seconds": _FOR_EVER} if timed and given["max_seconds"] is None else {}
        interrupted = False
        with shown(quiet=self.json) as display:
            if timed:
                with interrupts.deferred():
                    found = study(progress=display.show, **words)
                    interrupted = interrupts.waiting()
            else:
                found = study(progress=display.show)
        if self.data is not None:
            write_file(self.data, netcdf({None: found.dataset}), "out")
        if self.plot is not None:
            resolve_name(f"exactcreep.figures.{draw}")(found, self.plot, **pictured)
        if self.json:
            typer.echo(as_json({**(about or {})} | found.summary()))
        else:
            say_summary(found.summary()) if rows is None else rows(found)
            for path in (self.data, self.plot):
                if path is not None:
                    typer.echo(f"written: {path}")
        if interrupted:
            complain("interrupted: this is what is known")
            raise typer.Exit(INTERRUPTED)
        return found


@dataclass(frozen=True, kw_only=True)
class Output(Drawing):
    """Where the answer of a study that has a dataset goes.

    Parameters
    ----------
    out : path
        Write the data to this NetCDF file.
    """

    out: Path | None = None

    @property
    def data(self) -> Path | None:
        """Where the dataset goes."""
        return self.out


GROUPS |= {"Drawing": Drawing, "Output": Output}


def grouped(
    settings: Sequence[Mapping[str, Any]], said: Sequence[Any]
) -> list[tuple[list[str], list[int]]]:
    """Return groups of members with equal results whose settings are neighbours.

    Parameters
    ----------
    settings : sequence of mapping
        Keys and values of each member.
    said : sequence
        What is printed of each member; it is compared by ``==``.

    Returns
    -------
    list of (list of str, list of int)
        Of each group the values of every key, a range as ``first … last``, and its members.
    """
    rows: list[tuple[list[list[Any]], list[int]]] = []
    for number, (setting, _) in enumerate(zip(settings, said, strict=False)):
        rows.append(([[value] for value in setting.values()], [number]))
    for column in reversed(range(len(settings[0]) if settings else 0)):
        kept: list[tuple[list[list[Any]], list[int]]] = []
        for values, members in rows:
            if kept and said[kept[-1][1][0]] == said[members[0]]:
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
