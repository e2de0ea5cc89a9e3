"""What a run recorded: as data frames, and how much memory it may take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exactcreep import Creep, Cycles, Outcome, creep
from exactcreep.quasistatic import recorder as recorders
from exactcreep.quasistatic.checkpoint import CheckpointWarning
from exactcreep.solvers.tables import LOGS
from tests.paper import paper_chain

CHAIN = paper_chain(4)
RECORD = ("x_G", "x", "slips", *LOGS)


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(CHAIN, Cycles("0.005", 4), seed=3, record=RECORD)


def test_the_frames_of_a_run_have_its_rows_with_units_and_names(run: Creep) -> None:
    events, avalanches = run.to_pandas("events"), run.to_pandas("rearrangements")
    assert len(avalanches) == run.rearrangements
    assert avalanches["slips"].sum() == run.slip_count == len(run.to_pandas("slip_table"))
    alone = events.groupby(["rearrangement", "number"], observed=True).size()
    assert alone.size == run.event_count == avalanches["events"].sum()
    assert run.to_pandas("half_cycles").filter(like="slips_").to_numpy().sum() == run.slip_count
    assert set(events["kind"]) == {"start", "stop"}
    assert run.to_pandas("half_cycles").index.tolist() == list(range(1, 9))

    for quantity in run.dataset.data_vars.values():
        assert {"units", "long_name"} <= quantity.attrs.keys()
    still = creep(CHAIN, Cycles("0.00001", 1), record=tuple(LOGS))
    for table in LOGS:  # nothing happened: no rows, and the same columns
        own = still.to_pandas(table)
        assert len(own) == 0
        assert own.dtypes.to_dict() == run.to_pandas(table).dtypes.to_dict()


RECORDED = ("x", "rearrangements")


def test_runs_end_when_what_all_have_recorded_takes_half_of_the_free_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    drive, file = Cycles("0.01", 400), tmp_path / "run.ckpt"
    plain = creep(CHAIN, drive, record=RECORDED)
    with monkeypatch.context() as full:
        full.setattr(recorders, "free_memory", lambda: 0)
        part = creep(CHAIN, drive, record=RECORDED, checkpoint=file)
    assert part.outcome is Outcome.LIMIT
    assert part.reason == "what this process has recorded takes half of the free memory"
    assert 0 < part.half_cycles < plain.half_cycles
    for name, values in part.recorded.items():
        assert np.array_equal(values, plain.recorded[name][: len(values)])
    assert len(part.recorded["rearrangement_theta"]) == part.rearrangements
    with pytest.warns(CheckpointWarning, match="the run goes on"):
        assert creep(CHAIN, drive, record=RECORDED, checkpoint=file) == plain
