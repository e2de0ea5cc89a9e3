"""Long clusters, in which every part keeps the series of its own last change."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy

import numpy as np
import pytest

from exactcreep import Chain, Cycles, State
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.watch.limits import Limits
from tests.paper import event_rows, paper_chain

AMPLITUDES = {300: "0.05", 1000: "0.166"}
"""A third above Eq. 22."""
ROWS = 400
"""Events compared from one state: rounding grows tenfold in some hundreds."""


def simulation(chain: Chain) -> ExactSimulation:
    return ExactSimulation(chain, State.relaxed(chain, 3), 3, ("events",))


def rows(found: ExactSimulation, events: int) -> list[tuple[int, ...]]:
    """Go on for so many events or a few more, and return them."""
    drive = Cycles(AMPLITUDES[found.chain.n], 10**6)
    first = int(found.work.now["counts"]["target"][0])
    return event_rows(found.follow(drive, first, 100, Limits(events)))


def pairs(chain: Chain, count: int, events: int) -> Iterator[tuple[ExactSimulation, ...]]:
    """Yield pairs in one state, every so many events of a run; the second expands all."""
    run = simulation(chain)
    clock = run.work.clock
    run.work = run.work._replace(clock=None)
    for _ in range(count):
        rows(run, events)
        one, other = deepcopy(run), deepcopy(run)
        one.work = one.work._replace(clock=clock.copy())
        yield one, other


@pytest.mark.parametrize(("n", "sigma_mu", "count"), [(300, "0.01", 8), (1000, "0", 5)])
def test_far_apart_events_and_all_sliders_between_them_are_those_of_the_whole_window(
    n: int, sigma_mu: str, count: int
) -> None:
    inside = 0
    for pair in pairs(paper_chain(n, sigma_mu), count, 50_000):
        told: tuple[list[tuple[int, ...]], ...] = ([], [])
        for _ in range(10):
            for found, events in zip(pair, told, strict=True):
                events += rows(found, ROWS // 10)
            shared = min(map(len, told))
            assert told[0][:shared] == told[1][:shared]
            if len(told[0]) == len(told[1]):
                here, there = (found.state().displacements for found in pair)
                assert np.abs(here - there).max() < 1e-10
                inside += int(pair[0].work.now["epoch"]["on"][0])
        assert shared >= ROWS
    assert inside > 5
