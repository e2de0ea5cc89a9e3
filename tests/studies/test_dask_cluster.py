"""A sweep on a cluster loses nothing, whatever becomes of its workers and its scheduler."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep
from exactcreep.watch.progress import Progress
from tests.processes import PATIENCE
from tests.studies.test_sweep import written

# a clean process that has imported once what its children need
SERVERS = get_context("forkserver")
SERVERS.set_forkserver_preload(["distributed", "exactcreep.studies.sweep"])


def serve(log: Path, module: str, words: tuple[str, ...]) -> None:
    """Be a scheduler or a worker of dask."""
    handle = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    for stream in (1, 2):
        os.dup2(handle, stream)
    os.chdir(log.parent)
    import_module(f"distributed.cli.{module}").main(words, standalone_mode=False)


@contextmanager
def dask(folder: Path, workers: int) -> Iterator[tuple[Executor, Any, list[Any]]]:
    """Yield the executor of a dask cluster on this machine, its scheduler and its workers."""
    pytest.importorskip("distributed")
    from exactcreep.studies.dask_cluster import cluster

    address, log = folder / "scheduler.json", folder / "dask.log"
    here = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(address))
    with ExitStack() as running:

        def launched(module: str, *words: str) -> Any:
            process = SERVERS.Process(target=serve, args=(log, module, (*words, *here)))
            process.start()
            running.callback(process.join)
            running.callback(process.kill)
            return process

        scheduler = launched("dask_scheduler", "--port", "0", "--no-show")
        while not address.exists():
            assert scheduler.is_alive(), log.read_text()
            time.sleep(0.02)
        crowd = [launched("dask_worker", "--nthreads", "1", "--no-nanny") for _ in range(workers)]
        executor = running.enter_context(cluster(str(address), timeout=PATIENCE))
        executor._client.wait_for_workers(workers, timeout=PATIENCE)  # or the first hold all cells
        yield executor, scheduler, crowd


def test_a_killed_worker_of_a_cluster_loses_nothing(tmp_path: Path) -> None:
    scene, out = load_scene(written(tmp_path, cycles=300)), tmp_path / "out"
    with dask(tmp_path, 2) as (executor, _, crowd):

        def watch(progress: Progress) -> None:
            if progress.done >= 3:
                crowd[0].kill()

        grid = sweep(scene, executor=executor, out=out, progress=watch)
        assert not crowd[0].is_alive()
    assert grid.identical(sweep(scene))
