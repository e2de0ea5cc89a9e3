"""Run tasks side by side, on threads of this process or on an executor, each with its own future.

If a task fails, its name is known and the results of the others are saved (joblib cannot do this).
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent import futures
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from itertools import islice
from typing import Any

from exactcreep.model.numbers import InputError, Number, whole_number
from exactcreep.watch import interrupts

_GLANCE = 0.25  # seconds between two checks of signals and two updates of the progress display
_AHEAD = 256  # tasks that an executor has waiting


def in_parallel(
    function: Callable[..., Any],
    tasks: Iterable[tuple[int, Any]],
    executor: Executor | None = None,
    workers: Number | None = None,
) -> Generator[tuple[int, Future[Any]] | None, None, None]:
    """Yield the key and the future of each task as it finishes, and None while none does.

    It computes ``function(task)``, and yields at least four times a second. Without an executor it
    uses `workers` threads (default: one for each processor) and computes ``function(task,
    stopped)``; a task shall return early when ``stopped()``. A task is made shortly before it
    starts. When several tasks finish together, the failed ones are yielded last. After a signal no
    further task starts; tasks in threads return soon, others are abandoned. Raises `InputError` if
    the executor accepts no more tasks, after the finished results.
    """
    if executor is not None and not hasattr(executor, "submit"):
        raise InputError("executor", executor, "must be a concurrent.futures.Executor")
    if executor is not None and workers is not None:
        raise InputError("workers", workers, "belongs to the executor that is given")
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if workers is not None:
        count = whole_number(workers, "workers", least=1, most=10_000)
    left, running, remaining = threading.Event(), dict[Future[Any], int](), iter(tasks)

    def stopped() -> bool:
        return left.is_set() or interrupts.waiting()

    pool = futures.ThreadPoolExecutor(count) if executor is None else executor
    further, ahead = ((stopped,), 4 * (count or 1)) if executor is None else ((), _AHEAD)
    try:
        while not (interrupts.waiting() and executor is not None):
            if interrupts.waiting():
                remaining = iter(())
            for key, task in islice(remaining, ahead - len(running)):
                running[pool.submit(function, task, *further)] = key
            if not running:
                return
            ended = futures.wait(running, _GLANCE, futures.FIRST_COMPLETED).done
            for future in sorted(ended, key=lambda one: _error(one) is not None):
                error = _error(future)
                if isinstance(error, (BrokenExecutor, CancelledError)):
                    raise error
                yield running.pop(future), future
            if not ended:
                yield None
        yield from _finished(running)
    except (RuntimeError, OSError, CancelledError) as error:  # it was shut down or lost
        yield from _finished(running)
        allowed = f"was lost ({reason_of(error)}); what has finished is saved if there is an output"
        allowed += ", and the same call computes the rest"
        raise InputError("executor", type(executor).__name__, allowed) from None
    finally:
        left.set()
        for future in running:
            future.cancel()
        if executor is None:
            pool.shutdown()


def _error(future: Future[Any]) -> BaseException | None:
    return CancelledError() if future.cancelled() else future.exception()


def _finished(running: dict[Future[Any], int]) -> Iterator[tuple[int, Future[Any]]]:
    for future, key in running.items():
        if future.done() and _error(future) is None:
            yield key, future


def reason_of(error: BaseException) -> str:
    """Return the first line of an error's message."""
    return f"{type(error).__name__}: {error}".partition("\n")[0][:200].rstrip(": ")
