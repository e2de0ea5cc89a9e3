"""A chain taken along an itinerary that is known, at any number of digits.

Once the order of events is known everything is explicit: theta_c is linear in the forces, and each
event time is a simple root whose float64 value starts Newton's method. What is missing beside a
solver is the search: nothing here proves that no other event comes first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic
from exactcreep.motion.modes import Flow, Run
from exactcreep.motion.replay import Replay

_BEND = 32
"""log2 of how strongly conditions may bend, half their second derivative over the slope."""


class StrayRoot(ArithmeticError):
    """Newton's method left the neighbourhood of the event it was to refine."""


class Retracer:
    """A chain at rest, on its way along a known itinerary.

    Parameters
    ----------
    chain : Chain
    start : State
    arithmetic : Arithmetic
    seed : int
        Keys the static coefficients.
    refine : bool
        Whether event times are refined, or taken as they are.

    Attributes
    ----------
    state : State
        At rest, at the present theta; in the numbers of `arithmetic`.
    load : number
        ``l0 theta``.
    """

    def __init__(
        self,
        chain: Chain,
        start: State,
        arithmetic: Arithmetic,
        *,
        seed: int = 0,
        refine: bool = True,
    ) -> None:
        self.chain = chain
        self.arithmetic = arithmetic
        self.contacts = Contacts(chain, seed)
        self.refine = refine
        self.load = arithmetic.number(chain.l0) * arithmetic.number(start.theta)
        self.begins = True  # nothing has happened yet: it may be unstable as it stands
        self._rest(start)

    def _rest(self, state: State, events: Iterable[Event] = ()) -> None:
        self.state = state
        self.replay = Replay(self.chain, state, events, self.arithmetic, self.contacts)

    @property
    def travel(self) -> NDArray[Any]:
        """Displacements since the start, shape (n,)."""
        return self.state.displacements

    def unstable(self) -> bool:
        """Return whether a slider exceeds its threshold, by more than rounding, at the start."""
        rounding = 1 + self.arithmetic.number(self.arithmetic.roundoff) * 2**16
        return self.begins and any(
            bool(abs(force) > self.threshold(n) * rounding)
            for n, force in enumerate(self.replay.flow.forces.tolist())
        )

    def load_of(self, theta: Fraction) -> Any:
        """Return ``l0 theta``."""
        return self.arithmetic.number(self.chain.l0 * theta)

    def threshold(self, slider: int) -> Any:
        """Return the force that holds a slider (from 0) at rest at present."""
        return self.replay.threshold(slider)

    def ramp(self, load: Any) -> None:
        """Take theta to ``load / l0``."""
        tensions = self.arithmetic.vector(self.state.tensions) - (load - self.load)
        theta = load / self.arithmetic.number(self.chain.l0)
        self.load = load
        self._rest(replace(self.state, tensions=tensions, theta=theta))

    def starting_load(self, slider: int, sign: int) -> Any:
        """Return ``l0 theta_c`` at which the end slider `slider` (from 0) starts with `sign`."""
        room = sign * self.threshold(slider) - self.replay.flow.forces[slider]
        return self.load - room if slider == 0 else self.load + room

    def enter(self, events: Sequence[Event]) -> Flow:
        """Return the flow just after the last of `events`, which begin a rearrangement.

        Unless the chain is unstable as it stands, theta first goes to the first event's theta_c.
        """
        if not self.unstable():
            self.ramp(self.starting_load(events[0].sliders[0] - 1, events[0].signs[0]))
        self.begins = False
        self._rest(self.state, events)
        flow = self.replay.flow
        for phase in self.replay:
            if phase.lasts and self.refine:
                phase.span = self.time(flow, phase.runs, phase.events[0], float(phase.span))
            phase.arrive()
            for numbers in (flow.forces, flow.velocities, flow.moved):  # a course is one of points
                numbers[:] = [self.arithmetic.midpoint(x) for x in numbers.tolist()]
        return flow

    def rearrange(self, events: Sequence[Event]) -> None:
        """Go through a whole rearrangement."""
        self.enter(events)
        self._rest(self.replay.state())

    def time(self, flow: Flow, runs: Sequence[Run], event: Event, guess: Any) -> Any:
        """Return the time from now on at which the condition of `event` holds."""
        slider, sign = event.sliders[0] - 1, event.signs[0]
        if event.kind is EventKind.STOP:
            return self._root(lambda t: slider_motion(runs, slider, t)[1:], guess)
        return self._root(lambda t: self.margin(flow, runs, slider, sign, t), guess)

    def margin(
        self, flow: Flow, runs: Sequence[Run], slider: int, sign: int, t: Any
    ) -> tuple[Any, Any]:
        """Return ``mu_s c - sign F`` of a resting slider (from 0) at `t`, and its derivative."""
        value, slope = self.threshold(slider) - sign * flow.forces[slider], 0
        for n in (slider - 1, slider + 1):
            if any(n in run.sliders for run in runs):
                shift, velocity, _ = slider_motion(runs, n, t)
                value = value - sign * shift
                slope = slope - sign * velocity
        return value, slope

    def _root(self, condition: Any, guess: Any) -> Any:
        """Return the root of `condition` (value and slope) near `guess`, by Newton's method."""
        bits, midpoint = self.arithmetic.bits, self.arithmetic.midpoint
        t = expected = self.arithmetic.number(guess)
        half = self.arithmetic.number(2) ** -bits  # squares: half the bits are right
        last = None
        for _ in range(12 + 2 * bits.bit_length()):
            value, slope = condition(t)
            if slope == 0:
                raise StrayRoot("the condition of an event is level at its time")
            step = midpoint(value / slope)
            t = midpoint(t - step)
            size = step * step
            # the error after a step is the step's square, but for the bend of the condition
            if size < half and ((last is not None and size >= last) or size * 4**_BEND < half):
                return t
            if abs(t - expected) > 0.5:
                break
            last = size
        raise StrayRoot("no event near the time at which it is known to happen")


def slider_motion(runs: Sequence[Run], slider: int, t: Any) -> tuple[Any, Any, Any]:
    """Return displacement, velocity and acceleration of a moving slider (from 0) after `t`."""
    for run in runs:
        if slider in run.sliders:
            moved: tuple[Any, Any, Any] = run.motion.slider(slider - run.first, t)
            return moved
    raise KeyError(slider)
