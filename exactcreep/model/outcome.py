"""The words for a result: its evidence (how well it is known) and its outcome."""

from __future__ import annotations

from enum import Enum
from typing import Any


class Evidence(Enum):
    """How well a result is known, from the best to the least.

    Examples
    --------
    >>> creep(pair, Cycles("0.001", 3), solver="certified").evidence.value
    'proved'
    """

    PROVED = "proved"
    """Every comparison was decided in proved (ball or rational) arithmetic."""
    COMPUTED = "computed"
    """float64 decided every comparison by more than its rounding bound, and an estimate shows that
    rounding does not decide what is said: by it, the errors of tensions stay below 1e-12 of the
    largest force in a rearrangement; copies that differ by a few rounding errors have the events of
    the run, and tensions within 1e-9; or they have the same fate."""
    UNDECIDED = "undecided"
    """A comparison was within its rounding bound and settled by the model's rules, or rounding
    errors may be larger. The trajectory of a run is then known up to `Creep.known_until`."""

    @classmethod
    def of(cls, undecided: int, best: Evidence) -> Evidence:
        """Return UNDECIDED if the model's rules settled some of the comparisons, else `best`."""
        return cls.UNDECIDED if undecided else best

    def and_then(self, other: Evidence) -> Evidence:
        """Return the weaker of the two, for a result that needs both."""
        return max(self, other, key=list(Evidence).index)


class Outcome(Enum):
    """What the chain does, or why the computation stopped; see `exactcreep.creep`.

    Examples
    --------
    >>> creep(pair, Cycles("0.0001", 3)).outcome.value
    'at_rest'
    """

    CREEPING = "creeping"
    """The chain advances: every slider has moved in the same direction."""
    CYCLING = "cycling"
    """Sliders slip, but the chain does not advance."""
    AT_REST = "at_rest"
    """Nothing moves any more; for a rearrangement: every slider has stopped."""
    RUNAWAY = "runaway"
    """Provably no slider ever stops again."""
    LIMIT = "limit"
    """Given up: the result is partial, and `reason` says why."""


def direction_of(advance: Any, tan_alpha: Any) -> str:
    """Return the direction of x_G in one word.

    On the level ``+x`` or ``-x``, the axis from slider 1 to slider N; ``none`` for zero or nan.

    >>> direction_of(-0.2, tan_alpha=0.25), direction_of(-0.2, -0.25), direction_of(-0.2, 0)
    ('uphill', 'downhill', '-x')
    """
    if not (advance > 0 or advance < 0):
        return "none"
    if tan_alpha == 0:
        return "+x" if advance > 0 else "-x"
    return "downhill" if (advance > 0) == (tan_alpha > 0) else "uphill"


def with_direction(outcome: Outcome, direction: str) -> str:
    """Return the outcome, and the direction if there is one: ``creeping uphill``."""
    return outcome.value if direction == "none" else f"{outcome.value} {direction}"


def cycles_text(count: int) -> str:
    """Return a number of cycles in words: ``1 cycle``, ``2 cycles``."""
    return f"{count} cycle{'s' * (count != 1)}"


def found_text(outcome: Outcome, direction: str, when: str, evidence: Evidence) -> str:
    """Return the finding of a run or a fate: ``at rest, settled after 1 cycle (proved)``.

    Its evidence is left out if it is undecided: how well a trajectory is known is no outcome.
    """
    found = with_direction(outcome, direction).replace("_", " ")
    known = "" if evidence is Evidence.UNDECIDED else f" ({evidence.value})"
    return ", ".join(filter(None, (found, when))) + known
