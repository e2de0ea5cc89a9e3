"""The tables that simulations record: declared once, and the same from every solver."""

from __future__ import annotations

import inspect
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, as_claimed, as_written, quantity
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.result import Creep
from exactcreep.scene import load_scene
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.solver import Stretch
from exactcreep.solvers.tables import (
    COLUMNS,
    EVENT_TABLE,
    LOGS,
    REARRANGEMENT_TABLE,
    RECORDS,
    TABLES,
    joined,
    logged_events,
    record_arrays,
    rows_of,
)
from exactcreep.studies.sweep import sweep
from tests.paper import paper_chain

EVENTS_HAPPEN = sorted(set(SOLVERS) - {"sliding"})
MOVES, STILL = Cycles("0.004", 1), Cycles("0.000001", 1)
RECORDED = [name for name in COLUMNS if name != "theta"]
"""The dilation is known from the drive."""
STEEP = Chain(3, 1000, "1/2", "3/5", "1/100", tan_alpha=1)


@pytest.mark.parametrize("drive", [MOVES, STILL], ids=["events", "no events"])
@pytest.mark.parametrize("name", EVENTS_HAPPEN)
def test_every_solver_records_exactly_the_columns_of_the_tables(name: str, drive: Cycles) -> None:
    chain = paper_chain(3)
    simulation = solver_named(name, {}).simulation(chain, State.relaxed(chain), 0, RECORDS)
    stretch = simulation.follow(drive, 1, 2)
    assert stretch.completed == 2
    assert (simulation.tally.events > 0) == (drive is MOVES)
    assert sorted(stretch.recorded) == sorted(RECORDED)
    sizes = {"slider": 3, "spring": 2}
    lengths: dict[str, set[int]] = {}
    for column_name, array in stretch.recorded.items():
        column = COLUMNS[column_name]
        # a solver with digits of its own keeps its numbers
        own = column.dtype == "float64" and array.dtype == object and array.size > 0
        assert own or array.dtype == column.dtype
        assert array.shape[1:] == tuple(sizes[across] for across in column.across)
        for name, table in LOGS.items():
            if column_name in table.columns:
                lengths.setdefault(name, set()).add(len(array))
                break
        else:
            assert len(array) == 2
    assert list(lengths) == list(LOGS)
    for (length,) in lengths.values():
        assert (length > 0) == (drive is MOVES)


@pytest.mark.parametrize("drive", [MOVES, STILL], ids=["events", "no events"])
@pytest.mark.parametrize("solver", ["exact", "reference", "verlet", "certified"])
def test_a_file_holds_every_column_with_its_type_unit_and_meaning(
    solver: str, drive: Cycles, tmp_path: Path
) -> None:
    result = creep(paper_chain(3), drive, solver=solver, record=RECORDS)
    result.save(tmp_path / "run.nc")
    data = Creep.load(tmp_path / "run.nc").dataset
    for table in TABLES:
        for name, column in table.columns.items():
            assert data[name].dtype == column.dtype
            assert data[name].dims == (table.dimension, *column.across)
            assert data[name].attrs["units"] == column.unit
            assert data[name].attrs["long_name"] == column.meaning
    companions = [name for name in data.data_vars if name.endswith(("_decimal", "_radius"))]
    recorded = {name for name in companions if not name.startswith(("initial_", "final_"))}
    exact = {"x_G", "x", "tension"}
    if drive is MOVES:
        exact |= {"event_theta", "event_time", "slip_start", "slip_stop", "slip_displacement"}
        exact |= {
            name for name, column in REARRANGEMENT_TABLE.columns.items() if column.dtype[0] == "f"
        }
    expected = {f"{name}_{kind}" for name in exact for kind in ("decimal", "radius")}
    assert recorded == (expected if solver == "certified" else set())
    for name in companions:
        about = data[name.removesuffix("_decimal").removesuffix("_radius")]
        assert data[name].attrs["units"] == about.attrs["units"]
        assert data[name].dims == about.dims


def test_a_run_that_reaches_no_target_has_every_column_that_was_asked_for(tmp_path: Path) -> None:
    result = creep(STEEP, Cycles("0.01", 5), record=("x_G", "x", "tension", "slips"))
    assert result.outcome is Outcome.RUNAWAY
    assert result.half_cycles == 0
    expected = {"x_G": (0,), "x": (0, 3), "tension": (0, 2), "slips": (0, 3)}
    assert {name: array.shape for name, array in result.recorded.items()} == expected
    scene = tmp_path / "steep.toml"
    scene.write_text(
        '[chain]\nn = 3\nl0 = 1000\nmu_d = "1/2"\nmu_s = "3/5"\nsigma_mu = "1/100"\n'
        'tan_alpha = 1\n[drive]\nkind = "cycles"\namplitude = "0.01"\ncycles = 5\n'
        '[run]\nrecord = ["x"]\n[vary]\n"chain.tan_alpha" = ["1/4", 1]\n',
        encoding="utf-8",
    )
    found = sweep(load_scene(scene))
    assert found.recorded_x.shape == (2, 10, 3)
    assert np.isnan(found.recorded_x[1]).all()


def test_events_are_read_as_they_were_written() -> None:
    starts = Event(0.0, EventKind.START, (1, 3), (1, -1), 0)
    stop = Event(1.5, EventKind.STOP, (1,), (1,), 0)
    reversal = Event(1.5, EventKind.START, (1,), (-1,), 0)
    rows = []
    for number, event in enumerate((starts, stop, reversal)):
        rows += rows_of(event, 4, 2, number, 0.125)
    rows += rows_of(starts, 5, 3, 0, 0.25)
    recorded = record_arrays({"events": rows}, 3)
    # sliders of a simultaneous set may be logged in any order
    swapped = {name: array[[1, 0, 2, 3, 4, 5]] for name, array in recorded.items()}
    for columns in (recorded, swapped):
        read = list(logged_events(columns))
        assert [event for _, event in read] == [starts, stop, reversal, starts]
        assert [(r.half_cycle, r.rearrangement, r.number, r.theta) for r, _ in read] == [
            (4, 2, 0, 0.125), (4, 2, 1, 0.125), (4, 2, 2, 0.125), (5, 3, 0, 0.25),
        ]  # fmt: skip
    residuals = np.array([1.0, 3.0, 2.0, 0.0, 5.0, 4.0])
    largest = [event.residual for _, event in logged_events(recorded, residuals)]
    assert largest == [3.0, 2.0, 0.0, 5.0]


def test_parts_are_joined_whether_or_not_they_hold_anything() -> None:
    event = Event(0.5, EventKind.STOP, (2,), (1,), 0)
    part = record_arrays({"x_G": [0.25], "events": rows_of(event, 1, 0, 0, 0.1)}, 2)
    nothing = record_arrays({"x_G": (), "x": (), "events": ()}, 2)
    together = joined([nothing, part, {}, part])
    assert list(together) == ["x_G", "x", *EVENT_TABLE.columns]
    assert together["event_slider"].tolist() == [2, 2]
    assert together["x"].shape == (0, 2)
    for name, array in together.items():
        assert array.dtype == COLUMNS[name].dtype


@pytest.mark.parametrize("thing", [Stretch, Creep.dataset], ids=["Stretch", "Creep.dataset"])
def test_docstrings_list_every_column_with_unit_and_meaning(thing: object) -> None:
    lines = [line.strip() for line in (inspect.getdoc(thing) or "").splitlines()]
    for name, column in COLUMNS.items():
        (line,) = (line for line in lines if line.startswith(f"{name} "))
        assert f" {column.unit} " in line
        assert line.endswith(column.meaning)


def test_files_that_others_read_keep_their_columns() -> None:
    """A change here needs another `FORMAT` of results."""
    assert {name: column.dtype for name, column in COLUMNS.items()} == {
        "theta": "float64", "x_G": "float64", "x": "float64", "tension": "float64",
        "slips": "int64", "event_half_cycle": "int64", "event_rearrangement": "int64",
        "event_number": "int64", "event_theta": "float64", "event_time": "float64",
        "event_kind": "int8", "event_slider": "int64", "event_sign": "int8",
        "rearrangement_half_cycle": "int64", "rearrangement_theta": "float64",
        "rearrangement_direction": "int8", "rearrangement_began": "int64",
        "rearrangement_began_first": "int64", "rearrangement_began_last": "int64",
        "rearrangement_duration": "float64", "rearrangement_events": "int64",
        "rearrangement_slips": "int64", "rearrangement_sliders": "int64",
        "rearrangement_first": "int64", "rearrangement_last": "int64",
        "rearrangement_displacement": "float64", "rearrangement_largest_slip": "float64",
        "rearrangement_elastic_before": "float64", "rearrangement_elastic_after": "float64",
        "rearrangement_gravity": "float64", "rearrangement_dissipation": "float64",
        "rearrangement_undecided": "int64", "slip_slider": "int64",
        "slip_rearrangement": "int64", "slip_start": "float64", "slip_stop": "float64",
        "slip_displacement": "float64", "slip_coefficient": "float64",
    }  # fmt: skip


@pytest.mark.parametrize("digits", [3, 17, 40])
def test_numbers_read_back_from_their_decimals_hold_what_was_written(digits: int) -> None:
    known = [
        Enclosure(sign * Fraction(middle), radius)
        for sign in (1, -1)
        for middle in ("2/3", "1/3000000", "99999999/7", Fraction(3 * 10**18 - 1, 3 * 10**18), 0)
        for radius in (Fraction(0), Fraction(1, 3 * 10**30), Fraction(1, 700))
    ]
    values = np.empty(len(known), dtype=object)
    for k, value in enumerate(known):
        values[k] = value
    written = as_written("x", values, digits) | {"slips": np.arange(3)}
    assert sorted(written) == ["slips", "x", "x_decimal", "x_radius"]
    assert {quantity(name) for name in written} == {"slips", "x"}
    read = as_claimed(written)
    assert list(read) == ["x", "slips"]
    for (middle, radius), claimed in zip(known, read["x"].tolist(), strict=True):
        assert claimed.middle - claimed.radius <= middle - radius
        assert middle + radius <= claimed.middle + claimed.radius
        # half a unit of the last digit; where a radius limits them, that is below 50 radii
        assert claimed.radius <= abs(middle) / 10 ** (digits - 1) + 51 * radius
