"""Errors that are carried along: as two chains part that begin a little apart."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Event, Outcome, State, rearrange
from exactcreep.model.contacts import Contacts, EventKind
from exactcreep.motion import amplified
from exactcreep.motion.amplified import DIRECTIONS, MARGIN, amplified_error
from exactcreep.solvers.rearrangement import Rearrangement
from tests.paper import unstable_chain

PAIR = Chain(2, 1, "1/2", "3/5", tan_alpha="1/4")


def estimated(result: Rearrangement, roundoff: float = 2.0**-53) -> tuple[float, int]:
    contacts = Contacts(result.chain, result.seed)
    return amplified_error(result.chain, result.initial, result.events, contacts, roundoff)


def apart(result: Rearrangement, size: float, rng: np.random.Generator) -> float:
    """Return how far a chain whose forces are off by so much ends from a rearrangement."""
    off = rng.choice((-1.0, 1.0), result.chain.n) * size
    tensions = [float(t) + o for t, o in zip(result.initial.tensions, np.cumsum(off), strict=False)]
    start = replace(result.initial, tensions=np.array(tensions))
    other = rearrange(result.chain, start, direction=0, seed=result.seed)
    assert other.itinerary == result.itinerary
    away = other.state.displacements - result.state.displacements
    return float(max(abs(away).max(), abs(np.diff(away)).max()))


def test_errors_grow_as_two_chains_part_that_begin_a_little_apart() -> None:
    rng, signs, ratios = random.Random(4), np.random.default_rng(4), []
    while len(ratios) < 30:
        chain, state = unstable_chain(rng)
        result = rearrange(chain, state, direction=0, seed=3)
        if result.outcome is not Outcome.AT_REST or result.undecided:
            continue
        if 10 <= len(result.events) <= 60:
            size = 2.0**-40  # 1e-12: far above the rounding of both chains
            forces = np.diff([0.0, *result.initial.tensions, 0.0]) + chain.sin_alpha
            error, number = estimated(result, size / 2 / (abs(forces).max() + chain.friction))
            if number < 0:
                ratios.append(max(apart(result, size, signs) for _ in range(DIRECTIONS)) / error)
    assert max(ratios) < 1
    assert np.median(ratios) > 1 / (20 * MARGIN)


def slip(shift: float = 0.0) -> Rearrangement:
    """Return the lone slip of slider 2, which ends that far from the threshold of slider 1."""
    chain = replace(PAIR, tan_alpha=Fraction(1, 2) - Fraction(shift))
    return rearrange(chain, State.relaxed(chain), direction=1)


@pytest.mark.parametrize(("shift", "open_"), [(1e-3, False), (1e-9, True)])
def test_a_margin_within_its_error_puts_the_order_in_doubt(shift: float, open_: bool) -> None:
    """Slider 2 stops just before it would start slider 1."""
    error, number = estimated(slip(shift), 1e-8)
    assert (number, error == np.inf) == ((1, True) if open_ else (-1, False))


def test_a_graze_is_in_doubt_when_it_may_have_been_none() -> None:
    """A start whose force hardly rises beyond the threshold, and a speed that all but vanishes."""
    chain = Chain(2, 1, "0.5", "0.6", tan_alpha=Fraction(1, 2) + Fraction(1, 10**6))
    result = rearrange(chain, State.relaxed(chain), direction=1)
    assert [event.sliders for event in result.events[:2]] == [(2,), (1,)]
    assert estimated(result, 1e-5) == (np.inf, 1)
    assert estimated(result)[1] == -1


def test_what_a_slow_slider_has_left_to_go_is_an_error_of_its_place() -> None:
    result = slip(1e-3)
    start, stop = result.events
    early = Event(float(stop.time) - 1e-5, EventKind.STOP, stop.sliders, stop.signs)
    error, _ = estimated(replace_events(result, (start, early)))
    left = result.chain.excess * 1e-10 / 2  # of a / 2 t**2, beside which the rounding is small
    assert error == pytest.approx(MARGIN * left, rel=1e-3)


def replace_events(result: Rearrangement, events: tuple[Event, ...]) -> Rearrangement:
    return Rearrangement(
        chain=result.chain, initial=result.initial, events=events, seed=result.seed
    )


def test_an_error_that_is_no_longer_small_is_lost() -> None:
    error, number = estimated(slip(1e-3), amplified.LOST)
    assert (error, number) == (np.inf, 1)


def test_the_roundings_of_one_step_are_in_the_error_whatever_cancels() -> None:
    assert estimated(slip(1e-3))[0] >= MARGIN * 2.0**-53
    still = replace_events(slip(), ())
    assert estimated(still) == (0.0, -1)
