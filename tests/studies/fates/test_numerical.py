"""What a chain without disorder does in the end, as float64 finds it."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from exactcreep import Cycles, Evidence, Outcome, State, creep, fate
from exactcreep.solvers.exact import recurrence
from exactcreep.solvers.recurrence import PATIENCE, nearness
from exactcreep.studies.fates.result import Fate
from tests.conftest import Command
from tests.paper import captions


def tensions(found: Fate, cycles: int) -> np.ndarray:
    run = creep(found.chain, Cycles(found.amplitude, cycles), start=found.start, record="tension")
    return run.recorded["tension"][1::2]


@pytest.mark.parametrize(
    ("n", "amplitude"),
    [
        (2, "0.0007"),
        (3, "0.00085"),
        (4, "0.0011"),
        (5, "0.000759"),
        (6, "0.000969"),
    ],
)
def test_tensions_repeat_from_settled_after_on_and_not_before(n: int, amplitude: str) -> None:
    found = fate(captions(n), amplitude, solver="exact")
    assert found.evidence is Evidence.COMPUTED
    settled, period = found.settled_after, found.period
    assert settled is not None
    assert period is not None
    at_ends = tensions(found, settled + 2 * period)
    assert np.array_equal(at_ends[settled - 1 : -period], at_ends[settled - 1 + period :])
    if settled > 1:
        assert not np.array_equal(at_ends[settled - 2], at_ends[settled - 2 + period])
    x_g = creep(found.chain, Cycles(amplitude, settled)).recorded["x_G"][1::2]
    moves = np.diff(x_g, prepend=0.0)
    assert found.last_advance == np.flatnonzero(moves > 1e-12)[-1] + 1
    for shorter in range(1, period):
        assert not np.array_equal(at_ends[settled - 1], at_ends[settled - 1 + shorter])


def test_the_advance_of_a_period_is_that_of_a_run() -> None:
    found = fate(captions(3), "0.00085", solver="exact")
    assert (found.outcome, found.period) == (Outcome.CREEPING, 15)
    first = 2 * found.settled_after
    run = creep(found.chain, Cycles("0.00085", found.settled_after + 15))
    x_g = run.recorded["x_G"]
    assert found.advance == pytest.approx(x_g[-1] - x_g[first - 1], rel=1e-13)
    assert found.velocity == found.advance / 30


def test_the_itinerary_is_that_of_the_next_period() -> None:
    found = fate(captions(5), "0.000759", solver="exact")
    assert found.outcome is Outcome.CYCLING
    assert found.advance == 0
    # four slips of either end, each a rearrangement of its own, in either half-cycle
    slips = [(half, events[0][1]) for half, events in found.itinerary for _ in events[1:]]
    assert {(half, end) for half, end in slips} == {(h, (e,)) for h in (1, 2) for e in (1, 5)}
    run = creep(found.chain, Cycles("0.000759", 30), record=("slips",))
    assert len(found.itinerary) == run.recorded["slips"][-2:].sum()


def test_a_chain_that_returns_to_within_rounding_alone_is_undecided() -> None:
    found = fate(captions(4), "0.00095", solver="exact")
    assert (found.outcome, found.period) == (Outcome.CREEPING, 1)
    assert found.evidence is Evidence.UNDECIDED
    assert "not bit for bit" in found.reason
    assert found.cycles - found.settled_after >= PATIENCE
    at_ends = tensions(found, found.settled_after + 100)
    steps = np.abs(np.diff(at_ends, axis=0)).max(axis=1)
    assert steps[found.settled_after - 1 :].max() < 1e-12
    assert steps[found.settled_after - 2] > 2**-41  # half a tension's change is a force's


def test_what_comes_to_its_cycle_from_either_side_has_the_shortest_period() -> None:
    found = fate(captions(5), "0.000765", solver="exact")
    assert (found.outcome, found.period) == (Outcome.CREEPING, 1)
    at_ends = tensions(found, found.settled_after + 30)
    once = np.abs(at_ends[1:] - at_ends[:-1]).max(axis=1)
    twice = np.abs(at_ends[2:] - at_ends[:-2]).max(axis=1)
    forces = np.diff(at_ends, prepend=0.0, append=0.0)
    steps = np.abs(np.diff(forces, axis=0)).max(axis=1)
    close = nearness(found.chain)
    assert steps[found.settled_after - 1 :].max() <= close < steps[found.settled_after - 2]
    # two cycles before it settles the tensions come back better after two cycles than after one
    assert twice[found.settled_after - 3] < 0.5 * once[found.settled_after - 3]
    assert found.velocity == pytest.approx(0.35258442721957, rel=1e-12)


def test_creep_that_turns_round_by_an_irrational_angle_never_settles() -> None:
    """Three sliders: every cycle moves the tensions on by .00996... mod 2D, and by no fraction."""
    found = fate(captions(3), "0.0008", cycles=3000, solver="exact")
    assert found.outcome is Outcome.LIMIT
    assert found.last_advance == 3000
    at_ends = tensions(found, 3000)[1000:]
    turned = np.mod(np.diff(at_ends, axis=0) + 1e-9, 2 * found.chain.excess)
    counts, _ = np.histogram(turned[:, 0], bins=20)
    assert np.count_nonzero(counts) <= 4


@pytest.mark.parametrize(
    ("l0", "amplitude"),
    [(1000, "0.0003"), (1000, "0.0005"), (1000, "0.0007"), (1000, "0.01"), (10, "1.5")],
)
def test_two_relaxed_sliders_creep_by_the_staircase(l0: int, amplitude: str) -> None:
    chain = captions(2, l0=str(l0))
    found = fate(chain, amplitude, solver="exact")
    force = float(chain.mu_s) * chain.cos_alpha - chain.sin_alpha
    step = 2 * chain.excess
    stairs = max(0, np.ceil((l0 * float(amplitude) - force) / step))
    assert found.velocity == pytest.approx(step * stairs, rel=1e-12)
    assert found.evidence is Evidence.COMPUTED


@pytest.mark.parametrize(("amplitude", "outcome"), [("0.0003", "at_rest"), ("0.001", "cycling")])
def test_a_level_chain_creeps_nowhere(amplitude: str, outcome: str) -> None:
    found = fate(captions(4, tan_alpha="0"), amplitude, solver="exact")
    assert (found.outcome.value, found.advance) == (outcome, 0)


def test_a_course_that_does_not_settle_comes_back_as_a_limit() -> None:
    found = fate(captions(30), "0.0045", cycles=60, solver="exact")
    assert found.outcome is Outcome.LIMIT
    assert (found.settled_after, found.period, found.advance) == (None, None, None)
    assert (found.cycles, found.last_advance) == (60, 60)
    assert "60 cycles" in found.reason


def test_a_time_limit_comes_back_with_what_is_known() -> None:
    found = fate(captions(30), "0.0045", cycles=10**9, solver="exact", max_seconds=0.2)
    assert found.outcome is Outcome.LIMIT
    assert found.reason == "max_seconds = 0.2 was reached"
    assert 0 < found.last_advance <= found.cycles + 1


def test_a_stuck_chain_rests_from_the_beginning() -> None:
    found = fate(captions(4), 0, solver="exact")
    assert (found.outcome, found.settled_after, found.period) == (Outcome.AT_REST, 0, 1)
    assert (found.advance, found.itinerary) == (0, ())


def test_a_steep_chain_runs_away() -> None:
    found = fate(captions(3, tan_alpha="0.55"), "0.001", solver="exact")
    assert found.outcome is Outcome.RUNAWAY
    assert "stop ever again" in found.reason
    assert found.settled_after is None


def test_the_mirror_image_has_the_mirrored_fate() -> None:
    one = fate(captions(3), "0.00085", solver="exact")
    other = fate(captions(3, tan_alpha="-0.25"), "0.00085", solver="exact")
    assert other.advance == -one.advance
    assert replace(other, chain=one.chain, start=one.start, advance=one.advance, itinerary=()) == (
        replace(one, itinerary=())
    )
    turned = tuple(
        (
            half,
            tuple(
                (kind, tuple(4 - i for i in sliders[::-1]), tuple(-s for s in signs[::-1]))
                for kind, sliders, signs in events
            ),
        )
        for half, events in one.itinerary
    )
    assert other.itinerary == turned


def test_a_start_that_is_not_at_rest_is_first_rearranged() -> None:
    chain = captions(2)
    found = fate(chain, 0, start=State.prepared(chain, ["1.5"]), solver="exact")
    assert (found.outcome, found.settled_after, found.last_advance) == (Outcome.AT_REST, 1, 1)
    assert found.report["events"] > 0


def test_a_longer_period_is_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recurrence, "LONGEST_PERIOD", 14)
    assert fate(captions(3), "0.00085", cycles=2000, solver="exact").outcome is Outcome.LIMIT


def test_the_command_prints_what_the_function_returns(
    command: Command, tmp_path: Path, drawn: list[Figure]
) -> None:
    plot = tmp_path / "fate.png"
    words = ["fate", "--n", "3", "--amplitude", "0.00085", "--solver", "exact", "--plot", str(plot)]
    told = command(*words, "--json")
    assert told.code == 0
    assert told.json == fate(captions(3), "0.00085", solver="exact").summary()
    assert told.json["itinerary"][0]["events"] == ["start 3 down", "stop 3 down"]
    assert len(drawn) == 1
    shown = command(*words, "--force").out
    assert "creeping" in shown
    assert "period 15" in " ".join(shown.split())
    refused = command(*words)
    assert refused.code == 2
    assert "plot" in refused.sentence


def test_the_command_prints_an_enclosure_as_decimals_that_enclose_it(command: Command) -> None:
    words = ("fate", "--n", "3", "--amplitude", "0.00095")
    exact = [Fraction(end) for end in command(*words, "--json").json["advance_enclosure"]]
    printed = " ".join(command(*words).out.split())
    shown = re.search(r"advance enclosure ([\d.]+), ([\d.]+)", printed)
    low, high = map(Fraction, shown.groups())
    assert low < exact[0] < exact[1] < high
    assert high - low < 2 * (exact[1] - exact[0])


def test_the_command_leaves_with_3_if_nothing_has_settled(command: Command, tmp_path: Path) -> None:
    plot = tmp_path / "fate.pdf"
    told = command("fate", "--n", "6", "--amplitude", "0.0012", "--cycles", "40", "--solver",
                   "exact", "--plot", str(plot))  # fmt: skip
    assert told.code == 3
    assert "cycles 40" in " ".join(told.out.split())
    assert plot.exists()
