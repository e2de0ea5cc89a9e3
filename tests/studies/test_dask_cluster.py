"""A sweep on a cluster loses nothing, whatever becomes of its workers and its scheduler."""

from __future__ import annotations

import os
import random
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from subprocess import Popen

import pytest

from exactcreep import creep
from exactcreep.model.numbers import InputError
from exactcreep.progress import Progress
from exactcreep.quasistatic import checkpoint
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep
from tests.processes import PATIENCE, begun, wait_until
from tests.studies.test_sweep import written


@contextmanager
def launched(log: Path, module: str, *words: str) -> Iterator[Popen[str]]:
    program = (sys.executable, "-m", f"distributed.cli.{module}", *words)
    with (
        log.open("ab") as file,
        begun(*program, stdout=file, stderr=file, cwd=log.parent) as process,
    ):
        yield process


@contextmanager
def dask(folder: Path, workers: int) -> Iterator[tuple[Executor, Popen[str], list[Popen[str]]]]:
    """Yield the executor of a dask cluster on this machine, its scheduler and its workers."""
    pytest.importorskip("distributed")
    from exactcreep.studies.dask_cluster import cluster

    address, log = folder / "scheduler.json", folder / "dask.log"
    here = ("--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(address))
    with ExitStack() as running:
        scheduler = running.enter_context(
            launched(log, "dask_scheduler", "--port", "0", "--no-show", *here)
        )
        wait_until(address.exists, scheduler)
        alone = ("--nthreads", "1", "--no-nanny", *here)
        crowd = [
            running.enter_context(launched(log, "dask_worker", *alone)) for _ in range(workers)
        ]
        executor = running.enter_context(cluster(str(address), timeout=10))
        executor._client.wait_for_workers(workers, timeout=PATIENCE)  # or the first hold all cells
        yield executor, scheduler, crowd


class Logged(Executor):
    """An executor whose cells write when and where they begin and end to a file."""

    def __init__(self, inner: Executor, path: Path) -> None:
        self.inner, self.path = inner, str(path)

    def submit(self, function, /, *args, **kwargs):
        path = self.path

        def logged(experiment):
            import os

            name = f"{experiment.chain.n}-{experiment.drive.amplitude}-{experiment.seed}"

            def say(word: str) -> None:
                handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
                os.write(handle, f"{word} {os.getpid()} {name}\n".encode())
                os.close(handle)

            say("begin")
            value = function(experiment)
            say("end")
            return value

        return self.inner.submit(logged, *args)


def test_a_killed_worker_of_a_cluster_loses_nothing(tmp_path: Path) -> None:
    diary = tmp_path / "diary"
    scene = load_scene(written(tmp_path, cycles=400))
    out = tmp_path / "out"
    saved: set[str] = set()
    killed: list[int] = []

    # what the cells are called in the diary, by the result that only one of them has
    named = {
        creep(e.chain, e.drive, seed=e.seed).x_G: f"{e.chain.n}-{e.drive.amplitude}-{e.seed}"
        for e in (member.experiment for member in scene.members())
    }
    assert len(named) == 12

    def entries() -> list[list[str]]:
        return [line.split() for line in diary.read_text().splitlines()] if diary.exists() else []

    def watch(progress: Progress) -> None:
        if killed or progress.done < 3:
            return
        ended = {tuple(words[1:]) for words in entries() if words[0] == "end"}
        busy = [words for words in entries() if tuple(words[1:]) not in ended]
        if busy:
            saved.update(named[x_g_of(path)] for path in (out / "cells").glob("*.cell"))
            killed.append(int(busy[0][1]))
            os.kill(killed[0], signal.SIGKILL)

    with dask(tmp_path, 2) as (executor, _, _):
        grid = sweep(scene, executor=Logged(executor, diary), out=out, progress=watch)
    assert killed, (tmp_path / "dask.log").read_text()
    assert len(saved) >= 3
    begun = Counter(words[2] for words in entries() if words[0] == "begin")
    assert len(begun) == 12
    assert all(begun[name] == 1 for name in saved), "a saved cell was computed again"
    # the cell that the killed worker had begun was done by another one
    lost = {words[2] for words in entries() if int(words[1]) == killed[0]}
    ended = {words[2] for words in entries() if words[0] == "end" and int(words[1]) != killed[0]}
    assert any(begun[name] > 1 and name in ended for name in lost)
    assert grid.identical(sweep(scene))


def x_g_of(cell: Path) -> float:
    x_g: float = checkpoint.read(cell)["value"]["x_G"]
    return x_g


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
                stopped.send_signal(signal.SIGSTOP)
            elif len(doomed) < 2:
                stopped.send_signal(signal.SIGCONT)

        grid = sweep(scene, executor=executor, out=tmp_path / "out", progress=watch)
        assert not doomed
        stopped.send_signal(signal.SIGCONT)
    assert grid["finished"].size == 200
    assert grid.identical(sweep(scene))


class Deadly(Executor):
    """An executor on which one cell ends the process of every worker that begins it."""

    def __init__(self, inner: Executor) -> None:
        self.inner = inner

    def submit(self, function, /, *args, **kwargs):
        def computed(experiment):
            import os

            if (experiment.chain.n, experiment.seed, experiment.drive.amplitude * 100) == (6, 2, 1):
                os._exit(1)
            return function(experiment)

        return self.inner.submit(computed, *args)


@pytest.mark.slow
def test_a_cell_that_kills_its_workers_is_told_and_the_others_are_saved(tmp_path: Path) -> None:
    scene, out = load_scene(written(tmp_path, cycles=10)), tmp_path / "out"
    with (
        dask(tmp_path, 6) as (executor, _, _),
        pytest.raises(InputError, match=r"KilledWorker.*1 of 12 cells failed") as told,
    ):
        sweep(scene, executor=Deadly(executor), out=out)
    assert told.value.field == "cell"
    assert told.value.value == "chain.n = 6, drive.amplitude = 0.01, run.seed = 2"
    assert len(list((out / "cells").glob("*.cell"))) == 11
    assert sweep(scene, out=out, resume=True).identical(sweep(scene))
