"""The command `export`: tables of a saved run in files of other programs."""

from __future__ import annotations

import csv
import json
import sys

import pandas as pd
import pyarrow.parquet as pq
import pytest

from exactcreep import Cycles, creep
from exactcreep.solvers.tables import LOGS
from tests.conftest import Command
from tests.paper import paper_chain

TABLES = ("half_cycles", *LOGS)


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("amplitude", ["0.005", "0.00001"])
def test_a_table_comes_back_from_its_files_whole(
    command: Command, table: str, amplitude: str
) -> None:
    run = creep(paper_chain(4), Cycles(amplitude, 4), seed=3, record=("x_G", "x", *LOGS))
    run.save("run.nc")
    own = run.to_pandas(table)
    assert (len(own) > 0) == (amplitude == "0.005" or table == "half_cycles")
    for ending in ("parquet", "csv"):
        told = command("export", "run.nc", "--table", table, "--to", f"table.{ending}")
        assert told.err == f"written: table.{ending} ({len(own)} rows)\n"
    back = pd.read_parquet("table.parquet")
    types = own.assign(kind=own["kind"].astype("object")) if "kind" in own else own
    back = back.astype(types.dtypes.to_dict())  # a category without members is lost
    pd.testing.assert_frame_equal(back, types, check_exact=True, check_index_type=False)
    held = pq.read_schema("table.parquet")  # as programs see it that know nothing of pandas
    assert json.loads(held.metadata[b"PANDAS_ATTRS"]) == own.attrs
    assert set(held.names) == {own.index.name, *own}
    with open("table.csv", newline="") as file:
        header, *rows = csv.reader(file)
    units = {name: f" [{unit}]" * (unit != "1") for name, unit in own.attrs["units"].items()}
    assert header == [own.index.name, *(name + unit for name, unit in units.items())]
    assert rows == own.reset_index().astype(str).to_numpy().tolist()


def test_an_export_that_cannot_be_is_refused(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    creep(paper_chain(2), Cycles("0.005", 1)).save("run.nc")
    told = command("export", "run.nc", "--to", "it.csv", "--table", "events")
    assert 'needs record = ["events"]' in told.sentence
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    told = command("export", "run.nc", "--to", "it.parquet")
    assert 'needs pyarrow: pip install ".[export]"' in told.sentence
    assert command("export", "run.nc", "--to", "it.csv").code == 0
