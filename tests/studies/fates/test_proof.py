"""Fates that are proved for ever."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import flint
import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, fate
from exactcreep.motion.arithmetic import Undecided
from exactcreep.results import Enclosure, Fate, Progress
from exactcreep.solvers.tables import rearrangements
from exactcreep.studies.fates.proof import (
    Passed,
    ProvedFate,
    contraction,
    proved_fate,
)
from tests.paper import captions


def told(found: Fate) -> tuple[object, ...]:
    return found.outcome, found.evidence, found.period, found.settled_after


@pytest.mark.parametrize(
    ("n", "amplitude", "outcome", "period", "settled"),
    [
        (1, "0.01", Outcome.AT_REST, 1, 0),
        (2, "0.0004", Outcome.CREEPING, 1, 1),
        (3, "0.00085", Outcome.CREEPING, 15, 11),
        (4, "0.0009", Outcome.CREEPING, 5, 63),
        (4, "0.00065", Outcome.CYCLING, 1, 75),  # where float64 creeps
        (5, "0.000759", Outcome.CYCLING, 1, 25),
    ],
)
def test_a_fate_is_proved_for_ever(
    n: int, amplitude: str, outcome: Outcome, period: int, settled: int
) -> None:
    found = fate(captions(n), amplitude)
    assert told(found) == (outcome, Evidence.PROVED, period, settled)
    solver = "certified" if amplitude == "0.00065" else "exact"
    drive = Cycles(amplitude, settled + period)
    run = creep(found.chain, drive, record=("events",), solver=solver)
    log = [one for one in rearrangements(run.recorded) if one.half_cycle > 2 * settled]
    assert [event for one in log for event in one.itinerary] == period_of(found)


def test_what_runs_away_is_proved_and_of_chaos_no_proof_is_begun() -> None:
    steep = fate(captions(3, tan_alpha="0.55"), "0.001")
    assert told(steep) == (Outcome.RUNAWAY, Evidence.PROVED, None, None)
    chaos = fate(captions(6), "0.00099", cycles=200)
    assert (chaos.outcome, chaos.solver) == (Outcome.LIMIT, "exact")
    assert "no proof was begun; survival tells how long" in chaos.reason


def test_a_fate_is_first_that_of_float64_and_stays_so_if_time_ends_the_proof() -> None:
    heard: list[Progress] = []
    late = fate(captions(6), "0.00098", max_seconds=3, progress=heard.append)
    computed = fate(captions(6), "0.00098", solver="exact")
    assert told(late) == told(computed)
    assert late.evidence is Evidence.COMPUTED
    assert "max_seconds = 3 was reached before it was proved" in late.reason
    first = next(k for k, one in enumerate(heard) if computed.finding in one.answer)
    assert {one.phase for one in heard[:first]} == {"cycles"}
    assert all(computed.finding in one.answer for one in heard[first:])
    assert len(heard) > first + 1  # the cycles of the proof


def test_without_a_symmetry_no_proof_is_begun() -> None:
    chain = Chain(3, 1000, ["0.5", "0.5", "0.45"], "0.6", tan_alpha="0.25")
    found = fate(chain, "0.0008", cycles=200)
    assert (found.outcome, found.solver) == (Outcome.LIMIT, "exact")
    assert "needs the same mu_s - mu_d of sliders" in found.reason


ALIKE = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.15"}


@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
@pytest.mark.parametrize(
    ("differs", "amplitude", "tensions"),
    [
        ({"n": 4, "l0": "1/1000", "tan_alpha": "7/24"}, "618.51", ["3/125", "36/125", "24/125"]),
        ({"n": 2, "mu_d": ["0.5", "0.45"], "mu_s": ["0.6", "0.6"]}, "0.0006", [0]),
        ({"n": 2, "end_forces": ("0.05", "-0.02")}, "0.004", [0]),
        ({"n": 3, "mu_d": ["0.5", "0.55", "0.5"], "mu_s": ["0.6", "0.7", "0.6"],
          "end_forces": ("0.05", "0.05")}, "0.004", [0, 0]),
    ],
)  # fmt: skip
def test_from_its_settling_on_every_period_advances_by_what_is_proved(
    differs: Mapping[str, Any], amplitude: str, tensions: list[Any]
) -> None:
    chain = Chain(**ALIKE | differs)
    start = State.prepared(chain, tensions)
    found = fate(chain, amplitude, start=start, cycles=300)
    assert found.evidence is Evidence.PROVED
    settled, period = found.settled_after, found.period
    run = creep(chain, Cycles(amplitude, settled + 4 * period), start=start, record=("x_G",))
    x_g = np.append(0, run.recorded["x_G"][1::2])
    off = abs(x_g[period:] - x_g[:-period] - float(found.advance_enclosure.middle))
    within = off < float(found.advance_enclosure.radius) + 1e-12
    assert within[settled:].all()
    assert not settled or not within[settled - 1]


def test_a_set_contracts_only_if_its_shape_is_known_well_enough() -> None:
    """A norm of L = [[1, -1], [0, 1e-6]]: the radii (1, 1) reach as far as 2, not |L r| = 1e-6."""
    norm = np.array([[1.0, -1.0], [0.0, 1e-6]])

    def judged(radius: float, reach: float, narrowed: float = 1.0) -> float:
        still, known = flint.arb_mat(2, 2), Enclosure(Fraction(0), Fraction(0))
        no, shape = [flint.arb(0)] * 2, [flint.arb(radius)] * 2
        passed = Passed(still, still, no, no, no, shape, flint.arb(0), known)
        return contraction(passed, passed, norm, narrowed * np.linalg.inv(norm), reach, load=1.0)

    assert judged(1, 4.1) == judged(0.05, 1.0) == 0.0
    for given in ((1, 1e-3), (1, 1.0), (1, 3.9), (0.05, 1.0, 0.6)):
        with pytest.raises(Undecided, match="may leave the set"):
            judged(*given)


def test_a_fate_without_avalanches_in_its_cycle_is_that_of_all_amplitudes_between_two() -> None:
    def proved(n: int, amplitude: Fraction) -> ProvedFate:
        return proved_fate(captions(n), Cycles(amplitude, 100), State.relaxed(captions(n)))

    low, high = proved(2, Fraction("0.0003")).between or (1, 0)
    square = Fraction(35 * 4, 100 * 1000) ** 2 / 17  # of (mu_s - tan) cos / l0
    near = Fraction(1, 10**30)
    assert low == 0
    assert high**2 < square < (high + near) ** 2

    def happened(found: ProvedFate) -> tuple[object, ...]:
        return told(found.fate), [(one.half_cycle, one.itinerary) for one in found.log]

    locked = proved(4, Fraction("0.00065"))
    low, high = locked.between or (1, 0)
    assert low < Fraction("0.00065") < high
    for amplitude, same in ((low + near, True), (low - near, False)):
        assert (happened(proved(4, amplitude)) == happened(locked)) is same
    assert locked.shared
    assert not proved(3, Fraction("0.0007")).shared  # its avalanches depend on the state


def period_of(found: Fate) -> list[object]:
    """Return the events of the proved period, in order."""
    return [event for _, itinerary in found.itinerary or () for event in itinerary]
