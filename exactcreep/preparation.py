"""The time that a process spends on what comes once: compiling its solvers, or loading them.

It is no part of any estimate of how long work takes.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

_begun: list[float] = []
"""When the blocks that are running began, the outermost first."""
_spent: list[float] = []
"""How long each of those took that have ended, of nested ones the outermost."""


def seconds() -> float:
    """Return the wall time of all such blocks so far, in seconds, each moment counted once."""
    return sum(_spent) + (time.perf_counter() - _begun[0] if _begun else 0.0)


def begin() -> None:
    """Note that something is being prepared."""
    _begun.append(time.perf_counter())


def end() -> None:
    """Note that what was begun last is ready."""
    began = _begun.pop()
    if not _begun:
        _spent.append(time.perf_counter() - began)


@contextmanager
def preparing() -> Iterator[None]:
    """Count the time of a block as preparation."""
    begin()
    try:
        yield
    finally:
        end()
