"""The rules of the model at starts, stops and ties, written once for every kind of number.

A slider at rest stays while ``|F| <= mu_s c``; a moving slider feels ``mu_d c`` against its motion.
A start, a stop or the end of a ramp is a comparison, and a rule says what follows from it. Other
modules say how a chain begins (`chain.first_start`), which coefficient acts (`model.contacts`),
when the chain runs away (`motion.runaway`), and which chains have no slips (`Chain.slides`).

The rules use ``sign(x, slack)``, which returns -1, 0 or +1, and whether this is in doubt: `x` may
be off by `slack`, and a number that may be zero counts as zero. For floats the rules are compiled
(`FLOATS`). Rationals, balls and sets provide their own sign, which may raise. Every rule returns
its answer, and whether the answer is in doubt.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from exactcreep.compiling import merged


class Rules(NamedTuple):
    """The rules over one kind of number; see `rules`."""

    start_direction: Callable[..., tuple[int, bool]]
    reversal: Callable[..., tuple[int, bool]]
    is_before: Callable[..., tuple[bool, bool]]
    order: Callable[..., tuple[int, bool]]
    leaves: Callable[..., tuple[bool, bool]]
    driven: Callable[..., tuple[Any, bool]]


def rules(sign: Any, compiled: Any = lambda rule: rule) -> Rules:
    """Return the rules over numbers with this sign; `compiled` may compile them."""

    @compiled
    def start_direction(force, threshold, slack):
        """Return the direction in which a slider at rest starts; 0: at threshold it stays."""
        down, close = sign(force - threshold, slack)
        if down > 0:
            return 1, False
        up, closer = sign(-force - threshold, slack)
        if up > 0:
            return -1, False
        return 0, close or closer

    @compiled
    def reversal(force, threshold, way, slack):
        """Return the direction in which a slider starts that has just stopped on its way.

        It can only go back, against its new threshold: friction has slowed it down, so the force
        along its way is at most ``mu_d c``, which every contact holds.
        """
        back, close = sign(-way * force - threshold, slack)
        return (-way if back > 0 else 0 * way), close

    @compiled
    def is_before(room, end, slack):
        """Return whether a slider with this room starts before the end of the motion.

        `end` is the length of the motion, to the target of a ramp or to a stop. A slider that
        reaches its threshold exactly at the end stays.
        """
        left, close = sign(end - room, slack)
        return left > 0, close

    @compiled
    def order(one, other, slack):
        """Return which comes first: -1 `one`, +1 `other`, 0 both together as one event.

        On a ramp every slider with a rate has its own theta at threshold; in an avalanche every
        event has its own time. The first of them happen, stops and starts alike. A search compares
        ranges of times. Events come together if their ranges overlap and cannot be narrowed.
        """
        return sign(one - other, slack)

    @compiled
    def leaves(lead, moves, slack):
        """Return whether a slider exactly at its limit acts at once: stops, or starts from rest.

        It is at its limit as a motion begins, or it touches its limit in passing (`lead` is 0).
        `lead` is the first non-zero derivative of its event function, positive if the slider does
        not act. The event function is the speed of a slider that has started, or the distance of
        the force on a resting slider from its threshold. If all derivatives are zero, a moving
        slider stops (a slip of length zero, after which it draws), and a resting slider stays.
        """
        inwards, close = sign(lead, slack)
        return inwards < 0 or (moves and inwards == 0), close

    @compiled
    def driven(rate, way):
        """Return the direction in which a ramp `way` drives a slider whose force has this rate."""
        up, close = sign(rate, 0)
        return up * way, close

    return Rules(start_direction, reversal, is_before, order, leaves, driven)


def in_turn(freeze: Any, draw: Any, test: Any, compiled: Any = lambda rule: rule) -> Any:
    """Return a function that processes the sliders of an event, in ascending order.

    It freezes all sliders that stop, lets each of them draw, and then tests all of them with the
    same forces.
    """

    @compiled
    def resolve(sliders, *chain):
        for n in sliders:
            freeze(n, *chain)
        for n in sliders:
            draw(n, *chain)
        for n in sliders:
            test(n, *chain)

    return resolve


@merged
def _sign(x, slack):
    if x > slack:
        return 1, False
    if x < -slack:
        return -1, False
    return 0, slack > 0.0


FLOATS = rules(_sign, merged)
"""The rules over floats; only compiled code can call them."""
