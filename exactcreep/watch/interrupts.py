"""Handle Ctrl-C and SIGTERM: at once, or at the end of a block that must not be left half done.

Python drops a KeyboardInterrupt that is raised in a finaliser or a callback. So the command line
also remembers the signal, and `check` raises it again.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

STATUS = 128
"""A program that a signal ends has this exit status plus the signal's number."""
_heard: list[int] = []
"""The signals that the command line has received."""
_deferring: list[object] = []
"""The running blocks, the innermost last."""
_waiting: list[int] = []
"""The signals that wait for the end of the outermost block."""
_left: list[threading.Thread] = []
"""Preparations that a signal has left behind."""


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


def prepare(work: Callable[[], object]) -> None:
    """Do work that has no result, such as compiling; a signal leaves it behind at once.

    The compiler works for many seconds in one call, in which Python hears no signal: in the main
    thread a thread of its own does the work.
    """
    if threading.current_thread() is not threading.main_thread():
        work()
        return
    failures: list[BaseException] = []

    def tried() -> None:
        try:
            work()
        except BaseException as failure:  # raised again below
            failures.append(failure)

    thread = threading.Thread(target=tried, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(0.1)
            if _waiting:
                raise KeyboardInterrupt
    finally:
        if thread.is_alive():
            _left.append(thread)
    for failure in failures:
        raise failure


def leave(code: int) -> NoReturn:
    """End the process of the command line, without waiting for what was left behind."""
    if any(thread.is_alive() for thread in _left):
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


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
