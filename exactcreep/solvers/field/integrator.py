"""The readable event solver: a chain from rest to rest, in balls.

*Decompose* the moving sliders into runs. Find the *first event* among their stops and the starts of
their neighbours. *Move* to it by the closed form. *Resolve* it by the rules. *Repeat* until
every slider is at rest.

`solvers.field.at_rest` treats rest and ramps, and `motion.runaway` proves that an avalanche never
ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from fractions import Fraction
from functools import partial
from typing import Any

import flint
from numpy.typing import NDArray

from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.rules import in_turn
from exactcreep.motion.arithmetic import Balls, objects
from exactcreep.motion.first_event import (
    FirstEvent,
    Search,
    SearchLimit,
    Shifts,
    lone_slips,
    root_time,
)
from exactcreep.motion.modes import Flow, Run
from exactcreep.motion.runaway import escape_time
from exactcreep.solvers.field.at_rest import ChainAtRest, Rest
from exactcreep.solvers.interface import Start
from exactcreep.watch.limits import NO_LIMITS


class ChainIntegrator(ChainAtRest):
    """A chain that goes through rearrangements event by event; for arguments see `ChainAtRest`."""

    def __init__(self, start: Start, arithmetic: Balls, *, assume: bool = False) -> None:
        super().__init__(start, arithmetic, assume=assume)
        self.flow: Flow | None = None
        self._runs: list[Run] | None = None
        self.time: Any = arithmetic.number(0)
        self.ramped = False  # whether a ramp has taken the first sliders to their threshold
        self.announced = True
        self.event_number = 0
        self.runaway = False
        self.limits = NO_LIMITS

    def _set_off(self, starts: list[tuple[int, int]], *, ramped: bool) -> None:
        self.time = self.arithmetic.number(0)
        self.flow = Flow(self.arithmetic, self.rest.forces, self.frictions)
        self.flow.moved[:] = 0  # exactly
        self.ramped = ramped
        self.announced = False
        self.event_number = 0
        self.tally.rearrangements += 1
        self.flow.start(*zip(*starts, strict=True))

    def rearrangement(self) -> Iterator[Event | None]:
        """Yield the events of the present rearrangement, and None after the events of each instant.

        A caller may stop only at None, and continue later; otherwise an event is half resolved.
        """
        if self.flow is not None and not self.announced:
            self.announced = True
            sliders = self.flow.moving
            signs = self.flow.signs[sliders].tolist()
            yield self._event(EventKind.START, sliders, signs)
            yield None
        while self.flow is not None and not self.runaway:
            self._runs = None
            event = self.steadily(self._to_event)
            if event is None:
                self.runaway = True
                return
            yield from self.resolve(self.flow, event)
            if not self.flow.moving:
                self.steadily(self._to_rest)
            yield None

    def _to_event(self) -> FirstEvent | None:
        assert self.flow is not None
        event = self.first_event(self.flow)
        if event is not None:
            self.move(self.flow, event)
        return event

    def _to_rest(self) -> None:
        assert self.flow is not None
        self.come_to_rest(self.flow)

    def steadily(self, step: Callable[[], Any]) -> Any:
        """Return what a step computes, unspoilt by other threads; see `Balls.steadily`."""
        return self.arithmetic.steadily(step, self._snapshot, self._widths)

    def _snapshot(self) -> Callable[[], None]:
        """Return a function that undoes what happens from now on."""
        kept, tally = _copied(vars(self)), self.tally

        def undo() -> None:
            vars(self).update(_copied(kept))
            vars(tally).update(vars(self.tally))
            self.rest.tally = tally

        return undo

    def _widths(self) -> tuple[float, int]:
        """Return the largest radius of the present numbers, and the comparisons settled so far."""
        rest, flow = self.rest, self.flow
        numbers = [*rest.displacements, rest.theta, *rest.tensions]
        of = [rest.forces] if flow is None else [flow.forces, flow.velocities, flow.moved]
        numbers += [x for vector in of for x in vector.tolist()]
        radii = [float(x.rad()) for x in numbers if type(x) is flint.arb]
        return max(radii, default=0.0), self.tally.undecided

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event from here on; None if the chain has run away."""
        symmetric, horizon = self.rest.symmetric, None
        slips = lone_slips(flow, self.thresholds, self.rules, self.ask, symmetric=symmetric)
        if slips is not None:
            return slips
        if len(flow.moving) == self.chain.n:
            cosine = self.field.times_cosine(Fraction(1))
            horizon = escape_time(flow, self.runs[0], self.chain, cosine)
            if horizon is not None and bool(horizon == 0):
                return None
        search = Search(
            flow, self.runs, self.thresholds,
            assume=self.assume, half=symmetric, limits=self.limits,
        )  # fmt: skip
        first = search.first(horizon)
        if not first:
            if horizon is None:
                raise SearchLimit("nothing ever happens, and no bound proves it")
            flow.move(self.runs, horizon)
            self.time = self.time + horizon
            return None
        time = root_time(search, first[0])
        self.rest.evaluations += search.evaluations
        self.tally.undecided += search.undecided
        stops = [root.slider for root in first if root.side == 0]
        starts = [(root.slider, root.side) for root in first if root.side != 0]
        return event_of(time, stops, starts, self.chain.n if symmetric else None)

    def move(self, flow: Flow, event: FirstEvent) -> None:
        """Let the sliders move to the event."""
        if bool(event.time == 0):
            return
        later = self.time + event.time
        if event.shifts is None:
            flow.move(self.runs, event.time)
        for first, displacements, velocities in event.shifts or ():
            flow.shift(first, objects(displacements))
            flow.velocities[first : first + len(velocities)] = velocities
        if self.rest.symmetric:
            flow.mirror()
        self.time = later

    def resolve(self, flow: Flow, event: FirstEvent) -> Iterator[Event]:
        """Yield the stops and the starts of an event, by the rules of the model."""
        stops, starts = sorted(event.stops), dict(event.starts)
        ways = {n: int(flow.signs[n]) for n in stops}

        def test(n: int) -> None:
            of = flow.forces[n], self.thresholds[n], ways[n], 0
            if turned := self.steadily(partial(self.ask, self.rules.reversal, *of)):
                starts[n] = turned

        if stops:
            in_turn(lambda n: flow.stop([n]), self._draw, test)(stops)
            self.tally.slips += len(stops)
            for n in stops:
                self.rest.slips[n] += 1
            yield self._event(EventKind.STOP, stops, list(ways.values()))
        if starts:
            for n, sign in event.starts:  # exactly at threshold
                flow.forces[n] = sign * self.thresholds[n]
            sliders = sorted(starts)
            flow.start(sliders, [starts[n] for n in sliders])
            yield self._event(EventKind.START, sliders, [starts[n] for n in sliders])

    def come_to_rest(self, flow: Flow) -> None:
        """Make the present state a state of rest."""
        rest = self.rest
        rest.tensions, rest.displacements = self._shape()
        rest.forces = flow.forces
        self.flow = None
        self.shorten()

    @property
    def runs(self) -> list[Run]:
        """The runs of moving sliders since the last event; not needed for a lone slip."""
        if self._runs is None:
            assert self.flow is not None
            self._runs = self.flow.runs()
        return self._runs

    def _event(self, kind: EventKind, sliders: list[int], signs: list[int]) -> Event:
        self.tally.events += 1
        self.event_number += 1
        numbers = tuple(n + 1 for n in sliders)
        return Event(self.time, kind, numbers, tuple(signs))

    def _draw(self, n: int) -> None:
        rest = self.rest
        drawn = self.contacts.coefficient(n + 1, int(rest.draws[n]))
        rest.draws[n] += 1
        rest.coefficients[n] = float(drawn)
        rest.tally.draws_below_mu_d += self.contacts.is_low(n, drawn)
        self.thresholds[n] = self.held(n)

    # -- the present state ---------------------------------------------------------------------

    def _shape(self) -> tuple[NDArray[Any], NDArray[Any]]:
        if (flow := self.flow) is None:
            return super()._shape()
        displacements = self.rest.displacements.copy()
        for n in flow.touched:
            displacements[n] = displacements[n] + flow.moved[n]
        return self._strained(flow), displacements

    def _strained(self, flow: Flow) -> NDArray[Any]:
        """Return the present tensions."""
        tensions = self.rest.tensions.copy()
        first, last = max(min(flow.touched) - 1, 0), max(flow.touched) + 1
        moved = flow.moved[first : last + 1]
        tensions[first:last] = tensions[first:last] + (moved[1:] - moved[:-1])
        return tensions

    def velocities(self) -> NDArray[Any]:
        """Return the present velocities."""
        if self.flow is None:
            return self.arithmetic.zeros(self.chain.n)
        return self.flow.velocities.copy()

    def known_moves(self) -> NDArray[Any]:
        """Return the displacements in this rearrangement, as precisely as they are known."""
        assert self.flow is not None
        return self.flow.moved

    def go_on_from(self, rest: Rest) -> None:
        super().go_on_from(rest)
        self.flow = None


def _copied(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an object, with copies of those that change in place."""
    copies = {name: x.copy() if hasattr(x, "copy") else x for name, x in values.items()}
    if isinstance(flow := copies.get("flow"), Flow):
        copies["flow"] = copy(flow)
        vars(copies["flow"]).update(_copied(vars(flow)))
    return copies


def event_of(
    time: Any,
    stops: list[int],
    starts: list[tuple[int, int]],
    image_of: int | None,
    shifts: Shifts | None = None,
) -> FirstEvent:
    """Return the event of these sliders, and of their images in a chain of `image_of` sliders."""
    if image_of is not None:
        stops += [image_of - 1 - n for n in stops]
        starts += [(image_of - 1 - n, -sign) for n, sign in starts]
    return FirstEvent(time, tuple(sorted(stops)), tuple(sorted(starts)), shifts)
