"""When the amplified errors put the order of events in doubt; their size: `test_estimated`."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, State, rearrange
from exactcreep.model.contacts import Contacts
from exactcreep.motion.amplified import LOST, MARGIN, amplified_error
from exactcreep.results import Event, EventKind
from exactcreep.solvers.rearrangement import Rearrangement

ROUNDING = 2.0**-53


def slip(below: float) -> Rearrangement:
    """Return the slip of slider 2, which ends that far below the threshold of slider 1.

    Above the threshold slider 1 starts, too, with a force that hardly rises beyond it.
    """
    chain = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(below))
    start = State.relaxed(chain)
    return rearrange(chain, start, direction=1, solver="certified", max_events=6)


def estimated(result: Rearrangement, events: tuple[Event, ...]) -> tuple[float, int]:
    rounded = [replace(event, time=float(event.time)) for event in events]
    contacts = Contacts(result.chain, result.seed)
    return amplified_error(result.chain, result.initial, rounded, contacts)


@pytest.mark.parametrize(
    ("below", "doubt"),
    [
        (1e-3, -1),
        (1e-14, -1),
        (5e-16, 1),  # slider 1 may start before slider 2 stops
        (-1e-3, -1),
        (-1e-14, -1),
        (-5e-16, 1),  # slider 1 may not start
    ],
)
def test_an_order_is_in_doubt_from_the_event_on_whose_margin_is_within_its_error(
    below: float, doubt: int
) -> None:
    result = slip(below)
    assert [event.sliders for event in result.events[:2]] == [(2,), (2,) if below > 0 else (1,)]
    error, number = estimated(result, result.events)
    assert (number, error == np.inf) == (doubt, doubt >= 0)
    assert error >= MARGIN * ROUNDING


@pytest.mark.parametrize("early", [1e-5, 0.2])
def test_what_a_slow_slider_has_left_to_go_is_an_error_of_its_place(early: float) -> None:
    result = slip(1e-3)
    start, stop = result.events
    stopped = Event(float(stop.time) - early, EventKind.STOP, stop.sliders, stop.signs)
    left = result.chain.excess * early**2 / 2  # beside which the rounding is small
    error, number = estimated(result, (start, stopped))
    if left < LOST:
        assert (error, number) == (pytest.approx(MARGIN * left, rel=1e-3), -1)
    else:  # the error is no longer a small one
        assert (error, number) == (np.inf, 1)
    assert estimated(result, ()) == (0.0, -1)
