"""Checkpoints: a run goes on from its file bit for bit, and a file that is none is refused."""

import copy
import math
import os
import random
import time
import warnings
from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Cycles, GaussianSteps, InputError, Outcome, State, creep
from exactcreep import Path as Targets
from exactcreep.quasistatic import checkpoint as checkpoints
from exactcreep.quasistatic.checkpoint import VERSION, Checkpoint, CheckpointWarning, packed
from exactcreep.quasistatic.creep import resume, run_members
from exactcreep.quasistatic.experiment import Experiment
from tests.paper import paper_chain
from tests.quasistatic.runs import RECORDS, SIX, THIRTY, THREE, TWO, TWO_SURE

ALL = (*RECORDS, "rearrangements", "slip_table")
LONG = paper_chain(100)
RUNS: list[dict[str, Any]] = [
    {"chain": SIX, "drive": Cycles("0.005", 20), "seed": 5, "record": ALL},
    {"chain": TWO, "drive": Cycles("0.01", 300), "seed": 1, "record": ("x_G",), "twin": True},
    {"chain": TWO_SURE, "drive": Cycles("0.001", 700), "record": ("tension",)},
    {"chain": THIRTY, "drive": GaussianSteps("0.004", 6), "seed": 2, "record": ALL},
    {"chain": LONG, "drive": Cycles("0.02", 1), "seed": 2, "record": ALL},
    {"chain": SIX, "drive": Targets(["0.004", "-0.004", 0, "0.004"]), "record": ALL,
     "start": State.perturbed(SIX, "1.5", start_seed=4)},
    {"chain": SIX, "drive": Cycles("0.003", 4), "solver": "verlet", "dt": "0.05", "record": ALL},
    {"chain": TWO, "drive": Cycles("0.002", 900), "accuracy": "0.01", "record": ("x_G",)},
    {"chain": SIX, "drive": Cycles("0.003", 90), "solver": "sliding", "record": ("x", "slips"),
     "start": State.prepared(SIX, theta=Fraction(1, 3000))},
    {"chain": SIX, "drive": Cycles("0.003", 9), "solver": "sliding", "exact": True},
    {"chain": THREE, "drive": Cycles("0.0015", 2), "solver": "reference", "record": ALL},
    {"chain": THREE, "drive": Cycles("0.0015", 1), "solver": "mpmath", "record": ALL},
    {"chain": THREE, "drive": Cycles("0.0015", 2), "solver": "certified", "record": ALL},
]  # fmt: skip


@pytest.fixture(autouse=True)
def _quietly() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("run", RUNS, ids=range(len(RUNS)))
def test_runs_stopped_at_random_events_go_on_bit_for_bit(tmp_path: Path, run: dict) -> None:
    whole, rng = creep(**run), random.Random(7)
    file = tmp_path / "run.ckpt"
    # before its first event it stands at its start, which need not be at rest
    stops = [0, *sorted(rng.sample(range(1, max(whole.event_count, 6)), 3))]
    creep(**run, max_events=stops[0], checkpoint=file, every=0)
    for stop in (*stops[1:], whole.event_count - 5):  # the last in the midst of an avalanche
        part = resume(file, max_events=max(stop, 1), every=0)
        assert part == whole or part.outcome is Outcome.LIMIT
        assert part.event_count >= min(stop, whole.event_count)
    for _ in range(2):  # what is finished stays finished
        assert resume(file) == whole


def test_recorded_rows_are_added_and_never_written_again(tmp_path: Path) -> None:
    file, run = tmp_path / "run.ckpt", {"chain": SIX, "drive": Cycles("0.01", 12), "record": ALL}
    contents = [b""]

    def watch(progress: Any) -> None:
        contents.append(file.read_bytes())
        assert contents[-1].startswith(contents[-2])

    whole = creep(**run, checkpoint=file, every=0.005, progress=watch)
    recorded, written = sum(values.nbytes for values in whole.recorded.values()), len({*contents})
    assert written > 5
    assert file.stat().st_size < 1.5 * recorded + written * 2**14
    assert resume(file) == whole


def test_a_record_keeps_every_kind_of_value() -> None:
    values = [Fraction(-(7**200), 3**99), 2**200, -5, 0.1, math.inf, True, None]
    arrays = {
        "f": np.array([[0.1, -0.0], [5e-324, 2.0]], order="F"),
        "i": np.arange(3, dtype=np.uint64),
        "s": np.array(["1.25", ""]),
        "o": np.array([Fraction(1, 7), 0.5], dtype=object),
        "empty": np.empty((0, 3)),
    }
    back = checkpoints.from_bytes(checkpoints.to_bytes({"values": values, "arrays": arrays}))
    assert back["values"] == values
    for name, array in arrays.items():
        assert np.array_equal(back["arrays"][name], array)
        assert back["arrays"][name].dtype == array.dtype
    assert np.signbit(back["arrays"]["f"][0, 1])


def test_a_file_damaged_anywhere_is_refused_or_goes_on_from_a_record_before(tmp_path: Path) -> None:
    file, whole = tmp_path / "run.ckpt", creep(TWO, Cycles("0.01", 3))
    creep(TWO, Cycles("0.01", 3), checkpoint=file, every=0)
    good, rng = file.read_bytes(), np.random.default_rng(1)
    refused = 0
    for place in rng.integers(0, len(good), 80).tolist():
        bad = bytearray(good)
        bad[place] ^= 1 << int(rng.integers(8))
        file.write_bytes(bad)
        with suppress(InputError):
            assert resume(file) == whole
            refused -= 1
        refused += 1
    assert refused > 75
    for length in (0, 5, 30, 60):
        file.write_bytes(good[:length])
        with pytest.raises(InputError, match=r"not a checkpoint|truncated"):
            resume(file)
    for length in range(len(good) - 400, len(good), 50):  # as a writer leaves it that is killed
        file.write_bytes(good[:length])
        with pytest.warns(CheckpointWarning, match="ends within a record"):
            assert resume(file) == whole
        assert resume(file) == whole
    for version in (VERSION - 1, VERSION + 1):
        other = good.replace(b"checkpoint %d\n" % VERSION, b"checkpoint %d\n" % version, 1)
        file.write_bytes(other)
        with pytest.raises(InputError, match=f"{version}; this program reads version {VERSION}"):
            resume(file)


def records_of(file: Path) -> list[Any]:
    """Return the records of a checkpoint."""
    return checkpoints._records(file.read_bytes(), "it")[0]


def sealed(records: list[Any]) -> bytes:
    """Return a file of these records, whose checksums match."""
    data, digest = checkpoints._LINE, ""
    for record in records:
        line, digest = packed(record, digest)
        data += line
    return data


def places(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the ways to all numbers, texts and arrays in a tree."""
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], (*way, key))
    elif isinstance(value, list):
        for k, one in enumerate(value):
            yield from places(one, (*way, k))
    else:
        yield way


def mutated(value: Any, rng: random.Random) -> Any:
    """Return another value in its place: another number, shape or kind."""
    wild: list[Any] = [None, -1, 2**62, 2**70, 1e300, math.nan, "x", [], {}, np.zeros(3)]
    if isinstance(value, np.ndarray) and value.size and value.dtype.kind in "fi":
        whole = value.copy()
        kind = rng.randrange(4)
        if kind == 0:
            return whole[:-1] if rng.random() < 0.5 else np.concatenate([whole, whole])
        place = tuple(rng.randrange(size) for size in whole.shape)
        wide = 2**61 if whole.dtype == np.int64 else 99
        numbers = [77, -9, wide] if whole.dtype.kind == "i" else [1e9, -7.5, math.nan, math.inf]
        whole[place] = rng.choice(numbers)
        return whole
    if type(value) is int and rng.random() < 0.7:
        return value + rng.choice([-3, 1000, 7])
    return rng.choice(wild)


@pytest.mark.parametrize("number", [0, 2, 5, 6, 8, 12])
def test_a_crafted_snapshot_gets_a_sentence_in_time(tmp_path: Path, number: int) -> None:
    """Half of what matters is behind the checksum: shapes, ranges, counts, and the physics."""
    run, file, rng = RUNS[number], tmp_path / "run.ckpt", random.Random(number)
    whole = creep(**run)
    creep(**run, max_events=whole.event_count // 2, checkpoint=file, every=0)
    records = records_of(file)
    assert resume(file) == whole
    ways, refused = list(places(records[-1])), 0
    for _ in range(30):
        crafted = copy.deepcopy(records)
        *way, last = rng.choice(ways)
        here = crafted[-1]
        for key in way:
            here = here[key]
        here[last] = mutated(here[last], rng)
        file.write_bytes(sealed(crafted))
        begin = time.process_time()
        try:
            assert resume(file, max_seconds=3).half_cycles <= whole.drive.half_cycles
        except InputError:
            refused += 1
        assert time.process_time() - begin < 5
    # what is not refused is what nothing else tells: times, counts of work, what rounding left
    assert refused >= (18 if run.get("solver") == "certified" else 24)


def test_the_snapshots_that_once_hurt_the_kernel_are_refused(tmp_path: Path) -> None:
    run, file = RUNS[0], tmp_path / "run.ckpt"
    creep(**run, max_events=400, checkpoint=file, every=0)
    records = records_of(file)
    for name, place, value, sentence in (
        ("whole", (0, 0), 1000, "draws are not its slips"),
        ("whole", (0, 1), -5, "count is out of range"),
        ("counts", (0,), -1, "count is out of range"),
        ("counts", (1,), 2**62, "count is out of range"),
        ("numbers", (0, 2), 50.0, "forces and tensions"),
        ("numbers", (4, 1), 0.7, "coefficients"),
        ("numbers", (5, 0), 1e6, "thresholds"),
        ("numbers", (1, 3), math.nan, "not finite"),
        ("theta", (0,), 0.0, "."),
    ):
        crafted = copy.deepcopy(records)
        crafted[-1]["run"]["simulation"][name][place] = value
        file.write_bytes(sealed(crafted))
        with pytest.raises(InputError, match=sentence):
            resume(file)


def test_a_full_disk_costs_a_warning_and_the_run_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, whole = tmp_path / "run.ckpt", creep(SIX, Cycles("0.005", 20))
    sync, calls = os.fsync, []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) > 2:  # the file is begun, and its folder knows of it
            raise OSError(28, "No space left on device")
        sync(descriptor)

    def at_once(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.warns(
        CheckpointWarning, match="resume goes on from what it holds; the run"
    ) as seen:
        result = creep(SIX, Cycles("0.005", 20), checkpoint=file, every=0, force=True)
    assert len(seen) == 1
    assert result == whole
    assert resume(file) == whole
    fails = iter([False, False, True])  # once: then it is written after all
    monkeypatch.setattr(os, "fsync", lambda one: at_once(one) if next(fails, False) else sync(one))
    kept = Checkpoint(file, 0, force=True)
    with pytest.warns(CheckpointWarning, match="No space left"):
        assert run_members([Experiment.of(SIX, Cycles("0.005", 20))], checkpoint=kept) == [whole]
    assert kept.stale == ""
    assert resume(file) == whole


@pytest.mark.parametrize("content", [{}, {"experiments": [{}], "note": {}}])
def test_a_checkpoint_of_something_else_is_refused(tmp_path: Path, content: dict) -> None:
    (tmp_path / "other.ckpt").write_bytes(checkpoints.to_bytes(content))
    with pytest.raises(InputError, match="is not a checkpoint of a run"):
        resume(tmp_path / "other.ckpt")
