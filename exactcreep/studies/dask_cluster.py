"""A dask cluster as an executor; needs the extra `cluster`."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from distributed import Client
from distributed.cfexecutor import ClientExecutor

from exactcreep.model.numbers import InputError


class DaskExecutor(ClientExecutor):
    """Dask's executor, but a worker that dies after it has sent a result does not spoil it."""

    def _wrap_future(self, future: Any) -> Future[Any]:
        """Return a future of the standard library that ends as `future` does."""
        own: Future[Any] = Future()

        async def end() -> None:
            result = await future._result(raiseit=False)
            if future.status == "cancelled":
                own.cancel()
                own.set_running_or_notify_cancel()
            elif future.status == "error":
                own.set_exception(result[1])
            else:  # "finished", or dask has restarted the task
                own.set_result(result)

        def cancel(ended: Future[Any]) -> None:
            if ended.cancelled() and future.status != "cancelled":
                future.cancel()

        own.add_done_callback(cancel)
        self._client.loop.add_callback(end)
        return own


@contextmanager
def cluster(address: str, *, timeout: float = 30.0) -> Iterator[Executor]:
    """Yield an executor that computes on the workers of a dask scheduler.

    `address` is the scheduler's address, ``tcp://10.0.0.1:8786``, or the path of its
    ``--scheduler-file``; `timeout` is in seconds. If a worker dies, another computes its cell.
    """
    where = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client: Any = Client(  # type: ignore[no-untyped-call]
            **where, timeout=timeout, set_as_default=False
        )
    except (OSError, ValueError, TypeError) as error:  # a timeout is an OSError
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise InputError("scheduler", address, f"does not answer: {reason}") from None
    with client:
        # not pure: dask must not reuse the result of another cell with the same arguments
        yield DaskExecutor(client, pure=False)  # type: ignore[no-untyped-call]
