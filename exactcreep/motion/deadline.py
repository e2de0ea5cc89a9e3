"""Until when a computation may go on: a time, and Ctrl-C."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from exactcreep.model.numbers import InputError, exact_number, nearest_float


class OutOfTime(Exception):
    """A deadline passed within one event; nothing has changed since the event before."""


@dataclass(frozen=True)
class Deadline:
    """When a caller wants back what has been reached by then.

    Attributes
    ----------
    at : float
        On the clock of `time.perf_counter`; inf: never.
    reason : str
        What a result says that comes back for it.
    interrupted : callable, optional
        Returns whether the user wants it back now.
    """

    at: float = math.inf
    reason: str = ""
    interrupted: Callable[[], bool] | None = None

    @classmethod
    def after(cls, max_seconds: Any, *, since: float | None = None) -> Deadline:
        """Return the deadline `max_seconds` from now, or from `since`; None: never.

        Raises
        ------
        InputError
            If it is not a number, or negative.
        """
        if max_seconds is None:
            return NEVER
        seconds = exact_number(max_seconds, "max_seconds")
        if seconds < 0:
            raise InputError("max_seconds", max_seconds, "must not be negative")
        begin = time.perf_counter() if since is None else since
        wait = nearest_float(seconds)
        return cls(begin + wait, f"max_seconds = {wait:g} was reached")

    def passed(self) -> bool:
        """Return whether the caller wants back what there is."""
        if self.interrupted is not None and self.interrupted():
            return True
        return self.at < math.inf and time.perf_counter() >= self.at

    def require(self) -> None:
        """Raise `OutOfTime` if it has passed."""
        if self.passed():
            raise OutOfTime(self.reason)


NEVER = Deadline()
"""No deadline."""
