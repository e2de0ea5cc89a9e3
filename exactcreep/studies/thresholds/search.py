"""Search for the amplitude at which creep begins: scan, bisection, certified runs.

A scan in float64 finds an interval in which the answer changes, and bisection narrows it. Along one
itinerary neither theta_c nor later events depend on the amplitude; it decides only whether theta
reaches the next theta_c before it turns. So a certified run knows up to which amplitude the events
stay the same, and the edge lies there, or the next run goes on from there. In the end two certified
runs, at decimals that enclose the edge, show that the answers differ. Only these two are trusted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

from exactcreep.model.chain import Chain, first_start, mean_mu_d, require_dilation
from exactcreep.model.enclosure import magnitude
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.studies.thresholds.questions import Answer, Bracket, Question
from exactcreep.watch.limits import OutOfTime

MOST_DIGITS = 5_000
_SPARE = 2  # additional digits of a bracket
_FLOAT_DIGITS = 11  # of a bracket in float64
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends


@dataclass(frozen=True)
class Edge:
    """An amplitude at which creep, or an advance in some cycle, `begins` or ends.

    It lies between two decimals; `evidence` holds for both sides.
    """

    lower: str
    upper: str
    begins: bool = True
    evidence: Evidence = Evidence.COMPUTED

    @property
    def middle(self) -> Fraction:
        return (exact_number(self.lower, "edge") + exact_number(self.upper, "edge")) / 2

    def text(self, what: str) -> str:
        """Return the edge in words; `what` begins there."""
        where = f"{what} begins between A = {self.lower} and {self.upper}"
        return f"{where} ({self.evidence.value})"

    def summary(self, what: str = "creep") -> dict[str, Any]:
        """Return the edge by names; `what` begins or ends there."""
        begins = "begins" if self.begins else "ends"
        return {"lower": self.lower, "upper": self.upper, what: begins, "evidence": self.evidence}


class Span(NamedTuple):
    """The range of a search for a threshold: scans one after the other."""

    scans: list[Bracket]
    free: bool  # whether the first scan may begin lower
    points: int  # equal steps of each scan

    @classmethod
    def of(cls, chain: Chain, low: Number | None, high: Number | None, points: Number) -> Span:
        """Return the span for these arguments; the defaults do not affect the edge found."""
        cosine = Fraction(chain.cos_alpha)
        driven = abs(chain.n * chain.tan_alpha * cosine + sum(chain.end_forces))
        swing = sum(map(abs, chain.rates.values())) * chain.l0
        law = (chain.n * mean_mu_d(chain) * cosine - driven) / swing if swing else Fraction(0)
        first_slip = first_start(chain) / chain.l0
        begin = (law if law > 0 else first_slip) / 2 if low is None else exact_number(low, "from")
        if begin < 0:
            raise InputError("from", low, "must not be negative")
        usual = [end for end in sorted([2 * law, chain.n * first_slip]) if end > begin]
        ends = usual or [2 * begin] if high is None else [exact_number(high, "to")]
        if high is not None and begin >= ends[0]:
            raise InputError("to", high, f"must exceed from = {nearest_float(begin)}")
        require_dilation(chain, max(begin, *ends), "to", high)
        steps = whole_number(points, "points", least=1, most=10**7)
        return cls(list(pairwise([begin, *ends])), low is None, steps)


class Search:
    """The search for edges in a span; `find` fills in what is known.

    `edges`: the first to `digits` digits; `sides`: the answers below and above it; `reason`: why
    the edges are not known better.
    """

    def __init__(self, question: Question, digits: int) -> None:
        self.question, self.digits = question, digits + _SPARE
        self.edges: list[Edge] = []
        self.sides: tuple[Answer, Answer] | None = None
        self.reason = self.so_far = ""

    def find(self, span: Span, *, every: bool = False) -> None:
        """Find the first edge of the scans, or `every` edge."""
        try:
            for low, high, begins in self._brackets(span):
                self.edges.append(_rounded(low, high, begins))
                if len(self.edges) == 1:
                    self._refine(low, high)
                elif self.question.unsettled(high if begins else low):
                    self.edges[-1] = replace(self.edges[-1], evidence=Evidence.UNDECIDED)
                else:
                    self._in_floats(low, high, begins)
                if not every:
                    break
        except OutOfTime as limit:
            known = [] if self.edges else [self.so_far]
            self.reason = "; ".join(filter(None, (*known, str(limit))))

    def _brackets(self, span: Span) -> Iterator[tuple[Fraction, Fraction, bool]]:
        """Yield two amplitudes around every edge of the first scan that has one."""
        question, scans, lowest = self.question, span.scans, span.scans[0][0]
        if span.free and question.creeps(lowest):
            scans, lowest = [(Fraction(0), lowest)], Fraction(0)
        if question.creeps(lowest):
            allowed = "must be lower: the chain creeps there already"
            raise InputError("from", nearest_float(lowest), allowed)
        before, creeping = lowest, False
        for begin, end in scans:
            for k in range(1, span.points + 1):
                amplitude = begin + (end - begin) * k / span.points
                creeps = question.creeps(amplitude)
                none = f"no {question.what} up to A = {nearest_float(before):.6g} (computed)"
                self.so_far = "" if self.edges else none
                question.say("scan", k, span.points, "amplitudes", so_far=self.so_far)
                if creeps != creeping:
                    yield before, amplitude, creeps
                before, creeping = amplitude, creeps
            if self.edges:
                return
        allowed = "must be higher: the chain creeps at no point of the scan"
        raise InputError("to", nearest_float(before), allowed)

    def _in_floats(self, low: Fraction, high: Fraction, begins: bool) -> Bracket:
        """Bisect the last edge in float64."""
        while high - low > _NARROW * high:
            middle = (low + high) / 2
            is_above = self.question.creeps(middle) == begins
            low, high = (low, middle) if is_above else (middle, high)
            self.edges[-1] = _rounded(low, high, begins)
        return low, high

    def _refine(self, low: Fraction, high: Fraction) -> None:
        """Narrow the first bracket in float64 if that is reliable, then by certified runs."""
        question = self.question
        self._tell()
        if question.unsettled(high):
            self.edges[0] = replace(self.edges[0], evidence=Evidence.UNDECIDED)
            where = f"at A = {nearest_float(high):.9g} creep does not settle"
            self.reason = f"{where} within {question.cycles} cycles"
            return
        if not question.float_fails(low, high):  # otherwise bisection would find a spurious edge
            low, high = self._in_floats(low, high, begins=True)
            self._tell()
        unit = unit_of(high, self.digits)
        below, above = self._decided(low, high, unit)
        # a decimal exactly on the edge may be undecided; the next decimal outside is not
        if not self._proved(below * unit) and not self._creeps((below - 1) * unit):
            below -= 1
        if not self._proved(above * unit) and self._creeps((above + 1) * unit):
            above += 1
        self.sides = self._answer(below * unit), self._answer(above * unit)
        evidence = self.sides[0].evidence.and_then(self.sides[1].evidence)
        self.edges[0] = Edge(text_of(below, unit), text_of(above, unit), evidence=evidence)

    def _tell(self, edge: Edge | None = None) -> None:
        known = (edge or self.edges[0]).text(self.question.what)
        self.question.say("deciding", len(self.question.answers), 0, "runs", answer=known)

    def _answer(self, amplitude: Fraction) -> Answer:
        return self.question.answer(amplitude, self.digits)

    def _creeps(self, amplitude: Fraction) -> bool:
        return self._answer(amplitude).creeps

    def _proved(self, amplitude: Fraction) -> bool:
        return self._answer(amplitude).evidence is Evidence.PROVED

    def _decided(self, low: Fraction, high: Fraction, unit: Fraction) -> tuple[int, int]:
        """Return neighbouring multiples of `unit` between which creep begins."""
        below, above = math.floor(low / unit), math.ceil(high / unit)
        step = above - below
        while self._creeps(below * unit):
            if below == 0:
                raise InputError("from", str(low), "must be lower: the chain creeps at any A")
            below, above, step = max(below - step, 0), below, 2 * step
        while True:
            below, above = self._closed_in(below, above, unit)
            if self._creeps(above * unit):
                return below, above
            if step * unit > high:
                raise InputError("to", nearest_float(high), "must be higher: no creep is certified")
            below, above, step = above, above + step, 2 * step

    def _closed_in(self, below: int, above: int, unit: Fraction) -> tuple[int, int]:
        """Return neighbours; at the lower one the chain does not creep."""

        def cut(k: int) -> None:
            nonlocal below, above
            if below < k < above:
                below, above = (below, k) if self._creeps(k * unit) else (k, above)

        while (width := above - below) > 1:
            lower, upper = self._answer(below * unit), self.question.answers.get(above * unit)
            evidence = lower.evidence.and_then(upper.evidence if upper else Evidence.COMPUTED)
            self._tell(Edge(text_of(below, unit), text_of(above, unit), evidence=evidence))
            ends = [lower.between[1]] if lower.between else []
            ends += [upper.between[0]] if upper and upper.between else []
            for k in (math.floor(end / unit) for end in ends):
                for near in range(k, k + 3):  # a range is rounded inward
                    cut(near)
            if above - below > width // 2:
                cut((below + above) // 2)
        return below, above


def _rounded(low: Fraction, high: Fraction, begins: bool = True) -> Edge:
    unit = unit_of(high, _FLOAT_DIGITS)
    return Edge(
        text_of(math.floor(low / unit), unit), text_of(math.ceil(high / unit), unit), begins
    )


def unit_of(value: Fraction, digits: int) -> Fraction:
    """Return one unit of the last of `digits` significant decimal digits of `value` > 0."""
    return Fraction(10) ** (magnitude(value) + 1 - digits)


def text_of(count: int, unit: Fraction) -> str:
    """Return ``count * unit`` as a decimal; `unit` is a power of ten."""
    exponent = Decimal(unit.numerator).adjusted() - Decimal(unit.denominator).adjusted()
    sign, digits, _ = Decimal(count).as_tuple()
    return str(Decimal((sign, digits, exponent)))
