"""First events: found, proved, or said to be undecided."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from exactcreep.motion.arithmetic import Undecided, balls_of
from exactcreep.motion.first_event import Search, root_time
from exactcreep.motion.modes import Flow

FRICTION = Fraction(1, 2)


def flow_of(arithmetic, forces, moving, velocities=None):
    """A flow with the given forces; `moving` maps sliders (from 0) to their directions."""
    flow = Flow(arithmetic, arithmetic.vector(forces), arithmetic.vector([FRICTION] * len(forces)))
    flow.start(list(moving), list(moving.values()))
    for n, velocity in (velocities or {}).items():
        flow.velocities[n] = arithmetic.number(velocity)
    return flow


def first_time(arithmetic, flow, thresholds, *, assume=False):
    search = Search(flow, flow.runs(), arithmetic.vector(thresholds), assume=assume)
    found = search.first()
    return found, root_time(search, found[0]), search


def test_a_graze_is_undecided_and_roots_closer_than_the_precision_are():
    """Slider 1 brings slider 2 exactly to its threshold; or two sliders stop almost together."""
    thresholds = [Fraction(3, 5)] * 5
    graze = [Fraction(3, 5), Fraction(2, 5), 0, 0, 0], {0: 1}
    with balls_of(100).active():
        flow = flow_of(balls_of(100), *graze)
        _, time, search = first_time(balls_of(100), flow, thresholds, assume=True)
        assert search.undecided > 0
        assert float(time) == pytest.approx(math.pi, rel=1e-7)
    apart = {0: Fraction(1, 3), 4: -Fraction(1, 3) - Fraction(1, 10**40)}
    pair = [Fraction(3, 5), 0, 0, 0, Fraction(-3, 5)], {0: 1, 4: -1}, apart
    for bits, case in ((200, graze), (100, pair)):
        balls = balls_of(bits)
        with balls.active(), pytest.raises(Undecided):
            first_time(balls, flow_of(balls, *case), thresholds)
    with balls_of(200).active():
        first = first_time(balls_of(200), flow_of(balls_of(200), *pair), thresholds)[0]
        assert [watch.slider for watch in first] == [4]
