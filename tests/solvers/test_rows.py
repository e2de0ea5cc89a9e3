"""The tables of rearrangements and slips: they say what the events make of a chain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Chain, Creep, Cycles, GaussianSteps, InputError, State, creep
from exactcreep.limits import NO_LIMITS, Limits
from exactcreep.model.contacts import Contacts
from exactcreep.model.enclosure import as_claimed, floats
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.replay import Replay
from exactcreep.solvers.exact import layout
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.rows import Avalanche
from exactcreep.solvers.tables import (
    LOGS,
    REARRANGEMENT_TABLE,
    SLIP_TABLE,
    RearrangementRow,
    SlipRow,
)
from exactcreep.studies.event_log import rearrangements
from tests.paper import paper_chain

BOTH = ("rearrangements", "slip_table")
ALL = ("events", *BOTH)
AVALANCHES = Cycles("0.006", 3)
LEDGER = ("elastic_before", "gravity", "dissipation", "elastic_after")


def rows(recorded: Mapping[str, NDArray[Any]], table: str) -> dict[str, NDArray[Any]]:
    """Return the columns of a recorded table by their fields."""
    return {name: recorded[LOGS[table].prefix + name] for name in LOGS[table].fields}


def left(table: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return what the ledger of each row leaves over."""
    before, gravity, dissipation, after = (table[name] for name in LEDGER)
    return np.asarray(before + gravity - dissipation - after)


def replayed_rows(
    replay: Replay, number: int, half_cycle: int, direction: int
) -> tuple[RearrangementRow, list[SlipRow]]:
    """Return the row of a rearrangement that comes to rest, and those of its slips, by replay.

    Events do not tell what was undecided: the row says 0.
    """
    theta, still = replay.initial.theta, FLOAT64.zeros(replay.chain.n)
    avalanche = Avalanche(number, half_cycle, theta, direction, replay.tensions, still)
    slips: list[SlipRow] = []
    for phase in replay:
        phase.arrive()
        for event in phase.events:
            phase.happen(event)
            slips += avalanche.take(event, replay.flow.moved, replay.coefficient, FLOAT64)
    return avalanche.row(replay.chain, FLOAT64, 0), slips


def replayed(run: Creep, direction: NDArray[Any]) -> tuple[list[RearrangementRow], list[SlipRow]]:
    """Return both tables of a run as `Replay` makes them of its events."""
    chain, state, contacts = run.chain, run.experiment.initial, Contacts(run.chain, run.seed)
    table: list[RearrangementRow] = []
    slips: list[SlipRow] = []
    for number, one in enumerate(rearrangements(run.recorded)):
        fell = float(chain.l0) * (one.theta - state.theta)
        begin = replace(state, tensions=state.tensions - fell, theta=one.theta)
        replay = Replay(chain, begin, one.events, FLOAT64, contacts)
        row, new = replayed_rows(replay, number, one.half_cycle, int(direction[number]))
        table.append(row)
        slips += new
        state = replay.state()
    return table, slips


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
    "two": Chain(2, 1000, "1/2", "3/5", "1/100", tan_alpha="1/4"),
    "six": paper_chain(6),
    "without disorder": Chain(3, 1000, "1/2", "3/5", tan_alpha="1/4"),
    "low coefficients": Chain(4, 100, "1/2", "1/2", "1/20", tan_alpha="1/5"),
    "mirrored": Chain(4, 10, "1/2", "3/5", tan_alpha=0),
    "long": paper_chain(100),
}


@pytest.mark.filterwarnings("ignore::exactcreep.PhysicsWarning")
@pytest.mark.parametrize("which", CHAINS)
def test_the_compiled_rows_are_those_of_a_replay_of_the_events(which: str) -> None:
    chain = CHAINS[which]
    amplitude = {"two": "0.004", "low coefficients": "0.02", "long": "0.003", "mirrored": "0.3"}
    run = creep(chain, Cycles(amplitude.get(which, "0.006"), 2), seed=4, record=ALL)
    table = rows(run.recorded, "rearrangements")
    assert run.rearrangements == len(table["theta"]) > (20 if which == "mirrored" else 80)
    known, slips = replayed(run, table["direction"])
    known_table = REARRANGEMENT_TABLE.from_rows(known)
    known_slips = SLIP_TABLE.from_rows(slips)
    strip = {name.removeprefix("rearrangement_"): a for name, a in known_table.items()}
    del strip["undecided"]
    # the replay goes on from its own last state, which has rounded a little differently
    assert_alike(table, strip, 1e-11)
    strip = {name.removeprefix("slip_"): a for name, a in known_slips.items()}
    found = rows(run.recorded, "slip_table")
    order = [
        np.lexsort((one["slider"], one["stop"].round(9), one["rearrangement"]))
        for one in (found, strip)
    ]
    assert_alike(
        {name: a[order[0]] for name, a in found.items()},
        {name: a[order[1]] for name, a in strip.items()},
        1e-10,
    )
    assert np.abs(left(table)).max() < 1e-15 * (10 + table["elastic_before"].max())


def test_rows_of_an_avalanche_whose_parts_keep_their_own_time_are_those_of_a_replay() -> None:
    chain = CHAINS["long"]
    start = State.prepared(chain, np.random.default_rng(2).normal(0, 0.6, chain.n - 1))
    run = creep(chain, Cycles("0.0002", 1), seed=4, start=start, record=ALL)
    table, slips = (rows(run.recorded, name) for name in BOTH)
    assert table["last"][0] - table["first"][0] >= layout.LEAST_LONG
    assert table["events"][0] > 100
    known, known_slips = replayed(run, table["direction"])
    for name in ("duration", "displacement", "dissipation", "elastic_after", "sliders"):
        assert table[name][0] == pytest.approx(getattr(known[0], name), rel=1e-12)
    lengths = {slip[:3]: slip.displacement for slip in known_slips}
    found = list(zip(*(slips[name].tolist() for name in SLIP_TABLE.fields), strict=True))
    assert len(found) == len(lengths)
    assert all(abs(lengths[slip[:3]] - slip[4]) < 1e-12 for slip in found)
    assert np.abs(left(table)).max() < 1e-15 * (10 + table["elastic_before"].max())


def test_rows_are_the_same_whatever_else_is_recorded() -> None:
    """Two sliders without events take the shortcut for end slips, with events they do not."""
    for chain in (CHAINS["two"], CHAINS["six"]):
        alone, beside = (
            creep(chain, Cycles("0.005", 20), record=record).recorded for record in (BOTH, ALL)
        )
        for name in LOGS["slip_table"].columns:
            assert np.array_equal(alone[name], beside[name])
        for name in LOGS["rearrangements"].columns:
            close = np.abs(alone[name] - beside[name]).max()
            assert close <= (1e-14 if alone[name].dtype.kind == "f" else 0), name


SOLVERS = {
    "exact": {}, "reference": {}, "mpmath": {"digits": 20}, "certified": {"digits": 20},
    "verlet": {"dt": "0.01", "locate": True},
}  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS)
def test_sums_over_the_tables_are_what_the_run_did(solver: str) -> None:
    chain = paper_chain(3)
    start = State.prepared(chain, ["0.3", "0.9"], theta="0.001")
    run = creep(
        chain, Cycles("0.004", 2), solver=solver, record=BOTH, start=start, **SOLVERS[solver]
    )
    table = {name: floats(a) for name, a in rows(run.recorded, "rearrangements").items()}
    slips = {name: floats(a) for name, a in rows(run.recorded, "slip_table").items()}
    assert len(table["theta"]) == run.rearrangements > 20
    assert table["direction"][0] == 0 != np.abs(table["direction"][1:]).min()
    assert table["events"].sum() == run.event_count
    assert table["slips"].sum() == len(slips["slider"]) == run.slip_count
    assert table["undecided"].sum() == run.undecided
    assert math.fsum(table["displacement"]) == pytest.approx(run.x_G, abs=1e-13)
    assert math.fsum(slips["displacement"]) == pytest.approx(3 * run.x_G, abs=1e-13)
    for n in range(3):
        own = slips["displacement"][slips["slider"] == n + 1]
        assert math.fsum(own) == pytest.approx(float(run.state.displacements[n]), abs=1e-13)
        last = slips["coefficient"][slips["slider"] == n + 1][-1]
        assert last == run.state.coefficients[n]
    path = math.fsum(np.abs(slips["displacement"]))
    assert math.fsum(table["dissipation"]) == pytest.approx(chain.friction * path, rel=1e-13)
    gained = math.fsum(table["gravity"])
    assert gained == pytest.approx(3 * chain.sin_alpha * run.x_G, abs=1e-13)
    # from the last rest the ramp goes on to the end: every tension falls alike
    fell = 1000 * (float(run.state.theta) - table["theta"][-1])
    elastic = ((floats(run.state.tensions) + fell) ** 2).sum() / 2
    assert table["elastic_after"][-1] == pytest.approx(elastic, abs=1e-11)
    longest = table["largest_slip"][slips["rearrangement"].astype(int)]
    assert (np.abs(slips["displacement"]) <= longest).all()


@pytest.mark.parametrize("solver", ["exact", "reference", "mpmath"])
def test_the_ledger_of_every_rearrangement_closes_to_rounding(solver: str) -> None:
    n, drive = (3, Cycles("0.004", 1)) if solver == "mpmath" else (6, AVALANCHES)
    run = creep(paper_chain(n), drive, solver=solver, record=BOTH)
    table = rows(run.recorded, "rearrangements")
    assert len(table["theta"]) > 20 * n
    assert table["events"].max() > n
    rounding = 2.0**-52 * (table["elastic_before"] + 4 * table["events"])
    assert (np.abs(floats(left(table))) < rounding).all()


def test_the_ledger_of_every_rearrangement_is_enclosed() -> None:
    run = creep(paper_chain(3), Cycles("0.004", 1), solver="certified", digits=20, record=BOTH)
    names = [f"rearrangement_{name}" for name in LEDGER]
    parts = {name: a for name, a in run.recorded.items() if name.startswith(tuple(names))}
    known = [as_claimed(parts)[name].tolist() for name in names]
    assert len(known[0]) > 20
    for before, gravity, dissipation, after in zip(*known, strict=True):
        over = before.middle + gravity.middle - dissipation.middle - after.middle
        radius = before.radius + gravity.radius + dissipation.radius + after.radius
        assert abs(over) <= radius < 1e-17


@pytest.mark.parametrize(("locate", "order"), [(False, 2), (True, 3)])
def test_the_ledger_of_verlet_closes_to_its_order(locate: bool, order: int) -> None:
    """Seen at the end of a step, a stop takes away the square of a velocity of order dt."""
    over = []
    steps = (0.04, 0.02, 0.01, 0.005)
    for dt in steps:
        run = creep(
            paper_chain(3), Cycles("0.004", 2), solver="verlet", dt=dt, locate=locate,
            record=BOTH,
        )  # fmt: skip
        table = rows(run.recorded, "rearrangements")
        over.append(float(np.sqrt((left(table) ** 2).mean())))
    slope = np.polyfit(np.log(steps), np.log(over), 1)[0]
    assert slope == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("solver", SOLVERS)
def test_rows_do_not_depend_on_where_a_run_was_interrupted(solver: str) -> None:
    chain, drive = paper_chain(3), Cycles("0.003", 1)
    known = solver_named(solver, SOLVERS[solver])

    def begun() -> Any:
        return known.simulation(chain, State.relaxed(chain), 0, BOTH)

    whole = begun().follow(drive, 1, 2).recorded
    parts: list[Mapping[str, NDArray[Any]]] = []
    done, interruptions = 0, 0
    simulation = begun()
    while done < 2:
        stretch = simulation.follow(drive, done + 1, 2 - done, Limits(events=3))
        done += stretch.completed
        parts.append(stretch.recorded)
        parts.append(simulation.come_to_rest(NO_LIMITS))
        if simulation.at_rest:
            snapshot = simulation.snapshot()
            simulation = begun()
            simulation.restore(snapshot)
        interruptions += 1
    assert interruptions > 10
    for name in (*REARRANGEMENT_TABLE.columns, *SLIP_TABLE.columns):
        together = np.concatenate([floats(part[name]) for part in parts if name in part])
        assert np.array_equal(together, floats(whole[name])), name


def test_a_tie_begins_with_two_sliders_and_a_start_not_at_rest_has_no_ramp() -> None:
    chain = CHAINS["mirrored"]
    run = creep(chain, Cycles("0.3", 1), record=BOTH)
    table = rows(run.recorded, "rearrangements")
    assert set(table["began"]) == {2}
    assert set(table["began_first"]) == {1}
    assert set(table["began_last"]) == {4}
    assert table["undecided"].min() >= 1
    up = table["half_cycle"] == 1
    assert np.array_equal(table["direction"], np.where(up, 1, -1))
    alone = creep(Chain(1, 1, "1/2", "3/5", tan_alpha="1/2"), Cycles("0.1", 1), record=BOTH)
    assert rows(alone.recorded, "slip_table")["slider"].size == 0


@pytest.mark.parametrize("table", BOTH)
def test_the_sliding_limit_has_no_rearrangements(table: str) -> None:
    with pytest.raises(InputError, match="no events"):
        creep(paper_chain(3), AVALANCHES, solver="sliding", record=(table,))


def test_energies_do_not_drift_along_a_run() -> None:
    chain = paper_chain(6)
    drive = GaussianSteps("0.005", 4000)
    run = creep(chain, drive, record=("rearrangements",))
    table = rows(run.recorded, "rearrangements")
    assert len(table["theta"]) > 20_000
    fell = 1000 * (float(run.state.theta) - table["theta"][-1])
    elastic = ((run.state.tensions + fell) ** 2).sum() / 2
    assert table["elastic_after"][-1] == pytest.approx(elastic, abs=1e-11)
    assert np.abs(left(table)).max() < 2e-15
