"""Limits of a computation, as one value: the events, the memory and the time it may use."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from exactcreep.interrupts import waiting
from exactcreep.model.numbers import nearest_float, number_from_zero, whole_number

MEMORY = 2**30
"""Bytes of what is recorded that are kept in memory, unless another number is asked for."""
_ANY_NUMBER = 2**60  # of events: compiled loops add to it, in integers of 64 bits


class OutOfTime(Exception):
    """The time was over within one event; nothing has changed since the event before."""


class Stop(Enum):
    """Why a simulation came back."""

    DONE = "done"
    """Every target was reached."""
    BUDGET = "budget"
    """The events or the memory that were allowed are used up, or there is a pause."""
    DEADLINE = "deadline"
    """The time is over, or the user interrupted."""
    RUNAWAY = "runaway"
    """It was proved that the chain never comes to rest: no further target can be reached."""
    LIMIT = "limit"
    """The solver gives up: it reaches no further target."""

    @property
    def final(self) -> bool:
        return self in (Stop.RUNAWAY, Stop.LIMIT)


@dataclass(frozen=True)
class Limits:
    """What a computation may use, from the call that is given it.

    `events` are start and stop events, `used` of them before the call; `bytes` those of what is
    recorded, beyond `memory` in files. On the clock of `time.perf_counter` it has to end `at`, and
    to hand over what it has at `pause`; `seconds` is how long it may take in all.
    """

    events: int | None = None
    bytes: int | None = None
    at: float = math.inf
    seconds: float = math.inf
    pause: float = math.inf
    interrupted: Callable[[], bool] = bool
    used: int = 0
    memory: int = MEMORY

    @classmethod
    def of(
        cls,
        max_events: Any = None,
        max_seconds: Any = None,
        max_bytes: Any = None,
        memory: Any = MEMORY,
    ) -> Limits:
        """Return the limits that a user asks for; the time begins now."""  # fmt: skip
        events, size = (
            None if value is None else min(whole_number(value, name, least=0), _ANY_NUMBER)
            for name, value in (("max_events", max_events), ("max_bytes", max_bytes))
        )
        seconds = math.inf
        if max_seconds is not None:
            seconds = nearest_float(number_from_zero(max_seconds, "max_seconds"))
        kept = whole_number(memory, "memory", least=0)
        return cls(events, size, seconds=seconds, interrupted=waiting, memory=kept).begun()

    def begun(self) -> Limits:
        return replace(self, at=time.perf_counter() + self.seconds)

    def after(self, events: int) -> Limits:
        return replace(self, used=self.used + events)

    def later(self, seconds: float) -> Limits:
        return replace(self, at=self.at + seconds)

    @property
    def events_left(self) -> int:
        return _ANY_NUMBER if self.events is None else max(self.events - self.used, 0)

    @property
    def seconds_left(self) -> float | None:
        """How long it may still take; None: any time."""
        return None if self.at == math.inf else max(self.at - time.perf_counter(), 0.0)

    def passed(self) -> bool:
        """Return whether the time is over, or the user wants back what there is."""
        return self.interrupted() or (self.at < math.inf and time.perf_counter() >= self.at)

    def require(self) -> None:
        """Raise `OutOfTime` if the time is over."""
        if self.passed():
            raise OutOfTime(self.reason(Stop.DEADLINE))

    def stop(self, events: int) -> Stop | None:
        """Return why a computation ends that has used so many events; None: it goes on."""
        if events >= self.events_left:
            return Stop.BUDGET
        if self.passed():
            return Stop.DEADLINE
        return Stop.BUDGET if time.perf_counter() >= self.pause else None

    def reason(self, stop: Stop) -> str:
        """Return the sentence for what ended because of these limits; "" if it did not."""
        if stop is Stop.BUDGET:
            return f"max_events = {self.events} was reached"
        if stop is Stop.DEADLINE:
            reached = f"max_seconds = {self.seconds:g} was reached"
            return "interrupted" if self.interrupted() else reached
        return ""


NO_LIMITS = Limits()
"""As much as it takes."""
