"""The sliding limit against the paper's law and step-by-step minimisation of energy."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import Chain, Cycles, Evidence, InputError, State, Targets
from exactcreep.laws import pivots, prediction
from exactcreep.solvers.sliding import Sliding
from tests.laws.test_differing import chains, forces
from tests.oracle.incremental import follow

PYTHAGOREAN = [(Fraction(3, 4), Fraction(9, 10)), (Fraction(5, 12), Fraction(1, 2))]
"""Slopes whose cosine is rational, and a friction that holds."""


def chain_of(n: int, tan_alpha: Fraction, mu_d: Fraction = Fraction(1, 2)) -> Chain:
    return Chain(n, 1000, mu_d, mu_d + Fraction(1, 10), tan_alpha=tan_alpha)


def simulate(chain: Chain, drive: Any, *, start: State | None = None, seed: int = 0) -> Any:
    start = State.relaxed(chain) if start is None else start
    simulation = Sliding().simulation(chain, start, seed, ("x_G", "x", "tension", "slips"))
    stretch = simulation.follow(drive, 1, drive.target_count)
    assert stretch.completed == drive.target_count
    return simulation, stretch.recorded


def threshold_of(chain: Chain) -> Fraction:
    """Return the amplitude at which Eq. 23 is zero, of a chain whose cosine is rational."""
    square = 1 / (1 + chain.tan_alpha**2)
    cosine = Fraction(math.isqrt(square.numerator), math.isqrt(square.denominator))
    return Fraction(chain.n, 2) * (chain.mu_d - chain.tan_alpha) * cosine / chain.l0


@pytest.mark.parametrize(("tan_alpha", "mu_d"), [*PYTHAGOREAN, (Fraction(5, 12), Fraction(5, 6))])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 8, 12])
def test_cycles_creep_exactly_at_the_plateau_law_cut_off_at_zero(
    n: int, tan_alpha: Fraction, mu_d: Fraction
) -> None:
    """Where two sliders may be the pivot the law has two velocities, and the run their mean."""
    chain = chain_of(n, tan_alpha, mu_d)
    threshold, halves = threshold_of(chain), 59_996
    for factor in (Fraction(99, 100), 1, Fraction(101, 100), 17):
        amplitude = threshold * factor
        reach = chain.l0 * max(Fraction(0), amplitude - threshold)
        found = [(n + 3 - 2 * i) * reach for i in pivots(n, tan_alpha, mu_d)]
        drive, law = Cycles(amplitude, 30_000), sum(found) / len(found)
        assert set(prediction(chain, drive).sliding) == {float(law) for law in found}
        simulation, recorded = simulate(chain, drive)
        way = recorded["x"][-1] - recorded["x"][-1 - halves]
        rounding = 8e-15 * float(chain.l0 * amplitude)
        assert (abs(way - float(law) * halves) <= rounding * halves).all()
        if factor == 1:
            continue  # floats cannot tell the threshold itself from what is just above it
        open_ = len(found) > 1 and factor > 1
        assert (simulation.evidence is Evidence.UNDECIDED) == open_


@pytest.mark.parametrize("slope", [Fraction(1, 4), Fraction(23, 100)])
def test_a_tie_of_pivots_is_decided_on_the_rationals_of_the_chain(slope: Fraction) -> None:
    """No float64 is 1/4 - 1e-30: near it one slider is the pivot, and nothing is left open."""
    for near in (slope, slope - Fraction(1, 10**30), slope + Fraction(1, 10**30)):
        simulation, _ = simulate(chain_of(12, near), Cycles(Fraction(12, 1000), 6))
        tie = near == Fraction(1, 4)
        assert simulation.tally.undecided == 12 * tie
        assert len(simulation.report()["pivots"]) == 1 + tie


def test_any_path_from_any_start_minimises_energy_and_dissipation_step_by_step() -> None:
    """Of chains of equal and of differing friction; and their cycles are those of the law."""
    rng, relaxed = random.Random(3), 0
    for k, given in enumerate(chains(40, seed=9)):
        n = len(given["mu_d"])
        if k % 3 == 0:
            held = abs(given["tan_alpha"]) + Fraction(1, 3)
            given |= {"mu_d": [held] * n, "end_forces": (0, 0)}
        chain = Chain(n, 10, mu_s=given["mu_d"], **given)
        start = [Fraction(rng.randint(-100, 100), 50) * (k % 2) for _ in range(n - 1)]
        path = [Fraction(rng.randint(-60, 60), 40) for _ in range(12)]
        simulation, recorded = simulate(
            chain, Targets(path), start=State.prepared(chain, start), seed=k
        )
        places = [0.0, *(float(chain.l0 * target) for target in path)]
        x, tension = follow(*forces(given), places, tensions=start)
        assert recorded["x"] == pytest.approx(x[1:], abs=1e-10)
        assert recorded["tension"] == pytest.approx(tension[1:], abs=1e-10)
        assert simulation.tally.slips == recorded["slips"].sum() > 0
        relaxed += simulation.report()["start_relaxed"]
        assert simulation.report()["start_relaxed"] == (abs(x[0]).max() > 1e-9)
        if not simulation.report()["unique"]:
            continue
        amplitude = Fraction(rng.randint(1, 80), 40)
        law = prediction(chain, Cycles(amplitude, 9))
        assert law.deviation == 0
        _, cycles = simulate(chain, Cycles(amplitude, 5))
        advance = cycles["x_G"][-1] - cycles["x_G"][-3]
        assert advance / 2 == pytest.approx(law.values[0], abs=1e-10)
    assert 5 < relaxed < 35


def test_a_start_whose_sliders_all_move_ends_in_the_middle_of_where_it_may_rest() -> None:
    """Sliders 1 and 2 go down, slider 3 up: x is [0, -2.5, -6.5], and 2.5 to 6.5 more."""
    chain = Chain(3, 10, ["0.5", "0.5", "1"], ["0.5", "0.5", "1"], tan_alpha=0)
    start = State.prepared(chain, [3, 5])
    simulation = Sliding().simulation(chain, start, 0, ("x_G",))
    assert simulation.state().tensions == pytest.approx([0.5, 1])
    assert simulation.state().displacements == pytest.approx([4.5, 2, -2])
    assert simulation.evidence is Evidence.UNDECIDED


def test_with_two_possible_pivots_a_differing_chain_creeps_between_the_two_laws() -> None:
    """Friction 3, 1, 2 and no pull: sliders 1 and 2 share a spring, as do those mirrored."""
    chain = Chain(3, 10, [3, 1, 2], [3, 1, 2], tan_alpha=0)
    simulation, recorded = simulate(chain, Cycles(2, 6))
    low, high = prediction(chain, Cycles(2, 6)).values
    assert not simulation.report()["unique"]
    advance = (recorded["x"][-1] - recorded["x"][-3]).mean() / 2
    assert low < advance < high


@pytest.mark.parametrize(
    ("tan_alpha", "mu_d", "end", "field"),
    [
        ("-0.6", "0.5", 0, "tan_alpha"),
        ("-0.5", "0.5", 0, "tan_alpha"),
        ("0", "0", 0, "tan_alpha"),
        ("0", "0.5", "1.5", "end_forces"),
    ],
)
def test_a_chain_that_friction_does_not_hold_is_refused(
    tan_alpha: str, mu_d: str, end: Any, field: str
) -> None:
    chain = Chain(3, 10, mu_d, "0.9", tan_alpha=tan_alpha, end_forces=(0, end))
    with pytest.raises(InputError, match='solver="exact" follows') as refused:
        Sliding().simulation(chain, State.relaxed(chain), 0, ("x_G",))
    assert refused.value.name == field
    assert prediction(chain, Cycles("0.9", 3)) is None
