"""What runs record: columns that grow, and how much memory those of all runs may take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exactcreep import Cycles, Outcome, creep, resume
from exactcreep.quasistatic import recorder as recorders
from exactcreep.watch import limits
from tests.paper import paper_chain

CHAIN = paper_chain(3)
RECORDED = ("x", "rearrangements")


def test_runs_end_when_what_all_have_recorded_takes_half_of_the_free_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    drive, file = Cycles("0.01", 400), tmp_path / "run.ckpt"
    plain = creep(CHAIN, drive, record=RECORDED)
    with monkeypatch.context() as full:
        full.setattr(recorders, "_WORTH_A_LOOK", 1000)
        full.setattr(recorders, "free_memory", lambda: 0)
        part = creep(CHAIN, drive, record=RECORDED, checkpoint=file)
    assert part.outcome is Outcome.LIMIT
    assert part.reason == "what this process has recorded takes half of the free memory"
    assert 0 < part.half_cycles < plain.half_cycles
    for name, values in part.recorded.items():
        assert np.array_equal(values, plain.recorded[name][: len(values)])
    assert len(part.recorded["rearrangement_theta"]) == part.rearrangements
    assert resume(file) == plain


def test_the_free_memory_is_that_of_a_container_if_that_is_smaller(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(limits, "_CONTAINERS", ())
    free = limits.free_memory()
    assert free > 2**20
    folder = (f"{tmp_path}/", "memory.max", "memory.current", "file")
    monkeypatch.setattr(limits, "_CONTAINERS", (folder,))
    (tmp_path / "memory.current").write_text("5000\n")
    (tmp_path / "memory.stat").write_text("anon 2000\nfile 3000\n")
    for most, left in (("max", None), ("9000", 7000), ("1000", 0), (str(2**60), None)):
        (tmp_path / "memory.max").write_text(f"{most}\n")
        known = limits.free_memory()
        assert known == left if left is not None else known > 2**20
