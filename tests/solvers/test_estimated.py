"""The error that is estimated from the events, held against what the certified solver proves."""

from __future__ import annotations

import json
import random
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.solvers.interface import TENSION_TOLERANCE, Rearrangement
from tests.data.make_near_grazes import (
    CASES,
    FILE,
    SEED,
    VELOCITY_CASES,
    digest,
    stretched,
)
from tests.paper import unstable_chain

NEAR_GRAZES = json.loads(FILE.read_text(encoding="utf-8"))


def error_of(result: Rearrangement, places: list[Any]) -> float:
    """Return the largest error of a displacement or a tension, beside the true displacements."""
    pairs = zip(result.state.displacements.tolist(), places, strict=True)
    off = [Fraction(a) - Fraction(b) for a, b in pairs]
    stretched = [b - a for a, b in pairwise(off)]
    return float(max(map(abs, off + stretched)))


def proved(chain: Chain, state: State, **how: Any) -> tuple[Rearrangement, list[str]]:
    """Return what `certified` finds, and its displacements."""
    truth = rearrange(chain, state, solver="certified", digits=25, **how)
    return truth, [x.str(25, radius=False) for x in truth.state.displacements.tolist()]


def random_case(rng: random.Random, least: int, most: int) -> tuple[Chain, State, Rearrangement]:
    """Return a chain that is unstable as it stands, and the rearrangement that follows."""
    while True:
        chain, state = unstable_chain(rng)
        result = rearrange(chain, state, direction=0, seed=3)
        if least <= len(result.events) <= most and result.outcome is Outcome.AT_REST:
            return chain, state, result


def test_the_estimate_is_above_the_error_not_far_above_and_the_same_every_time() -> None:
    rng, ratios = random.Random(2011), []
    for least, most, count in ((1, 9, 12), (10, 99, 6), (100, 400, 1)):
        for _ in range(count):
            chain, state, result = random_case(rng, least, most)
            truth, places = proved(chain, state, direction=0, seed=3)
            assert truth.itinerary == result.itinerary
            ratios.append(error_of(result, places) / result.error)
    assert max(ratios) < 1
    assert np.median(ratios) > 1 / 50
    assert rearrange(chain, state, direction=0, seed=3).error == result.error


def test_near_grazes_are_in_doubt_or_as_right_as_is_said() -> None:
    verdicts: Counter[tuple[bool, bool]] = Counter()
    of_velocity: Counter[bool] = Counter()
    assert len(NEAR_GRAZES) == CASES + VELOCITY_CASES
    for number, case in enumerate(NEAR_GRAZES):
        chain, state = stretched(case["seed"], Fraction(case["extra"]))
        result = rearrange(chain, state, direction=0, seed=SEED, max_events=400)
        alike = digest(result.itinerary) == case["events"]
        undecided = result.evidence is Evidence.UNDECIDED
        spoilt = not alike or error_of(result, case["places"]) > TENSION_TOLERANCE
        assert undecided or not spoilt
        if alike:
            assert error_of(result, case["places"]) <= result.error
        verdicts[spoilt, undecided] += 1
        of_velocity[undecided] += number >= CASES
    assert verdicts[True, True] >= 40
    assert min(of_velocity.values()) > VELOCITY_CASES // 10
    assert verdicts[False, True] <= verdicts[True, True]  # what is right is seldom in doubt
    chain, state = stretched(NEAR_GRAZES[0]["seed"], Fraction(NEAR_GRAZES[0]["extra"]))
    truth, places = proved(chain, state, direction=0, seed=SEED)
    kept = NEAR_GRAZES[0]["events"], NEAR_GRAZES[0]["places"]
    assert (digest(truth.itinerary), places) == kept  # what their generator makes


def five_sliders(extra: Fraction, place: float = 0.0, **options: Any) -> Rearrangement:
    """Return an avalanche of five sliders whose second spring is stretched by `extra` more.

    All stand displaced by `place`.
    """
    chain = Chain(5, 1, "1/10", "1/5", tan_alpha="1/20")
    limit = Fraction(chain.times_cosine(chain.mu_s))
    tensions = [limit * Fraction(t, 100) for t in (-96, 119, -24, -12)]
    tensions[1] += extra
    state = replace(State.prepared(chain, tensions), displacements=np.full(5, place))
    return rearrange(chain, state, direction=0, **options)


@pytest.fixture(scope="module")
def graze() -> Fraction:
    """The least `extra` beyond which a slider of `five_sliders` starts, to 2**-52."""
    low, high = Fraction(0), Fraction(1, 100)
    without = five_sliders(low).itinerary
    for _ in range(46):
        middle = (low + high) / 2
        low, high = (middle, high) if five_sliders(middle).itinerary == without else (low, middle)
    return high


def test_a_start_near_grazing_costs_digits_and_is_told(graze: Fraction) -> None:
    near = {}
    for k in (4, 6, 8, 10, 12):
        near[k] = five_sliders(graze + Fraction(1, 10**k))
    for k in (4, 6, 8):
        assert 3 < near[k + 2].error / near[k].error < 33  # one digit for two powers of ten
    assert near[6].evidence is Evidence.COMPUTED
    far = near[12]
    assert (far.evidence, far.undecided) == (Evidence.UNDECIDED, 0)
    assert far.error > TENSION_TOLERANCE
    assert "beyond 1e-12" in far.doubt
    again = five_sliders(graze + Fraction(1, 10**12), solver="certified", digits=25)
    assert again.itinerary == far.itinerary
    places = [x.str(25, radius=False) for x in again.state.displacements.tolist()]
    assert error_of(far, places) < far.error


def test_reference_loses_digits_near_grazing_and_says_so(graze: Fraction) -> None:
    for k in (6, 10):
        near = five_sliders(graze + Fraction(1, 10**k), solver="reference")
        truth = five_sliders(graze + Fraction(1, 10**k), solver="certified", digits=25)
        off = error_of(near, [x.str(25, radius=False) for x in truth.state.displacements.tolist()])
        assert off < near.error < 1000 * off
        assert (near.evidence is Evidence.COMPUTED) == (near.error <= TENSION_TOLERANCE) == (k < 10)
        if k == 10:
            assert "rounding may have grown to" in near.doubt
    sharp = five_sliders(graze + Fraction(1, 10**10), solver="mpmath", digits=30)
    assert sharp.evidence is Evidence.COMPUTED
    assert 0 < sharp.error < 1e-30


def test_a_tie_that_the_rules_have_settled_is_undecided_whatever_is_estimated() -> None:
    """Slider 1 needs 2D for a start when slider 2 has slipped that far."""
    for k in (13, 17):
        chain = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(1, 10**k))
        result = rearrange(chain, State.relaxed(chain), direction=1)
        assert len(result.events) == 2  # below mu_d it stays
        assert result.undecided == (k == 17)
        assert (result.evidence is Evidence.UNDECIDED) == (k == 17)
        assert result.error == np.inf if k == 17 else result.error < 1e-14


STEEP = Chain(3, 1, "1/2", "3/5", tan_alpha="7/10")
STILL = Chain(3, 1, "1/2", "3/5", tan_alpha="1/4")
ERRORS = [
    (STEEP, [0, 0], 1, 3, TENSION_TOLERANCE),  # it runs away: up to the last event
    (STILL, [0, 0], 0, 0, 0.0),  # nothing moves
]


@pytest.mark.parametrize(("chain", "tensions", "direction", "first", "most"), ERRORS)
def test_the_error_is_small_where_nothing_is_in_doubt(
    chain: Chain, tensions: list[Any], direction: int, first: int, most: float
) -> None:
    state = State.prepared(chain, [Fraction(t) for t in tensions])
    result = rearrange(chain, state, direction=direction)
    assert len(result.events[0].sliders) == first if first else result.events == ()
    assert (result.outcome is Outcome.RUNAWAY) == (chain is STEEP)
    assert result.error <= most
    assert (result.error > 0) == (first > 0)
    assert result.doubt == ""
