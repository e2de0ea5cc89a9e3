"""Limits of a computation: events and time as one value, and the free memory."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from exactcreep.model.numbers import nearest_float, number_from_zero, whole_number
from exactcreep.watch import preparation
from exactcreep.watch.interrupts import waiting
from exactcreep.watch.preparation import OutOfTime as OutOfTime
from exactcreep.watch.preparation import clock

_ANY_NUMBER = 2**60  # events; compiled loops add to it in 64-bit integers


class Stop(Enum):
    """Why a simulation returned."""

    DONE = "done"
    """Every target was reached."""
    BUDGET = "budget"
    """The allowed events are used up, or there is a pause."""
    DEADLINE = "deadline"
    """The time is over, or the user interrupted."""
    RUNAWAY = "runaway"
    """The chain provably never comes to rest: no further target can be reached."""
    LIMIT = "limit"
    """The solver gave up and reaches no further target."""

    @property
    def final(self) -> bool:
        return self in (Stop.RUNAWAY, Stop.LIMIT)


@dataclass(frozen=True)
class Limits:
    """The events and the time that a computation may use.

    `events` are start and stop events, `used` of them before the call. On `preparation.clock` the
    computation has to end at `at` and to return a partial result at `pause`; `seconds`: in all.
    """

    events: int | None = None
    at: float = math.inf
    seconds: float = math.inf
    pause: float = math.inf
    interrupted: Callable[[], bool] = bool
    used: int = 0

    @classmethod
    def of(cls, max_events: Any = None, max_seconds: Any = None) -> Limits:
        """Return the limits that a user asks for; the time begins now."""
        events, seconds = None, math.inf
        if max_events is not None:
            events = min(whole_number(max_events, "max_events", least=0), _ANY_NUMBER)
        if max_seconds is not None:
            seconds = nearest_float(number_from_zero(max_seconds, "max_seconds"))
            preparation.limit(seconds)
        return cls(events, clock() + seconds, seconds, interrupted=waiting)

    def after(self, events: int) -> Limits:
        return replace(self, used=self.used + events)

    @property
    def events_left(self) -> int:
        return _ANY_NUMBER if self.events is None else max(self.events - self.used, 0)

    @property
    def seconds_left(self) -> float | None:
        """Remaining seconds; None: no limit."""
        return None if self.at == math.inf else max(self.at - clock(), 0.0)

    def passed(self) -> bool:
        """Return whether the time is over, or the user has interrupted."""
        if self.at < math.inf:
            preparation.ended()
        return self.interrupted() or (self.at < math.inf and clock() >= self.at)

    def require(self) -> None:
        """Raise `OutOfTime` if the time is over."""
        if self.passed():
            raise OutOfTime(self.reason(Stop.DEADLINE))

    def stop(self, events: int) -> Stop | None:
        """Return why a computation that has used so many events ends, or None."""
        if events >= self.events_left:
            return Stop.BUDGET
        if self.passed():
            return Stop.DEADLINE
        return Stop.BUDGET if clock() >= self.pause else None

    def reason(self, stop: Stop) -> str:
        """Return the sentence for a computation that these limits ended; "" if they did not."""
        if stop is Stop.BUDGET:
            return f"max_events = {self.events} was reached"
        if stop is Stop.DEADLINE:
            reached = f"max_seconds = {self.seconds:g} was reached"
            return "interrupted" if self.interrupted() else reached
        return ""


NO_LIMITS = Limits()
"""No limits at all."""


def free_memory() -> float:
    """Return the free bytes of this machine or container; inf if unknown."""
    free = [math.inf]
    with suppress(OSError):
        told = re.search(r"MemAvailable: *(\d+) kB", Path("/proc/meminfo").read_text())
        free += [1024.0 * int(told[1])] if told else []
    with suppress(OSError, ValueError):  # ValueError: there is no limit, but the word "max"
        box = Path("/sys/fs/cgroup")  # of a container
        bound, held = (int((box / f"memory.{name}").read_text()) for name in ("max", "current"))
        parts = dict(map(str.split, (box / "memory.stat").read_text().splitlines()))
        free.append(bound - held + int(parts["file"]))  # the file cache is free
    return max(min(free), 0.0)
