"""The clock of all limits and times, which stands still while solvers are compiled or loaded.

Preparation may also be late: a command makes a million cells before it first looks at its limits.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager

_begun: list[float] = []
"""Start times of the running blocks, the outermost first."""
_spent = [0.0]
"""Total time of all finished blocks; nested blocks count once."""


def seconds() -> float:
    """Return the wall time of all blocks so far, in seconds; nested blocks count once."""
    return _spent[0] + (time.perf_counter() - _begun[0] if _begun else 0.0)


def clock() -> float:
    """Return the wall time without preparation, in seconds, from an arbitrary zero."""
    return time.perf_counter() - seconds()


def begin() -> None:
    """Start a block of preparation."""
    _begun.append(time.perf_counter())


def end() -> None:
    """End the block that started last."""
    began = _begun.pop()
    if not _begun:
        _spent[0] += time.perf_counter() - began


@contextmanager
def preparing() -> Iterator[None]:
    """Count the time of a block as preparation."""
    begin()
    try:
        yield
    finally:
        end()


# --- late preparation ----------------------------------------------------------------------------

_GRACE = 0.5  # seconds
_due: list[float] = []
"""When the preparation of the present command ends late; empty: it has ended, or is no command."""


class Late(Exception):
    """A command ends late; no computation catches this."""


class OutOfTime(Late):
    """A limit ended a computation, the message says which; within an event the state is kept."""


@contextmanager
def command() -> Iterator[None]:
    """During a block, let preparation that ends later than `limit` says raise `Late`."""
    _due[:] = [math.inf]
    try:
        yield
    finally:
        _due.clear()
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)


def limit(seconds: float) -> None:
    """Limit the preparation of the present command from now on; the first limit holds."""

    def late(*_: object) -> None:
        if _due and clock() >= _due[0]:
            _due.clear()
            raise Late(f"max_seconds = {seconds:g} was reached before there was a result")

    if _due == [math.inf] and hasattr(signal, "setitimer"):
        _due[0] = clock() + seconds + _GRACE
        signal.signal(signal.SIGALRM, late)
        signal.setitimer(signal.ITIMER_REAL, _GRACE, _GRACE)


def ended() -> None:
    """Let the present command take any time: it looks at its limits itself, or has its result."""
    _due.clear()
