"""Programs that tests run in processes of their own, where every wait ends."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE = 300
"""Seconds that a process may take: its first compilation on a busy machine takes a third of them.

It ends a wait that would last for ever; it is no judgement of how fast the program is.
"""
PROGRAM = (sys.executable, "-m", "exactcreep")


def environment(**changed: str) -> dict[str, str]:
    """Return the variables of a process that imports what this one imports."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "COLUMNS": "100", **changed}


def finished(
    *words: str, patience: float | None = PATIENCE, folder: Path | None = None, **changed: str
) -> subprocess.CompletedProcess[str]:
    """Return what a program printed and its status; `changed` are variables of its environment."""
    return subprocess.run(
        words, env=environment(**changed), capture_output=True, text=True, timeout=patience,
        check=False, cwd=folder,
    )  # fmt: skip


@contextmanager
def begun(*words: str, **options: Any) -> Iterator[subprocess.Popen[str]]:
    """Yield a process that goes on beside the test, and end it; `options` are those of `Popen`."""
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(words, env=environment(), text=True, **piped | options) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_until(reached: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait until `reached()`, which the running `process` has to bring about."""
    end = time.monotonic() + PATIENCE
    while not reached():
        assert process.poll() is None, "the process has left"
        assert time.monotonic() < end, "the process does not get there"
        time.sleep(0.02)
