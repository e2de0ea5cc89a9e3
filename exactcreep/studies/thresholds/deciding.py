"""The condition that decides at an edge: of the first event in which two runs differ.

Up to that event everything is an explicit function of the amplitude: the run is followed again
along its itinerary, at any precision, and the condition to its root by the secant method. For lone
slips it is linear in the amplitude, and the root exact at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from typing import Any

from exactcreep.model.contacts import EventKind
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, Arithmetic, balls_of
from exactcreep.motion.itinerary import Retracer, StrayRoot
from exactcreep.quasistatic.decimals import enclosure
from exactcreep.studies.eventlog import LoggedEvent, LoggedRearrangement, first_difference
from exactcreep.studies.thresholds.horizon import ADVANCE, Question

_STRAY = 10**5  # widths of a float64 bracket that rounding may have put it off


class Condition:
    """A function of the amplitude, zero at the edge: of what a run is like along an itinerary.

    Parameters
    ----------
    question : Question
    of : callable
        Returns the number from a `_Rerun`.
    """

    def __init__(self, question: Question, of: Callable[[_Rerun], Any]) -> None:
        self.question = question
        self.of = of
        self.spans: list[Any] = []  # of the phases, at the amplitude before

    def __call__(self, amplitude: Fraction, bits: int) -> Fraction:
        """Return the number at `amplitude`, computed with so many bits."""
        balls = balls_of(bits)
        with balls.active():
            return enclosure(self.of(_Rerun(self.question, amplitude, balls, self.spans))).middle


def conditions(
    question: Question,
    log: list[LoggedRearrangement],
    one: list[LoggedEvent],
    other: list[LoggedEvent],
) -> Iterator[Condition]:
    """Yield the conditions that may decide between two runs, the likeliest first."""
    differs = first_difference(one, other)
    if differs is None:
        yield Condition(question, lambda rerun: rerun.advance(log))
        return
    _, a, b = differs
    begin = a or b
    assert begin is not None  # two runs that differ have an event that does
    earlier, later = (a, b) if b is None or (a is not None and _before(a, b)) else (b, a)
    assert earlier is not None
    same = later is not None and later.rearrangement == earlier.rearrangement
    if earlier.number == 0 and later is not None and same and later.number == 0:
        same = later.half_cycle == earlier.half_cycle
    rival = later if same else None
    if earlier.number == 0:
        yield Condition(question, lambda rerun: rerun.ramp(log, earlier, rival))
        return
    for event, partner in ((earlier, later), (later, earlier)):
        if event is not None and event.event.kind is EventKind.START:
            yield Condition(question, partial(_Rerun.margin, log=log, event=event, partner=partner))
    if rival is not None:
        yield Condition(question, lambda rerun: rerun.tie(log, earlier, rival))


def _before(a: LoggedEvent, b: LoggedEvent) -> bool:
    """Return whether `a`, which comes after the same events as `b`, comes before it."""
    if (a.half_cycle, a.rearrangement) != (b.half_cycle, b.rearrangement):
        return (a.half_cycle, a.rearrangement) < (b.half_cycle, b.rearrangement)
    return bool(a.event.time <= b.event.time)


def _starting(course: Retracer, place: LoggedEvent) -> Any:
    return course.starting_load(place.event.sliders[0] - 1, place.event.signs[0])


class _Rerun:
    """The run at one amplitude along a known itinerary, at the precision of an arithmetic."""

    def __init__(
        self, question: Question, amplitude: Fraction, arithmetic: Arithmetic, spans: list[Any]
    ) -> None:
        self.chain = question.chain
        self.limits = question.limits
        self.amplitude = amplitude
        self.half_cycles = question.half_cycles
        self.course = Retracer(question.chain, question.start, arithmetic, spans=spans)

    def target(self, half_cycle: int) -> Any:
        """Return ``l0 theta`` of a target."""
        way = 1 if half_cycle % 2 == 1 else -1
        return self.course.load_of(way * self.amplitude)

    def at_rest(self, log: list[LoggedRearrangement], count: int) -> Retracer:
        """Return the course after the first `count` rearrangements."""
        self._follow(1, log[:count])
        return self.course

    def _follow(self, half_cycle: int, log: list[LoggedRearrangement]) -> None:
        for one in log:
            self.limits.require()
            for passed in range(half_cycle, one.half_cycle):
                self.course.ramp(self.target(passed))
            half_cycle = one.half_cycle
            self.course.rearrange(one.events)

    def ramp(
        self, log: list[LoggedRearrangement], event: LoggedEvent, rival: LoggedEvent | None
    ) -> Any:
        """Return how far a start of a rearrangement is from `rival`, or from the ramp's end."""
        course = self.at_rest(log, event.rearrangement)
        end = self.target(event.half_cycle) if rival is None else _starting(course, rival)
        return _starting(course, event) - end

    def advance(self, log: list[LoggedRearrangement]) -> Any:
        """Return by how much the advance of the last cycle exceeds the limit."""
        first = sum(one.half_cycle <= self.half_cycles - 2 for one in log)
        begin = self.at_rest(log, first).travel.copy()
        self._follow(log[first - 1].half_cycle if first else 1, log[first:])
        way = -1 if self.chain.tan_alpha < 0 else 1
        moved = (self.course.travel - begin).sum() * way / self.chain.n
        return moved - self.course.arithmetic.number(ADVANCE)

    def margin(
        self, log: list[LoggedRearrangement], event: LoggedEvent, partner: LoggedEvent | None
    ) -> Any:
        """Return the least margin of the slider that `event` starts."""
        course = self.at_rest(log, event.rearrangement)
        shared = log[event.rearrangement].events[: event.number]
        flow = course.enter(shared)
        last = shared[-1]
        others = set() if partner is None else set(partner.event.sliders)
        slider, sign = next(
            (n - 1, s)
            for n, s in zip(event.event.sliders, event.event.signs, strict=True)
            if n not in others or partner is None or partner.event.kind is not EventKind.START
        )
        if last.kind is EventKind.STOP and slider + 1 in last.sliders:  # a reversal
            return course.threshold(slider) - sign * flow.forces[slider]
        return course.least_margin(flow, slider, sign, event.event.time - last.time)

    def tie(self, log: list[LoggedRearrangement], one: LoggedEvent, other: LoggedEvent) -> Any:
        """Return by how much time `one` comes before `other`."""
        course = self.at_rest(log, one.rearrangement)
        shared = log[one.rearrangement].events[: one.number]
        flow = course.enter(shared)
        runs = flow.runs()
        first, second = (
            course.time(flow, runs, place.event, place.event.time - shared[-1].time)
            for place in (one, other)
        )
        return first - second


def secant(
    condition: Callable[[Fraction, int], Fraction],
    low: Fraction,
    high: Fraction,
    digits: int,
    loss: int,
) -> Fraction | None:
    """Return the root of `condition` near the bracket to `digits` digits, None if there is none.

    The working precision follows the digits that are known.
    """
    wanted = digits * BITS_PER_DIGIT
    final = math.ceil(wanted) + loss
    width = high - low
    try:
        known = log2(high / width)
        if known >= wanted:
            return high
        bits = bits_before = min(final, math.ceil(3 * known) + loss)
        previous, before, present = low, condition(low, bits), high
        for _ in range(32):
            now = condition(present, bits)
            if now in (0, before):
                if bits == bits_before == final:
                    return present if now == 0 else None
                bits = bits_before = final
                before = condition(previous, bits)
                continue
            following = _rounded(present - now / (now - before) * (present - previous), final)
            if not low - _STRAY * width <= following <= high + _STRAY * width:
                return None
            if following == present:
                return present
            # the error of a point is the step from there; that of the slope is as large as the
            # bend makes it, or rounding
            bend, known = (log2(abs(following / (following - x))) for x in (previous, present))
            known += min(bend, bits_before - loss - bend)
            if known >= wanted + 16 and low < following < high:
                return following
            bits_before, bits = bits, max(bits, min(final, math.ceil(2 * known) + loss))
            previous, present, before = present, following, now
    except (StrayRoot, ArithmeticError, KeyError, StopIteration):
        pass
    return None


def _rounded(value: Fraction, bits: int) -> Fraction:
    """Return a number near `value` of about so many bits."""
    unit = Fraction(2) ** (value.numerator.bit_length() - value.denominator.bit_length() - bits)
    return round(value / unit) * unit


def log2(value: Fraction) -> float:
    """Return log2 of a positive rational, however large."""
    shift = value.numerator.bit_length() - value.denominator.bit_length()
    return shift + math.log2(value / Fraction(2) ** shift)
