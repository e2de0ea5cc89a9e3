"""The amplitude above which a chain creeps: an edge to any digits, or an intercept of v(A)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from inspect import signature
from typing import Any

from exactcreep import laws
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.uniform import EXPANSION
from exactcreep.quasistatic.creep import interruptible
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.sense import EDGE, IN_CYCLE, INTERCEPT, require_sense
from exactcreep.studies.thresholds.intercept import intercept_of
from exactcreep.studies.thresholds.questions import MOST_CYCLES, InCycle, Lasting, Sliding
from exactcreep.studies.thresholds.search import MOST_DIGITS, Edge, Search, Span
from exactcreep.studies.thresholds.threshold_result import Threshold, laws_beside
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits
from exactcreep.watch.progress import Hearer, reporter

_LONG = 100  # sliders of a chain of which one run may take seconds: a theorem comes first
_KINDS = EDGE, INTERCEPT
_OF_A_SIDE = "outcome", "evidence", "settled_after", "period", "advance", "direction", "reason"


@shows_progress
@interruptible
def threshold(
    chain: Chain,
    *,
    kind: str | None = None,
    after: int | None = None,
    digits: Number | None = None,
    low: Number | None = None,
    high: Number | None = None,
    points: Number | None = None,
    edges: bool = False,
    cycles: Number | None = None,
    fit: tuple[Number, Number] | None = None,
    size: Number | None = None,
    seed: Number | None = None,
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Threshold:
    """Find the amplitude above which a chain creeps.

    Without disorder this is an edge: the first amplitude in a scan above which the relaxed chain
    creeps for ever; above it there may be ranges in which the chain rests. With `after`, it is the
    first amplitude above which the chain advances in cycle `after`; the chain may stop later. With
    disorder no edge is sharp, and the straight part of v(A) is extrapolated to zero instead: the
    intercept, the threshold in the paper's figures and in Eq. 22. For more than five sliders
    without disorder, which creep chaotically, name the kind or use `survival`.

    Parameters
    ----------
    chain : Chain
        Friction may differ from slider to slider, end forces may act, and for an edge expansion may
        differ from spring to spring.
    kind : str, optional
        ``edge`` (no disorder; at most five sliders, unless `after` is given or ``mu_s = mu_d``) or
        ``intercept`` (at least two sliders with slips, on a slope below mu_d). Default:
        ``intercept`` with disorder, else ``edge``.
    after : int, optional
        Edge: number of cycles. In the last one x_G has to advance by more than 1e-6 g tau_dyn**2
        downhill, or in the direction of weight and end forces. Default: the chain has to creep for
        ever, in either direction; see `fate`.
    digits : int, optional
        Edge: number of known significant digits; `lower` and `upper` have two more. Default: 15.
    low : number, optional
        Edge: lower end of the scan. Default: half of Eq. 22. If the chain creeps there, the scan is
        extended down to 0.
    high : number, optional
        Edge: upper end of the scan. Default: twice Eq. 22. If nothing creeps there, the scan goes
        on to N times the amplitude at which the relaxed chain first slips.
    points : int, optional
        Edge: number of equal steps of the scan. Default: 1000. Intercept: number of amplitudes, at
        least 8. Default: 12. Amplitude k, from 1, has the start and the disorder of start k of
        `survival`.
    edges : bool
        Edge: whether to list all edges of the scan: the first to all digits, the others in float64.
    cycles : int, optional
        Intercept: number of cycles at each amplitude. Default: 400.
    fit : pair of numbers, optional
        Intercept: range of the line in units of Eq. 22. Default: 1.2 and 2.
    size : number, optional
        Intercept: tensions of a start are uniform in (-size, size), unit m g. Default: 1e-3.
    seed : int, optional
        Intercept: seed of the starts and of the disorder. Default: 0.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Wall time after which the result so far is returned; `reason` then says so.

    Returns
    -------
    Threshold
        Its `kind`, and two decimal amplitudes around the edge, or the intercept with its error and
        the quality of the line; with the laws for comparison.

    Raises
    ------
    InputError
        If an argument is out of range or belongs to the other kind, the question makes no sense for
        the chain, nothing creeps in the scan, or `cycles` are too few for standard errors.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep (with `after`: not
    advance in that cycle) at `lower`, and does at `upper`. The edge is the first one in the scan;
    the scan may miss edges between two of its points. With ``mu_s = mu_d`` the result is exact:
    creep for ever begins at N m/(2 l0); odd chains with ``N abs(tan_alpha) <= mu_d`` never creep.
    An intercept is never proved: a weighted least-squares line through velocities measured in
    float64, `UNDECIDED` if its chi2 has a probability below 1 %. If a run reaches a limit of its
    solver, the result holds what is known by then, and `reason` names the amplitude. Source:
    Eqs. 20 and 22.

    Examples
    --------
    Two relaxed sliders creep above (mu_s c - s)/l0:

    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.kind, found.lower, found.evidence.value
    ('edge', '0.00016923076923076', 'proved')
    >>> rough = threshold(Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25"), cycles=200)
    >>> rough.kind, round(rough.intercept / rough.law_seuil, 1)
    ('intercept', 1.3)
    """
    if kind is not None and not (isinstance(kind, str) and kind in _KINDS):
        raise InputError("kind", kind, "must be " + " or ".join(_KINDS))
    if after is not None:
        after = whole_number(after, "after", least=1, most=10**7)
    rough = isinstance(chain, Chain) and chain.sigma_mu != 0
    chosen = kind or (INTERCEPT if rough else EDGE)
    require_sense(chain, IN_CYCLE if after and chosen == EDGE else chosen)
    answer: Callable[..., Threshold] = intercept_of if chosen == INTERCEPT else edge_of
    words: dict[str, Any] = {
        "after": after, "digits": digits, "low": low, "high": high, "points": points,
        "edges": edges or None, "cycles": cycles, "fit": fit, "size": size, "seed": seed,
    }  # fmt: skip
    given = {name: value for name, value in words.items() if value is not None}
    (other,) = {*_KINDS} - {chosen}
    for name in given.keys() - signature(answer).parameters.keys():
        why = ": with disorder no edge is sharp" if rough and not kind else ""
        allowed = f"belongs to kind={other!r}, and this is an {chosen}{why}"
        raise InputError(name, given[name], allowed)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    if chain.n >= _LONG and (least := laws.edges(chain).get("no_lasting_creep")):
        theorem = f"no start creeps for ever below A = {least:.6g} (proved)"
        say("scan", 0, 1, "amplitudes", answer=theorem)
    return answer(chain, limits, say, **given)


@dataclass(frozen=True, eq=False, repr=False)
class CreepEdge(Threshold):
    """The edge above which a chain creeps for ever, or advances in cycle `after`; any digits."""

    chain: Chain
    kind: str
    cycles: int
    digits: int
    solver: str
    compare: str
    law_seuil: str | None
    law_corrected: str | None
    law_two_sliders: str | None
    lower: str | None = None
    upper: str | None = None
    evidence: Evidence = Evidence.UNDECIDED
    direction: str = "none"
    fates: tuple[Fate | None, Fate | None] | None = None
    sensitive: tuple[float, ...] = ()
    edges: tuple[Edge, ...] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    @property
    def what(self) -> str:
        """What begins at the edge: ``creep``, or with `after` ``advance in cycle ...``."""
        return "creep" if self.kind == EDGE else f"advance in cycle {self.cycles}"

    @property
    def finding(self) -> str:
        """The amplitudes around the edge, and how sure they are, in words."""
        what = "creep for ever" if self.kind == EDGE else self.what
        if self.lower is None or self.upper is None:
            return f"it is not known where {what} begins"
        where = Edge(self.lower, self.upper, evidence=self.evidence).text(what)
        if self.solver == "sliding":
            return where
        if self.edges is None:
            return f"{where}, the first edge of a scan in float64 (--edges lists all)"
        several = len(self.edges) > 1
        which = f"first of {len(self.edges)} edges" if several else "only edge"
        return f"{where}, the {which} of a scan in float64"

    _told = (
        "kind", "lower", "upper", "cycles", "digits", "solver", "evidence", "direction", "report",
    )  # fmt: skip

    def _facts(self) -> dict[str, Any]:
        names = "lower upper evidence direction kind digits law_seuil solver reason"
        return {"n": self.chain.n} | {name: getattr(self, name) for name in names.split()}

    def _numbers(self) -> dict[str, Any]:
        out: dict[str, Any] = {**super()._numbers(), **self._beside()}
        what = self.what.split()[0]
        if self.kind == EDGE:
            out["sensitive"] = self.sensitive
        for name, one in zip(("fate_at_lower", "fate_at_upper"), self.fates or (), strict=False):
            out[name] = one and {part: getattr(one, part) for part in _OF_A_SIDE}
        if self.edges is not None:
            out["edges"] = [edge.summary(what) for edge in self.edges]
        return out | ({"reason": self.reason} if self.reason else {})

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        columns, edges = ("lower", "upper", "begins"), self.edges or ()
        return {name: ("edge", [getattr(e, name) for e in edges]) for name in columns}, {}


def edge_of(
    chain: Chain,
    limits: Limits,
    say: Callable[..., None],
    *,
    after: int | None = None,
    digits: Number = 15,
    low: Number | None = None,
    high: Number | None = None,
    points: Number = 1000,
    edges: bool = False,
) -> CreepEdge:
    """Return the edge of a chain for which it makes sense; see `threshold`."""
    span = Span.of(chain, low, high, points)
    if not isinstance(edges, bool):
        raise InputError("edges", edges, "must be true or false")
    places = whole_number(digits, "digits", least=1, most=MOST_DIGITS)
    for_ever = Sliding if chain.slides else Lasting
    kind, cycles = (InCycle, after) if after else (for_ever, MOST_CYCLES)
    question = kind(chain, cycles, limits, say)
    search = Search(question, places)
    search.find(span, every=edges)
    known: dict[str, Any] = {**laws_beside(chain, places)}
    if search.edges:
        known |= {name: vars(search.edges[0])[name] for name in ("lower", "upper", "evidence")}
    if search.sides:
        known["direction"] = search.sides[1].direction
        if search.sides[1].fate:
            known["fates"] = search.sides[0].fate, search.sides[1].fate
    return CreepEdge(
        chain=chain,
        kind=f"{IN_CYCLE} {after}" if after else EDGE,
        cycles=question.cycles,
        digits=places,
        solver="sliding" if chain.slides else "certified",
        compare=_compared(chain, after),
        **known,
        sensitive=tuple(sorted(map(nearest_float, getattr(question, "sensitive", ())))),
        edges=(tuple(search.edges) or None) if edges else None,
        report={"deciding_runs": len(question.answers)},
        reason=search.reason,
    )


def _compared(chain: Chain, after: int | None) -> str:
    if chain.n == 2 and not chain.slides and not chain.unlike:
        return "(mu_s c - s)/l0, which is exact for two relaxed sliders, and no other law"
    if EXPANSION in chain.unlike:
        return "no law: springs expand differently"
    if after is not None:
        return f"no law: it says what happens in cycle {after}, and creep may end later"
    if chain.slides:
        return f"{'h/l0' if chain.unlike else 'Eq. 22'}, which is exact without slips"
    return "no law: Eq. 22 is about long chains, and about an intercept of v(A)"
