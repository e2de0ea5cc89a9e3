"""Run tasks on threads of this process or on an executor, each with a future of its own.

So the others are saved, and the one that failed is named. joblib does not replace this: its
generator of results ends at the first task that fails, and on dask (1.6) waits for ever for a task
whose worker died.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from exactcreep import interrupts
from exactcreep.model.numbers import InputError, Number, whole_number

_GLANCE = 0.25  # seconds between two reports of progress
_FEWEST_AHEAD = 64  # tasks handed to an executor beyond those that have finished


@dataclass
class Signals:
    """What a study and its tasks in threads tell each other: to stop, and that one compiles."""

    stop: bool = False
    compiling: bool = False


@dataclass(frozen=True)
class Pool:
    """An executor, how many tasks it may hold, and signals if it is threads of this process."""

    executor: Executor
    ahead: int
    signals: Signals | None = None

    def run(
        self,
        function: Callable[..., Any],
        tasks: Mapping[int, Any],
        take: Callable[[int, Future[Any]], None],
        show: Callable[[], None],
    ) -> None:
        """Have ``function(task)`` computed, with the signals if there are any.

        `take` is called with the key of a task and its future as it finishes; what it raises ends
        the others, and those that had finished by then are taken, too. `show` is called about four
        times a second. `InputError` if the executor takes no tasks any more.
        """
        waiting: dict[Future[Any], int] = {}
        shown, remaining = -math.inf, iter(tasks.items())
        signals = () if self.signals is None else (self.signals,)
        try:
            while True:
                for key, task in remaining:
                    try:
                        waiting[self.executor.submit(function, task, *signals)] = key
                    except (RuntimeError, OSError) as error:  # it has been shut down, or cut off
                        raise self.lost(error) from None
                    if len(waiting) >= self.ahead:
                        break
                if not waiting or time.monotonic() - shown >= _GLANCE:
                    shown = time.monotonic()
                    show()
                if not waiting:
                    return
                if self.signals is not None and interrupts.waiting():
                    self.signals.stop = True
                for future in wait(waiting, _GLANCE, return_when=FIRST_COMPLETED).done:
                    take(waiting.pop(future), future)
        except BaseException:
            for future in waiting:
                future.cancel()
            for future, key in waiting.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    take(key, future)
            raise

    def lost(self, error: BaseException) -> InputError:
        allowed = f"was lost ({reason_of(error)}); what has finished is saved if there is an output"
        allowed += ", and resume computes the rest"
        return InputError("executor", type(self.executor).__name__, allowed)


def reason_of(error: BaseException) -> str:
    """Return the first line of what an error says."""
    return f"{type(error).__name__}: {error}".partition("\n")[0][:200].rstrip(": ")


@contextmanager
def pool_of(executor: Executor | None, workers: Number | None) -> Iterator[Pool]:
    """Yield a pool of so many threads, default one for each processor, or of an executor."""
    if executor is not None:
        if workers is not None:
            raise InputError("workers", workers, "belongs to the executor that is given")
        known = getattr(executor, "_max_workers", None)
        yield Pool(executor, max(4 * known if isinstance(known, int) else 256, _FEWEST_AHEAD))
        return
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if workers is not None:
        count = whole_number(workers, "workers", least=1, most=10_000)
    signals = Signals()
    with ThreadPoolExecutor(count) as threads:
        try:
            yield Pool(threads, 4 * (count or 1), signals)
        except BaseException:
            signals.stop = True
            raise
