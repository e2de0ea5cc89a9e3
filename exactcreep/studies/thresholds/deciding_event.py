"""The amplitude at which two runs part, from the first event in which they differ.

Every rearrangement begins with an end of the chain at its threshold, and the forces add up to N s:
along one itinerary neither theta_c nor what follows depends on the amplitude. The amplitude decides
one thing alone: whether theta turns before it comes to the next theta_c. So the runs part where the
amplitude is that theta_c, and one run along the itinerary, at any precision, tells it.
"""

from __future__ import annotations

import math
from fractions import Fraction

from exactcreep.model.enclosure import exact_value
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, balls_of
from exactcreep.motion.itinerary import Retracer
from exactcreep.studies.event_log import LoggedRearrangement, first_difference, numbered
from exactcreep.studies.thresholds.horizon import Question

_BITS_LOST = 64  # and a quarter of one for every event


def deciding_amplitude(
    question: Question,
    one: list[LoggedRearrangement],
    other: list[LoggedRearrangement],
    digits: int,
) -> Fraction | None:
    """Return the amplitude at which two runs part to `digits` digits, None if rounding parts them.

    Beyond it they may part once more, and the edge lie further on.
    """
    differs = first_difference(numbered(one), numbered(other))
    if differs is None:
        return None
    shared, *sides = differs
    event = min((side for side in sides if side is not None), key=lambda side: side[:2])
    if event.number:
        return None
    arithmetic = balls_of(math.ceil(digits * BITS_PER_DIGIT) + _BITS_LOST + shared // 4)
    try:
        with arithmetic.active():
            course = Retracer(question.chain, question.start, arithmetic)
            for rearrangement in one[: event.rearrangement]:
                question.limits.require()
                course.rearrange(rearrangement.events)
            load = course.starting_load(event.event.sliders[0] - 1, event.event.signs[0])
    except (ArithmeticError, KeyError):  # it is the itinerary of no chain: rounding had made it
        return None
    way = 1 if event.half_cycle % 2 else -1
    return way * exact_value(load) / question.chain.l0
