"""The tables that simulations record: declared once, the same from every solver, and true.

Their rows say what the events make of a chain, and the energies of each rearrangement add up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Chain, Creep, Cycles, Outcome, State, creep
from exactcreep.model.contacts import Contacts
from exactcreep.model.enclosure import Enclosure, as_written, floats, quantity
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.replay import Replay
from exactcreep.solvers.avalanche_table import Avalanche, rearrangement_rows
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.tables import (
    COLUMNS,
    LOGS,
    RECORDS,
)
from exactcreep.studies.event_log import rearrangements
from tests.oracle.obeys import as_claimed
from tests.paper import paper_chain

MOVES, STILL = Cycles("0.004", 1), Cycles("0.000001", 1)
STEEP = paper_chain(3, tan_alpha=1)
BOTH = ("rearrangements", "slip_table")
ALL = ("events", *BOTH)
OPTIONS = {
    "exact": {}, "reference": {}, "mpmath": {"digits": 20}, "certified": {"digits": 20},
    "verlet": {"dt": "0.01", "locate": True},
}  # fmt: skip
each_drive = pytest.mark.parametrize("drive", [MOVES, STILL], ids=["events", "no events"])
each_solver = pytest.mark.parametrize("solver", OPTIONS)


# What is declared


@each_drive
@pytest.mark.parametrize("name", sorted(set(SOLVERS) - {"sliding"}))
def test_every_solver_records_exactly_the_columns_of_the_tables(name: str, drive: Cycles) -> None:
    chain, sizes = paper_chain(3), {"slider": 3, "spring": 2}
    simulation = solver_named(name, {}).simulation(chain, State.relaxed(chain), 0, RECORDS)
    recorded = simulation.follow(drive, 1, 2).recorded
    assert (simulation.tally.events > 0) == (drive is MOVES)
    assert sorted(recorded) == sorted(COLUMNS.keys() - {"theta"})
    for column_name, array in recorded.items():
        column = COLUMNS[column_name]
        # a solver with digits of its own keeps its numbers
        own = column.dtype == "float64" and array.dtype == object and array.size > 0
        assert own or array.dtype == column.dtype
        assert array.shape[1:] == tuple(sizes[across] for across in column.across)
    assert all(len(recorded[name]) == 2 for name in ("x_G", "x", "tension", "slips"))
    for table in LOGS.values():
        (length,) = {len(recorded[name]) for name in table.columns}
        assert (length > 0) == (drive is MOVES)


def test_a_run_that_reaches_no_target_has_every_column_that_was_asked_for() -> None:
    result = creep(STEEP, Cycles("0.01", 5), record=("x_G", "x", "tension", "slips"))
    assert result.outcome is Outcome.RUNAWAY
    assert result.half_cycles == 0
    expected = {"x_G": (0,), "x": (0, 3), "tension": (0, 2), "slips": (0, 3)}
    assert {name: array.shape for name, array in result.recorded.items()} == expected


def test_files_that_others_read_keep_their_columns() -> None:
    """A change here needs another `FORMAT` of results."""
    known = {
        "int8": "event_kind event_sign rearrangement_direction",
        "int64": "slips event_half_cycle event_rearrangement event_number event_slider"
        " rearrangement_half_cycle rearrangement_began rearrangement_began_first"
        " rearrangement_began_last rearrangement_events rearrangement_slips rearrangement_sliders"
        " rearrangement_first rearrangement_last rearrangement_undecided slip_slider"
        " slip_rearrangement",
        "float64": "theta x_G x tension event_theta event_time rearrangement_theta"
        " rearrangement_duration rearrangement_displacement rearrangement_largest_slip"
        " rearrangement_elastic_before rearrangement_elastic_after rearrangement_gravity"
        " rearrangement_end_forces rearrangement_dissipation slip_start slip_stop slip_displacement"
        " slip_coefficient",
    }
    for dtype, names in known.items():
        assert {name for name, column in COLUMNS.items() if column.dtype == dtype} == {
            *names.split()
        }


@pytest.mark.parametrize("digits", [3, 40])
def test_numbers_read_back_from_their_decimals_hold_what_was_written(digits: int) -> None:
    known = [
        Enclosure(Fraction(middle), Fraction(radius))
        for middle in ("2/3", "-1/3000000", "-99999999/7", "2999999999/3000000000", 0)
        for radius in (0, "1e-30", "1/700")
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


# What rows say

LEDGER = ("elastic_before", "gravity", "end_forces", "dissipation", "elastic_after")


def rows(recorded: Mapping[str, NDArray[Any]], table: str) -> dict[str, NDArray[Any]]:
    """Return the columns of a recorded table by their fields."""
    return {name: recorded[LOGS[table].prefix + name] for name in LOGS[table].fields}


def left(table: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return what the ledger of each row leaves over."""
    before, gravity, end_forces, dissipation, after = (table[name] for name in LEDGER)
    return np.asarray(before + gravity + end_forces - dissipation - after)


def replayed(run: Creep, direction: NDArray[Any]) -> dict[str, dict[str, NDArray[Any]]]:
    """Return both tables of a run, by their fields, as `Replay` makes them of its events.

    Events do not tell what was undecided: the rows say 0.
    """
    chain, state, contacts = run.chain, run.experiment.initial, Contacts(run.chain, run.seed)
    made: dict[str, list[Any]] = {name: [] for name in BOTH}
    for number, one in enumerate(rearrangements(run.recorded)):
        fell = float(chain.l0) * (one.theta - state.theta)
        begin = replace(state, tensions=state.tensions - fell, theta=one.theta)
        replay = Replay(chain, begin, one.events, FLOAT64, contacts)
        way = int(direction[number])
        known = {"half_cycle": one.half_cycle, "theta": one.theta, "direction": way}
        avalanche = Avalanche(chain, FLOAT64, known, replay.tensions)
        for phase in replay:
            phase.arrive()
            for event in phase.events:
                phase.happen(event)
                moved = replay.flow.moved
                made["slip_table"] += avalanche.take(event, number, moved, replay.coefficient)
        made["rearrangements"] += rearrangement_rows([(avalanche, 0)])
        state = replay.state()
    return {name: rows(LOGS[name].from_rows(found), name) for name, found in made.items()}


def assert_alike(
    table: dict[str, NDArray[Any]], known: dict[str, NDArray[Any]], allowed: float
) -> None:
    """Assert that counts are equal, and numbers equal up to `allowed`."""
    for name, values in known.items():
        assert len(values) == len(table[name])
        if values.dtype.kind == "i":
            assert np.array_equal(table[name], values), name
        else:
            assert np.abs(table[name] - values).max() <= allowed, name


CHAINS = {
    "two": paper_chain(2),
    "six": paper_chain(6),
    "low coefficients": Chain(4, 100, "1/2", "1/2", "1/20", tan_alpha="1/5"),
    "mirrored": Chain(4, 10, "1/2", "3/5", tan_alpha=0),
}


@pytest.mark.filterwarnings("ignore::exactcreep.PhysicsWarning")
@pytest.mark.parametrize("which", CHAINS)
def test_the_compiled_rows_are_those_of_a_replay_of_the_events(which: str) -> None:
    chain = CHAINS[which]
    amplitude = {"low coefficients": "0.02", "mirrored": "0.3"}.get(which, "0.006")
    run = creep(chain, Cycles(amplitude, 2), seed=4, record=ALL)
    table = rows(run.recorded, "rearrangements")
    assert run.rearrangements == len(table["theta"]) > (20 if which == "mirrored" else 80)
    known = replayed(run, table["direction"])
    del known["rearrangements"]["undecided"]
    # the replay goes on from its own last state, which has rounded a little differently
    assert_alike(table, known["rearrangements"], 1e-11)
    found = [rows(run.recorded, "slip_table"), known["slip_table"]]
    for k, one in enumerate(found):
        order = np.lexsort((one["slider"], one["stop"].round(9), one["rearrangement"]))
        found[k] = {name: values[order] for name, values in one.items()}
    assert_alike(*found, 1e-10)
    assert np.abs(left(table)).max() < 1e-15 * (10 + table["elastic_before"].max())


@each_solver
def test_a_rearrangement_is_the_sum_of_its_slips(solver: str) -> None:
    chain = paper_chain(3)
    start = State.prepared(chain, ["0.3", "0.9"], theta="0.001")
    run = creep(
        chain, Cycles("0.004", 1), solver=solver, record=ALL, start=start, **OPTIONS[solver]
    )
    recorded = {name: floats(array) for name, array in run.recorded.items()}
    table, slips = (rows(recorded, name) for name in BOTH)
    assert len(table["theta"]) > 50
    for number, one in enumerate(rearrangements(run.recorded)):
        own = [n for n, of in enumerate(slips["rearrangement"]) if of == number]
        lengths = [abs(slips["displacement"][n]) for n in own]
        sliders, starters = [slips["slider"][n] for n in own], one.events[0].sliders
        expected = {
            "duration": slips["stop"][own[-1]],
            "slips": len(own),
            "sliders": len(set(sliders)),
            "first": min(sliders),
            "last": max(sliders),
            "largest_slip": max(lengths),
            "dissipation": pytest.approx(chain.friction * sum(lengths), rel=1e-14),
            "events": len(one.events),
            "began": len(starters),
            "began_first": min(starters),
            "began_last": max(starters),
        }
        assert {name: table[name][number] for name in expected} == expected
    assert (table["slips"] > table["sliders"]).any()
    assert (table["began"] == 2).any()


@each_solver
def test_sums_over_the_tables_are_what_the_run_did(solver: str) -> None:
    chain = paper_chain(3)
    start = State.prepared(chain, ["0.3", "0.9"], theta="0.001")
    run = creep(
        chain, Cycles("0.004", 2), solver=solver, record=BOTH, start=start, **OPTIONS[solver]
    )
    recorded = {name: floats(array) for name, array in run.recorded.items()}
    table, slips = (rows(recorded, name) for name in BOTH)
    assert len(table["theta"]) == run.rearrangements > 20
    assert table["direction"][0] == 0
    assert (table["direction"][1:] != 0).all()
    assert table["events"].sum() == run.event_count
    assert table["slips"].sum() == len(slips["slider"]) == run.slip_count
    assert table["undecided"].sum() == run.undecided
    for n in range(3):
        own = slips["slider"] == n + 1
        moved = slips["displacement"][own].sum()
        assert moved == pytest.approx(float(run.state.displacements[n]), abs=1e-13)
        assert slips["coefficient"][own][-1] == run.state.coefficients[n]
    path = np.abs(slips["displacement"]).sum()
    sums = {
        "displacement": run.x_G,
        "dissipation": chain.friction * path,
        "gravity": 3 * chain.sin_alpha * run.x_G,
    }
    for name, expected in sums.items():
        assert table[name].sum() == pytest.approx(expected, rel=1e-13, abs=1e-13)
    if solver != "verlet":
        rounding = 2.0**-52 * (table["elastic_before"] + 4 * table["events"])
        assert (np.abs(left(table)) < rounding).all()
    # from the last rest the ramp goes on to the end: every tension falls alike
    fell = 1000 * (float(run.state.theta) - table["theta"][-1])
    elastic = ((floats(run.state.tensions) + fell) ** 2).sum() / 2
    assert table["elastic_after"][-1] == pytest.approx(elastic, abs=1e-11)
    longest = table["largest_slip"][slips["rearrangement"].astype(int)]
    assert (np.abs(slips["displacement"]) <= longest).all()
