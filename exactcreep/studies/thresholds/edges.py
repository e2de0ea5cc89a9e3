"""The search for edges, the amplitudes at which creep begins or ends, to any number of digits.

A scan in float64 finds where the answer to a question changes; bisection narrows the edge as far as
float64 tells. Across the edge one event differs; its condition is followed to its root (see
`deciding`). Two runs of the chosen solver, at the decimals that enclose the root, then show that
the answers differ; what leads to these decimals need not be trusted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.quasistatic.decimals import magnitude
from exactcreep.studies.eventlog import first_difference, numbered
from exactcreep.studies.thresholds.deciding import conditions, secant
from exactcreep.studies.thresholds.horizon import Question, Trial, last_outcome, transient, weaker
from exactcreep.studies.thresholds.lasting import Lasting, side_by_side
from exactcreep.studies.thresholds.span import Bracket, Span, bisected, text_of, unit_of
from exactcreep.studies.thresholds.threshold import Difference, Edge, Threshold

MOST_DIGITS = {"certified": 5_000, "mpmath": 300, "exact": 12}
"""Digits of an amplitude that each solver is asked to tell."""
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
SPARE = 2  # digits of the bracket beyond those asked for
_LATER = (4, 16, 64)  # times the cycles, after which a transient may be over


def _rounded(low: Fraction, high: Fraction, begins: bool) -> Edge:
    """Return an edge of float accuracy, rounded outward."""
    unit = unit_of(high, MOST_DIGITS["exact"] - 1)
    below, above = math.floor(low / unit), math.ceil(high / unit)
    return Edge(text_of(below, unit), text_of(above, unit), begins, Evidence.COMPUTED)


class Refined(NamedTuple):
    """An edge, what happens on both sides, and why it is no edge that is known; "" if it is."""

    edge: Edge
    at_lower: Trial
    at_upper: Trial
    doubt: str = ""


@dataclass
class EdgeSearch:
    """The search for an edge: scan, bisection, the deciding event's root, two deciding runs.

    Attributes
    ----------
    asked : Threshold
        What is looked for, with no answer yet.
    question : Question
    span : Span
    points : int
        Equal steps of the scan.
    say : callable
        Told how far the search has come.
    windows : bool
        Whether all edges of the scan are wanted.
    refine : int
        How many of them to all digits.
    """

    asked: Threshold
    question: Question
    span: Span
    points: int
    say: Callable[..., None]
    windows: bool = False
    refine: int = 0
    trials: int = 0
    # what has been found, should time be out
    found: list[tuple[Fraction, Fraction, bool]] = field(default_factory=list)
    narrowest: Bracket | None = None
    decided: Refined | None = None
    transient: dict[str, Any] | None = None

    def threshold(self) -> Threshold:
        """Return the threshold, and what was asked for beside it."""
        question, windows = self.question, None
        edges = list(self.edges()) if self.windows else []
        refined = self.decided = self.refined(*(edges[0][:2] if edges else self.first_bracket()))
        at_lower, at_upper = refined.at_lower, refined.at_upper
        if self.windows:
            windows = tuple(
                (self.refined(*edge).edge if k else refined.edge)
                if k < self.refine
                else self.rough(*edge)
                for k, edge in enumerate(edges)
            )
        known: dict[str, Any] = {"windows": windows}
        logs = [at_lower.log, at_upper.log]
        if isinstance(question, Lasting):
            logs = side_by_side(at_lower, at_upper)
            known |= {
                "outcome_at_lower": at_lower.outcome,
                "outcome_evidence": at_lower.evidence,
                "fates": (at_lower.fate, at_upper.fate),
                "sensitive": tuple(sorted(map(nearest_float, question.sensitive))),
                "reason": refined.doubt,
            }
        else:
            outcome, evidence = last_outcome(at_lower, question.half_cycles)
            locked = outcome is Outcome.CYCLING and evidence is Evidence.PROVED
            lasts = locked or outcome is Outcome.AT_REST
            if outcome is None:
                outcome, evidence = self.settled(Fraction(refined.edge.lower))
            known |= {"outcome_at_lower": outcome, "outcome_evidence": evidence}
            known["stable_digits"] = self.stable_digits(refined.edge, lasts)
        differs = None if refined.doubt else first_difference(*map(numbered, logs))
        known["deciding_event"] = None if differs is None else Difference(*differs[1:])
        return self.answer(refined.edge, **known)

    def unfinished(self, reason: str) -> Threshold:
        """Return what had been found when time was out."""
        known: dict[str, Any] = {"reason": reason}
        edge = None
        if self.decided is not None:
            edge, lower = self.decided.edge, self.decided.at_lower
            outcome, evidence = lower.outcome, lower.evidence
            if outcome is None:
                outcome, evidence = last_outcome(lower, self.question.half_cycles)
            known |= {"outcome_at_lower": outcome, "outcome_evidence": evidence}
        elif self.narrowest is not None:
            edge = _rounded(*self.narrowest, begins=True)
        if self.windows:
            known["windows"] = tuple(_rounded(*one) for one in self.found)
        return self.answer(edge, **known)

    def answer(self, edge: Edge | None, **known: Any) -> Threshold:
        """Return what was asked for with an answer."""
        report: dict[str, Any] = {"deciding_runs": self.trials}
        if self.transient is not None:
            report["transient"] = self.transient
        if isinstance(self.question, Lasting):
            report["certified_points"] = len(self.question.certified)
        if edge is not None:
            known |= {name: getattr(edge, name) for name in ("lower", "upper", "evidence")}
        return replace(self.asked, report=report, **known)

    # -- float64 -----------------------------------------------------------------------------

    def edges(self) -> Iterator[tuple[Fraction, Fraction, bool]]:
        """Yield a bracket of every edge of the scan, and whether creep begins there."""
        before = self.span.scans[0][0]
        creeping = self.question.creeps(before)
        if creeping:
            allowed = "must be lower: the chain creeps there already"
            raise InputError("from", nearest_float(before), allowed)
        for begin, end in self.span.scans:
            for k in range(1, self.points + 1):
                amplitude = begin + (end - begin) * k / self.points
                creeps = self.question.creeps(amplitude)
                self.say("scan", k, self.points, "amplitudes")
                if creeps != creeping:
                    self.found.append((before, amplitude, creeps))
                    self.narrowest = self.narrowest or (before, amplitude)
                    yield before, amplitude, creeps
                before, creeping = amplitude, creeps
            if self.found:
                return
        allowed = "must be higher: the chain creeps at no point of the scan"
        raise InputError("to", nearest_float(before), allowed)

    def first_bracket(self) -> Bracket:
        """Return the bracket that was given, or the first of the scan."""
        if self.span.bracket is None:
            low, high, _ = next(self.edges())
            return low, high
        low, high = self.span.bracket
        creeps = [self.question.creeps(amplitude) for amplitude in (low, high)]
        if creeps != [False, True]:  # or float64 does not tell them apart
            creeps = [self._tried(amplitude).creeps for amplitude in (low, high)]
        if creeps != [False, True]:
            shown = f"{nearest_float(low)} {nearest_float(high)}"
            allowed = "must straddle an edge: no creep at LO, creep at HI"
            raise InputError("bracket", shown, allowed)
        self.narrowest = low, high
        return low, high

    def narrowed(self, low: Fraction, high: Fraction, begins: bool) -> Bracket:
        """Return the bracket after bisection in float64."""
        creeps = self.question.creeps
        for bracket in bisected(low, high, _NARROW, lambda a: creeps(a) == begins):
            if begins and self.decided is None:
                self.narrowest = bracket
        return bracket

    def rough(self, low: Fraction, high: Fraction, begins: bool) -> Edge:
        """Return an edge at float accuracy; between points of the scan where creep does not settle.

        How long a transient lives changes from float to float: there is no edge to bisect for.
        """
        if self.question.unsettled(high if begins else low):
            return replace(_rounded(low, high, begins), evidence=Evidence.UNDECIDED)
        return _rounded(*self.narrowed(low, high, begins), begins)

    # -- all digits --------------------------------------------------------------------------

    def refined(self, low: Fraction, high: Fraction, begins: bool = True) -> Refined:
        """Return an edge to all digits, decided by two runs of the chosen solver."""
        question, side = self.question, high if begins else low
        if question.unsettled(side):
            sides = [question.tried(amplitude, "exact", {}) for amplitude in (low, high)]
            doubt = (
                f"at A = {nearest_float(side):.9g} creep does not settle within"
                f" {question.cycles} cycles"
            )
            return Refined(self.rough(low, high, begins), sides[0], sides[1], doubt)
        unit = unit_of(high, self.asked.digits + SPARE)
        coarse = question.float_fails(low, high)
        if coarse:  # bisection in float64 would find an edge of its own
            guess = high - unit
        else:
            low, high = self.narrowed(low, high, begins)
            guess = self._guess(low, high)
        if self.asked.solver == "exact":
            # float64 claims no more than what its own edge shares with that of the same
            # itinerary at more digits
            apart = max(abs(guess - low), abs(guess - high))
            while unit < 4 * apart:
                unit *= 10
        trials: dict[int, Trial] = {}

        def above(k: int) -> bool:
            if k not in trials:
                trials[k] = self._tried(k * unit)
            return trials[k].creeps == begins

        first, last = math.floor(low / unit), math.ceil(high / unit)
        below_k = first if coarse else math.floor(guess / unit)
        above_k = last if coarse else below_k + 1
        # the edge is the first condition's, or lies further on in the bracket of float64, or, if
        # that errs, outside
        reach, step = math.floor(guess / unit) - first, max(math.ceil((high - low) / unit), 1)
        while above(below_k):
            above_k, below_k = below_k, max(below_k - max(reach, 1), 0)
            reach, step = step, 2 * step
            if above_k == 0:
                raise InputError("bracket", str(low), "must not creep at its lower end")
        reach = last - above_k
        while not above(above_k):
            below_k, above_k = above_k, above_k + max(reach, 1)
            reach, step = step, 2 * step
            if step * unit > high:
                raise InputError("bracket", str(high), "must creep at its upper end")
        while above_k - below_k > 1:
            width = above_k - below_k
            ends = trials[below_k], trials[above_k]
            root = self._root(below_k * unit, above_k * unit, *ends, loss=1)
            near = [] if root is None else [math.floor(root / unit), math.floor(root / unit) + 1]
            for k in near:
                if below_k < k < above_k:
                    below_k, above_k = (below_k, k) if above(k) else (k, above_k)
            if above_k - below_k > max(width // 2, 1):
                k = (below_k + above_k) // 2
                below_k, above_k = (below_k, k) if above(k) else (k, above_k)
        # an end that lies exactly on the edge may be undecided; one unit further out it is not
        if self.asked.solver == "certified":
            if trials[below_k].evidence is not Evidence.PROVED and not above(below_k - 1):
                below_k -= 1
            if trials[above_k].evidence is not Evidence.PROVED and above(above_k + 1):
                above_k += 1
        at_lower, at_upper = trials[below_k], trials[above_k]
        evidence = weaker(at_lower.evidence, at_upper.evidence)
        edge = Edge(text_of(below_k, unit), text_of(above_k, unit), begins, evidence)
        return Refined(edge, at_lower, at_upper)

    def _tried(self, amplitude: Fraction, question: Question | None = None) -> Trial:
        self.trials += 1
        self.say("deciding", self.trials, 0, "runs")
        solver, digits = self.asked.solver, self.asked.digits + SPARE
        options = {} if solver == "exact" else {"digits": digits}
        if solver == "certified":
            # an exact tie outside Q(c) is undecided at any precision: do not try very many
            options["most_digits"] = 4 * digits + 1000
        return (question or self.question).tried(amplitude, solver, options)

    def _guess(self, low: Fraction, high: Fraction) -> Fraction:
        """Return where float64 has the edge: a root of the deciding condition, or the middle."""
        if high - low < _NARROW * high / 2:  # float64 would not tell its ends apart
            low, high = low - _NARROW * high, high + _NARROW * high
        trials = [self.question.tried(amplitude, "exact", {}) for amplitude in (low, high)]
        root = self._root(low, high, *trials, loss=16)
        return (low + high) / 2 if root is None else root

    def _root(
        self, low: Fraction, high: Fraction, at_low: Trial, at_high: Trial, *, loss: int
    ) -> Fraction | None:
        """Return the root of the condition in which the runs at `low` and `high` first differ.

        None if none of the conditions that may be it has a root there. Beyond the root the runs
        may differ from that at `high` once more, and the edge lie further on. One bit is taken to
        be lost in `loss` events.
        """
        log, beside = side_by_side(at_low, at_high)
        one, other = numbered(log), numbered(beside)
        events = len(one)
        if at_low.fate is not None:  # what follows the difference does not matter
            differs = first_difference(one, other)
            events = 0 if differs is None else differs[0] // 4
        lost = 64 + events // loss
        for condition in conditions(self.question, log, one, other):
            root = secant(condition, low, high, self.asked.digits + SPARE + 3, lost)
            if root is not None:
                return root
        return None

    # -- longer drives -------------------------------------------------------------------------

    def settled(self, amplitude: Fraction) -> tuple[Outcome | None, Evidence]:
        """Return what float64 has the chain do after many more cycles at `amplitude`."""
        changes: list[tuple[int, float]] = []
        for times in _LATER:
            later = replace(self.question, cycles=times * self.question.cycles)
            most = _LATER[-1] * self.question.cycles
            self.say("behaviour below", later.cycles, most, "cycles")
            trial = later.tried(amplitude, "exact", {})
            outcome, evidence = last_outcome(trial, later.half_cycles)
            if outcome is not None and not trial.creeps:
                return outcome, weaker(evidence, Evidence.COMPUTED)
            changes.append((later.cycles, trial.change))
        self.transient = transient(changes)
        return None, weaker(trial.evidence, Evidence.COMPUTED)

    def stable_digits(self, edge: Edge, lasts: bool) -> int:
        """Return how many digits of an edge survive when `cycles` is doubled.

        `lasts`: what the chain does at its lower end, it does for ever.
        """
        lower, upper = Fraction(edge.lower), Fraction(edge.upper)
        shown = min(self.asked.digits, magnitude(edge.middle / (upper - lower)))
        doubled = replace(self.question, cycles=2 * self.question.cycles)
        if self._tried(upper, doubled).creeps and (
            lasts or not self._tried(lower, doubled).creeps
        ):
            return shown
        again = EdgeSearch(self.asked, doubled, self.span, self.points, self.say)
        try:
            low, high = again.first_bracket()
        except InputError:
            return 0
        low, high = again.narrowed(low, high, True)
        close = abs((low + high) / 2 - edge.middle) <= 100 * _NARROW * high
        other = again.refined(low, high).edge.middle if close else (low + high) / 2
        if other == edge.middle:
            return shown
        return max(0, min(shown, magnitude(edge.middle / abs(edge.middle - other))))
