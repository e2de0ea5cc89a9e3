"""Ties and grazes of chains that no float decides: the same in every arithmetic, and told."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, Evidence, State, creep, rearrange
from tests.paper import captions

each_solver = pytest.mark.parametrize("solver", ["exact", "reference", "mpmath", "certified"])


def run(chain: Chain, amplitude: Any, solver: str) -> Creep:
    """Return a cycle, in which events come together."""
    found = creep(chain, Cycles(amplitude, 1), solver=solver, record=("x", "events"))
    proved = solver == "certified"
    assert found.evidence is (Evidence.PROVED if proved else Evidence.UNDECIDED)
    assert (found.undecided == 0) == proved
    return found


@each_solver
@pytest.mark.parametrize("n", [2, 5])
def test_identical_motions_are_one_event_and_stay_identical(n: int, solver: str) -> None:
    found = run(captions(n, tan_alpha=0), Fraction(n, 500), solver)
    x = found.recorded["x"].astype(object).astype(float)
    assert (x == -x[:, ::-1]).all()
    assert abs(x).max() > 1
    counted = np.bincount(found.recorded["event_slider"], minlength=n + 1)
    assert counted[1] == counted[n] > 0


@each_solver
@pytest.mark.parametrize("k", [3, 6, 12])
def test_every_grazing_crossing_is_found(k: int, solver: str) -> None:
    """Slider 1 is beyond its threshold only for a short time around pi."""
    chain = captions(2, tan_alpha=Fraction(1, 2) + Fraction(1, 10**k))
    start = State.relaxed(chain)
    found = rearrange(chain, start, direction=1, solver=solver, max_events=12)
    assert found.itinerary[:2] == (("start", (2,), (1,)), ("start", (1,), (1,)))
    gap = math.pi - float(found.events[1].time)
    assert gap == pytest.approx(2 * math.sqrt(10 * 10.0**-k), rel=0.1)
    assert (found.evidence is Evidence.PROVED) == (solver == "certified")
