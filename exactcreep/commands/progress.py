"""How far a command has come: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exactcreep.quasistatic.loop import Progress
    from exactcreep.studies.sweeps import SweepProgress

COMPILING = "compiling the kernel, once; the next start finds it ready"
_SECONDS_BETWEEN_LINES = 5.0


class RunBar(AbstractContextManager["RunBar"]):
    """Progress of a run on standard error: members, half-cycles, time left."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
        from rich.progress import TimeRemainingColumn as TimeLeft

        self.console = Console(stderr=True)
        columns: list[Any] = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
        columns += [TextColumn("half-cycles,"), TimeLeft(), TextColumn("left")]
        on_terminal = self.console.is_terminal
        self.bar = Progress(*columns, console=self.console, transient=True, disable=not on_terminal)
        self.task = self.bar.add_task("starting", total=None)
        self.begin: float | None = None  # of the run, after compilation
        self.next_line = math.inf if on_terminal else -math.inf

    def __enter__(self) -> RunBar:
        self.bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.bar.stop()

    def show(self, progress: Progress) -> None:
        """Show how far the run has come."""
        if progress.phase == "compiling":
            self.console.print(COMPILING)
            return
        several = progress.members > 1
        who = f"member {progress.member}/{progress.members}" if several else "running"
        # members are taken as equally long, so that the time left is that of all of them
        total = progress.total * progress.members
        done = progress.half_cycles + progress.total * (progress.member - 1)
        self.bar.update(self.task, description=who, total=total, completed=done)
        now = time.monotonic()
        if self.begin is None:
            self.begin = now
        if now >= self.next_line:
            self.next_line = now + _SECONDS_BETWEEN_LINES
            # the first half-cycles say little about the last
            known = done > total // 1000
            left = (
                f", about {(now - self.begin) * (total - done) / done:.0f} s left" if known else ""
            )
            sys.stderr.write(
                f"{who}: {progress.half_cycles} of {progress.total} half-cycles,"
                f" {progress.events} events{left}\n"
            )
            sys.stderr.flush()


class SweepBar(AbstractContextManager["SweepBar"]):
    """Progress of a sweep on standard error: cells, events per second, time left."""

    def __init__(self, name: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

        self.name = name
        self.console = Console(stderr=True)
        on_terminal = self.console.is_terminal
        columns: list[Any] = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
        columns += [TextColumn("cells{task.fields[told]}")]
        self.bar = Progress(*columns, console=self.console, transient=True, disable=not on_terminal)
        self.task = self.bar.add_task(name, total=None, told="")
        self.next_line = math.inf if on_terminal else time.monotonic()
        self.compiling = False

    def __enter__(self) -> SweepBar:
        self.bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.bar.stop()

    def show(self, progress: SweepProgress) -> None:
        """Show how far the sweep has come."""
        if progress.phase == "compiling" and not self.compiling:
            self.compiling = True
            self.console.print(COMPILING)
        told = f", {progress.events_per_second:.3g} events/s" if progress.events else ""
        if progress.seconds_left > 0:
            told += f", about {_duration(progress.seconds_left)} left"
        self.bar.update(self.task, total=progress.total, completed=progress.cells, told=told)
        now = time.monotonic()
        if now >= self.next_line:
            self.next_line = now + _SECONDS_BETWEEN_LINES
            sys.stderr.write(
                f"{self.name}: {progress.cells} of {progress.total} cells ({progress.found} found"
                f" saved){told}\n"
            )
            sys.stderr.flush()


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"


@contextmanager
def phase_bar() -> Iterator[Callable[[str, float], None]]:
    """Yield what shows a phase and the fraction done, on standard error, on a terminal only."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda phase, fraction: bar.update(task, description=phase, completed=fraction)
