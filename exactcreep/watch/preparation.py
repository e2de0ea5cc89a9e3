"""The clock of all limits and times: it stands while solvers are compiled or loaded.

That comes once in a process, or once on a machine. No limit counts it, no result, no estimate.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

_begun: list[float] = []
"""When the blocks that are running began, the outermost first."""
_spent = [0.0]
"""How long all those took together that have ended, of nested ones the outermost."""


def seconds() -> float:
    """Return the wall time of all such blocks so far, in seconds, each moment counted once."""
    return _spent[0] + (time.perf_counter() - _begun[0] if _begun else 0.0)


def clock() -> float:
    """Return the wall time without preparation, in seconds; its zero means nothing."""
    return time.perf_counter() - seconds()


def begin() -> None:
    """Note that something is being prepared."""
    _begun.append(time.perf_counter())


def end() -> None:
    """Note that what was begun last is ready."""
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
