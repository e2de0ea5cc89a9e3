"""The condition that decides at an edge: of the first event in which two runs differ.

Up to that event everything is an explicit function of the amplitude: the run is followed again
along its itinerary, at any precision, and the condition to its root by the secant method. For lone
slips it is linear in the amplitude, and the root exact at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any

from exactcreep.model.contact import EventKind
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, digits_of
from exactcreep.motion.itinerary import Course, StrayRoot
from exactcreep.quasistatic.decimals import enclosure
from exactcreep.studies.eventlog import LoggedEvent, LoggedRearrangement, first_difference
from exactcreep.studies.thresholds.horizon import ADVANCE, Question

_STRAY = 10**5  # widths of a float64 bracket that rounding may have put it off

Condition = Callable[[Fraction, int], Any]
"""A function of the amplitude and of the working precision in bits, zero at the edge."""


def conditions(
    question: Question,
    log: list[LoggedRearrangement],
    one: list[LoggedEvent],
    other: list[LoggedEvent],
) -> Iterator[Condition]:
    """Yield the conditions that may decide between two runs, the likeliest first."""
    differs = first_difference(one, other)

    def advance(amplitude: Fraction, bits: int) -> Any:
        return _Rerun(question, amplitude, bits).advance(log)

    if differs is None:
        yield advance
        return
    _, a, b = differs
    begin = a or b
    assert begin is not None  # two runs that differ have an event that does
    earlier, later = (a, b) if b is None or (a is not None and _before(a, b)) else (b, a)
    assert earlier is not None
    same = later is not None and later.rearrangement == earlier.rearrangement
    if earlier.number == 0 and later is not None and same and later.number == 0:
        same = later.half_cycle == earlier.half_cycle
    if earlier.number == 0:

        def ramp(amplitude: Fraction, bits: int) -> Any:
            rerun = _Rerun(question, amplitude, bits)
            course = rerun.at_rest(log, earlier.rearrangement)
            first = _starting(course, earlier)
            if later is not None and same:
                return first - _starting(course, later)
            return first - rerun.target(earlier.half_cycle)

        yield ramp
        return
    for event in (earlier, later):
        if event is not None and event.event.kind is EventKind.START:
            partner = later if event is earlier else earlier

            def margin(
                amplitude: Fraction,
                bits: int,
                event: LoggedEvent = event,
                partner: LoggedEvent | None = partner,
            ) -> Any:
                return _Rerun(question, amplitude, bits).margin(log, event, partner)

            yield margin
    if later is not None and same:

        def tie(amplitude: Fraction, bits: int) -> Any:
            return _Rerun(question, amplitude, bits).tie(log, earlier, later)

        yield tie


def _before(a: LoggedEvent, b: LoggedEvent) -> bool:
    """Return whether `a`, which comes after the same events as `b`, comes before it."""
    if (a.half_cycle, a.rearrangement) != (b.half_cycle, b.rearrangement):
        return (a.half_cycle, a.rearrangement) < (b.half_cycle, b.rearrangement)
    return bool(a.event.time <= b.event.time)


def _starting(course: Course, place: LoggedEvent) -> Any:
    return course.starting_load(place.event.sliders[0] - 1, place.event.signs[0])


class _Rerun:
    """The run at one amplitude along a known itinerary, at a given precision."""

    def __init__(self, question: Question, amplitude: Fraction, bits: int) -> None:
        self.chain = question.chain
        self.limits = question.limits
        self.amplitude = amplitude
        self.half_cycles = question.half_cycles
        self.course = Course(question.chain, question.start, digits_of(bits))

    def target(self, half_cycle: int) -> Any:
        """Return ``l0 theta`` of a target."""
        way = 1 if half_cycle % 2 == 1 else -1
        return self.course.load_of(way * self.amplitude)

    def at_rest(self, log: list[LoggedRearrangement], count: int) -> Course:
        """Return the course after the first `count` rearrangements."""
        half_cycle = 1
        for one in log[:count]:
            self.limits.require()
            self._reach(half_cycle, one.half_cycle)
            half_cycle = one.half_cycle
            self.course.rearrange(one.events)
        return self.course

    def _reach(self, present: int, wanted: int) -> None:
        for half_cycle in range(present, wanted):
            self.course.ramp(self.target(half_cycle))

    def advance(self, log: list[LoggedRearrangement]) -> Any:
        """Return by how much the advance of the last cycle exceeds the limit."""
        first = sum(one.half_cycle <= self.half_cycles - 2 for one in log)
        begin = self.at_rest(log, first).travel.copy()
        half_cycle = log[first - 1].half_cycle if first else 1
        for one in log[first:]:
            self.limits.require()
            self._reach(half_cycle, one.half_cycle)
            half_cycle = one.half_cycle
            self.course.rearrange(one.events)
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
    condition: Condition, low: Fraction, high: Fraction, digits: int, loss: int
) -> Fraction | None:
    """Return the root of `condition` near the bracket to `digits` digits, None if there is none.

    The working precision follows the digits that are known.
    """
    wanted = digits * BITS_PER_DIGIT
    final = math.ceil(wanted) + loss
    width = high - low
    previous, present = low, high
    bits = 0
    condition = lru_cache(maxsize=4)(condition)  # a run in many digits takes seconds
    try:
        for _ in range(32):
            known = log2(abs(present) / abs(present - previous))
            if known >= wanted:
                return present
            # the next step about doubles what is known; both points are taken at this precision,
            # so that their difference is not rounding
            bits = max(bits, min(final, math.ceil(3 * known) + loss))
            before, now = condition(previous, bits), condition(present, bits)
            if now in (0, before) and bits < final:
                bits = final
                continue
            if now == 0:
                return present
            if now == before:
                return None
            following = present - enclosure(now / (now - before)).middle * (present - previous)
            if not low - _STRAY * width <= following <= high + _STRAY * width:
                return None
            if following == present:
                return present if bits == final else None
            if low < following < high:  # then the error is of the order of the last two steps'
                steps = abs(following - present), abs(following - previous)
                if sum(log2(abs(following) / step) for step in steps) >= wanted + 16:
                    return following
            previous, present = present, following
    except (StrayRoot, ArithmeticError, KeyError, StopIteration):
        pass
    return None


def log2(value: Fraction) -> float:
    """Return log2 of a positive rational, however large."""
    shift = value.numerator.bit_length() - value.denominator.bit_length()
    return shift + math.log2(value / Fraction(2) ** shift)
