"""Search for the amplitude at which creep begins: scan, bisection, two deciding runs.

A scan in float64 finds an interval in which the answer changes, and bisection narrows it. The first
event that differs across the edge gives its amplitude. Then two runs of the chosen solver, at
decimals that enclose this amplitude, show that the answers differ. Only these two are trusted.

*The deciding event.* Along one itinerary neither theta_c nor later events depend on the amplitude;
it decides only whether theta reaches the next theta_c before it turns. So two runs part where the
amplitude equals that theta_c, which one run along the itinerary computes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep import solvers
from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, balls_of
from exactcreep.solvers.interface import Start
from exactcreep.studies.event_log import LoggedEvent, first_difference, numbered
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.thresholds.amplitudes import Bracket, Span, bisected, text_of, unit_of
from exactcreep.studies.thresholds.questions import Log, Observation, Question, side_by_side
from exactcreep.watch.limits import OutOfTime

MOST_DIGITS = {"certified": 5_000, "exact": 12}
"""Most digits of an amplitude by solver."""
SPARE = 2
"""Additional digits of a bracket."""
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
_STRAY = 10**5  # widths by which rounding may have shifted a float64 bracket
_LATER = (4, 16, 64)  # factors on the number of cycles, after which a transient may be over
_OF_A_GUESS = 3  # additional digits of an edge computed along an itinerary
_BITS_LOST = 64  # bits that a run along an itinerary may lose, and a quarter of a bit per event


@dataclass(frozen=True)
class Difference:
    """The first event that differs across an edge; None: no further event on that side."""

    at_lower: LoggedEvent | None
    at_upper: LoggedEvent | None

    @classmethod
    def of(cls, lower: Observation, upper: Observation) -> Difference | None:
        """Return the difference between both sides, None if no event differs."""
        _, *sides = first_difference(*map(numbered, side_by_side(lower, upper)))
        return cls(*sides) if any(sides) else None

    def summary(self) -> dict[str, Any]:
        return {name: event and event.summary() for name, event in vars(self).items()}


@dataclass(frozen=True)
class Edge:
    """An amplitude at which creep, or an advance in some cycle, `begins` or ends.

    It lies between two decimals (None if unknown); `evidence` holds for both sides. The other
    fields come from the two deciding runs, see `Threshold`; `doubt` says why the edge is unknown.
    """

    lower: str | None = None
    upper: str | None = None
    begins: bool = True
    evidence: Evidence = Evidence.UNDECIDED
    direction: str = field(default="none", repr=False)
    outcome_at_lower: Outcome | None = field(default=None, repr=False)
    outcome_evidence: Evidence = field(default=Evidence.COMPUTED, repr=False)
    deciding_event: Difference | None = field(default=None, repr=False)
    fates: tuple[Fate | None, Fate | None] | None = field(default=None, repr=False)
    doubt: str = field(default="", repr=False)

    @property
    def middle(self) -> Fraction:
        return sum(exact_number(end or 0, "edge") for end in (self.lower, self.upper)) / Fraction(2)

    def text(self, what: str) -> str:
        """Return the edge in words; `what` begins there."""
        where = f"{what} begins between A = {self.lower} and {self.upper}"
        return f"{where} ({self.evidence.value})"

    def summary(self, what: str = "creep") -> dict[str, Any]:
        """Return the edge by names; `what` begins or ends there."""
        begins = "begins" if self.begins else "ends"
        return {"lower": self.lower, "upper": self.upper, what: begins, "evidence": self.evidence}


class Unfinished(OutOfTime):
    """The time ended before the search did; `edges` are the results so far."""

    def __init__(self, limit: OutOfTime, *edges: Edge) -> None:
        super().__init__(str(limit))
        self.edges = edges


def first_edge(question: Question, span: Span, digits: int) -> Edge:
    """Return the edge in a bracket, or the first of the scans, or raise `Unfinished`."""
    reached: list[Edge] = []
    try:
        for edge in _approached(question, _first_bracket(question, span, digits), digits):
            reached[:] = [edge]
    except OutOfTime as limit:
        raise Unfinished(limit, *reached) from None
    return reached[0]


def all_edges(question: Question, span: Span, digits: int) -> tuple[Edge, ...]:
    """Return every edge of the scans, the first to all digits, or raise `Unfinished`."""
    scanned: list[Scanned] = []
    reached: list[Edge] = []
    try:
        for low, high, begins in _scanned(question, span):
            scanned.append((low, high, begins))
            reached.append(_rounded(low, high, begins))
        low, high, _ = scanned[0]
        for edge in _approached(question, (low, high), digits):
            reached[0] = edge
        for k, other in enumerate(scanned[1:], 1):
            reached[k] = _in_floats(question, *other)
    except OutOfTime as limit:
        raise Unfinished(limit, *reached) from None
    return tuple(reached)


Scanned = tuple[Fraction, Fraction, bool]
"""A bracket of an edge, and whether creep begins there."""


def _scanned(question: Question, span: Span) -> Iterator[Scanned]:
    """Yield a bracket of every edge of the first scan that has one."""
    scans, lowest = span.scans, span.scans[0][0]
    if span.free and question.creeps(lowest):
        scans, lowest = [(Fraction(0), lowest)], Fraction(0)
    if question.creeps(lowest):
        allowed = "must be lower: the chain creeps there already"
        raise InputError("from", nearest_float(lowest), allowed)
    before, creeping, any_edge = lowest, False, False
    for begin, end in scans:
        for k in range(1, span.points + 1):
            amplitude = begin + (end - begin) * k / span.points
            creeps = question.creeps(amplitude)
            none = f"no {question.what} up to A = {nearest_float(before):.6g} (computed)"
            question.say("scan", k, span.points, "amplitudes", so_far="" if any_edge else none)
            if creeps != creeping:
                any_edge = True
                yield before, amplitude, creeps
            before, creeping = amplitude, creeps
        if any_edge:
            return
    allowed = "must be higher: the chain creeps at no point of the scan"
    raise InputError("to", nearest_float(before), allowed)


def _first_bracket(question: Question, span: Span, digits: int) -> Bracket:
    """Return the given bracket, or the first bracket of the scans."""
    if span.bracket is None:
        low, high, _ = next(_scanned(question, span))
        return low, high

    def decided(amplitude: Fraction) -> bool:
        return question.decided(amplitude, digits + SPARE).creeps

    low, high = span.bracket
    for creeps in (question.creeps, decided):
        if (creeps(low), creeps(high)) == (False, True):  # float64 sees the edge
            return low, high
    shown = f"{nearest_float(low)} {nearest_float(high)}"
    raise InputError("bracket", shown, "must straddle an edge: no creep at LO, creep at HI")


def _rounded(low: Fraction, high: Fraction, begins: bool = True) -> Edge:
    unit = unit_of(high, MOST_DIGITS["exact"] - 1)
    lower, upper = text_of(math.floor(low / unit), unit), text_of(math.ceil(high / unit), unit)
    return Edge(lower, upper, begins, Evidence.COMPUTED)


def _in_floats(question: Question, low: Fraction, high: Fraction, begins: bool) -> Edge:
    """Return an edge bisected in float64, or between points of the scan if creep never settles."""
    if question.unsettled(high if begins else low):
        return replace(_rounded(low, high, begins), evidence=Evidence.UNDECIDED)
    *_, bracket = bisected(low, high, _NARROW, lambda a: question.creeps(a) == begins)
    return _rounded(*bracket, begins)


def _approached(question: Question, bracket: Bracket, digits: int) -> Iterator[Edge]:
    """Yield ever narrower brackets of an edge above which the chain creeps.

    The last bracket has all digits and is decided by two runs of the deciding solver, unless creep
    does not settle there.
    """
    yield (scanned := _rounded(*bracket))
    low, high = bracket
    question.tell(scanned.text(question.what))
    if question.unsettled(high):
        ends = (question.tried(amplitude, "exact", {}) for amplitude in bracket)
        doubt = f"at A = {nearest_float(high):.9g} creep does not settle within"
        doubt += f" {question.cycles} cycles"
        edge = replace(_rounded(*bracket), evidence=Evidence.UNDECIDED, doubt=doubt)
        yield _with_sides(edge, *ends)
        return
    unit = unit_of(high, digits + SPARE)
    guess: Fraction | None = None
    if not question.float_fails(low, high):  # otherwise bisection would find a spurious edge
        for low, high in bisected(*bracket, _NARROW, question.creeps):
            yield (narrow := _rounded(low, high))
        question.tell(narrow.text(question.what))
        guess, error = _guessed(question, low, high, digits)
        while unit < 4 * error:
            unit *= 10
    edge = _decided(_Decimals(question, unit, digits + SPARE), (low, high), guess)
    yield edge
    if edge.outcome_at_lower is None:
        yield from _settled(question, edge)


def _guessed(
    question: Question, low: Fraction, high: Fraction, digits: int
) -> tuple[Fraction, Fraction]:
    """Return the edge computed from the event that decides a float64 bracket, and its error.

    Digits are claimed only as far as the float64 edge and the itinerary's edge agree.
    """
    room = _NARROW * high if high - low < _NARROW * high / 2 else 0  # the ends may be equal
    ends = (question.tried(amplitude, "exact", {}) for amplitude in (low - room, high + room))
    guess = deciding_amplitude(question, *side_by_side(*ends), digits + SPARE + _OF_A_GUESS)
    if guess is None or abs(guess - high) > _STRAY * (high - low + room):
        guess = (low + high) / 2
    apart = max(abs(guess - low), abs(guess - high))
    return guess, apart if question.solver == "exact" else Fraction(0)


class _Decimals(NamedTuple):
    """The decimals k * unit; the deciding solver runs once at each."""

    question: Question
    unit: Fraction
    digits: int

    def trial(self, k: int) -> Observation:
        return self.question.decided(k * self.unit, self.digits)

    def creeps(self, k: int) -> bool:
        return self.trial(k).creeps

    def proved(self, k: int) -> bool:
        return self.trial(k).evidence is Evidence.PROVED

    def edge(self, below: int, above: int) -> Edge:
        """Return the edge between two decimals, with the evidence of their runs."""
        evidence = self.trial(below).evidence.and_then(self.trial(above).evidence)
        return Edge(text_of(below, self.unit), text_of(above, self.unit), evidence=evidence)

    def stands(self, k: int) -> bool:
        """Return whether a run that stopped early gives the same answer when followed further."""
        taken = self.creeps(k)
        return self.question.decided_at_its_end(k * self.unit, self.digits).creeps == taken

    def parting(self, below: int, above: int) -> Fraction | None:
        """Return the amplitude at which two runs part, None if rounding parts them."""
        runs = side_by_side(self.trial(below), self.trial(above))
        return deciding_amplitude(self.question, *runs, self.digits + _OF_A_GUESS)

    def cell(self, amplitude: Fraction) -> tuple[int, int]:
        """Return the neighbours of an amplitude; the lower one may equal it."""
        below = math.floor(amplitude / self.unit)
        return below, below + 1

    def around(self, low: Fraction, high: Fraction) -> tuple[int, int]:
        """Return the closest decimals that enclose a bracket."""
        return math.floor(low / self.unit), math.ceil(high / self.unit)


def _decided(decimals: _Decimals, bracket: Bracket, guess: Fraction | None) -> Edge:
    """Return the edge between neighbouring decimals: by the guess, the bracket, or outside it."""
    below, above = decimals.around(*bracket)
    if guess is not None:
        below, above = decimals.cell(guess)
    stands = False
    while not stands:
        below, above = _bracketed(decimals, below, above, bracket)
        below, above = _closed_in(decimals, below, above)
        stands = decimals.stands(below) and decimals.stands(above)
    if decimals.question.solver == "certified":
        # a decimal exactly on the edge may be undecided; the next decimal outside is not
        if not decimals.proved(below) and not decimals.creeps(below - 1):
            below -= 1
        if not decimals.proved(above) and decimals.creeps(above + 1):
            above += 1
    lower, upper = decimals.trial(below), decimals.trial(above)
    edge = replace(decimals.edge(below, above), deciding_event=Difference.of(lower, upper))
    return _with_sides(edge, lower, upper)


def _bracketed(decimals: _Decimals, below: int, above: int, bracket: Bracket) -> tuple[int, int]:
    """Return decimals between which creep begins: these two, or two further out."""
    low, high = bracket
    first, last = decimals.around(low, high)
    step = last - first
    while decimals.creeps(below):
        if below == 0:
            raise InputError("bracket", str(low), "must not creep at its lower end")
        below, above = first if first < below else max(below - step, 0), below
        step *= 2
    while not decimals.creeps(above):
        if step * decimals.unit > high:
            raise InputError("bracket", str(high), "must creep at its upper end")
        below, above = above, last if last > above else above + step
        step *= 2
    return below, above


def _closed_in(decimals: _Decimals, below: int, above: int) -> tuple[int, int]:

    def cut(k: int) -> None:
        nonlocal below, above
        if below < k < above:
            below, above = (below, k) if decimals.creeps(k) else (k, above)

    while (width := above - below) > 1:
        decimals.question.tell(decimals.edge(below, above).text(decimals.question.what))
        alike = decimals.trial(below).between
        edge = None if alike is None else alike[1]
        if edge is None or abs(edge / decimals.unit - below) <= 1:
            edge = decimals.parting(below, above)
        if edge is not None:
            for k in decimals.cell(edge):
                cut(k)
        if above - below > width // 2:
            cut((below + above) // 2)
    return below, above


def _with_sides(edge: Edge, lower: Observation, upper: Observation) -> Edge:
    return replace(
        edge,
        direction=upper.direction,
        outcome_at_lower=lower.outcome,
        outcome_evidence=lower.outcome_evidence,
        fates=(lower.fate, upper.fate),
    )


def _settled(question: Question, edge: Edge) -> Iterator[Edge]:
    """Yield an edge with the later end of the transient below it, found in float64."""
    most = _LATER[-1] * question.cycles
    for times in _LATER:
        later = replace(question, cycles=times * question.cycles)
        question.say("behaviour below", later.cycles, most, "cycles")
        trial = later.tried(exact_number(edge.lower or 0, "edge"), "exact", {})
        edge = replace(edge, outcome_evidence=trial.outcome_evidence.and_then(Evidence.COMPUTED))
        if trial.outcome is not None and not trial.creeps:
            yield replace(edge, outcome_at_lower=trial.outcome)
            return
        yield edge


def deciding_amplitude(question: Question, log: Log, other: Log, digits: int) -> Fraction | None:
    """Return the amplitude at which two runs part to `digits` digits, None if rounding parts them.

    Above this amplitude they may part again; then the edge lies further up.
    """
    shared, *sides = first_difference(numbered(log), numbered(other))
    event = min(filter(None, sides), key=lambda side: side[:2], default=None)
    if event is None or event.number:
        return None
    bits = math.ceil(digits * BITS_PER_DIGIT) + _BITS_LOST + shared // 4
    ways = -1, 1  # direction of theta in even and in odd half-cycles
    way = ways[event.half_cycle % 2]
    try:
        with balls_of(bits).active():
            itinerary = solvers.KnownItinerary(Start(question.chain, question.start, 0), bits)
            for rearrangement in log[: event.rearrangement]:
                question.limits.require()
                itinerary.follow(ways[rearrangement.half_cycle % 2], rearrangement.events)
            slider, sign = event.event.sliders[0] - 1, event.event.signs[0]
            # a number of the field, too, has the digits that are set here
            ball = itinerary.arithmetic.number(itinerary.load_of_start(slider, sign, way))
    except ArithmeticError:  # no chain has this itinerary: it is an artefact of rounding
        return None
    return way * exact_value(ball) / question.chain.l0
