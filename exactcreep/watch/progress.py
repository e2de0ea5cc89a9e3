"""Progress of a long computation: the value that it reports to its caller."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from exactcreep.watch.preparation import clock

_SOON = 1.0  # seconds until a study says what it knows so far
_TOO_FEW = 1e-3  # fraction of the work below which the remaining time cannot be estimated


@dataclass(frozen=True)
class Progress:
    """How far a computation has come.

    Attributes
    ----------
    phase : str
        ``compiling`` (once, before the first run on a machine), ``running``, or a part of a study.
    done, total : number
        Finished work and all work, in units of `counted`; total is 0 if unknown.
    events, seconds : int, float
        Start and stop events so far; wall time of the phase without compilation, for a resumed run
        over all sessions.
    counted, text : str
        ``half-cycles``, ``cells``, ... ("": `done` is a share of `total`), and the present item.
    found : int
        How many of `done` an earlier computation had saved.
    work, theta : float or None
        Of a run: the finished part of the work, between 0 and 1, and the present theta.
    answer : str
        Of a study: what it knows by now, and how well, in one line; "" as long as it knows nothing.

    Examples
    --------
    >>> seen, chain = [], Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> run = creep(chain, Cycles("0.001", 5), progress=seen.append)
    >>> seen[-1].half_cycles, seen[-1].total, seen[-1].events
    (10, 10, 152)
    """

    phase: str
    done: float
    total: float
    events: int = 0
    seconds: float = 0.0
    counted: str = "half-cycles"
    text: str = ""
    found: int = 0
    work: float | None = None
    theta: float | None = None
    answer: str = ""

    @property
    def half_cycles(self) -> int:
        """Number of targets that a run has reached."""
        return int(self.done)

    @property
    def share(self) -> float:
        """The finished part of the work, between 0 and 1; 0 if unknown."""
        counted = self.done / self.total if self.total else 0.0
        return counted if self.work is None else self.work

    @property
    def events_per_second(self) -> float:
        """Events per second of wall time; 0 before any time has passed."""
        return self.events / self.seconds if self.seconds > 0 else 0.0

    @property
    def seconds_left(self) -> float:
        """Estimated wall time to the end; nan before a thousandth of the work is done."""
        share = self.share
        return self.seconds * (1 - share) / share if share > _TOO_FEW else math.nan


Hearer = bool | Callable[[Progress], None] | None
"""Who receives progress: a callable; False: nobody; True: a bar, or lines without a terminal; None:
a bar on terminals and in notebooks after one second."""


def reporter(progress: Hearer) -> Callable[..., None]:
    """Return a function that reports the progress of a study, from attributes of `Progress`.

    An `answer` is kept for later reports. After 1 second, and 2, 4, ..., `so_far` is
    the answer, or what it returns.
    """
    now, begin, known = "", clock(), ""
    born, due = begin, begin + _SOON

    def report(
        phase: str, done: float, total: float = 1, counted: str = "", *,
        answer: str = "", so_far: str | Callable[[], str] = "", **further: Any,
    ) -> None:  # fmt: skip
        nonlocal now, begin, known, due
        moment = clock()
        if so_far and moment >= due:
            answer, due = so_far() if callable(so_far) else so_far, 2 * moment - born
        known = answer or known
        if phase != now:
            now, begin = phase, moment
        if callable(progress):
            about = {"seconds": moment - begin, "counted": counted, "answer": known, **further}
            progress(Progress(phase, done, total, **about))

    return report
