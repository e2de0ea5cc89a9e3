"""The amplitude above which a chain creeps for ever, or advances in a cycle, to any digits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.uniform import EXPANSION
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.sense import EDGE, IN_CYCLE
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.questions import MOST_CYCLES, InCycle, Lasting, Sliding
from exactcreep.studies.thresholds.search import MOST_DIGITS, Edge, Search
from exactcreep.studies.thresholds.threshold_result import Threshold, laws_beside
from exactcreep.watch.limits import Limits

_OF_A_SIDE = "outcome", "evidence", "settled_after", "period", "advance", "direction", "reason"


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
    scanned: bool = False
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
        if not self.scanned:
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
    bracket: tuple[Number, Number] | None = None,
    edges: bool = False,
) -> CreepEdge:
    """Return the edge of a chain for which it makes sense; see `threshold`."""
    span = Span.of(chain, low, high, bracket, points)
    if not isinstance(edges, bool):
        raise InputError("edges", edges, "must be true or false")
    places = whole_number(digits, "digits", least=1, most=MOST_DIGITS)
    if edges and span.bracket is not None:
        raise InputError("edges", edges, "needs a scan, and a bracket skips it")
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
        scanned=span.bracket is None and not chain.slides,
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
