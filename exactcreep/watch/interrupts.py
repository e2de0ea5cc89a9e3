"""Handle Ctrl-C and SIGTERM: at once, or at the end of a block that must not be left half done.

Python drops a KeyboardInterrupt that is raised in a finaliser or a callback. So the command line
also remembers the signal, and `check` raises it again.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

STATUS = 128
"""A program that a signal ends has this exit status plus the signal's number."""
_heard: list[int] = []
"""The signals that the command line has received."""
_deferring: list[object] = []
"""The running blocks, the innermost last."""
_waiting: list[int] = []
"""The signals that wait for the end of the outermost block."""


def _hear(number: int, frame: Any) -> None:
    _heard.append(number)
    if _deferring:
        _defer(number, frame)
    else:
        signal.default_int_handler(number, frame)


def _defer(number: int, frame: Any) -> None:
    if _waiting:
        raise KeyboardInterrupt
    _waiting.append(number)


def listen() -> None:
    """Remember every Ctrl-C of this process (unless ignored so far), and treat SIGTERM alike."""
    signal.signal(signal.SIGTERM, _hear)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _hear)


def check() -> None:
    """Raise `KeyboardInterrupt` if the command line has received a signal outside of a block."""
    if _heard and not _deferring:
        raise KeyboardInterrupt


def waiting() -> bool:
    """Return whether a signal waits for the end of a block, which should then return soon."""
    return bool(_waiting)


def deferring() -> bool:
    """Return whether a block defers signals."""
    return bool(_deferring)


def status() -> int | None:
    """Return the exit status for the last signal of the command line; None if there was none."""
    return STATUS + _heard[-1] if _heard else None


@contextmanager
def deferred() -> Iterator[Callable[[], bool]]:
    """Let a first signal wait for the end of a block; a second one interrupts at once.

    Yields a function that returns whether a signal came since the outermost block began.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    check()
    alone = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    _deferring.append(_defer)
    if alone:
        signal.signal(signal.SIGINT, _defer)
    try:
        yield waiting
    finally:
        if alone:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        _deferring.pop()
        if not _deferring:
            _waiting.clear()
