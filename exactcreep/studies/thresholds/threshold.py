"""The amplitude above which a chain creeps for ever, or advances in a cycle, to any digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.model.uniform import EXPANSION
from exactcreep.quasistatic.creep import interruptible
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.sense import require_sense
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.beside_laws import BesideLaws, laws_beside
from exactcreep.studies.thresholds.questions import (
    ADVANCE,
    MOST_CYCLES,
    Lasting,
    Question,
    WithoutSlips,
)
from exactcreep.studies.thresholds.search import (
    MOST_DIGITS,
    Difference,
    Edge,
    Unfinished,
    all_edges,
    first_edge,
)
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits
from exactcreep.watch.progress import Hearer, reporter

_OF_A_SIDE = "outcome", "evidence", "settled_after", "period", "advance", "direction", "reason"


@dataclass(frozen=True, eq=False, repr=False)
class Threshold(BesideLaws):
    """The amplitude at which creep begins, with the laws for comparison.

    Attributes
    ----------
    chain, digits, solver
        The arguments.
    criterion, cycles : str, int
        ``lasting``: the chain has to settle within `cycles`; ``horizon``: it has to advance in the
        last of them (`after`).
    compare : str
        The law to compare the edge with.
    lower, upper : str or None
        Decimals: the chain does not creep (``horizon``: not advance in the last cycle) at `lower`,
        and does at `upper`. If creep does not settle within `cycles`: the last
        amplitude of the scan at which the chain locked, and the next one. None for one slider.
    evidence : Evidence
        How well the behaviour at `lower` and at `upper` is known.
    direction : str
        Direction of the creep (or advance) at `upper`; ``none`` if unknown.
    outcome_at_lower, outcome_evidence : Outcome or None, Evidence
        `AT_REST` (no event in a whole cycle) or `CYCLING` (slips that return the chain to the same
        state) within `cycles`, or 64 times as many in float64; else None. `PROVED` if the run is
        proved and the cycle has only lone slips; otherwise the state returns to within rounding.
        With ``mu_s = mu_d`` the fate for ever: `CREEPING` is then at most 1e-6 in a cycle.
    deciding_event : Difference or None
        First event that differs between both sides. None: the events are the same, and only the
        advance passes 1e-6.
    fates : pair of Fate or None
        For ``lasting``: what the chain does for ever at `lower` and at `upper`.
    sensitive : tuple of float
        Amplitudes at which starts 1e-13 apart differ in float64, and no certified run found the
        fate. The answer of float64 was taken there, and may be wrong.
    windows : tuple of Edge or None
        On request: every edge of the scan; only the first one is refined beyond float64.
    report : mapping
        Numbers of runs.
    reason : str
        The limit that ended the search, or that creep does not settle; "" if it was completed.

    Examples
    --------
    >>> threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12).evidence.value
    'proved'
    """

    chain: Chain
    criterion: str
    cycles: int
    digits: int
    solver: str
    compare: str
    lower: str | None = None
    upper: str | None = None
    evidence: Evidence = Evidence.UNDECIDED
    direction: str = "none"
    outcome_at_lower: Outcome | None = None
    outcome_evidence: Evidence = Evidence.COMPUTED
    deciding_event: Difference | None = None
    fates: tuple[Fate | None, Fate | None] | None = None
    sensitive: tuple[float, ...] = ()
    windows: tuple[Edge, ...] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    @property
    def law_seuil(self) -> str | None:
        """N m/(2 l0) of Eq. 22 as a decimal; h/l0 of `differing_intercept` if sliders differ."""
        return laws_beside(self.chain, self.digits)["law_seuil"]

    @property
    def law_corrected(self) -> str | None:
        """(N m + D)/(2 l0) as a decimal: Eq. 22 corrected, see `laws.onset_amplitude`."""
        return laws_beside(self.chain, self.digits)["law_corrected"]

    @property
    def law_two_sliders(self) -> str | None:
        """``(mu_s c - s)/l0`` of two relaxed sliders, c = cos(alpha), s = |sin(alpha)|, or None."""
        return laws_beside(self.chain, self.digits)["law_two_sliders"]

    @property
    def what(self) -> str:
        """What begins at the edge: ``creep``, or with `after` ``advance in cycle ...``."""
        return f"advance in cycle {self.cycles}" if self.criterion == "horizon" else "creep"

    @property
    def finding(self) -> str:
        """The amplitudes around the edge, and how sure they are, in words."""
        what = "creep for ever" if self.criterion == "lasting" else f"an {self.what}"
        if self.lower is None or self.upper is None:
            return f"it is not known where {what} begins"
        more = len(self.windows or ()) - 1
        first = f", the first of {more + 1} edges" if more > 0 else ""
        where = f"{what} begins between A = {self.lower} and {self.upper}{first}"
        return f"{where} ({self.evidence.value})"

    told = (
        "lower", "upper", "cycles", "digits", "solver", "criterion",
        "outcome_at_lower", "outcome_evidence", "evidence", "direction", "deciding_event", "report",
    )  # fmt: skip

    def _facts(self) -> dict[str, Any]:
        names = "lower upper outcome_at_lower evidence direction criterion digits law_seuil"
        names += " solver reason"
        return {"n": self.chain.n} | {name: getattr(self, name) for name in names.split()}

    def _numbers(self) -> dict[str, Any]:
        out: dict[str, Any] = {**super()._numbers(), **self._beside()}
        what = self.what.split()[0]
        if self.criterion == "lasting":
            out["sensitive"] = self.sensitive
        for name, one in zip(("fate_at_lower", "fate_at_upper"), self.fates or (), strict=False):
            known = one and one.summary()
            out[name] = known and {part: known[part] for part in _OF_A_SIDE}
        if self.windows is not None:
            out["windows"] = [edge.summary(what) for edge in self.windows]
        return out | ({"reason": self.reason} if self.reason else {})

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        columns, edges = ("lower", "upper", "begins"), self.windows or ()
        return {name: ("edge", [getattr(e, name) for e in edges]) for name in columns}, {}


@shows_progress
@interruptible
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
    solver: str = "certified",
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Threshold:
    """Find the first amplitude in a scan above which a relaxed chain creeps for ever.

    This amplitude is called the edge; above it there may be ranges in which the chain rests. With
    `after`, find the first amplitude above which the chain advances in cycle `after`; the chain may
    stop advancing later. For long chains, which creep chaotically, use `survival`; for chains with
    disorder, use `intercept`.

    Parameters
    ----------
    chain : Chain
        Without disorder. At most five sliders, unless `after` is given or ``mu_s = mu_d``. Friction
        may differ from slider to slider, expansion from spring to spring; end forces may act.
    after : int, optional
        Number of cycles. In the last one x_G has to advance by more than 1e-6 g tau_dyn**2
        downhill, or in the direction of weight and end forces. Default: the chain has to creep for
        ever, in either direction; see `fate`.
    digits : int
        Number of known significant digits of the edge; `lower` and `upper` have two more.
    low, high : number, optional
        Ends of the scan. Default: 1/2 and 2 times Eq. 22. If nothing creeps there, the scan goes on
        to N times the amplitude at which the relaxed chain first slips. If the chain creeps at the
        lower end, the scan is extended down to 0.
    points : int
        Number of equal steps of the scan.
    bracket : pair of numbers, optional
        Replaces the scan: the chain does not creep at the first number, and creeps at the second.
    windows : bool
        Whether to list all edges of the scan: the first to all digits, the others in float64.
    solver : str
        Solver that refines the bracket: ``certified``, or ``exact`` (float64: at most 12 digits,
        fewer near sensitive edges).
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Wall time after which the result so far is returned; `reason` then says so.

    Returns
    -------
    Threshold
        Two decimal amplitudes around the edge, with the laws for comparison.

    Raises
    ------
    InputError
        If an argument is out of range, the question makes no sense for the chain, a bracket is
        empty or contains no edge, or nothing creeps in the scan.
    GivenUp
        If a run reaches a limit of its solver.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep (with `after`: not
    advance in that cycle) at `lower`, and does at `upper`. The edge is the first one in the scan;
    the scan may miss edges between two of its points. With ``mu_s = mu_d`` the result is exact:
    creep for ever begins at N m/(2 l0); odd chains with ``N abs(tan_alpha) <= mu_d`` never creep.

    Examples
    --------
    Two relaxed sliders creep above (mu_s c - s)/l0:

    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.lower, found.evidence.value
    ('0.00016923076923076', 'proved')
    """
    lasting = after is None
    if after is not None:
        after = whole_number(after, "after", least=1, most=10**7)
    require_sense(chain, "threshold", after)
    most = after or MOST_CYCLES
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    span = Span.of(chain, low, high, bracket, points)
    if not isinstance(solver, str) or solver not in MOST_DIGITS:
        raise InputError("solver", solver, "must be " + " or ".join(MOST_DIGITS))
    if not isinstance(windows, bool):
        raise InputError("windows", windows, "must be true or false")
    places = whole_number(digits, "digits", least=1, most=MOST_DIGITS[solver])
    if windows and span.bracket is not None:
        raise InputError("windows", windows, "needs a scan, and a bracket skips it")
    edges: tuple[Edge, ...] = ()
    sensitive: tuple[float, ...] = ()
    report: dict[str, Any] = {}
    over = ""
    if chain.n == 1:
        rest, proved = Outcome.AT_REST, Evidence.PROVED
        edges = (Edge(outcome_at_lower=rest, outcome_evidence=proved, evidence=proved),)
    else:
        asked: Any = Lasting if lasting else Question
        if chain.slides:
            asked = partial(WithoutSlips, least=Fraction(0) if lasting else ADVANCE)
            solver, span = "sliding", span._replace(points=1)  # its advance grows with A
        question = asked(chain, most, State.relaxed(chain), limits, solver, say)
        try:
            if windows:
                edges = all_edges(question, span, places)
            else:
                edges = (first_edge(question, span, places),)
        except Unfinished as search:
            edges, over = search.edges, str(search)
        report = question.report()
        if isinstance(question, Lasting):
            sensitive = tuple(sorted(map(nearest_float, question.sensitive)))
    edge = edges[0] if edges else Edge()
    return Threshold(
        chain=chain,
        criterion="lasting" if lasting else "horizon",
        cycles=most,
        digits=places,
        solver=solver,
        compare=_compared(chain, after),
        lower=edge.lower,
        upper=edge.upper,
        evidence=edge.evidence,
        direction=edge.direction,
        outcome_at_lower=edge.outcome_at_lower,
        outcome_evidence=edge.outcome_evidence,
        deciding_event=edge.deciding_event,
        fates=edge.fates if lasting else None,
        sensitive=sensitive,
        windows=(edges or None) if windows else None,
        report=report,
        reason=over or edge.doubt,
    )


def _compared(chain: Chain, after: int | None) -> str:
    if chain.n == 1:
        return "no law: one slider has no spring"
    if chain.n == 2 and not chain.slides and not chain.unlike:
        return "(mu_s c - s)/l0, which is exact for two relaxed sliders, and no other law"
    if EXPANSION in chain.unlike:
        return "no law: springs expand differently"
    if after is not None:
        return f"no law: it says what happens in cycle {after}, and creep may end later"
    if chain.slides:
        return f"{'h/l0' if chain.unlike else 'Eq. 22'}, which is exact without slips"
    return "no law: Eq. 22 is about long chains, and about the intercept of v(A)"
