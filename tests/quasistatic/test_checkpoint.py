"""Checkpoints: a run goes on from its file bit for bit, and a file that is none is refused."""

import itertools
import os
import random
import socket
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Cycles, GaussianSteps, InputError, Outcome, State, Targets, creep, load_scene
from exactcreep.quasistatic.checkpoint import CheckpointWarning
from tests.paper import paper_chain
from tests.processes import PROGRAM, begun, wait_until
from tests.quasistatic.runs import RECORDS, SIX, THIRTY, TWO, VECTORS

pytestmark = pytest.mark.filterwarnings("ignore")
ALL = (*RECORDS, "rearrangements", "slip_table")
LONG = paper_chain(100)
RUNS: list[dict[str, Any]] = [
    {"chain": SIX, "drive": Cycles("0.005", 20), "seed": 5, "record": ALL},
    {"chain": TWO, "drive": Cycles("0.01", 300), "seed": 1, "record": ("x_G",), "twin": True},
    {"chain": THIRTY, "drive": GaussianSteps("0.004", 6), "seed": 2, "record": ALL},
    {"chain": LONG, "drive": Cycles("0.02", 1), "seed": 2, "record": ALL},
    {"chain": SIX, "drive": Targets(["0.004", "-0.004", 0, "0.004"]), "record": ALL,
     "start": State.perturbed(SIX, "1.5", start_seed=4)},
    {"chain": SIX, "drive": Cycles("0.003", 4), "solver": "verlet", "dt": "0.05", "record": ALL},
    {"chain": TWO, "drive": Cycles("0.002", 900), "accuracy": "0.01", "record": ("x_G",)},
    {"chain": SIX, "drive": Cycles("0.003", 90), "solver": "sliding", "record": ("x", "slips"),
     "start": State.prepared(SIX, theta=Fraction(1, 3000))},
    {"chain": paper_chain(3), "drive": VECTORS, "seed": 5, "record": ALL},
]  # fmt: skip


@pytest.mark.parametrize("run", RUNS, ids=range(len(RUNS)))
def test_runs_stopped_at_random_events_go_on_bit_for_bit(tmp_path: Path, run: dict) -> None:
    whole, rng = creep(**run), random.Random(7)
    file = tmp_path / "run.ckpt"
    # before its first event it stands at its start, which need not be at rest
    stops = [0, *sorted(rng.sample(range(1, max(whole.event_count, 6)), 3))]
    creep(**run, max_events=stops[0], checkpoint=file, every=0)
    for stop in (*stops[1:], whole.event_count - 5):  # the last in the midst of an avalanche
        part = creep(**run, checkpoint=file, max_events=max(stop, 1), every=0)
        assert part == whole or part.outcome is Outcome.LIMIT
        assert part.event_count >= min(stop, whole.event_count)
    for _ in range(2):  # what is finished stays finished
        assert creep(**run, checkpoint=file) == whole


def test_recorded_rows_are_added_and_never_written_again(tmp_path: Path) -> None:
    file, run = tmp_path / "run.ckpt", {"chain": SIX, "drive": Cycles("0.01", 12), "record": ALL}
    contents = [b""]

    def watch(progress: Any) -> None:
        contents.append(file.read_bytes())
        assert contents[-1].startswith(contents[-2])

    whole = creep(**run, checkpoint=file, every=0, progress=watch)
    recorded, written = sum(values.nbytes for values in whole.recorded.values()), len({*contents})
    assert written > 5
    assert file.stat().st_size < 1.5 * recorded + written * 2**14
    assert creep(**run, checkpoint=file) == whole


def test_a_file_damaged_anywhere_goes_on_from_the_record_before(tmp_path: Path) -> None:
    file, whole = tmp_path / "run.ckpt", creep(TWO, Cycles("0.01", 3))

    def resume(file: Path) -> Any:
        return creep(TWO, Cycles("0.01", 3), checkpoint=file)

    creep(TWO, Cycles("0.01", 3), checkpoint=file, every=0)
    good, rng = file.read_bytes(), np.random.default_rng(1)
    first = good.index(b"\n", good.index(b"\n") + 1) + 1  # where the experiment ends
    for place in rng.integers(0, len(good), 80).tolist():
        bad = bytearray(good)
        bad[place] ^= 1 << int(rng.integers(8))
        file.write_bytes(bad)
        if place < first:
            with pytest.raises(InputError, match=r"is not a checkpoint|version|damaged"):
                resume(file)
            assert file.read_bytes() == bad
        else:
            with pytest.warns(CheckpointWarning, match="is damaged: its last"):
                assert resume(file) == whole
    for length in (0, 5, 30, 60):
        file.write_bytes(good[:length])
        with pytest.raises(InputError, match=r"not a checkpoint|truncated"):
            resume(file)
    lengths = range(max(first + 1, len(good) - 400), len(good), 50)
    lost = [good[:length] for length in lengths]  # as a writer leaves it that is killed
    lost += [good + b"more", good + bytes(4096), good + good[first:]]
    for bad in lost:
        file.write_bytes(bad)
        with pytest.warns(CheckpointWarning, match="ends within an entry, or is damaged"):
            assert resume(file) == whole
        assert resume(file) == whole


def test_a_full_disk_costs_a_warning_and_the_run_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, whole = tmp_path / "run.ckpt", creep(SIX, Cycles("0.005", 20))
    calls = itertools.count(1)

    def full(descriptor: int) -> None:
        if next(calls) > 2:  # the file is begun, and its folder knows of it
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.warns(CheckpointWarning, match="the same call goes on from what it holds") as seen:
        result = creep(SIX, Cycles("0.005", 20), checkpoint=file, every=0, force=True)
    assert len(seen) == 1
    assert result == whole == creep(SIX, Cycles("0.005", 20), checkpoint=file)


def test_a_second_process_is_refused_until_the_first_is_killed(tmp_path: Path) -> None:
    file, linked = tmp_path / "run.ckpt", tmp_path / "link"
    endless = "run two-sliders-cycles --set drive.cycles=1e9 --every 0 --checkpoint"
    with begun(*PROGRAM, *endless.split(), str(file)) as process:
        wait_until(lambda: file.exists() and file.stat().st_size > 50_000, process)
        linked.symlink_to(file)
        named = f"is being written by process {process.pid} on {socket.gethostname()}"
        for name in (file, linked):
            for force in (False, True):
                with pytest.raises(InputError, match=named):
                    creep(TWO, Cycles("0.01", 3), checkpoint=name, force=force)
        assert process.poll() is None
        process.kill()
        process.wait()
    assert str(process.pid) in (tmp_path / ".run.ckpt.lock").read_text()  # left behind
    run = load_scene("two-sliders-cycles").experiment({"drive.cycles": 10**9})
    gone_on = creep(run.chain, run.drive, checkpoint=file, max_events=1)
    assert gone_on.half_cycles > 0


def test_a_file_of_another_experiment_is_refused_with_the_first_parameter_that_differs(
    tmp_path: Path,
) -> None:
    file, run = tmp_path / "run.ckpt", {"chain": TWO, "drive": Cycles("0.01", 3)}
    creep(**run, checkpoint=file, max_events=5)
    content = file.read_bytes()
    for change, said in (
        ({"chain": SIX, "drive": Cycles("0.01", 4)}, "chain.n is 2 there, and 6 here"),
        ({"drive": Cycles("0.01", 4), "seed": 1}, "drive.cycles is 3 there, and 4 here"),
        ({"seed": 1}, "seed is 0 there, and 1 here"),
        ({"record": ()}, r"record is \['x_G'\] there, and \[\] here"),
        ({"start": State.prepared(TWO, ["0.1"])}, "start.tensions is None there, and"),
        ({"solver": "verlet", "dt": "0.05"}, "solver is 'exact' there, and 'verlet' here"),
    ):
        with pytest.raises(InputError, match=f"holds another experiment: {said}.*anew with force"):
            creep(**{**run, **change}, checkpoint=file)
        assert file.read_bytes() == content
    with pytest.warns(CheckpointWarning, match=r"run.ckpt holds 0 of 6 half-cycles: the run goes"):
        creep(**run, checkpoint=file)
    with pytest.warns(CheckpointWarning, match=r"run.ckpt holds 6 of 6 half-cycles: the run has"):
        assert creep(**run, checkpoint=file) == creep(**run)
    other = {**run, "seed": 1}
    assert creep(**other, checkpoint=file, force=True) == creep(**other)
    assert creep(**other, checkpoint=file) == creep(**other)
