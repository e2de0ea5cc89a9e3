"""A sweep on a cluster loses nothing, whatever becomes of its workers and its scheduler."""

from __future__ import annotations

import os
import random
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from exactcreep.model.numbers import InputError
from exactcreep.progress import Progress
from exactcreep.quasistatic import checkpoint
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep
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
        executor = running.enter_context(cluster(str(address), timeout=10))
        executor._client.wait_for_workers(workers, timeout=PATIENCE)  # or the first hold all cells
        yield executor, scheduler, crowd


class Told(Executor):
    """An executor each cell of which calls ``before(name)`` and ``after(name)`` on its worker."""

    def __init__(self, inner: Executor, before: Callable, after: Callable = str) -> None:
        self.inner, self.before, self.after = inner, before, after

    def submit(self, function, /, *args, **kwargs):
        before, after = self.before, self.after

        def computed(experiment):
            name = f"{experiment.chain.n}-{float(experiment.drive.amplitude)}-{experiment.seed}"
            before(name)
            value = function(experiment)
            after(name)
            return value

        return self.inner.submit(computed, *args)


def test_a_killed_worker_of_a_cluster_loses_nothing(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    scene = load_scene(written(tmp_path, cycles=100))
    path = str(diary)
    saved: list[dict[str, object]] = []
    killed: list[int] = []

    def say(word: str) -> Callable[[str], None]:
        def write(name: str) -> None:
            import os

            handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
            os.write(handle, f"{word} {os.getpid()} {name}\n".encode())
            os.close(handle)

        return write

    def entries(word: str) -> list[tuple[str, ...]]:
        lines = map(str.split, diary.read_text().splitlines() if diary.exists() else ())
        return [tuple(words[1:]) for words in lines if words[0] == word]

    def watch(progress: Progress) -> None:
        busy = [one for one in entries("begin") if one not in entries("end")]
        if not killed and progress.done >= 3 and busy:
            saved.extend(checkpoint.read(cell)["value"] for cell in (out / "cells").glob("*.cell"))
            killed.append(int(busy[0][0]))
            os.kill(killed[0], signal.SIGKILL)

    with dask(tmp_path, 2) as (executor, _, _):
        told = Told(executor, say("begin"), say("end"))
        grid = sweep(scene, executor=told, out=out, progress=watch)
    assert killed, (tmp_path / "dask.log").read_text()
    assert grid.identical(sweep(scene))
    begun, ended = Counter(name for _, name in entries("begin")), entries("end")
    assert len(begun) == 12
    table = grid.x_G.to_series()
    kept = [key for key, x_G in table.items() if x_G in {value["x_G"] for value in saved}]
    assert len(kept) == len(saved) >= 3
    for n, amplitude, seed in kept:
        assert begun[f"{n}-{amplitude}-{seed}"] == 1, "a saved cell was computed again"
    # the cell that the killed worker had begun was done by another one
    lost = {name for pid, name in entries("begin") if int(pid) == killed[0]}
    other = {name for pid, name in ended if int(pid) != killed[0]}
    assert any(begun[name] > 1 and name in other for name in lost)


def test_a_scheduler_that_does_not_answer_is_one_clear_sentence() -> None:
    pytest.importorskip("distributed")
    from exactcreep.studies.dask_cluster import cluster

    with (
        pytest.raises(InputError, match=r"scheduler = 'tcp://127.0.0.1:9': does not answer"),
        cluster("tcp://127.0.0.1:9", timeout=0.5),
    ):
        pass


@pytest.mark.slow
def test_a_scheduler_that_is_killed_ends_the_sweep_in_a_sentence_and_resume_goes_on(
    tmp_path: Path,
) -> None:
    scene, out = load_scene(written(tmp_path, cycles=400)), tmp_path / "out"
    with dask(tmp_path, 1) as (executor, scheduler, _):

        def watch(progress: Progress) -> None:
            if progress.done >= 2:
                scheduler.kill()

        with pytest.raises(InputError, match=r"'DaskExecutor': was lost .*resume"):
            sweep(scene, executor=executor, out=out, progress=watch)
    assert 2 <= len(list((out / "cells").glob("*.cell"))) < 12
    assert sweep(scene, out=out, resume=True).identical(sweep(scene))


@pytest.mark.slow
def test_most_workers_killed_and_one_stopped_for_a_while_change_no_bit(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, cycles=300))
    scene = scene.with_settings({"vary.run.seed": list(range(50))})
    moments = random.Random(20110603)
    with dask(tmp_path, 16) as (executor, _, workers):
        stopped = workers.pop()
        doomed = sorted(moments.sample(range(5, 150), 10))

        def watch(progress: Progress) -> None:
            if doomed and progress.done >= doomed[0]:
                doomed.pop(0)
                workers.pop(moments.randrange(len(workers))).kill()
                os.kill(stopped.pid, signal.SIGSTOP)
            elif len(doomed) < 2:
                os.kill(stopped.pid, signal.SIGCONT)

        grid = sweep(scene, executor=executor, out=tmp_path / "out", progress=watch)
        assert not doomed
        os.kill(stopped.pid, signal.SIGCONT)
    assert grid["finished"].size == 200
    assert grid.identical(sweep(scene))


@pytest.mark.slow
def test_a_cell_that_kills_its_workers_is_told_and_the_others_are_saved(tmp_path: Path) -> None:
    scene, out = load_scene(written(tmp_path, cycles=10)), tmp_path / "out"

    def die(name: str) -> None:
        import os

        if name == "6-0.01-2":
            os._exit(1)

    with (
        dask(tmp_path, 6) as (executor, _, _),
        pytest.raises(InputError, match=r"KilledWorker.*1 of 12 cells failed") as told,
    ):
        sweep(scene, executor=Told(executor, die), out=out)
    assert told.value.field == "cell"
    assert told.value.value == "chain.n = 6, drive.amplitude = 0.01, run.seed = 2"
    assert len(list((out / "cells").glob("*.cell"))) == 11
    assert sweep(scene, out=out, resume=True).identical(sweep(scene))
