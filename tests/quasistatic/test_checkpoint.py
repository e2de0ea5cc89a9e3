"""Checkpoints: a run goes on from its file bit for bit, and a damaged file is refused."""

import math
import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from exactcreep import Cycles, InputError, Outcome, creep
from exactcreep.quasistatic import checkpoint as checkpoints
from exactcreep.quasistatic.checkpoint import Checkpoint, CheckpointWarning
from exactcreep.quasistatic.creep import resume, run_members
from exactcreep.quasistatic.experiment import Experiment
from tests.quasistatic.runs import RECORDS, SIX, THREE, TWO, same


@pytest.mark.parametrize(
    ("solver", "options"),
    [
        ("exact", {}),
        ("verlet", {"dt": "0.05"}),
        ("reference", {}),
        ("mpmath", {"digits": 30}),
        ("certified", {"digits": 30}),
    ],
)
def test_a_run_goes_on_from_its_checkpoint_bit_for_bit(
    tmp_path: Path, solver: str, options: dict
) -> None:
    small = solver in ("reference", "mpmath", "certified")
    chain, drive = (THREE, Cycles("0.0015", 4)) if small else (SIX, Cycles("0.005", 20))
    run = {"seed": 5, "solver": solver, "record": RECORDS, **options}
    whole = creep(chain, drive, **run)
    file = tmp_path / "run.ckpt"
    part = creep(chain, drive, max_events=whole.event_count // 3, checkpoint=file, **run)
    assert part.outcome is Outcome.LIMIT
    part = resume(file, max_events=whole.event_count // 2)
    assert part.outcome is Outcome.LIMIT
    assert part.event_count < whole.event_count
    assert same(resume(file), whole)


def test_what_is_finished_stays_finished(tmp_path: Path) -> None:
    file = tmp_path / "run.ckpt"
    whole = creep(SIX, Cycles("0.005", 20), record=RECORDS, checkpoint=file)
    assert same(resume(file), whole)
    assert same(resume(file), whole)


def test_a_checkpoint_keeps_every_kind_of_value() -> None:
    content = {
        "rationals": [Fraction(1, 3), Fraction(-(7**200), 3**99)],
        "numbers": (2**200, -5, 0.1, math.inf, True, None),
        "arrays": {
            "f": np.array([[0.1, -0.0], [5e-324, 2.0]], order="F"),
            "i": np.arange(3, dtype=np.uint64),
            "s": np.array(["1.25", ""]),
            "o": np.array([Fraction(1, 7), 0.5], dtype=object),
            "empty": np.empty((0, 3)),
        },
        "scalar": np.float64(1 / 3),
    }
    back = checkpoints.from_bytes(checkpoints.to_bytes(content))
    assert back["rationals"] == content["rationals"]
    assert back["numbers"] == content["numbers"]
    assert back["scalar"] == content["scalar"]
    for name, array in content["arrays"].items():
        assert np.array_equal(back["arrays"][name], array)
        assert back["arrays"][name].dtype == array.dtype
    assert np.signbit(back["arrays"]["f"][0, 1])


def test_a_checkpoint_damaged_anywhere_is_refused_in_one_sentence(tmp_path: Path) -> None:
    file = tmp_path / "run.ckpt"
    creep(TWO, Cycles("0.01", 3), checkpoint=file)
    good = file.read_bytes()
    generator = np.random.default_rng(1)
    for place in generator.integers(0, len(good), 200).tolist():
        bad = bytearray(good)
        bad[place] ^= 1 << int(generator.integers(8))
        file.write_bytes(bad)
        with pytest.raises(InputError, match="checkpoint = "):
            resume(file)
    for length in (0, 5, 30, len(good) // 2, len(good) - 1):
        file.write_bytes(good[:length])
        with pytest.raises(InputError, match=r"not a checkpoint|truncated"):
            resume(file)
    now = checkpoints.VERSION
    for version in (now - 1, now + 1):  # older and newer
        other = good.replace(b"checkpoint %d\n" % now, b"checkpoint %d\n" % version, 1)
        file.write_bytes(other)
        with pytest.raises(InputError, match=f"{version}; this program reads version {now}"):
            resume(file)
    file.write_bytes(good + b"more")
    with pytest.raises(InputError, match="checksum"):
        resume(file)
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(InputError, match="must be a file"):
            resume(path)


def test_a_checkpoint_that_cannot_be_written_leaves_the_last_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "run.ckpt"
    whole = creep(TWO, Cycles("0.01", 3), checkpoint=file)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        creep(TWO, Cycles("0.01", 4), checkpoint=file, force=True)
    monkeypatch.undo()
    assert same(resume(file), whole)
    assert [path.name for path in tmp_path.iterdir()] == ["run.ckpt"]


@pytest.mark.parametrize("repaired", [True, False])
def test_a_run_goes_on_and_tries_again_when_its_checkpoint_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, repaired: bool
) -> None:
    whole = creep(SIX, Cycles("0.005", 20))
    file, written, write = tmp_path / "run.ckpt", [], checkpoints.write_file

    def sometimes_full(*arguments, **options) -> None:
        written.append(len(written))
        if len(written) in (2, 3) or (not repaired and len(written) > 3):
            raise InputError("checkpoint", str(file), "cannot be written: No space left on device")
        write(*arguments, **options)

    monkeypatch.setattr(checkpoints, "write_file", sometimes_full)
    with pytest.warns(CheckpointWarning, match="No space left on device; the run goes on") as seen:
        result = creep(SIX, Cycles("0.005", 20), checkpoint=file, every=0)
    assert len(written) > 4
    assert same(result, whole)
    assert len(seen) == 1
    monkeypatch.undo()
    assert (resume(file, max_events=0).half_cycles == 40) == repaired
    assert same(resume(file), whole)


def test_of_two_runs_with_one_checkpoint_the_second_does_not_begin(tmp_path: Path) -> None:
    """It is refused even if the first one's file was not there when both were started."""
    file = tmp_path / "run.ckpt"
    second = Checkpoint(file)
    whole = creep(SIX, Cycles("0.005", 20), checkpoint=file)
    experiment = Experiment.of(SIX, Cycles("0.005", 20))
    with pytest.raises(InputError, match="exists and is not overwritten without force"):
        run_members([experiment], checkpoint=second)
    assert same(resume(file), whole)


def test_a_checkpoint_of_many_members_is_written_when_it_is_due_and_not_for_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, written = checkpoints.write_file, []

    def counted(*arguments: object, **options: object) -> None:
        written.append(arguments)
        write(*arguments, **options)

    monkeypatch.setattr(checkpoints, "write_file", counted)
    members = [Experiment.of(TWO, Cycles("0.01", 2), seed=seed) for seed in range(9)]
    whole = run_members(members, checkpoint=Checkpoint(tmp_path / "run.ckpt", 10**9))
    assert len(written) == 2
    saved = Checkpoint.read(tmp_path / "run.ckpt")
    again = run_members(saved.experiments, checkpoint=saved)
    assert all(map(same, again, whole))
    with pytest.raises(InputError, match="holds 9 runs; the command exactcreep resume goes on"):
        resume(tmp_path / "run.ckpt")


@pytest.mark.parametrize("content", [{}, {"members": [{}], "note": {}}, {"members": 7, "note": {}}])
def test_a_checkpoint_of_something_else_is_refused(tmp_path: Path, content: dict) -> None:
    (tmp_path / "other.ckpt").write_bytes(checkpoints.to_bytes(content))
    with pytest.raises(InputError, match="is not a checkpoint of a run"):
        resume(tmp_path / "other.ckpt")
