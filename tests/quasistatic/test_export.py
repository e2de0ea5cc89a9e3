"""What a run recorded, as data frames, a tree, and files of other programs."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from exactcreep import Creep, Cycles, InputError, creep
from exactcreep.solvers.tables import LOGS
from tests.paper import paper_chain

CHAIN = paper_chain(4)
RECORD = ("x_G", "x", "slips", *LOGS)
TABLES = ("half_cycles", *LOGS)


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(CHAIN, Cycles("0.005", 4), seed=3, record=RECORD)


def test_the_tables_of_a_run_add_up_to_it(run: Creep) -> None:
    events, avalanches = run.to_pandas("events"), run.to_pandas("rearrangements")
    assert len(avalanches) == run.rearrangements
    assert avalanches["slips"].sum() == run.slip_count == len(run.to_pandas("slip_table"))
    assert avalanches["displacement"].sum() == pytest.approx(run.x_G, rel=1e-12)
    alone = events.groupby(["rearrangement", "number"], observed=True).size()
    assert alone.size == run.event_count == avalanches["events"].sum()
    assert run.to_pandas("half_cycles").filter(like="slips_").to_numpy().sum() == run.slip_count
    of_events = events.groupby("rearrangement").last()
    for name, column in {"theta": "theta", "half_cycle": "half_cycle", "time": "duration"}.items():
        assert of_events[name].tolist() == pytest.approx(avalanches[column].tolist(), rel=1e-15)
    assert set(events["kind"]) == {"start", "stop"}
    assert run.to_pandas("half_cycles").index.tolist() == list(range(1, 9))


def test_a_whole_number_that_32_bits_do_not_hold_keeps_64(run: Creep) -> None:
    numbers = run.recorded["event_half_cycle"].copy()
    assert run.to_pandas("events")["half_cycle"].dtype == np.int32
    numbers[-1] = 2**31
    far = replace(run, recorded={**run.recorded, "event_half_cycle": numbers})
    column = far.to_pandas("events")["half_cycle"]
    assert column.dtype == np.int64
    assert column.iloc[-1] == 2**31


def test_a_tree_has_a_group_for_each_table_that_becomes_a_frame(run: Creep) -> None:
    assert set(run.tree.children) == {"states", *TABLES}
    assert run.tree.attrs == run.dataset.attrs
    for table in ("rearrangements", "slip_table"):
        frame = run.tree[table].to_dataset().to_dataframe()
        pd.testing.assert_frame_equal(
            frame, run.to_pandas(table), check_dtype=False, check_index_type=False
        )


@pytest.mark.parametrize("table", TABLES)
def test_a_table_comes_back_from_its_files_whole(run: Creep, table: str, tmp_path: Path) -> None:
    own, path = run.to_pandas(table), tmp_path / "table.parquet"
    assert run.export(table, path) == len(own) > 0
    back = pd.read_parquet(path)
    pd.testing.assert_frame_equal(back, own, check_exact=True, check_index_type=False)
    assert back.attrs == own.attrs
    held = pq.read_schema(path)  # as programs see it that know nothing of pandas
    assert json.loads(held.metadata[b"PANDAS_ATTRS"]) == own.attrs
    assert set(held.names) == {own.index.name, *own}
    run.export(table, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open() as file:
        header, *rows = csv.reader(file)
    units = {name: f" [{unit}]" * (unit != "1") for name, unit in own.attrs["units"].items()}
    assert header == [own.index.name, *(name + unit for name, unit in units.items())]
    told = own.reset_index().astype(str)
    for name, column in zip(told, zip(*rows, strict=True), strict=True):
        assert list(column) == told[name].tolist()


def test_digits_of_a_solver_that_has_them_are_exported(tmp_path: Path) -> None:
    drive = Cycles("0.002", 1)
    run = creep(CHAIN, drive, solver="mpmath", digits=30, record=("rearrangements",))
    run.export("rearrangements", tmp_path / "run.parquet")
    back = pd.read_parquet(tmp_path / "run.parquet")
    assert len(back) == run.rearrangements > 0
    assert all(len(text) >= 30 for text in back["displacement_decimal"] if float(text))


def test_a_run_in_which_nothing_happened_has_tables_without_rows(tmp_path: Path) -> None:
    still = creep(CHAIN, Cycles("0.00001", 1), record=tuple(LOGS))
    for table in LOGS:
        own = still.to_pandas(table)
        assert still.export(table, tmp_path / "it.parquet", force=True) == len(own) == 0
        back = pd.read_parquet(tmp_path / "it.parquet")
        assert list(back) == list(own)
        numbers = [name for name in own if name != "kind"]  # a category without members is lost
        assert back[numbers].dtypes.to_dict() == own[numbers].dtypes.to_dict()
    assert set(still.tree.children) == {"states", *TABLES}


@pytest.mark.parametrize(
    ("table", "path", "sentence"),
    [
        ("events", "it.csv", "was not recorded: the run needs record"),
        ("avalanches", "it.csv", "must be one of half_cycles"),
        ("half_cycles", "it.xlsx", "must end in"),
    ],
)
def test_an_export_that_cannot_be_is_refused(
    table: str, path: str, sentence: str, tmp_path: Path
) -> None:
    bare = creep(CHAIN, Cycles("0.005", 1), record=())
    with pytest.raises(InputError, match=sentence):
        bare.export(table, tmp_path / path)
    assert not list(tmp_path.iterdir())


def test_parquet_without_pyarrow_says_what_to_install(
    run: Creep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r'needs pyarrow: pip install "exactcreep\[export\]"'):
        run.export("events", tmp_path / "it.parquet")
    run.export("events", tmp_path / "it.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["it.csv"]
