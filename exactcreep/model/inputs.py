"""Remember the input files of the running command, so that no output replaces one of them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_inputs: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs", default=None)
"""Device and inode of the inputs of the running command; None if no command is running."""


@contextmanager
def inputs_kept() -> Iterator[None]:
    """During a block (a command), refuse outputs that would replace an input noted by `keep`."""
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
    """Return whether an existing file is an input of the running command."""
    about = os.stat(path)
    return (about.st_dev, about.st_ino) in (_inputs.get() or ())
