"""Edges, the amplitudes at which creep begins or ends, to any number of digits.

A scan in float64 finds where the answer to a question changes; bisection narrows the edge as far as
float64 tells. Across the edge one event differs; its condition is followed to its root (see
`deciding`). Two runs of the chosen solver, at the decimals that enclose the root, then show that
the answers differ; what leads to these decimals need not be trusted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple, TypedDict

import xarray as xr

from exactcreep.laws import LAWS, edges
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, nearest_float, plain_data
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.representation import Shown, drawn
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, digits_of
from exactcreep.quasistatic.decimals import enclosure
from exactcreep.studies.eventlog import LoggedEvent, first_difference, numbered
from exactcreep.studies.fates.proof import Recurrence
from exactcreep.studies.thresholds.deciding import conditions, log2, secant
from exactcreep.studies.thresholds.horizon import Question, Trial, last_outcome, transient, weaker
from exactcreep.studies.thresholds.lasting import Lasting, side_by_side

MOST_DIGITS = {"certified": 5_000, "mpmath": 300, "exact": 12}
"""Digits of an amplitude that each solver is asked to tell."""
_FLOAT_DIGITS = MOST_DIGITS["exact"]
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
SPARE = 2  # digits of the bracket beyond those asked for
_LATER = (4, 16, 64)  # times the cycles, after which a transient may be over


@dataclass(frozen=True)
class Edge:
    """An amplitude at which creep, or an advance in some cycle, begins or ends.

    Attributes
    ----------
    lower, upper : str
        Decimals that enclose it: at one of them the chain creeps (or advances), not at the other.
    begins : bool
        Whether creep begins there (it creeps at `upper`), or ends.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    """

    lower: str
    upper: str
    begins: bool
    evidence: Evidence

    @property
    def middle(self) -> Fraction:
        """The middle of the bracket."""
        return (Fraction(self.lower) + Fraction(self.upper)) / 2

    def summary(self, what: str = "creep") -> dict[str, Any]:
        """Return the edge by names, ready for JSON; `what` begins or ends there."""
        return {
            "lower": self.lower,
            "upper": self.upper,
            what: "begins" if self.begins else "ends",
            "evidence": self.evidence.value,
        }


@dataclass(frozen=True)
class Difference:
    """The first event that differs across an edge; None: no further event on that side."""

    at_lower: LoggedEvent | None
    at_upper: LoggedEvent | None

    def summary(self) -> dict[str, Any]:
        """Return both events by names, ready for JSON."""
        return {
            "at_lower": None if self.at_lower is None else self.at_lower.summary(),
            "at_upper": None if self.at_upper is None else self.at_upper.summary(),
        }


@dataclass(frozen=True, repr=False)
class Threshold(Shown):
    """An edge of what a chain does, by the criterion horizon or lasting, with the laws beside it.

    Attributes
    ----------
    chain : Chain
    cycles : int
        Of ``horizon``: in the last of them the chain has to advance. Of ``lasting``: in so many it
        has to settle.
    digits : int
        Significant digits asked for.
    law_seuil, law_corrected, law_two_sliders : str or None
        Eq. (seuil); with the term that it drops; ``(mu_s c - s)/l0``, for two sliders only.
    lower, upper : str or None
        Decimals: the chain does not creep (``horizon``: not advance in the last cycle) at `lower`,
        and does at `upper`. Where creep does not settle they are points of the scan: the last
        that locked, and the first that outlived the cycles. None for one slider.
    outcome_at_lower : Outcome or None
        `AT_REST` (no event in a whole cycle, hence for ever), `CYCLING` (slips that return
        the chain to the same state); if neither within `cycles`, what it has come to after up to
        64 times as many in float64; None if it still does neither.
    outcome_evidence : Evidence
        Of `outcome_at_lower`: `PROVED` if the run is and the cycle has lone slips alone, which
        return the chain exactly; otherwise it has been seen to return, to within rounding.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    stable_digits : int or None
        Of ``horizon``: how many of the digits survive when `cycles` is doubled.
    deciding_event : Difference or None
        None if no event differs: the advance itself passes 1e-6 there.
    solver : str
    criterion : str
        ``horizon`` or ``lasting``; see `threshold`.
    compare : str
        Which law it may be compared with.
    fates : pair of Recurrence or None
        What the chain does for ever at `lower` and at `upper`, of the criterion ``lasting``.
    sensitive : tuple of float
        Amplitudes at which starts 1e-13 apart part in float64, and no certified run has told the
        fate either: there the answer is that of float64, and may be wrong.
    windows : tuple of Edge
        Every edge of the scan, if asked for.
    preparations : mapping of int to Edge
        The threshold from each seeded start, if asked for; None where none was found.
    report : mapping
        How many runs of the solver it took; at how many amplitudes of the scan a certified run
        told the fate where float64 does not; if `outcome_at_lower` is None, ``transient``: how many
        ``cycles`` were followed in float64, the largest ``change`` of a tension in the last of
        them, and the ``power`` of the number of cycles like which the changes fall, if they do.
    reason : str
        Which limit ended the search, or that creep does not settle; "" if it was completed. What
        it had not come to is None, or missing from a list; `lower` and `upper` are as narrow as
        they had become.

    Examples
    --------
    >>> from exactcreep import Chain, threshold
    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> float(found.upper) > float(found.lower), found.evidence.value, found.outcome_at_lower.value
    (True, 'proved', 'at_rest')
    """

    chain: Chain
    cycles: int
    digits: int
    law_seuil: str | None
    law_corrected: str | None
    law_two_sliders: str | None
    lower: str | None
    upper: str | None
    outcome_at_lower: Outcome | None
    outcome_evidence: Evidence
    evidence: Evidence
    solver: str
    criterion: str
    compare: str
    stable_digits: int | None = None
    deciding_event: Difference | None = None
    fates: tuple[Recurrence | None, Recurrence | None] | None = None
    sensitive: tuple[float, ...] = ()
    windows: tuple[Edge, ...] | None = None
    preparations: Mapping[int, Edge | None] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    def _facts(self) -> dict[str, Any]:
        return {
            "n": self.chain.n,
            "lower": self.lower,
            "upper": self.upper,
            "outcome_at_lower": self.outcome_at_lower,
            "evidence": self.evidence,
            "criterion": self.criterion,
            "digits": self.digits,
            "law_seuil": self.law_seuil,
            "solver": self.solver,
            "reason": self.reason,
        }

    def _picture(self) -> str:
        """Return whether there is creep over the amplitude, from half the threshold to twice it."""
        if self.lower is None or self.upper is None:
            return ""
        low, high = float(self.lower), float(self.upper)
        return drawn([0, 0, 1, 1], [low / 2, low, high, 2 * high])

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        outcome = self.outcome_at_lower
        out: dict[str, Any] = {
            "lower": self.lower,
            "upper": self.upper,
            "outcome_at_lower": None if outcome is None else outcome.value,
            "outcome_evidence": self.outcome_evidence.value,
            "evidence": self.evidence.value,
            "cycles": self.cycles,
            "digits": self.digits,
            "stable_digits": self.stable_digits,
            "deciding_event": None
            if self.deciding_event is None
            else self.deciding_event.summary(),
            "solver": self.solver,
        }
        out |= {"criterion": self.criterion, **beside(self.chain, self.compare, self.digits)}
        what = "advance" if self.criterion == "horizon" else "creep"
        if self.criterion == "lasting":
            out["sensitive"] = list(self.sensitive)
        if self.fates is not None:
            sides = zip(("fate_at_lower", "fate_at_upper"), self.fates, strict=True)
            out |= {name: one and one.summary() for name, one in sides}
        if self.windows is not None:
            out["windows"] = [edge.summary(what) for edge in self.windows]
        if self.preparations is not None:
            out["preparations"] = [
                {"seed": seed, "lower": None, "upper": None, **(e.summary(what) if e else {})}
                for seed, e in self.preparations.items()
            ]
        if self.reason:
            out["reason"] = self.reason
        return out | {"report": dict(self.report)}

    def dataset(self) -> xr.Dataset:
        """Return the edges of the scan along ``edge``, and all single values as attributes."""
        columns = ("lower", "upper", "begins")
        return xr.Dataset(
            {name: ("edge", [getattr(e, name) for e in self.windows or ()]) for name in columns},
            attrs=single_values(self.chain, self.summary()),
        )


@dataclass(frozen=True)
class Asked:
    """The checked arguments of a search for an edge."""

    chain: Chain
    criterion: str
    cycles: int
    digits: int
    points: int
    windows: bool
    refine: int
    seeds: int
    solver: str
    relaxed: bool
    say: Callable[..., None]

    def options(self) -> dict[str, Any]:
        """Return the options of the solver that decides."""
        if self.solver == "exact":
            return {}
        digits = self.digits + SPARE
        if self.solver == "mpmath":
            return {"digits": digits}
        # an exact tie outside Q(c) is undecided at any precision: do not try very many
        return {"digits": digits, "most_digits": 4 * digits + 1000}

    def answer(self, **known: Any) -> Threshold:
        """Return a result with what was asked for, and the laws beside."""
        return Threshold(
            chain=self.chain,
            cycles=self.cycles,
            digits=self.digits,
            **{"solver": self.solver, "criterion": self.criterion} | known,
            **laws_beside(self.chain, self.digits),
            compare=self._compare(),
        )

    def _compare(self) -> str:
        chain = self.chain
        if chain.n == 1:
            return "no law: one slider has no spring"
        if chain.mu_s == chain.mu_d:
            return "Eq. (seuil), which is exact without slips"
        if chain.n == 2 and self.relaxed:
            return "(mu_s c - s)/l0, which is exact for two relaxed sliders, and no other law"
        if self.criterion == "horizon":
            return f"no law: it says what happens in cycle {self.cycles}, and creep may end later"
        return "no law: Eq. (seuil) is about long chains, and about the intercept of v(A)"


def _rounded(low: Fraction, high: Fraction, begins: bool) -> Edge:
    """Return an edge of float accuracy, rounded outward."""
    unit = unit_of(high, _FLOAT_DIGITS - 1)
    below, above = math.floor(low / unit), math.ceil(high / unit)
    return Edge(text_of(below, unit), text_of(above, unit), begins, Evidence.COMPUTED)


class Refined(NamedTuple):
    """An edge, what happens on both sides, and why it is no edge that is known; "" if it is."""

    edge: Edge
    at_lower: Trial
    at_upper: Trial
    doubt: str = ""


class Search:
    """The search for an edge: scan, bisection, the deciding event's root, two deciding runs."""

    def __init__(
        self,
        asked: Asked,
        question: Question,
        scans: list[tuple[Fraction, Fraction]],
        bracket: tuple[Fraction, Fraction] | None,
    ) -> None:
        self.asked = asked
        self.question = question
        self.scans = scans
        self.bracket = bracket
        self.trials = 0
        # what has been found, should time be out
        self.found: list[tuple[Fraction, Fraction, bool]] = []
        self.narrowest: tuple[Fraction, Fraction] | None = None
        self.decided: Refined | None = None
        self.transient: dict[str, Any] | None = None

    def threshold(self) -> Threshold:
        """Return the threshold, and what was asked for beside it."""
        question = self.question
        edges = list(self.edges()) if self.asked.windows else None
        low, high = edges[0][:2] if edges else self.first_bracket()
        refined = self.decided = self.refined(low, high, begins=True)
        at_lower, at_upper = refined.at_lower, refined.at_upper
        known: dict[str, Any] = {"windows": self.windows(refined, edges)}
        if isinstance(question, Lasting):
            sides = map(numbered, side_by_side(at_lower, at_upper))
            known |= {
                "outcome_at_lower": at_lower.outcome,
                "outcome_evidence": at_lower.evidence,
                "fates": (at_lower.fate, at_upper.fate),
                "sensitive": tuple(sorted(map(nearest_float, question.sensitive))),
                "reason": refined.doubt,
            }
        else:
            known |= self._at_horizon(refined)
            sides = map(numbered, (at_lower.log, at_upper.log))
        differs = None if refined.doubt else first_difference(*sides)
        known["deciding_event"] = None if differs is None else Difference(*differs[1:])
        return self._result(refined.edge, **known)

    def _at_horizon(self, refined: Refined) -> dict[str, Any]:
        """Return what the chain does below the edge later on, and what a longer run changes."""
        outcome, evidence = last_outcome(refined.at_lower, self.question.half_cycles)
        lasting = outcome is Outcome.AT_REST or (
            outcome is Outcome.CYCLING and evidence is Evidence.PROVED
        )
        if outcome is None:
            outcome, evidence = self.settled(Fraction(refined.edge.lower))
        return {
            "outcome_at_lower": outcome,
            "outcome_evidence": evidence,
            "stable_digits": self.stable_digits(refined, lasting),
        }

    def windows(
        self, first: Refined, edges: list[tuple[Fraction, Fraction, bool]] | None
    ) -> tuple[Edge, ...] | None:
        """Return every edge of the scan, as accurately as was asked for."""
        if edges is None:
            return None
        return tuple(
            (first if k == 0 else self.refined(*edge)).edge
            if k < self.asked.refine
            else self.rough(*edge)
            for k, edge in enumerate(edges)
        )

    def unfinished(self, reason: str) -> Threshold:
        """Return what had been found when time was out."""
        edge = None
        outcome, evidence = None, Evidence.COMPUTED
        if self.decided is not None:
            edge = self.decided.edge
            lower = self.decided.at_lower
            outcome, evidence = lower.outcome, lower.evidence
            if outcome is None:
                outcome, evidence = last_outcome(lower, self.question.half_cycles)
        elif self.narrowest is not None:
            edge = _rounded(*self.narrowest, begins=True)
        windows = tuple(_rounded(*one) for one in self.found) if self.asked.windows else None
        return self._result(
            edge,
            outcome_at_lower=outcome,
            outcome_evidence=evidence,
            windows=windows,
            reason=reason,
        )

    def _result(self, edge: Edge | None, **known: Any) -> Threshold:
        report: dict[str, Any] = {"deciding_runs": self.trials}
        if self.transient is not None:
            report["transient"] = self.transient
        if isinstance(self.question, Lasting):
            report["certified_points"] = len(self.question.certified)
        return self.asked.answer(
            lower=None if edge is None else edge.lower,
            upper=None if edge is None else edge.upper,
            evidence=Evidence.UNDECIDED if edge is None else edge.evidence,
            report=report,
            **known,
        )

    def edge(self) -> Refined:
        """Return the lowest edge at which creep begins."""
        return self.refined(*self.first_bracket(), begins=True)

    # -- float64 -----------------------------------------------------------------------------

    def edges(self) -> Iterator[tuple[Fraction, Fraction, bool]]:
        """Yield a bracket of every edge of the scan, and whether creep begins there."""
        points = self.asked.points
        before = self.scans[0][0]
        creeping = self.question.creeps(before)
        if creeping:
            allowed = "must be lower: the chain creeps there already"
            raise InputError("from", nearest_float(before), allowed)
        for begin, end in self.scans:
            found = False
            for k in range(1, points + 1):
                amplitude = begin + (end - begin) * k / points
                creeps = self.question.creeps(amplitude)
                self.asked.say("scan", k, points, "amplitudes")
                if creeps != creeping:
                    found = True
                    self.found.append((before, amplitude, creeps))
                    self.narrowest = self.narrowest or (before, amplitude)
                    yield before, amplitude, creeps
                before, creeping = amplitude, creeps
            if found:
                return
        allowed = "must be higher: the chain creeps at no point of the scan"
        raise InputError("to", nearest_float(before), allowed)

    def first_bracket(self) -> tuple[Fraction, Fraction]:
        """Return the bracket that was given, or the first of the scan."""
        if self.bracket is None:
            low, high, _ = next(self.edges())
            return low, high
        low, high = self.bracket
        creeps = [self.question.creeps(amplitude) for amplitude in self.bracket]
        if creeps != [False, True]:  # or float64 does not tell them apart
            creeps = [self._tried(amplitude).creeps for amplitude in self.bracket]
        if creeps != [False, True]:
            shown = f"{nearest_float(low)} {nearest_float(high)}"
            allowed = "must straddle an edge: no creep at LO, creep at HI"
            raise InputError("bracket", shown, allowed)
        self.narrowest = low, high
        return low, high

    def narrowed(
        self, low: Fraction, high: Fraction, begins: bool, width: Fraction = _NARROW
    ) -> tuple[Fraction, Fraction]:
        """Return the bracket after bisection at midpoints, in float64."""
        while high - low > width * high:
            middle = (low + high) / 2
            if self.question.creeps(middle) == begins:
                high = middle
            else:
                low = middle
            if begins and self.decided is None:
                self.narrowest = low, high
        return low, high

    def rough(self, low: Fraction, high: Fraction, begins: bool) -> Edge:
        """Return an edge at float accuracy; between points of the scan where creep does not settle.

        How long a transient lives changes from float to float: there is no edge to bisect for.
        """
        if self.question.unsettled(high if begins else low):
            return replace(_rounded(low, high, begins), evidence=Evidence.UNDECIDED)
        return _rounded(*self.narrowed(low, high, begins), begins)

    # -- all digits --------------------------------------------------------------------------

    def refined(self, low: Fraction, high: Fraction, begins: bool) -> Refined:
        """Return an edge to all digits, decided by two runs of the chosen solver."""
        unit = unit_of(high, self.asked.digits + SPARE)
        question = self.question
        if question.unsettled(high if begins else low):
            sides = [question.tried(amplitude, "exact", {}) for amplitude in (low, high)]
            side = nearest_float(high if begins else low)
            doubt = f"at A = {side:.9g} creep does not settle within {question.cycles} cycles"
            return Refined(self.rough(low, high, begins), sides[0], sides[1], doubt)
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

        below_k, above_k = math.floor(guess / unit), math.floor(guess / unit) + 1
        # the edge is the first condition's, or lies further on in the bracket of float64, or, if
        # that errs, outside
        step = max(math.ceil((high - low) / unit), 1)
        reach = below_k - math.floor(low / unit)
        if coarse:
            below_k, above_k = math.floor(low / unit), math.ceil(high / unit)
        while above(below_k):
            above_k = below_k
            below_k = max(below_k - max(reach, 1), 0)
            reach = step
            step *= 2
            if above_k == 0:
                raise InputError("bracket", str(low), "must not creep at its lower end")
        reach = math.ceil(high / unit) - above_k
        while not above(above_k):
            below_k = above_k
            above_k += max(reach, 1)
            reach = step
            step *= 2
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
        proved = self.asked.solver == "certified"
        if proved and trials[below_k].evidence is not Evidence.PROVED and not above(below_k - 1):
            below_k -= 1
        if proved and trials[above_k].evidence is not Evidence.PROVED and above(above_k + 1):
            above_k += 1
        at_lower, at_upper = trials[below_k], trials[above_k]
        evidence = weaker(at_lower.evidence, at_upper.evidence)
        edge = Edge(text_of(below_k, unit), text_of(above_k, unit), begins, evidence)
        return Refined(edge, at_lower, at_upper)

    def _tried(self, amplitude: Fraction, question: Question | None = None) -> Trial:
        self.trials += 1
        self.asked.say("deciding", self.trials, 0, "runs")
        return (question or self.question).tried(amplitude, self.asked.solver, self.asked.options())

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

    def settled(self, amplitude: Fraction) -> tuple[Outcome | None, Evidence]:
        """Return what float64 has the chain do after many more cycles at `amplitude`."""
        changes: list[tuple[int, float]] = []
        for times in _LATER:
            later = replace(self.question, cycles=times * self.question.cycles)
            most = _LATER[-1] * self.question.cycles
            self.asked.say("behaviour below", later.cycles, most, "cycles")
            trial = later.tried(amplitude, "exact", {})
            outcome, evidence = last_outcome(trial, later.half_cycles)
            if outcome is not None and not trial.creeps:
                return outcome, weaker(evidence, Evidence.COMPUTED)
            changes.append((later.cycles, trial.change))
        self.transient = transient(changes)
        return None, weaker(trial.evidence, Evidence.COMPUTED)

    def stable_digits(self, refined: Refined, lasting: bool) -> int:
        """Return how many digits of an edge survive when `cycles` is doubled.

        `lasting`: what the chain does at its lower end, it does for ever.
        """
        asked, edge = self.asked, refined.edge
        width = Fraction(edge.upper) - Fraction(edge.lower)
        shown = min(asked.digits, math.floor(log2(edge.middle / width) / BITS_PER_DIGIT))
        doubled = replace(self.question, cycles=2 * self.question.cycles)
        lower, upper = Fraction(edge.lower), Fraction(edge.upper)
        if self._tried(upper, doubled).creeps and (
            lasting or not self._tried(lower, doubled).creeps
        ):
            return shown
        again = Search(replace(asked, windows=False), doubled, self.scans, self.bracket)
        try:
            low, high = again.first_bracket()
        except InputError:
            return 0
        low, high = again.narrowed(low, high, True)
        close = abs((low + high) / 2 - edge.middle) <= 100 * _NARROW * high
        other = again.refined(low, high, True).edge.middle if close else (low + high) / 2
        return _shared_digits(edge.middle, other, shown)


def _shared_digits(a: Fraction, b: Fraction, most: int) -> int:
    """Return how many significant digits `b` shares with `a`, at most `most`."""
    if a == b:
        return most
    return max(0, min(most, math.floor(log2(abs(a) / abs(a - b)) / BITS_PER_DIGIT)))


# -- decimals --------------------------------------------------------------------------------


def unit_of(value: Fraction, digits: int) -> Fraction:
    """Return one unit of the last of `digits` significant decimal digits of `value` > 0."""
    exponent = math.floor(log2(value) / BITS_PER_DIGIT)
    while Fraction(10) ** (exponent + 1) <= value:
        exponent += 1
    while Fraction(10) ** exponent > value:
        exponent -= 1
    return Fraction(10) ** (exponent + 1 - digits)


def text_of(count: int, unit: Fraction) -> str:
    """Return ``count * unit`` as a decimal; `unit` is a power of ten."""
    digits = len(str(unit.denominator)) - len(str(unit.numerator))
    return str(Decimal((int(count < 0), tuple(map(int, str(abs(count)))), -digits)))


def single_values(chain: Chain, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of a summary is text or a number, and the chain: attributes of a dataset."""
    single = {k: v for k, v in summary.items() if isinstance(v, (str, int, float))}
    return plain_data(chain.parameters()) | single


def beside(chain: Chain, compare: str, digits: int = 12) -> dict[str, Any]:
    """Return what stands beside a threshold: laws, theorems, which of them are about the same."""
    return {**laws_beside(chain, digits), "theorems": edges(chain), "compare": compare}


class _Predicted(TypedDict):
    law_seuil: str | None
    law_corrected: str | None
    law_two_sliders: str | None


def laws_beside(chain: Chain, digits: int) -> _Predicted:
    """Return what the laws predict, as decimals."""
    context = digits_of(math.ceil((digits + 10) * BITS_PER_DIGIT)).context
    rationals = {name: getattr(chain, name) for name in ("l0", "mu_d", "mu_s")}
    rationals["tan_alpha"] = abs(chain.tan_alpha)
    parameters = {k: context.mpf(v.numerator) / v.denominator for k, v in rationals.items()}

    def shown(label: str, form: str) -> str | None:
        law = LAWS.get(label)
        function = None if law is None else getattr(law, form)
        if function is None:
            return None
        return enclosure(function(n=chain.n, **parameters)).text(digits)

    two = chain.n == 2
    return {
        "law_seuil": shown("seuil", "printed"),
        "law_corrected": shown("seuil", "corrected"),
        "law_two_sliders": shown("threshold_th_2_cycle_corrected", "exact") if two else None,
    }
