"""The error estimate: its jump rules against finite differences, its size against the truth."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterable
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from exactcreep import Chain, Evidence, InputError, Outcome, State, rearrange
from exactcreep.motion.arithmetic import digits_of
from exactcreep.motion.itinerary import Retracer
from exactcreep.motion.rounding_error import PROBES, PROMISE, propagated, rounding_error
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.solver import Rearrangement

FIFTY_DIGITS = digits_of(200)


def random_case(rng: random.Random, least: int, most: int) -> tuple[Chain, State, Rearrangement]:
    """Return a chain that is unstable as it stands, and the rearrangement that follows."""
    while True:
        n = rng.randint(2, 12)
        mu_d = Fraction(rng.choice([1, 5, 20, 100, 300, 600]), 1000)
        mu_s = mu_d + Fraction(rng.choice([20, 100, 1000]), 1000)
        sigma = rng.choice(["0", "0.01"])
        chain = Chain(n, 1, mu_d, mu_s, sigma, tan_alpha=mu_d * Fraction(rng.randint(-9, 9), 10))
        unit = Fraction(chain.times_cosine(mu_s))
        tensions = [unit * Fraction(rng.randint(-150, 150), 100) for _ in range(n - 1)]
        state = State.prepared(chain, tensions, seed=3)
        result = rearrange(chain, state, direction=0, seed=3)
        decided = not result.undecided and (result.state.coefficients > float(mu_d)).all()
        if least <= len(result.events) <= most and result.outcome is Outcome.AT_REST and decided:
            return chain, state, result


def end_at_fifty_digits(chain: Chain, start: State, errors: list[Fraction], result: Rearrangement):
    """Return the displacements at the end if those at the start are off by `errors`."""
    stretched = np.diff(np.array(errors, dtype=object))
    tensions = np.array([Fraction(t) for t in start.tensions.tolist()], dtype=object) + stretched
    moved = State(tensions, start.displacements, start.coefficients, start.draws, start.theta)
    course = Retracer(chain, moved, FIFTY_DIGITS, seed=3)
    course.rearrange(result.events)
    return [course.travel[n] + FIFTY_DIGITS.number(errors[n]) for n in range(chain.n)]


def carried(chain: Chain, state: State, result: Rearrangement, errors: np.ndarray) -> np.ndarray:
    """Return what errors of the displacements, one column each, become without rounding."""
    columns = np.zeros((chain.n, PROBES))
    columns[:, : errors.shape[1]] = errors
    after, doubt = propagated(chain, state, result.events, 3, columns)
    assert not doubt
    return after[:, : errors.shape[1]]


@pytest.mark.parametrize("seed", range(12))
def test_errors_are_carried_as_finite_differences_at_fifty_digits_say(seed: int) -> None:
    rng = random.Random(seed)
    chain, state, result = random_case(rng, 4, 60)
    kinds = {event.kind.value for event in result.events}
    assert kinds == {"start", "stop"}
    way = [Fraction(rng.randint(-100, 100), 100) for _ in range(chain.n)]
    step = Fraction(1, 10**20)
    plain = end_at_fifty_digits(chain, state, [Fraction(0)] * chain.n, result)
    moved = end_at_fifty_digits(chain, state, [step * w for w in way], result)
    slope = np.array([float((b - a) * 10**20) for a, b in zip(plain, moved, strict=True)])
    size = 1e-18  # far below what would put an event in doubt
    ours = carried(chain, state, result, size * np.array([way], dtype=float).T)
    assert np.abs(ours[:, 0] / size - slope).max() <= 1e-9 * np.abs(slope).max()


def reversals(result: Rearrangement) -> int:
    pairs = zip(result.events, result.events[1:], strict=False)
    return sum(
        a.time == b.time and a.kind.value == "stop" and bool({*a.sliders} & {*b.sliders})
        for a, b in pairs
    )


def test_the_finite_differences_see_reversals_and_whole_chains() -> None:
    cases = [random_case(random.Random(seed), 4, 60)[2] for seed in range(12)]
    assert sum(map(reversals, cases)) >= 10
    assert sum(len(case.events) for case in cases) >= 150


def test_an_error_that_only_shifts_the_whole_chain_stays_as_it_is() -> None:
    chain, state, result = random_case(random.Random(5), 20, 200)
    after = carried(chain, state, result, np.full((chain.n, 1), 1e-15))
    assert np.abs(after - 1e-15).max() < 1e-24


def test_the_error_of_a_lone_slip_is_that_of_its_length() -> None:
    chain = Chain(3, 1, "1/2", "3/5", tan_alpha="1/4")
    state = State.prepared(chain, [Fraction(1, 2), 0])
    result = rearrange(chain, state, direction=0)
    assert result.itinerary == (("start", (1,), (1,)), ("stop", (1,), (1,)))
    after = carried(chain, state, result, np.array([[1e-15, 0, 0], [0, 1e-15, 0]]).T)
    # it swings about its own end of the spring: twice where the neighbour is, minus where it began
    assert after[0] == pytest.approx([-1e-15, 2e-15], rel=1e-12)


def error_of(result: Rearrangement, truth: Rearrangement) -> float:
    both = zip(result.state.tensions.tolist(), truth.state.tensions.tolist(), strict=True)
    return max(abs(float(b - a)) for a, b in both)


def test_the_estimate_is_above_the_error_and_not_far_above() -> None:
    rng = random.Random(2011)
    ratios = []
    for least, most, count in ((1, 9, 20), (10, 99, 15), (100, 400, 5)):
        for _ in range(count):
            chain, state, result = random_case(rng, least, most)
            truth = rearrange(chain, state, direction=0, seed=3, solver="certified", digits=20)
            assert truth.itinerary == result.itinerary
            ratios.append(error_of(result, truth) / result.error)
    assert max(ratios) < 1
    assert np.median(ratios) > 1 / 50


def test_the_estimate_is_deterministic() -> None:
    chain, _, result = random_case(random.Random(8), 50, 300)
    again = rounding_error(chain, result.initial, result.events, seed=3)
    assert again == rounding_error(chain, result.initial, result.events, seed=3)
    assert again.error == result.error


def five_sliders(extra: Fraction, **options: object) -> Rearrangement:
    """Return an avalanche of five sliders whose second spring is stretched by `extra` more."""
    chain = Chain(5, 1, "1/10", "1/5", tan_alpha="1/20")
    limit = Fraction(chain.times_cosine(chain.mu_s))
    tensions = [limit * Fraction(t, 100) for t in (-96, 119, -24, -12)]
    tensions[1] += extra
    return rearrange(chain, State.prepared(chain, tensions), direction=0, **options)


@cache
def graze() -> Fraction:
    """Return the least `extra` beyond which a slider of `five_sliders` starts, to 2**-52."""
    low, high = Fraction(0), Fraction(1, 100)
    without = five_sliders(low).itinerary
    for _ in range(46):
        middle = (low + high) / 2
        if five_sliders(middle).itinerary == without:
            low = middle
        else:
            high = middle
    return high


def grazing(k: int, **options: object) -> Rearrangement:
    """Return `five_sliders` 10**-k beyond its graze, which starts at a rate of 10**(-k/2)."""
    return five_sliders(graze() + Fraction(1, 10**k), **options)


def test_a_start_near_grazing_costs_digits_and_is_told() -> None:
    errors = [grazing(k).error for k in (4, 6, 8, 10)]
    for near, nearer in pairwise(errors):
        assert 5 < nearer / near < 20  # one digit for two powers of ten
    assert grazing(6).evidence is Evidence.COMPUTED
    far = grazing(12)
    assert (far.evidence, far.undecided) == (Evidence.UNDECIDED, 0)
    assert far.error > PROMISE
    assert "beyond 1e-12" in far.doubt


def test_an_undecided_rearrangement_is_done_again_in_balls_if_that_is_allowed() -> None:
    again = grazing(12, escalate=True)
    assert (again.solver, again.evidence) == ("certified", Evidence.PROVED)
    assert again.report["escalated"] == grazing(12).doubt
    assert again.itinerary == grazing(12).itinerary
    spoilt = [error_of(grazing(k), grazing(k, escalate=True)) / grazing(k).error for k in (12, 13)]
    assert 1e-3 < max(spoilt) < 1
    assert error_of(grazing(13), grazing(13, escalate=True)) > PROMISE
    assert grazing(6, escalate=True).solver == "exact"


def test_only_single_rearrangements_escalate() -> None:
    chain = Chain(2, 1, "1/2", "3/5", tan_alpha="1/4")
    allowed = solver_named("exact", {"escalate": True})
    with pytest.raises(InputError, match="escalate = True: is for one rearrangement"):
        allowed.simulation(chain, State.relaxed(chain), 0, ("x_G",))
    with pytest.raises(InputError, match="cannot be taken back"):
        list(allowed.iterate(chain, State.relaxed(chain), 1, 0))
    with pytest.raises(InputError, match="must be true or false"):
        solver_named("exact", {"escalate": "yes"})


def test_a_neighbour_that_comes_next_to_its_threshold_puts_the_order_in_doubt() -> None:
    """Slider 1 needs 2D for a start when slider 2 has slipped that far."""
    chain = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(1, 10**17))
    result = rearrange(chain, State.relaxed(chain), direction=1)
    assert result.error == math.inf
    assert result.doubt.endswith("slider 1 comes next to its threshold")
    assert result.evidence is Evidence.UNDECIDED
    clear = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(1, 10**13))
    assert rearrange(clear, State.relaxed(clear), direction=1).error < 1e-14


def test_nothing_that_moves_has_no_error() -> None:
    chain = Chain(3, 1, "1/2", "3/5", tan_alpha="1/4")
    result = rearrange(chain, State.relaxed(chain), direction=0)
    assert (result.events, result.error, result.doubt) == ((), 0.0, "")


def test_a_long_avalanche_that_rounding_has_spoilt_is_flagged() -> None:
    chain = Chain(8, "1e-6", "1/1000", "101/1000", 0, tan_alpha="-3/5000")
    tensions = [Fraction(t, 100) for t in (-3, 18, -18, -14, -2, 0, -2)]
    first = rearrange(chain, State.prepared(chain, tensions), direction=0)
    assert (len(first.events), first.evidence) == (672, Evidence.COMPUTED)
    second = rearrange(chain, first.state, direction=1)
    assert (len(second.events), second.evidence) == (608, Evidence.UNDECIDED)
    assert second.doubt.startswith("rounding may have grown")


def stretched(seed: int, extra: Fraction, **options: object) -> Rearrangement:
    """Return the rearrangement of a random chain one of whose springs is stretched by more."""
    rng = random.Random(seed)
    n = rng.randint(3, 7)
    mu_d = Fraction(rng.choice([5, 50, 100, 300]), 1000)
    mu_s = mu_d + Fraction(rng.choice([20, 100, 300]), 1000)
    sigma = rng.choice(["0", "0.01"])
    chain = Chain(n, 1, mu_d, mu_s, sigma, tan_alpha=mu_d * Fraction(rng.randint(-9, 9), 10))
    unit = Fraction(chain.times_cosine(mu_s))
    tensions = [unit * Fraction(rng.randint(-150, 150), 100) for _ in range(n - 1)]
    tensions[rng.randrange(n - 1)] += extra
    return rearrange(chain, State.prepared(chain, tensions, seed=3), direction=0, seed=3, **options)


def edges(seeds: Iterable[int]) -> list[tuple[int, Fraction, Fraction]]:
    """Return seeds and stretches 4e-17 apart between which the itinerary changes."""
    found = []
    for seed in seeds:
        low, high = Fraction(0), Fraction(1, 100)
        first, last = stretched(seed, low), stretched(seed, high)
        longest = max(len(first.events), len(last.events))
        if first.itinerary == last.itinerary or not first.events or longest > 100:
            continue
        for _ in range(48):
            middle = (low + high) / 2
            if stretched(seed, middle).itinerary == first.itinerary:
                low = middle
            else:
                high = middle
        found.append((seed, low, high))
    return found


def test_where_the_itinerary_changes_it_is_in_doubt_or_right_on_either_side() -> None:
    doubts = set()
    places = edges([*range(60, 110), 152, 185, 296, 297])  # the last four stop, or all but
    assert len(places) >= 15
    for seed, low, high in places:
        both = [stretched(seed, low), stretched(seed, high)]
        assert Evidence.UNDECIDED in {result.evidence for result in both}
        for extra, result in zip((low, high), both, strict=True):
            if result.evidence is Evidence.UNDECIDED:
                doubts |= set(re.findall(r"slider \d+ (.*)", result.doubt))
                continue
            proved = stretched(seed, extra, solver="certified")
            assert result.itinerary == proved.itinerary
            assert error_of(result, proved) <= result.error
    assert doubts >= {
        "comes next to its threshold",
        "only just exceeds its threshold",
        "comes next to the one before",
        "stops next to its threshold",
        "all but stops",
        "stops with next to no deceleration",
    }
