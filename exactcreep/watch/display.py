"""Show progress: a bar on terminals and in notebooks, elsewhere lines or nothing."""

from __future__ import annotations

import functools
import inspect
import math
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import timedelta
from importlib import import_module
from importlib.util import find_spec
from typing import Any, ParamSpec, TypeVar

from exactcreep.watch import interrupts, terminal
from exactcreep.watch.progress import Hearer, Progress

P = ParamSpec("P")
T = TypeVar("T")

COMPILING = "compiling for this kind of run, once; the next start finds it ready"
_FIRST_LINE, _BETWEEN_LINES, _BETWEEN_FRAMES = 2.0, 60.0, 0.1  # seconds; the pauses double
_SHORT = 1.0  # seconds without a bar
_telling: list[object] = []  # displays, or silence, that hold for all nested computations


class Display(AbstractContextManager["Display"]):
    """Shows on standard error how far a computation has come, and how long the rest may take.

    `name`: of the computation; `quiet`: without a terminal, report only that the compiler works;
    nothing is shown before `after` seconds.
    """

    def __init__(self, name: str = "", *, quiet: bool = False, after: float = 0.0) -> None:
        self.name, self.quiet, self.compiling = name, quiet, False
        self.begin = time.monotonic() + after
        self.bar: Any = None
        self.pause, self.next = 0.0, math.nan  # seconds, and the time of the next output
        self.last: Progress | None = None
        self.answer = ""

    def __enter__(self) -> Display:
        _telling.append(self)
        return self

    def __exit__(self, *error: object) -> None:
        _telling.remove(self)
        self.stop()

    def stop(self) -> None:
        if self.bar is not None:
            self.bar.stop()

    @property
    def reached(self) -> str:
        """The last progress of the computation in words; "" before the first."""
        if self.last is None or self.last.phase == "compiling":
            return ""
        return f": {self._what(self.last)}, {_far(self.last)}"

    def heard(self, progress: Hearer) -> Callable[[Progress], None] | None:
        """Return the progress callback. A nested computation reports only to its own callable."""
        if callable(progress):
            return progress
        if type(progress) not in (bool, type(None)):
            numbers = import_module("exactcreep.model.numbers")  # help loads no numpy
            raise numbers.InputError("progress", progress, "must be true, false or a function")
        if progress is False or _telling != [self]:
            return None
        notebook = "ipykernel" in sys.modules and find_spec("ipywidgets")
        return self.show if progress or terminal.is_terminal("stderr") or notebook else None

    def show(self, progress: Progress) -> None:
        """Show the progress; raise a Ctrl-C that Python has dropped."""
        self.last = progress
        interrupts.check()
        if time.monotonic() < self.begin:
            return
        if math.isnan(self.next):
            self._start()
        if progress.phase == "compiling" and not self.compiling:
            self.compiling = True
            self.write(COMPILING)
        if progress.answer != self.answer:
            self.answer = progress.answer
            self.write(terminal.printable(self.answer[0].upper() + self.answer[1:]))
        if time.monotonic() < self.next:
            return
        self.next = time.monotonic() + self.pause
        what, far = self._what(progress), _far(progress)
        if not math.isnan(left := progress.seconds_left):
            far += f", about {timedelta(seconds=round(left))} left"
        if self.bar is None:
            self.write(f"{what}: {far}")
            self.pause = min(2 * self.pause, _BETWEEN_LINES)
            return
        about = {"total": 1, "completed": progress.share} if progress.total else {}
        self.bar.update(self.task, description=what, far=far, **about)

    def _start(self) -> None:
        console = terminal.console("stderr")
        if console.is_terminal or (console.is_jupyter and find_spec("ipywidgets")):
            rich = import_module("rich.progress")
            far = rich.TextColumn("{task.fields[far]}")
            what = rich.TextColumn("{task.description}", markup=False)
            columns = (what, rich.BarColumn(), far)
            self.bar = rich.Progress(*columns, console=console, transient=True)
            self.task = self.bar.add_task(self.name, total=None, far="")
            self.pause, self.next = _BETWEEN_FRAMES, -math.inf
            self.bar.start()
        else:
            self.pause = _FIRST_LINE
            self.next = math.inf if self.quiet else self.begin + _FIRST_LINE

    def write(self, line: str) -> None:
        """Print a line above the bar."""
        if self.bar is not None:
            self.bar.console.print(line, markup=False)
        else:
            print(line, file=terminal.stream("stderr"), flush=True)

    def _what(self, progress: Progress) -> str:
        return terminal.printable(f"{self.name or progress.phase} {progress.text}".strip())


def _far(progress: Progress) -> str:
    if progress.counted:
        of = f" of {progress.total:.0f}" if progress.total else ""
        far = f"{progress.done:.0f}{of} {progress.counted}"
    else:
        far = f"{100 * progress.share:.0f} %"
    if progress.found:
        far += f" ({progress.found} found saved)"
    if progress.theta is not None:
        far += f", theta = {progress.theta:.4g}"
    return far + (f", {progress.events_per_second:.3g} events/s" if progress.events else "")


def shows_progress(computation: Callable[P, T]) -> Callable[P, T]:
    """Make a computation show its progress as `Hearer` says, whatever `numpy.errstate` holds."""
    usual = {"divide": "warn", "over": "warn", "under": "ignore", "invalid": "warn"}
    own = inspect.signature(computation).parameters

    @functools.wraps(computation)
    def watched(*args: P.args, **words: P.kwargs) -> T:
        if "chain" in own and (further := {*words} - {*own}):
            # imported late, because the display needs no numbers
            import_module("exactcreep.model.chain").refuse_own(words, further, computation.__name__)
        with Display(after=_SHORT) as display, import_module("numpy").errstate(**usual):
            words["progress"] = display.heard(words.get("progress"))  # type: ignore[arg-type]
            return computation(*args, **words)

    return watched
