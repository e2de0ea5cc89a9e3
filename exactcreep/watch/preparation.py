"""The clock of all limits and times, which stands still while solvers are compiled or loaded."""

from __future__ import annotations

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
