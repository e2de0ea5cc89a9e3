"""The closed form of a rearrangement, made from its events: runs move from instant to instant."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.enclosure import same
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import Flow, ModalPiece, forces_of, frictions_of, loads_of
from exactcreep.motion.solution import Motion, Solution


def solution_of(
    chain: Chain, initial: State, events: Sequence[Event], arithmetic: Arithmetic = FLOAT64
) -> Solution:
    """Return the motion that events describe, from `initial`, at rest at theta_c, to the last one.

    It must be called inside the arithmetic's `active`. Guarantee: between events the motion is the
    closed form for the given event times, in float64 to a few ulp of the largest displacement
    since; in balls an enclosure.
    """
    tensions = arithmetic.vector(initial.tensions)
    forces = forces_of(arithmetic, tensions, loads_of(arithmetic, chain))
    places = arithmetic.vector(initial.displacements)
    start = Motion(places, arithmetic.zeros(chain.n), forces)
    times = [arithmetic.number(0)]
    for event in events:
        if not same(time := arithmetic.number(event.time), times[-1]):
            times.append(time)

    return Solution(partial(_pieces, chain, start, events, times, arithmetic), start, times)


def _pieces(
    chain: Chain, start: Motion, events: Sequence[Event], times: list[Any], arithmetic: Arithmetic
) -> list[ModalPiece]:
    out: list[ModalPiece] = []
    with arithmetic.active():
        flow = Flow(arithmetic, start.forces, frictions_of(arithmetic, chain))
        for event in events:
            now = times[len(out)]
            if not same(time := arithmetic.number(event.time), now):
                runs = flow.runs()
                out.append(flow.piece(now, time, start, runs))
                flow.move(runs, time - now)
            sliders = [slider - 1 for slider in event.sliders]
            if event.kind is EventKind.START:
                flow.start(sliders, event.signs)
            else:
                flow.stop(sliders)
    return out
