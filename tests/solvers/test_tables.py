"""The tables that simulations record: alike in every solver, and what the events make of a chain.

The rows of slips and rearrangements add up to what the run did, and their energies balance.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Chain, Creep, Cycles, State, creep
from exactcreep.model.enclosure import floats
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.tables import COLUMNS, LOGS, RECORDS, rearrangements
from tests.paper import paper_chain

pytestmark = pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
TABLES = ("rearrangements", "slip_table")


@pytest.mark.parametrize("moves", [True, False])
@pytest.mark.parametrize("name", sorted(set(SOLVERS) - {"sliding"}))
def test_every_solver_records_exactly_the_columns_of_the_tables(name: str, moves: bool) -> None:
    chain, drive = paper_chain(3), Cycles("0.004" if moves else "0.000001", 1)
    sizes = {"slider": 3, "spring": 2}
    simulation = solver_named(name, {}).simulation(chain, State.relaxed(chain), 0, RECORDS)
    recorded = simulation.follow(drive, 1, 2).recorded
    assert (simulation.tally.events > 0) == moves
    assert sorted(recorded) == sorted(COLUMNS.keys() - {"theta"})
    for column_name, array in recorded.items():
        column = COLUMNS[column_name]
        # a solver with digits of its own keeps its numbers
        own = column.dtype == "float64" and array.dtype == object and array.size > 0
        assert own or array.dtype == column.dtype
        assert array.shape[1:] == tuple(sizes[across] for across in column.across)
    assert all(len(recorded[name]) == 2 for name in ("x_G", "x", "tension", "slips"))
    x_g, x = floats(recorded["x_G"]), floats(recorded["x"])
    assert x_g == pytest.approx(x.mean(axis=1), rel=1e-14, abs=1e-15)
    for table in LOGS.values():
        (length,) = {len(recorded[name]) for name in table.columns}
        assert (length > 0) == moves


UNLIKE = Chain(
    4, 1000, mu_d=["0.5", "0.4", "0.45", "0.5"], mu_s=["0.6", "0.5", "0.5", "0.7"],
    sigma_mu="0.01", tan_alpha="0.2", end_forces=("0.1", "-0.05"), expansion=["1", "0.5", "1.2"],
)  # fmt: skip
CHAINS: dict[str, tuple[Chain, str]] = {
    "three": (paper_chain(3), "0.004"),
    "two": (paper_chain(2), "0.006"),
    "low coefficients": (Chain(4, 100, "1/2", "1/2", "1/20", tan_alpha="1/5"), "0.02"),
    "mirrored": (Chain(4, 10, "1/2", "3/5", tan_alpha=0), "0.3"),
    "unlike": (UNLIKE, "0.004"),
}
OPTIONS: dict[str, dict[str, Any]] = {
    "exact": {}, "certified": {"digits": 20}, "verlet": {"dt": "0.001", "locate": True},
}  # fmt: skip


@cache
def run(solver: str, which: str) -> Creep:
    chain, amplitude = CHAINS[which]
    start = State.prepared(chain, ["0.3", "0.9"], theta="0.001") if which == "three" else None
    known = {"seed": 4, "record": ("events", *TABLES), "start": start}
    return creep(chain, Cycles(amplitude, 2), solver=solver, **known, **OPTIONS[solver])


def tables(found: Creep) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Return rearrangements and slips by their fields, simultaneous slips by their sliders."""
    both = []
    for table in (LOGS[name] for name in TABLES):
        both.append({name: floats(found.recorded[table.prefix + name]) for name in table.fields})
    slips = both[1]
    order = np.lexsort((slips["slider"], slips["stop"].round(6), slips["rearrangement"]))
    return both[0], {name: values[order] for name, values in slips.items()}


@pytest.mark.parametrize(
    ("solver", "which"),
    [*(("certified", which) for which in CHAINS), ("verlet", "three")],
)
def test_the_tables_of_a_run_are_those_of_exact(solver: str, which: str) -> None:
    allowed = 1e-4 if solver == "verlet" else 1e-9
    for found, known in zip(tables(run(solver, which)), tables(run("exact", which)), strict=True):
        assert len(known["slips" if "slips" in known else "slider"]) > 20
        for name in found.keys() - {"undecided"}:
            assert np.abs(found[name] - known[name]).max() <= allowed, name


@pytest.mark.parametrize("which", CHAINS)
def test_a_rearrangement_is_the_sum_of_its_events_and_slips(which: str) -> None:
    found = run("exact", which)
    table, slips = tables(found)
    friction = np.array(found.chain.each("mu_d", found.chain.times_cosine))
    for number, one in enumerate(rearrangements(found.recorded)):
        own = slips["rearrangement"] == number
        lengths, sliders = abs(slips["displacement"][own]), slips["slider"][own].astype(int)
        starters = one.events[0].sliders
        expected = {
            "theta": one.theta,
            "half_cycle": one.half_cycle,
            "duration": slips["stop"][own].max(),
            "slips": own.sum(),
            "sliders": len(set(sliders)),
            "first": min(sliders),
            "last": max(sliders),
            "largest_slip": max(lengths),
            "displacement": pytest.approx(
                slips["displacement"][own].sum() / found.chain.n, abs=1e-13
            ),
            "dissipation": pytest.approx((friction[sliders - 1] * lengths).sum(), rel=1e-13),
            "events": len(one.events),
            "began": len(starters),
            "began_first": min(starters),
            "began_last": max(starters),
        }
        assert {name: table[name][number] for name in expected} == expected
    assert (slips["start"] < slips["stop"]).any()
    assert (table["slips"] > table["sliders"]).any() or which in ("two", "mirrored")


@pytest.mark.parametrize("which", CHAINS)
def test_the_tables_add_up_to_what_the_run_did_and_energies_balance(which: str) -> None:
    found = run("exact", which)
    chain, (table, slips) = found.chain, tables(found)
    assert len(table["theta"]) == found.rearrangements > 10
    assert (
        (table["direction"] == 0) == (np.arange(found.rearrangements) < (which == "three"))
    ).all()
    assert table["events"].sum() == found.event_count
    assert table["slips"].sum() == len(slips["slider"]) == found.slip_count
    assert table["undecided"].sum() == found.report["undecided"]
    moved = np.zeros(chain.n)
    for n in range(chain.n):
        own = slips["slider"] == n + 1
        moved[n] = slips["displacement"][own].sum()
        assert moved[n] == pytest.approx(float(found.state.displacements[n]), abs=1e-12)
        assert slips["coefficient"][own][-1] == found.state.coefficients[n]
    assert table["displacement"].sum() == pytest.approx(moved.mean(), abs=1e-12)
    assert table["gravity"].sum() == pytest.approx(chain.sin_alpha * moved.sum(), abs=1e-12)
    ends = float(chain.end_forces[0]) * moved[0] + float(chain.end_forces[1]) * moved[-1]
    assert table["end_forces"].sum() == pytest.approx(ends, abs=1e-12)
    given = table["elastic_before"] + table["gravity"] + table["end_forces"]
    left = given - table["dissipation"] - table["elastic_after"]
    assert (abs(left) <= 1e-14 * (1 + table["elastic_before"] + table["events"])).all()
    # from the last rest the ramp goes on to the end: every tension falls
    weights = np.array(chain.expansion or [1] * (chain.n - 1), dtype=float)
    fell = float(chain.l0) * (float(found.state.theta) - table["theta"][-1]) * weights
    elastic = ((floats(found.state.tensions) + fell) ** 2).sum() / 2
    assert table["elastic_after"][-1] == pytest.approx(elastic, abs=1e-10)
