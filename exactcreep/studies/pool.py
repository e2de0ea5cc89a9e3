"""Run tasks on threads of this process or on an executor, each with its own future.

If a task fails, its name is known and the results of the others are saved (joblib cannot do this).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any

from exactcreep.model.numbers import InputError, Number, whole_number
from exactcreep.watch import interrupts

_GLANCE = 0.25  # seconds between two checks of signals and two updates of the progress display
_FEWEST_AHEAD = 64  # tasks that an executor has waiting


@dataclass
class Signals:
    """Signals between a study and its tasks in threads: a task shall stop, or one compiles."""

    stopped: bool = False
    compiling: bool = False

    @property
    def stop(self) -> bool:
        """Whether tasks shall return early, because the study received a signal."""
        return self.stopped or interrupts.waiting()


@dataclass(frozen=True)
class Pool:
    """An executor, the number of tasks that it may hold, and signals if it uses threads."""

    executor: Executor
    ahead: int
    signals: Signals | None = None

    def completed(
        self, function: Callable[..., Any], tasks: Iterable[tuple[int, Any]]
    ) -> Iterator[tuple[int, Future[Any]] | None]:
        """Yield the key and the future of each task as it finishes, and None while none does.

        It computes ``function(task)``, for threads with the signals, and yields at least four times
        a second. When several tasks finish together, the failed ones are yielded last. After a
        signal no further task starts; tasks in threads return soon, others are abandoned. Raises
        `InputError` if the executor accepts no more tasks, after the finished results.
        """
        running: dict[Future[Any], int] = {}
        remaining = iter(tasks)
        signals = () if self.signals is None else (self.signals,)
        try:
            while not (interrupts.waiting() and self.signals is None):
                if interrupts.waiting() and self.signals is not None:
                    self.signals.stopped = True
                    remaining = iter(())
                for key, task in islice(remaining, self.ahead - len(running)):
                    running[self.executor.submit(function, task, *signals)] = key
                if not running:
                    return
                ended = wait(running, _GLANCE, return_when=FIRST_COMPLETED).done
                for future in sorted(ended, key=_failed):
                    yield running.pop(future), future
                if not ended:
                    yield None
            yield from _finished(running)
        except (RuntimeError, OSError) as error:  # the executor was shut down or lost
            yield from _finished(running)
            raise self.lost(error) from None
        finally:
            for future in running:
                future.cancel()

    def lost(self, error: BaseException) -> InputError:
        allowed = f"was lost ({reason_of(error)}); what has finished is saved if there is an output"
        allowed += ", and resume computes the rest"
        return InputError("executor", type(self.executor).__name__, allowed)


def _failed(future: Future[Any]) -> bool:
    return future.cancelled() or future.exception() is not None


def _finished(running: dict[Future[Any], int]) -> Iterator[tuple[int, Future[Any]]]:
    for future, key in running.items():
        if future.done() and not _failed(future):
            yield key, future


def reason_of(error: BaseException) -> str:
    """Return the first line of an error's message."""
    return f"{type(error).__name__}: {error}".partition("\n")[0][:200].rstrip(": ")


@contextmanager
def pool_of(executor: Executor | None, workers: Number | None) -> Iterator[Pool]:
    """Yield a pool on an executor, or on `workers` threads (default: one for each processor)."""
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
            signals.stopped = True
            raise
