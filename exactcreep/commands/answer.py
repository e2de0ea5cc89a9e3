"""Print, save and draw the result of a command, as JSON or for people, and set its exit status."""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.values import File, Flag
from exactcreep.watch import preparation, terminal
from exactcreep.watch.display import Display
from exactcreep.watch.terminal import printable

LIMIT, STALE, INTERRUPTED = 3, 4, 130
"""Exit statuses: a limit was reached, the checkpoint is stale, Ctrl-C."""
_JSON_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?")
_WITHOUT_END = 10**5  # columns, unless a terminal folds the lines
_LABELS = {
    "law_seuil": "paper, Eq. 22",
    "law_corrected": "corrected, (N m + D)/(2 l0)",
    "law_two_sliders": "two sliders, (mu_s c - s)/l0",
    "lower": "below the edge",
    "upper": "above the edge",
    "compare": "to be compared with",
    "velocity": "velocity per half-cycle",
    "advanced_until": "last advance in cycle",
    "exponential": "p-value of a constant rate",
    "deaths": "arrests seen",
    "cycles_lived": "cycles followed",
    "theorems": "proved bounds",
    "at_rest": "a state can stay at rest up to A =",
    "no_lasting_creep": "no creep lasts below A =",
    "locked_ends": "cycles with slips of the end sliders only exist up to A =",
}
"""Printed names of keys of summaries that do not explain themselves."""
_UNPRINTED = {
    "outcome", "settled_after", "by_rounding", "reason",  # the sentence has them
    "report", "itinerary", "rate", "confidence", "dormant",
    "n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "end_forces", "expansion",
}  # fmt: skip
"""Keys of summaries that only ``--json`` has, as it alone has lists of numbers."""


# --- JSON -----------------------------------------------------------------------------------------


def as_json(value: Any) -> str:
    """Return `value` as JSON; a decimal of a scene keeps all its digits."""
    text = json.dumps(_plain(value), indent=2)
    return re.sub(r'"\\u0000([^"]*)"', r"\1", text)


def _plain(value: Any) -> Any:
    """Return a value that JSON can hold: nan becomes null; decimals become text."""
    from exactcreep.scene import Literal

    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if isinstance(value, Literal) and _JSON_NUMBER.fullmatch(value):
        return f"\0{value}"
    return None if isinstance(value, float) and not math.isfinite(value) else value


# --- words ----------------------------------------------------------------------------------------


def complain(sentence: str) -> None:
    """Print a sentence on standard error."""
    _remark(f"exactcreep: {' '.join(sentence.split())}")


def _remark(line: str) -> None:
    with suppress(OSError):  # the device may be full; the exit status remains
        print(printable(line), file=terminal.stream("stderr"), flush=True)


@contextmanager
def unread() -> Iterator[None]:
    """Discard further output once its reader, e.g. ``head``, has closed the pipe."""
    try:
        yield
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def put(text: str, end: str = "\n") -> None:
    """Print text that has no markup."""
    _put(printable(text), end)


def _put(text: str, end: str = "") -> None:
    with unread():
        print(text, end=end, file=terminal.stream())


def say_written(files: object) -> None:
    """Say on standard error which files are written; standard output has only the answer."""
    _remark(f"written: {files}")


def say(words: Any, *, soft_wrap: bool = True, **style: Any) -> None:
    """Print words with rich's markup, or a table; only a terminal folds lines."""
    console = terminal.console(columns=None if terminal.folds() else _WITHOUT_END)
    with console.capture() as printed:
        console.print(printable(words) if isinstance(words, str) else words,
                      soft_wrap=soft_wrap, **style)  # fmt: skip
    _put(re.sub(r" +$", "", printed.get(), flags=re.MULTILINE))


def say_heading(scene: str, title: str) -> None:
    """Print the name and title of a scene, without repeating the name."""
    from rich.markup import escape

    title = title.removeprefix(f"{scene} ")
    say(f"[bold]{escape(scene)}[/bold]" + (f": {escape(title)}" if title else ""))


def say_rows(rows: Iterable[tuple[str, Any]]) -> None:
    """Print names and values in two columns."""
    from rich.table import Table
    from rich.text import Text

    table = Table.grid(padding=(0, 2))
    for name, value in rows:
        table.add_row(printable(name), Text(printable(str(value))))
    say(table, soft_wrap=False)


def say_summary(summary: Mapping[str, Any]) -> None:
    """Print the summary of a result: one line for each key whose value is known and not zero."""
    rows = {key: _worded(value) for key, value in summary.items() if key not in _UNPRINTED}
    say_rows((_label(key), text) for key, text in rows.items() if text)


def _label(key: str) -> str:
    return _LABELS.get(key, key.replace("_", " "))


def _worded(value: Any) -> str:
    """Return a value of a summary in words; "" if it is unknown, zero or a list of numbers."""
    from exactcreep.model.numbers import in_words

    if isinstance(value, Mapping):
        parts = {key: _worded(part) for key, part in value.items() if value.get("starts") != 0}
        if any(isinstance(part, Mapping) for part in value.values()):
            said = (f"{key.replace('_', ' ')}: {text}" for key, text in parts.items() if text)
            return "\n".join(said)
        return ", ".join(f"{_label(key)} {text}" for key, text in parts.items() if text)
    if isinstance(value, list):
        return "\n".join(_worded(part) for part in value if isinstance(part, Mapping))
    if not value or value == "none" or value != value:  # nan
        return ""
    return f"{value:.9g}" if isinstance(value, float) else in_words(value)


def say_table(
    names: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    right: Collection[str] = (),
    folded: Collection[str] = (),
    **style: Any,
) -> None:
    """Print rows under the names of their columns; some columns align right or may be folded."""
    from rich.table import Table

    table = Table(**{"box": None, "padding": (0, 1), "header_style": "bold"} | style)
    for name in names:
        side: Any = "right" if name in right else "left"
        table.add_column(name, justify=side, no_wrap=name not in folded, overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    say(table, soft_wrap=False)


def counted(words: Iterable[str] | Mapping[str, int]) -> str:
    """Return how often each word occurs, the most frequent first."""
    return ", ".join(f"{count} {word}" for word, count in Counter(words).most_common())


def duration(seconds: float) -> str:
    """Return a time in words: ``35 us``, ``1.2 s``; ``-`` if it is unknown."""
    if math.isnan(seconds):
        return "-"
    unit, size = ("s", 1.0) if seconds >= 1 else ("ms", 1e-3) if seconds >= 1e-3 else ("us", 1e-6)
    return f"{seconds / size:.3g} {unit}"


# --- answers --------------------------------------------------------------------------------------


@contextmanager
def shown(name: str = "", *, quiet: bool = False) -> Iterator[Display]:
    """Show the progress of a command; at Ctrl-C say how far it came, and exit with status 130."""
    with Display(name, quiet=quiet) as display:
        try:
            yield display
        except KeyboardInterrupt:
            display.stop()
            complain(f"interrupted{display.reached}")
            raise SystemExit(INTERRUPTED) from None


def distinct(**files: Path | None) -> None:
    """Raise `InputError` if two of these files are the same."""
    named: dict[Path, str] = {}
    for name, path in files.items():
        if path is not None and (first := named.setdefault(path.resolve(), name)) != name:
            raise exactcreep.InputError(name, str(path), f"must not be the file of {first}")


def drawing(function: str, *arguments: Any) -> Callable[[], Any]:
    """Return what draws by a ``module:function`` of `exactcreep.figures`, imported only then."""
    return lambda: resolve_name(f"exactcreep.figures.{function}")(*arguments)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Printed:
    """How a command prints and writes its answer.

    Parameters
    ----------
    json
        Print one JSON object.
    """

    json: Flag = False
    plot: Annotated[Path | None, Parameter(parse=False)] = None
    out: Annotated[Path | None, Parameter(parse=False)] = None
    force: Annotated[bool, Parameter(parse=False)] = False

    def check(self, **others: Path | None) -> None:
        """Raise `InputError` unless every file can be written, and no two are the same.

        This is checked before the computation. `others` are the files of other parameters.
        """
        from exactcreep.quasistatic.writing import check_output, check_picture

        outputs = {"out": self.out, "plot": self.plot}
        distinct(**others, **outputs)
        for name, path in outputs.items():
            if path is not None:
                check_output(path, name, force=self.force)
        if self.plot is not None:
            check_picture(self.plot)

    def deliver(
        self,
        summary: Mapping[str, Any],
        say: Callable[[], object],
        *,
        save: Callable[..., object] | None = None,
        draw: Callable[[], Any] | None = None,
        status: int = 0,
        remark: str = "",
    ) -> None:
        """Save, draw and print an answer (even if the disk is full), and exit with its status.

        `summary` is printed by ``--json``, and `say` prints it for people. `save` writes the data
        to a path (over an existing file with ``force=True``), `draw` returns the figure, and
        `remark` is a sentence for standard error.
        """

        def write_picture(path: Path, *, force: bool) -> None:
            figure = draw and draw()  # imports matplotlib
            resolve_name("exactcreep.figures.style:save_picture")(figure, path, force=force)

        preparation.ended()  # what was found in time is delivered
        written, failed = list[Path](), None
        for path, write in ((self.out, save), (self.plot, write_picture)):
            if path is not None and write is not None:
                try:
                    write(path, force=self.force)
                    written.append(path)
                except exactcreep.InputError as error:
                    failed = failed or error
                except KeyboardInterrupt:
                    status, remark = INTERRUPTED, f"interrupted: {path} is not written"
                    break
        if self.json:
            put(as_json(summary))
        else:
            say()
        for path in written:
            say_written(path)
        if failed is not None:
            raise failed
        if remark:
            complain(remark)
        if status:
            raise SystemExit(status)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Drawing(Printed):
    """The output of a command that draws and has no data to save.

    Parameters
    ----------
    plot
        Draw the result to this PNG, PDF or SVG file.
    force
        Overwrite existing files.
    """

    plot: File | None = None
    force: Flag = False


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Output(Drawing):
    """The output of a command that saves and draws.

    Parameters
    ----------
    out
        Write the data to this NetCDF file, FILE.nc.
    """

    out: File | None = None

    def check(self, **others: Path | None) -> None:
        if self.out is not None and self.out.suffix != ".nc":
            raise exactcreep.InputError("out", str(self.out), "must end in .nc: a NetCDF file")
        super().check(**others)
