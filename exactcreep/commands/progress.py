"""How far a command has come: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import math
import sys
import time
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from exactcreep import interrupts

if TYPE_CHECKING:
    from exactcreep.progress import Progress

COMPILING = "compiling the kernel, once; the next start finds it ready"
_BETWEEN_LINES = 5.0  # seconds
_BETWEEN_FRAMES = 0.1


class Display(AbstractContextManager["Display"]):
    """Shows on standard error how far a computation has come, and how long the rest may take.

    Parameters
    ----------
    name : str
        Of what is computed; default what the computation says itself.
    quiet : bool
        Without a terminal, say nothing but that the compiler is at work.
    """

    def __init__(self, name: str = "", *, quiet: bool = False) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bar

        self.name, self.compiling = name, False
        self.bar: Bar | None = None
        console = Console(stderr=True)
        if console.is_terminal:
            far = TextColumn("{task.fields[far]}")
            columns = (TextColumn("{task.description}"), BarColumn(), far)
            self.bar = Bar(*columns, console=console, transient=True)
            self.task = self.bar.add_task(name or "starting", total=None, far="")
            self.pause, self.next = _BETWEEN_FRAMES, -math.inf
        else:
            self.pause, self.next = _BETWEEN_LINES, time.monotonic() + _BETWEEN_LINES
            if quiet:
                self.next = math.inf

    def __enter__(self) -> Display:
        if self.bar is not None:
            self.bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Take the bar away."""
        if self.bar is not None:
            self.bar.stop()

    def show(self, progress: Progress) -> None:
        """Show how far the computation has come; raise a Ctrl-C that was lost on its way."""
        interrupts.check()
        if progress.phase == "compiling" and not self.compiling:
            self.compiling = True
            self._write(COMPILING)
        if time.monotonic() < self.next:
            return
        self.next = time.monotonic() + self.pause
        what, far = self._what(progress), _far(progress)
        if self.bar is None:
            self._write(f"{what}: {far}")
            return
        # members are taken as equally long, so that the bar is that of all of them
        total = progress.total * progress.members or None
        done = progress.done + progress.total * (progress.member - 1)
        self.bar.update(self.task, description=what, far=far, total=total, completed=done)

    def _write(self, line: str) -> None:
        if self.bar is not None:
            self.bar.console.print(line)
        else:
            sys.stderr.write(f"{line}\n")
            sys.stderr.flush()

    def _what(self, progress: Progress) -> str:
        what = f"{self.name or progress.phase} {progress.text}".strip()
        several = progress.members > 1
        return f"member {progress.member}/{progress.members}" if several else what


def _far(progress: Progress) -> str:
    """Return how much is done, how fast, and how long the rest may take."""
    far = f"{progress.done:.0f}" + (f" of {progress.total:.0f}" if progress.total else "")
    far += f" {progress.counted}"
    if not progress.counted:
        far = f"{100 * progress.done / progress.total:.0f} %"
    if progress.found:
        far += f" ({progress.found} found saved)"
    if progress.events:
        far += f", {progress.events_per_second:.3g} events/s"
    left = progress.seconds_left
    return far if math.isnan(left) else f"{far}, about {_duration(left)} left"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
