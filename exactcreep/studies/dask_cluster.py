"""A dask cluster as an executor; needs the extra `cluster`."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from distributed import Client

from exactcreep.model.numbers import InputError


@contextmanager
def cluster(address: str, *, timeout: float = 30.0) -> Iterator[Executor]:
    """Yield an executor that computes on the workers of a dask scheduler.

    Parameters
    ----------
    address : str
        Of the scheduler, e.g. ``tcp://10.0.0.1:8786``, or the path of its ``--scheduler-file``.
    timeout : float
        Seconds to wait for it.

    Raises
    ------
    InputError
        If no scheduler answers there.

    Notes
    -----
    A cell whose worker dies is computed again by another one, up to the number of times that
    dask's ``distributed.scheduler.allowed-failures`` says.
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
        # not pure: dask must never take a cell's result from another one of the same arguments
        executor: Executor = client.get_executor(pure=False)
        yield executor
