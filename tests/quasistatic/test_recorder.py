"""What runs record: columns that grow, and how much memory those of all runs may take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exactcreep import Cycles, Outcome, creep, resume
from exactcreep.quasistatic import recorder as recorders
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
