"""When the amplified errors put the order of events in doubt; their size: `test_estimated`."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Event, EventKind, State, rearrange
from exactcreep.model.contacts import Contacts
from exactcreep.motion.amplified import LOST, MARGIN, amplified_error
from exactcreep.solvers.rearrangement import Rearrangement

ROUNDING = 2.0**-53


def slip(below: float) -> Rearrangement:
    """Return the slip of slider 2, which ends that far below the threshold of slider 1.

    Above the threshold slider 1 starts, too, with a force that hardly rises beyond it.
    """
    chain = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(below))
    return rearrange(chain, State.relaxed(chain), direction=1)


def estimated(
    result: Rearrangement, events: tuple[Event, ...], roundoff: float
) -> tuple[float, int]:
    contacts = Contacts(result.chain, result.seed)
    return amplified_error(result.chain, result.initial, events, contacts, roundoff)


@pytest.mark.parametrize(
    ("below", "roundoff", "doubt"),
    [
        (1e-3, ROUNDING, -1),
        (1e-3, 1e-8, -1),
        (1e-9, 1e-8, 1),  # slider 1 may start before slider 2 stops
        (-1e-6, ROUNDING, -1),
        (-1e-6, 1e-5, 1),  # slider 1 may not start
        (1e-3, LOST, 1),  # the error is no longer a small one
    ],
)
def test_an_order_is_in_doubt_from_the_event_on_whose_margin_is_within_its_error(
    below: float, roundoff: float, doubt: int
) -> None:
    result = slip(below)
    assert [event.sliders for event in result.events[:2]] == [(2,), (2,) if below > 0 else (1,)]
    error, number = estimated(result, result.events, roundoff)
    assert (number, error == np.inf) == (doubt, doubt >= 0)
    assert error >= MARGIN * roundoff


def test_what_a_slow_slider_has_left_to_go_is_an_error_of_its_place() -> None:
    result = slip(1e-3)
    start, stop = result.events
    early = Event(float(stop.time) - 1e-5, EventKind.STOP, stop.sliders, stop.signs)
    error, _ = estimated(result, (start, early), ROUNDING)
    left = result.chain.excess * 1e-10 / 2  # of a / 2 t**2, beside which the rounding is small
    assert error == pytest.approx(MARGIN * left, rel=1e-3)
    assert estimated(result, (), ROUNDING) == (0.0, -1)
