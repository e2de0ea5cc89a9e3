"""The search for an edge: scan, bisection, the deciding event, two deciding runs.

A scan in float64 finds where the answer to a question changes; bisection narrows the edge as far as
float64 tells. One event differs across the edge, and tells where it lies.
Two runs of the chosen solver, at the decimals that enclose this amplitude, then show that the
answers differ; what leads to these decimals need not be trusted.

*The deciding event.* Every rearrangement begins with an end of the chain at its threshold, and the
forces add up to N s: along one itinerary neither theta_c nor what follows depends on the amplitude.
The amplitude decides one thing alone: whether theta turns before it comes to the next theta_c. So
two runs part where the amplitude is that theta_c, and one run along the itinerary tells it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep import solvers
from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, balls_of
from exactcreep.solvers.interface import Start
from exactcreep.studies.event_log import LoggedEvent, first_difference, numbered
from exactcreep.studies.thresholds.amplitudes import Bracket, Span, bisected, text_of, unit_of
from exactcreep.studies.thresholds.questions import (
    Lasting,
    Log,
    Observation,
    Question,
    side_by_side,
    weaker,
)

MOST_DIGITS = {"certified": 5_000, "exact": 12}
"""Digits of an amplitude that each solver is asked to tell."""
SPARE = 2
"""Digits of a bracket beyond those asked for."""
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
_STRAY = 10**5  # widths of a float64 bracket that rounding may have put it off
_LATER = (4, 16, 64)  # times the cycles, after which a transient may be over
_BITS_LOST = 64  # of a run along an itinerary, and a quarter of one for every event


@dataclass(frozen=True)
class Edge:
    """Where creep, or an advance in some cycle, `begins` or ends: between two decimals.

    `evidence` is of what happens at both.
    """

    lower: str
    upper: str
    begins: bool
    evidence: Evidence

    @property
    def middle(self) -> Fraction:
        return (Fraction(self.lower) + Fraction(self.upper)) / 2

    def summary(self, what: str = "creep") -> dict[str, Any]:
        """Return the edge by names; `what` begins or ends there."""
        begins = "begins" if self.begins else "ends"
        return {"lower": self.lower, "upper": self.upper, what: begins, "evidence": self.evidence}


@dataclass(frozen=True)
class Difference:
    """The first event that differs across an edge; None: no further event on that side."""

    at_lower: LoggedEvent | None
    at_upper: LoggedEvent | None

    def summary(self) -> dict[str, Any]:
        return {name: event and event.summary() for name, event in vars(self).items()}


def deciding_amplitude(question: Question, one: Log, other: Log, digits: int) -> Fraction | None:
    """Return the amplitude at which two runs part to `digits` digits, None if rounding parts them.

    Beyond it they may part once more, and the edge lie further on.
    """
    shared, *sides = first_difference(numbered(one), numbered(other))
    event = min(filter(None, sides), key=lambda side: side[:2], default=None)
    if event is None or event.number:
        return None
    bits = math.ceil(digits * BITS_PER_DIGIT) + _BITS_LOST + shared // 4
    ways = -1, 1  # of theta in even half-cycles, and in odd ones
    way = ways[event.half_cycle % 2]
    try:
        with balls_of(bits).active():
            known = solvers.KnownItinerary(Start(question.chain, question.start, 0), bits)
            for rearrangement in one[: event.rearrangement]:
                question.limits.require()
                known.follow(ways[rearrangement.half_cycle % 2], rearrangement.events)
            load = known.load_of_start(event.event.sliders[0] - 1, event.event.signs[0], way)
    except ArithmeticError:  # it is the itinerary of no chain: rounding had made it
        return None
    return way * exact_value(load) / question.chain.l0


class Refined(NamedTuple):
    """An edge, what happens on both sides, and why it is no edge that is known; "" if it is."""

    edge: Edge
    at_lower: Observation
    at_upper: Observation
    doubt: str = ""


def _rounded(low: Fraction, high: Fraction, begins: bool = True) -> Edge:
    unit = unit_of(high, MOST_DIGITS["exact"] - 1)
    ends = text_of(math.floor(low / unit), unit), text_of(math.ceil(high / unit), unit)
    return Edge(*ends, begins, Evidence.COMPUTED)


@dataclass
class EdgeSearch:
    """The search for an edge: in so many `points` of a scan, to so many `digits` of a solver.

    `known` are the fields of a `Threshold` that have been found so far, `runs` those of the
    deciding solver by amplitude; they are `decided` when they have told the threshold.
    """

    question: Question
    span: Span
    points: int
    solver: str
    digits: int
    say: Callable[..., None]
    known: dict[str, Any] = field(default_factory=dict)
    runs: dict[Fraction, Observation] = field(default_factory=dict)
    decided: bool = False

    def search(self, *, windows: bool) -> None:
        """Find the threshold, and what was asked for beside it; `known` grows on the way."""
        question, known, lowest = self.question, self.known, self.span.scans[0][0]
        if self.span.free and question.creeps(lowest):
            self.span = self.span._replace(scans=[(Fraction(0), lowest)])
        edges: list[tuple[Fraction, Fraction, bool]] = []
        for bracket in self.edges() if windows else ():
            edges.append(bracket)
            known["windows"] = tuple(_rounded(*found) for found in edges)
        low, high = edges[0][:2] if edges else self.first_bracket()
        self._enclosed(_rounded(low, high))
        edge, lower, upper, doubt = self.refined(low, high)
        self.decided = True
        self._enclosed(edge)
        outcome, evidence = lower.outcome, lower.outcome_evidence
        known |= {"outcome_at_lower": outcome, "outcome_evidence": evidence}
        known["direction"] = upper.direction
        if windows:
            known["windows"] = (edge, *(self.rough(*other) for other in edges[1:]))
        if isinstance(question, Lasting):
            known["sensitive"] = tuple(sorted(map(nearest_float, question.sensitive)))
            known |= {"fates": (lower.fate, upper.fate), "reason": doubt}
        elif outcome is None:
            self._settle(Fraction(edge.lower))
        if not doubt:
            _, *sides = first_difference(*map(numbered, side_by_side(lower, upper)))
            known["deciding_event"] = Difference(*sides) if any(sides) else None

    def report(self) -> dict[str, Any]:
        report = {"deciding_runs": len(self.runs)}
        if isinstance(self.question, Lasting):
            report["certified_points"] = len(self.question.certified)
        return report

    def _enclosed(self, edge: Edge) -> None:
        self.known |= {"lower": edge.lower, "upper": edge.upper, "evidence": edge.evidence}

    def edges(self) -> Iterator[tuple[Fraction, Fraction, bool]]:
        """Yield a bracket of every edge of the scan, and whether creep begins there."""
        before, creeping, found = self.span.scans[0][0], False, False
        if self.question.creeps(before):
            allowed = "must be lower: the chain creeps there already"
            raise InputError("from", nearest_float(before), allowed)
        for begin, end in self.span.scans:
            for k in range(1, self.points + 1):
                amplitude = begin + (end - begin) * k / self.points
                creeps = self.question.creeps(amplitude)
                self.say("scan", k, self.points, "amplitudes")
                if creeps != creeping:
                    found = True
                    yield before, amplitude, creeps
                before, creeping = amplitude, creeps
            if found:
                return
        allowed = "must be higher: the chain creeps at no point of the scan"
        raise InputError("to", nearest_float(before), allowed)

    def first_bracket(self) -> Bracket:
        """Return the bracket that was given, or the first of the scan."""
        if self.span.bracket is None:
            return next(self.edges())[:2]
        low, high = self.span.bracket
        for creeps in (self.question.creeps, lambda amplitude: self._tried(amplitude).creeps):
            if (creeps(low), creeps(high)) == (False, True):  # where float64 tells them apart
                return low, high
        shown = f"{nearest_float(low)} {nearest_float(high)}"
        raise InputError("bracket", shown, "must straddle an edge: no creep at LO, creep at HI")

    def narrowed(self, low: Fraction, high: Fraction, begins: bool) -> Bracket:
        creeps = self.question.creeps
        for bracket in bisected(low, high, _NARROW, lambda a: creeps(a) == begins):
            if not self.decided:
                self._enclosed(_rounded(*bracket))
        return bracket

    def rough(self, low: Fraction, high: Fraction, begins: bool) -> Edge:
        """Return an edge at float accuracy; between points of the scan where creep does not settle.

        How long a transient lives changes from float to float: there is no edge to bisect for.
        """
        if self.question.unsettled(high if begins else low):
            return replace(_rounded(low, high, begins), evidence=Evidence.UNDECIDED)
        return _rounded(*self.narrowed(low, high, begins), begins)

    def refined(self, low: Fraction, high: Fraction, begins: bool = True) -> Refined:
        """Return an edge to all digits, decided by two runs of the chosen solver."""
        question, side = self.question, high if begins else low
        if question.unsettled(side):
            lower, upper = (question.tried(amplitude, "exact", {}) for amplitude in (low, high))
            doubt = f"at A = {nearest_float(side):.9g} creep does not settle within"
            doubt += f" {question.cycles} cycles"
            return Refined(self.rough(low, high, begins), lower, upper, doubt)
        unit = unit_of(high, self.digits + SPARE)
        if question.float_fails(low, high):  # bisection in float64 would find an edge of its own
            first, last = below, above = math.floor(low / unit), math.ceil(high / unit)
        else:
            low, high = self.narrowed(low, high, begins)
            room = _NARROW * high if high - low < _NARROW * high / 2 else 0  # or its ends are alike
            ends = (question.tried(one, "exact", {}) for one in (low - room, high + room))
            guess = self._deciding(*ends)
            if guess is None or abs(guess - high) > _STRAY * (high - low + room):
                guess = (low + high) / 2
            # float64 claims no more than its own edge shares with that of the itinerary
            apart = max(abs(guess - low), abs(guess - high)) if self.solver == "exact" else 0
            while unit < 4 * apart:
                unit *= 10
            first, last = math.floor(low / unit), math.ceil(high / unit)
            below = math.floor(guess / unit)
            above = below + 1
        # the edge is the deciding event's, or lies further on in the bracket of float64, or, if
        # that errs, outside
        step = last - first
        while True:
            while self._beyond(below, unit, begins):
                if below == 0:
                    raise InputError("bracket", str(low), "must not creep at its lower end")
                below, above = first if first < below else max(below - step, 0), below
                step *= 2
            while not self._beyond(above, unit, begins):
                if step * unit > high:
                    raise InputError("bracket", str(high), "must creep at its upper end")
                below, above = above, last if last > above else above + step
                step *= 2
            below, above = self._closed_in(below, above, unit, begins)
            if all(self._stands(k * unit) for k in (below, above)):
                return self._decided(below, above, unit, begins)

    def _stands(self, amplitude: Fraction) -> bool:
        """Return whether a run that was not followed to its end comes to what was taken for it."""
        trial = self._tried(amplitude)
        if trial.fate is not None and trial.fate.outcome is Outcome.LIMIT:
            self.runs[amplitude] = self.question.tried(amplitude, self.solver, {})
        return self._tried(amplitude).creeps == trial.creeps

    def _beyond(self, k: int, unit: Fraction, begins: bool) -> bool:
        return self._tried(k * unit).creeps == begins

    def _closed_in(self, below: int, above: int, unit: Fraction, begins: bool) -> tuple[int, int]:
        """Return two neighbours of these multiples of `unit` between which the answer changes."""

        def cut(k: int) -> None:
            nonlocal below, above
            if below < k < above:
                below, above = (below, k) if self._beyond(k, unit, begins) else (k, above)

        while (width := above - below) > 1:
            k = below if begins else above  # where the chain does not creep
            between = self._tried(k * unit).between
            edge = None if between is None else between[begins]
            if edge is None or abs(edge / unit - k) <= 1:
                edge = self._deciding(self._tried(below * unit), self._tried(above * unit))
            if edge is not None:
                cut(math.floor(edge / unit))
                cut(math.floor(edge / unit) + 1)
            if above - below > width // 2:
                cut((below + above) // 2)
        return below, above

    def _decided(self, below: int, above: int, unit: Fraction, begins: bool) -> Refined:
        # an end that lies exactly on the edge may be undecided; one unit further out it is not
        ends = []
        for k, way in ((below, -1), (above, 1)):
            unproved = self._tried(k * unit).evidence is not Evidence.PROVED
            if unproved and self.solver == "certified":
                k += way if self._beyond(k + way, unit, begins) == (way > 0) else 0
            ends.append(k)
        lower, upper = (self._tried(k * unit) for k in ends)
        evidence = weaker(lower.evidence, upper.evidence)
        found = Edge(text_of(ends[0], unit), text_of(ends[1], unit), begins, evidence)
        return Refined(found, lower, upper)

    def _tried(self, amplitude: Fraction) -> Observation:
        if amplitude not in self.runs:
            self.say("deciding", len(self.runs) + 1, 0, "runs")
            digits = self.digits + SPARE
            options = {} if self.solver == "exact" else {"digits": digits}
            if self.solver == "certified":
                # an exact tie outside Q(c) is undecided at any precision: do not try very many
                options["most_digits"] = 4 * digits + 1000
            self.runs[amplitude] = self.question.tried(amplitude, self.solver, options)
        return self.runs[amplitude]

    def _deciding(self, one: Observation, other: Observation) -> Fraction | None:
        digits = self.digits + SPARE + 3
        return deciding_amplitude(self.question, *side_by_side(one, other), digits)

    def _settle(self, amplitude: Fraction) -> None:
        """Follow a transient in float64 through many more cycles at `amplitude`."""
        most = _LATER[-1] * self.question.cycles
        for times in _LATER:
            later = replace(self.question, cycles=times * self.question.cycles)
            self.say("behaviour below", later.cycles, most, "cycles")
            trial = later.tried(amplitude, "exact", {})
            self.known["outcome_evidence"] = weaker(trial.outcome_evidence, Evidence.COMPUTED)
            if trial.outcome is not None and not trial.creeps:
                self.known["outcome_at_lower"] = trial.outcome
                return
