"""The amplitude above which a chain creeps: edges, to any number of digits.

A scan in float64 finds where the answer to a question changes; bisection narrows the edge as far as
float64 tells. One event differs across the edge, and tells where it lies (see `deciding_event`).
Two runs of the chosen solver, at the decimals that enclose this amplitude, then show that the
answers differ; what leads to these decimals need not be trusted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from exactcreep.display import shows_progress
from exactcreep.limits import Limits, OutOfTime
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import magnitude
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.solver import advance
from exactcreep.studies.event_log import first_difference, numbered
from exactcreep.studies.thresholds.amplitudes import (
    Bracket,
    Span,
    bisected,
    require_sense,
    text_of,
    unit_of,
)
from exactcreep.studies.thresholds.deciding_event import deciding_amplitude
from exactcreep.studies.thresholds.horizon import Observation, Question, transient, weaker
from exactcreep.studies.thresholds.lasting import MOST_CYCLES, Lasting, side_by_side
from exactcreep.studies.thresholds.results import Difference, Edge, Threshold

MOST_DIGITS = {"certified": 5_000, "mpmath": 300, "exact": 12}
"""Digits of an amplitude that each solver is asked to tell."""
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
_STRAY = 10**5  # widths of a float64 bracket that rounding may have put it off
_SPARE = 2  # digits of the bracket beyond those asked for
_LATER = (4, 16, 64)  # times the cycles, after which a transient may be over
_SEED_SIZE = Fraction(1, 10**6)  # of seeded tensions: far below a slip, far above rounding


@shows_progress
def threshold(
    chain: Chain,
    *,
    after: int | None = None,
    digits: Number = 15,
    low: Number | None = None,
    high: Number | None = None,
    points: Number = 1000,
    bracket: tuple[Number, Number] | None = None,
    windows: bool = False,
    refine: Number = 0,
    start_tension: Number = 0,
    seeds: Number = 0,
    solver: str = "certified",
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Threshold:
    """Return the amplitude of temperature cycles above which a chain creeps for ever.

    Or, with `after`, above which it advances in cycle `after`: exact and reproducible, but no more
    than it says, as the chain may lock a little later. Long chains creep chaotically: see
    `half_life`; chains with disorder: see `intercept`.

    Parameters
    ----------
    chain : Chain
        Without disorder; without `after` of at most five sliders.
    after : int, optional
        Full cycles +A, -A, in the last of which x_G has to advance down the incline by more than
        1e-6. Default: the chain creeps for ever, down or up; see `fate`.
    digits : int
        Significant digits of the bracket.
    low, high : number, optional
        Ends of the scan; default 1/2 and 2 times Eq. (seuil). If nothing creeps up to there (or the
        law is not positive), the default scan goes on to N (mu_s c - s)/l0; if the chain creeps at
        its lower end, as it may from a start with tensions, it begins at 0.
    points : int
        Equal steps of the scan.
    bracket : pair of numbers, optional
        Instead of a scan: the chain does not creep at the first, and creeps at the second.
    windows : bool
        Whether to list all edges of the scan.
    refine : int
        How many windows to give to all digits; the others have float accuracy.
    start_tension : number
        Of every spring, at theta = 0; default none, the relaxed chain.
    seeds : int
        With `after`: also find the threshold from so many starts with seeded tensions, uniform in
        (-size, size) with size ``|start_tension|``, or 1e-6.
    solver : str
        Which decides about the bracket: ``certified``, ``exact`` (float64: at most 12 digits, and a
        wider bracket where rounding does not tell so many), or, with `after`, ``mpmath``.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Come back after so much wall time with what is known; `reason` then says so.

    Returns
    -------
    Threshold
        `lower` and `upper`, how well they are known, and which of the laws beside it is about the
        same thing.

    Raises
    ------
    InputError
        If an argument is out of range, the question has no sense for the chain, a bracket is empty
        or does not straddle an edge, or nothing creeps in the scan.
    GivenUp
        If a run comes to a limit of its solver.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep (with `after`: not
    advance in that cycle) at `lower`, and does at `upper`. It is the first edge of the scan: no
    claim is made between its points.

    With ``mu_s = mu_d`` the chain slides with theta and the threshold is N m/(2 l0), exactly. For
    ``tan_alpha < 0`` the mirror image is meant. Creep for ever may go either way: down the incline,
    or up it as chains of even N do near ``tan_alpha = 0``; `direction` says which was found. On the
    level a chain that starts symmetric never creeps.

    Examples
    --------
    Two relaxed sliders creep from (mu_s c - s)/l0 on:

    >>> from exactcreep import Chain
    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.lower, found.criterion, found.evidence.value
    ('0.00016923076923076', 'lasting', 'proved')
    """
    lasting = after is None
    require_sense(chain, "threshold" if lasting else "threshold after")
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    span = Span.of(chain, low, high, bracket)
    known = [name for name in MOST_DIGITS if name in SOLVERS and not (lasting and name == "mpmath")]
    if not isinstance(solver, str) or solver not in known:
        raise InputError("solver", solver, "must be " + " or ".join(known))
    if not isinstance(windows, bool):
        raise InputError("windows", windows, "must be true or false")
    size = exact_number(start_tension, "start_tension")
    most = MOST_CYCLES if after is None else whole_number(after, "after", least=1, most=10**7)
    criterion = "lasting" if lasting else "horizon"
    asked = Threshold(
        chain=chain,
        criterion=criterion,
        cycles=most,
        digits=whole_number(digits, "digits", least=1, most=MOST_DIGITS[solver]),
        solver=solver,
        compare=_compared(chain, criterion, most, relaxed=size == 0),
    )
    steps = whole_number(points, "points", least=1, most=10**7)
    count = whole_number(refine, "refine", least=0)
    number = whole_number(seeds, "seeds", least=0, most=10**6)
    for name, value, missing in (("refine", count, not windows), ("seeds", number, lasting)):
        if value and missing:
            needed = "windows" if name == "refine" else "after: from some start creep lasts longest"
            raise InputError(name, value, f"needs {needed}")
    if span.bracket is not None and windows:
        raise InputError("windows", windows, "needs a scan, and a bracket skips it")
    if chain.n == 1:
        rest, proved = Outcome.AT_REST, Evidence.PROVED
        return replace(asked, outcome_at_lower=rest, outcome_evidence=proved, evidence=proved)
    if chain.mu_s == chain.mu_d:
        for name, value in (("windows", windows), ("seeds", number)):
            if value:
                allowed = "has no meaning with mu_s = mu_d: there is one edge, whatever the start"
                raise InputError(name, value, allowed)
        return _sliding(asked)
    question = Question(chain, most, State.prepared(chain, [size] * (chain.n - 1)), limits)
    if lasting:
        question = Lasting(chain, most, question.start, limits, solver)
    search = EdgeSearch(asked, question, span, steps, say)
    preparations: dict[int, Edge | None] = {}
    try:
        search.search(windows=windows, refine=count)
        for seed in range(1, number + 1):
            start = State.perturbed(chain, abs(size) or _SEED_SIZE, start_seed=seed)
            preparations[seed] = search.prepared(start)
            say("preparations", seed, number, "starts")
    except OutOfTime as limit:
        search.found = replace(search.found, reason=str(limit))
    return replace(search.found, report=search.report(), preparations=preparations or None)


def _compared(chain: Chain, criterion: str, cycles: int, *, relaxed: bool) -> str:
    """Return which law an edge may be compared with."""
    if chain.n == 1:
        return "no law: one slider has no spring"
    if chain.mu_s == chain.mu_d:
        return "Eq. (seuil), which is exact without slips"
    if chain.n == 2 and relaxed:
        return "(mu_s c - s)/l0, which is exact for two relaxed sliders, and no other law"
    if criterion == "horizon":
        return f"no law: it says what happens in cycle {cycles}, and creep may end later"
    return "no law: Eq. (seuil) is about long chains, and about the intercept of v(A)"


def _sliding(asked: Threshold) -> Threshold:
    """Return N m/(2 l0), where the chain slides with theta: mu_s = mu_d."""
    chain = asked.chain
    tangent = abs(chain.tan_alpha)
    # N (mu_d - tan) cos / (2 l0) = sqrt(square), floored exactly
    square = (chain.n * (chain.mu_d - tangent) / (2 * chain.l0)) ** 2 / (1 + tangent**2)
    unit = Fraction(10) ** (magnitude(square) // 2 + 1 - asked.digits - _SPARE)
    below = math.isqrt(math.floor(square / unit**2))
    cycles = min(asked.cycles, 20)  # it repeats from the second on
    simulation = solver_named("sliding", {}).simulation(
        chain, State.relaxed(chain), 0, ("x_G", "slips")
    )
    followed = advance(simulation, Cycles(below * unit, cycles), 2 * cycles)
    moves = bool(np.any(followed.recorded["slips"][-2:]))
    return replace(
        asked,
        solver="sliding",
        lower=text_of(below, unit),
        upper=text_of(below + 1, unit),
        outcome_at_lower=Outcome.CYCLING if moves else Outcome.AT_REST,
        evidence=Evidence.PROVED,
        direction="downhill",
        stable_digits=asked.digits if asked.criterion == "horizon" else None,
        report={"exact": (below * unit) ** 2 == square},
    )


def _rounded(low: Fraction, high: Fraction, begins: bool = True) -> Edge:
    """Return an edge of float accuracy, rounded outward."""
    unit = unit_of(high, MOST_DIGITS["exact"] - 1)
    below, above = math.floor(low / unit), math.ceil(high / unit)
    return Edge(text_of(below, unit), text_of(above, unit), begins, Evidence.COMPUTED)


class Refined(NamedTuple):
    """An edge, what happens on both sides, and why it is no edge that is known; "" if it is."""

    edge: Edge
    at_lower: Observation
    at_upper: Observation
    doubt: str = ""


@dataclass
class EdgeSearch:
    """The search for an edge: scan, bisection, the deciding event's theta_c, two deciding runs.

    Attributes
    ----------
    found : Threshold
        What is asked for, with what is known so far.
    question : Question
    span : Span
    points : int
        Equal steps of the scan.
    say : callable
        Told how far the search has come.
    runs : dict of (int, Fraction) to Observation
        Of the deciding solver, by cycles and amplitude.
    decided : bool
        Whether the runs that decide about the threshold are done.
    transient : dict or None
        How a transient goes on that has come to no end.
    """

    found: Threshold
    question: Question
    span: Span
    points: int
    say: Callable[..., None]
    runs: dict[tuple[int, Fraction], Observation] = field(default_factory=dict)
    decided: bool = False
    transient: dict[str, Any] | None = None

    def search(self, *, windows: bool, refine: int) -> None:
        """Find the threshold, and what was asked for beside it; `found` grows on the way."""
        question, edges, lowest = self.question, [], self.span.scans[0][0]
        if self.span.free and question.creeps(lowest):
            self.span = replace(self.span, scans=[(Fraction(0), lowest)])
        if windows:
            self._know(windows=())
            for edge in self.edges():
                edges.append(edge)
                self._know(windows=tuple(_rounded(*one) for one in edges))
        low, high = edges[0][:2] if edges else self.first_bracket()
        self._enclosed(_rounded(low, high))
        refined = self.refined(low, high)
        self.decided = True
        self._enclosed(refined.edge)
        lower, upper = refined.at_lower, refined.at_upper
        outcome, evidence = lower.outcome, lower.outcome_evidence
        self._know(outcome_at_lower=outcome, outcome_evidence=evidence, direction=upper.direction)
        if windows:
            told = [refined.edge] if refine else []
            told += [self.refined(*edge).edge for edge in edges[1:refine]]
            told += [self.rough(*edge) for edge in edges[refine:]]
            self._know(windows=tuple(told))
        if isinstance(question, Lasting):
            sensitive = tuple(sorted(map(nearest_float, question.sensitive)))
            self._know(fates=(lower.fate, upper.fate), sensitive=sensitive, reason=refined.doubt)
        else:
            if outcome is None:
                self._settle(Fraction(refined.edge.lower))
            locked = outcome is Outcome.CYCLING and evidence is Evidence.PROVED
            lasts = locked or outcome is Outcome.AT_REST
            self._know(stable_digits=self.stable_digits(refined.edge, lasts))
        if not refined.doubt:
            differs = first_difference(*map(numbered, side_by_side(lower, upper)))
            self._know(deciding_event=None if differs is None else Difference(*differs[1:]))

    def prepared(self, start: State) -> Edge | None:
        """Return the edge from another start; None: none is found."""
        other = replace(self, question=replace(self.question, start=start), runs={})
        try:
            return other.refined(*other.first_bracket()).edge
        except InputError:
            return None

    def _know(self, **known: Any) -> None:
        self.found = replace(self.found, **known)

    def _enclosed(self, edge: Edge) -> None:
        self._know(lower=edge.lower, upper=edge.upper, evidence=edge.evidence)

    def report(self) -> dict[str, Any]:
        """Return what it took."""
        report: dict[str, Any] = {"deciding_runs": len(self.runs)}
        if self.transient is not None:
            report["transient"] = self.transient
        if isinstance(self.question, Lasting):
            report["certified_points"] = len(self.question.certified)
        return report

    # -- float64 -----------------------------------------------------------------------------

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
            low, high, _ = next(self.edges())
            return low, high
        low, high = self.span.bracket
        for creeps in (self.question.creeps, lambda amplitude: self._tried(amplitude).creeps):
            if (creeps(low), creeps(high)) == (False, True):  # where float64 tells them apart
                return low, high
        shown = f"{nearest_float(low)} {nearest_float(high)}"
        raise InputError("bracket", shown, "must straddle an edge: no creep at LO, creep at HI")

    def narrowed(self, low: Fraction, high: Fraction, begins: bool) -> Bracket:
        """Return the bracket after bisection in float64."""
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

    # -- all digits --------------------------------------------------------------------------

    def refined(self, low: Fraction, high: Fraction, begins: bool = True) -> Refined:
        """Return an edge to all digits, decided by two runs of the chosen solver."""
        question, side = self.question, high if begins else low
        if question.unsettled(side):
            sides = [question.tried(amplitude, "exact", {}) for amplitude in (low, high)]
            doubt = f"at A = {nearest_float(side):.9g} creep does not settle within"
            doubt += f" {question.cycles} cycles"
            return Refined(self.rough(low, high, begins), sides[0], sides[1], doubt)
        unit = unit_of(high, self.found.digits + _SPARE)
        if question.float_fails(low, high):  # bisection in float64 would find an edge of its own
            first, last = below, above = math.floor(low / unit), math.ceil(high / unit)
        else:
            low, high = self.narrowed(low, high, begins)
            room = _NARROW * high if high - low < _NARROW * high / 2 else 0  # or its ends are alike
            guess = self._deciding(
                *(question.tried(one, "exact", {}) for one in (low - room, high + room))
            )
            if guess is None or abs(guess - high) > _STRAY * (high - low + room):
                guess = (low + high) / 2
            if self.found.solver == "exact":
                # float64 claims no more than what its own edge shares with that of the same
                # itinerary at more digits
                apart = max(abs(guess - low), abs(guess - high))
                while unit < 4 * apart:
                    unit *= 10
            first, last = math.floor(low / unit), math.ceil(high / unit)
            below = math.floor(guess / unit)
            above = below + 1
        # the edge is the deciding event's, or lies further on in the bracket of float64, or, if
        # that errs, outside
        step = last - first
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
        return self._closed_in(below, above, unit, begins)

    def _beyond(self, k: int, unit: Fraction, begins: bool) -> bool:
        return self._tried(k * unit).creeps == begins

    def _closed_in(self, below: int, above: int, unit: Fraction, begins: bool) -> Refined:
        """Return the edge between two multiples of `unit`, within one unit of the last digit."""

        def cut(k: int) -> None:
            nonlocal below, above
            if below < k < above:
                below, above = (below, k) if self._beyond(k, unit, begins) else (k, above)

        while (width := above - below) > 1:
            edge = self._deciding(self._tried(below * unit), self._tried(above * unit))
            if edge is not None:
                cut(math.floor(edge / unit))
                cut(math.floor(edge / unit) + 1)
            if above - below > width // 2:
                cut((below + above) // 2)
        # an end that lies exactly on the edge may be undecided; one unit further out it is not
        ends = []
        for k, way in ((below, -1), (above, 1)):
            unproved = self._tried(k * unit).evidence is not Evidence.PROVED
            if unproved and self.found.solver == "certified":
                k += way if self._beyond(k + way, unit, begins) == (way > 0) else 0
            ends.append(k)
        lower, upper = (self._tried(k * unit) for k in ends)
        evidence = weaker(lower.evidence, upper.evidence)
        edge_ = Edge(text_of(ends[0], unit), text_of(ends[1], unit), begins, evidence)
        return Refined(edge_, lower, upper)

    def _tried(self, amplitude: Fraction, question: Question | None = None) -> Observation:
        """Return what the deciding solver finds."""
        question = question or self.question
        key = question.cycles, amplitude
        if key not in self.runs:
            self.say("deciding", len(self.runs) + 1, 0, "runs")
            solver, digits = self.found.solver, self.found.digits + _SPARE
            options = {} if solver == "exact" else {"digits": digits}
            if solver == "certified":
                # an exact tie outside Q(c) is undecided at any precision: do not try very many
                options["most_digits"] = 4 * digits + 1000
            self.runs[key] = question.tried(amplitude, solver, options)
        return self.runs[key]

    def _deciding(self, one: Observation, other: Observation) -> Fraction | None:
        """Return the amplitude that tells two runs apart."""
        digits = self.found.digits + _SPARE + 3
        return deciding_amplitude(self.question, *side_by_side(one, other), digits)

    # -- longer drives -------------------------------------------------------------------------

    def _settle(self, amplitude: Fraction) -> None:
        """Follow a transient in float64 through many more cycles at `amplitude`."""
        changes: list[tuple[int, float]] = []
        for times in _LATER:
            later = replace(self.question, cycles=times * self.question.cycles)
            most = _LATER[-1] * self.question.cycles
            self.say("behaviour below", later.cycles, most, "cycles")
            trial = later.tried(amplitude, "exact", {})
            evidence = weaker(trial.outcome_evidence, Evidence.COMPUTED)
            if trial.outcome is not None and not trial.creeps:
                self._know(outcome_at_lower=trial.outcome, outcome_evidence=evidence)
                return
            changes.append((later.cycles, trial.change))
        self.transient = transient(changes)
        self._know(outcome_evidence=evidence)

    def stable_digits(self, edge: Edge, lasts: bool) -> int:
        """Return how many digits of an edge survive when `cycles` is doubled.

        `lasts`: what the chain does at its lower end, it does for ever.
        """
        lower, upper = Fraction(edge.lower), Fraction(edge.upper)
        shown = min(self.found.digits, magnitude(edge.middle / (upper - lower)))
        doubled = replace(self.question, cycles=2 * self.question.cycles)
        if self._tried(upper, doubled).creeps and (lasts or not self._tried(lower, doubled).creeps):
            return shown
        again = replace(self, question=doubled, runs={})
        try:
            low, high = again.first_bracket()
        except InputError:
            return 0
        low, high = again.narrowed(low, high, begins=True)
        close = abs((low + high) / 2 - edge.middle) <= 100 * _NARROW * high
        other = again.refined(low, high).edge.middle if close else (low + high) / 2
        if other == edge.middle:
            return shown
        return max(0, min(shown, magnitude(edge.middle / abs(edge.middle - other))))
