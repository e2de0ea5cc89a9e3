"""The result of `fate`: what a chain does for ever, computed in float64 or proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Itinerary
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome, cycles_text, direction_of, found_text
from exactcreep.model.result import Result
from exactcreep.model.state import State

Period = tuple[tuple[int, Itinerary], ...]
"""The rearrangements of one period: each with its half-cycle, from 1, and its itinerary."""


@dataclass(frozen=True, eq=False, repr=False)
class Fate(Result):
    """What a chain does in the end.

    Attributes
    ----------
    chain, amplitude, start
        The arguments; cycles are +A, -A.
    solver : str
        ``certified``, or ``exact`` if this is the answer of float64.
    outcome : Outcome
        `AT_REST`, `CYCLING` (locked: slips return the same tensions without an advance),
        `CREEPING` (the same tensions after a period, with an advance), `RUNAWAY`, or `LIMIT` (it
        has not settled, and `reason` says what ended the search).
    evidence : Evidence
        `PROVED`: for ever. `COMPUTED`: in float64 the same state returned bit for bit, and starts
        that differ by a few rounding errors have the same outcome. `UNDECIDED`: they have another
        outcome, the state returned to within rounding, or a comparison was within its error bound.
    cycles : int
        Number of whole cycles that were followed.
    settled_after, period : int or None
        After `settled_after` cycles every period has this `itinerary` and this `advance`, and ends
        with the same tensions. If a proved cycle has avalanches, the tensions approach the cycle,
        and `advance_enclosure` holds the advance of every period. None: not settled.
    advance : float or None
        Of x_G over a period, unit ``g tau_dyn**2``; 0 at rest or locked.
    advanced_until : int
        Last cycle (up to `settled_after` if known) in which x_G moved, down or up the incline, by
        more than 2**-40 (mu_s + |tan_alpha|) cos(alpha); 0: none.
    marginal : bool
        Locked in the limit: after k cycles the distance from a locked cycle falls like 1/k. From
        `settled_after` on, every cycle has the same slips.
    by_rounding : bool
        Whether the outcome or the number `settled_after` differs between starts that differ by a
        few rounding errors; `reason` has their numbers. Only the answer of float64 says so.
    itinerary : tuple or None
        See `Period`.
    advance_enclosure : Enclosure or None
        The advance, if the solver encloses it.
    reason : str
        What proves a runaway; which limit ended the search; or how the chain returns if it does not
        return exactly.
    report : mapping
        Facts that only this solver reports.

    Examples
    --------
    >>> fate(pair, "0.001").finding
    'creeping downhill, settled after 1 cycle (proved)'
    """

    chain: Chain
    amplitude: Fraction
    start: State
    solver: str
    outcome: Outcome
    evidence: Evidence
    cycles: int
    settled_after: int | None = None
    period: int | None = None
    advance: float | None = None
    advanced_until: int = 0
    marginal: bool = False
    by_rounding: bool = False
    itinerary: Period | None = None
    advance_enclosure: Enclosure | None = None
    reason: str = ""
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def direction(self) -> str:
        """``downhill``, ``uphill``, on the level ``+x`` (slider 1 to N) or ``-x``, or ``none``."""
        ways = {Outcome.RUNAWAY: self.chain.heading, Outcome.CREEPING: self.advance or 0.0}
        return direction_of(ways.get(self.outcome, 0), self.chain.tan_alpha)

    @property
    def velocity(self) -> float | None:
        """Advance of x_G per half-cycle once settled, ``g tau_dyn**2``; None: not settled."""
        return None if self.advance is None or not self.period else self.advance / self.period / 2

    @property
    def finding(self) -> str:
        """What the chain does for ever, from which cycle on, and how sure that is, in words."""
        when = ""
        if self.outcome is Outcome.LIMIT:
            when = f"not settled in {cycles_text(self.cycles)}"
        elif self.settled_after is not None and not self.by_rounding:
            when = f"settled after {cycles_text(self.settled_after)}"
        return found_text(self.outcome, self.direction, when, self.evidence)

    _told = (
        "solver", "outcome", "evidence", "direction", "cycles", "settled_after", "period",
        "advance", "velocity", "advanced_until", "marginal", "by_rounding", "reason",
    )  # fmt: skip

    def _facts(self) -> dict[str, Any]:
        return {"n": self.chain.n, "amplitude": self.amplitude, **super()._numbers()}

    def _numbers(self) -> dict[str, Any]:
        out = self._facts() | {"amplitude": nearest_float(self.amplitude), "report": self.report}
        if self.advance_enclosure is not None:
            middle, radius = self.advance_enclosure
            out["advance_enclosure"] = [middle - radius, middle + radius]
        if self.itinerary is not None:
            out["itinerary"] = [
                {"half_cycle": half, "events": [f"{kind} {movers(*who)}" for kind, *who in events]}
                for half, events in self.itinerary
            ]
        return out


def movers(sliders: Sequence[int], signs: Sequence[int]) -> str:
    """Return which sliders move in an event, and in which direction: ``1 up, 5 down``."""
    pairs = zip(sliders, signs, strict=True)
    return ", ".join(f"{n} {'down' if sign > 0 else 'up'}" for n, sign in pairs)
