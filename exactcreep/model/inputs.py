"""Which files the running command has read: no output of it may replace one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_inputs: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs", default=None)
"""Device and inode of the inputs of the running command; None where no command is running."""


@contextmanager
def inputs_kept() -> Iterator[None]:
    """Let no output of a block, which is a command, replace a file that it has read: see `keep`."""
    before = _inputs.set(set())
    try:
        yield
    finally:
        _inputs.reset(before)


def keep(path: str | os.PathLike[str]) -> None:
    """Note that a file is an input of the running command."""
    if (inputs := _inputs.get()) is not None:
        about = os.stat(path)
        inputs.add((about.st_dev, about.st_ino))


def is_input(path: str | os.PathLike[str]) -> bool:
    """Return whether the running command has read a file that exists as its input."""
    about = os.stat(path)
    return (about.st_dev, about.st_ino) in (_inputs.get() or ())
