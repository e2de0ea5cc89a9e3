"""Say in one sentence what a chain was found to do: its threshold, its fate, its lives."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from exactcreep.model.numbers import in_full, with_error
from exactcreep.model.outcome import Evidence

if TYPE_CHECKING:
    from exactcreep import Fate, Intercept, Survival, Threshold

_KNOWN = {
    Evidence.PROVED: "proved",
    Evidence.COMPUTED: "computed in float64",
    Evidence.UNDECIDED: "undecided",
}
_OF_STARTS = {
    "locked": "locked",
    "at_rest": "at rest",
    "creeping": "still creeping",
    "dormant": "dormant",
    "runaway": "running away",
    "undecided": "undecided",
}


def of_threshold(found: Threshold) -> str:
    """Say between which amplitudes the edge lies, or why none is known."""
    what = f"an {found.what}" if found.criterion == "horizon" else "creep for ever"
    if found.lower is None or found.upper is None:
        return _because(f"It is not known where {what} begins", found.reason)
    more = len(found.windows or ()) - 1
    windows = f", the first of {more + 1} edges" if more > 0 else ""
    where = f"{what} begins between A = {found.lower} and {found.upper}{windows}"
    return _because(f"{where[0].upper()}{where[1:]} ({_KNOWN[found.evidence]})", found.reason)


def of_intercept(found: Intercept) -> str:
    """Say where the straight part of v(A) meets zero, and what the paper's law says."""
    if math.isnan(found.intercept):
        return _because("It is not known where the straight part of v(A) meets zero", found.reason)
    shift = f", by up to {found.systematic:.2g} elsewhere in the range" * (found.systematic > 0)
    where = f"A = {with_error(found.intercept, found.error)}{shift}"
    beside = f"Eq. 22 says {found.law_seuil:.6g}"
    return _because(f"The straight part of v(A) meets zero at {where}; {beside}", found.reason)


def of_fate(fate: Fate) -> str:
    """Say what the chain does for ever, after how many cycles, and how well that is known."""
    return fate.sentence[:1].upper() + fate.sentence[1:]


def of_survival(lives: Survival) -> str:
    """Say how soon creep ends, and what the starts came to."""
    followed = len(lives.records)
    shares = lives.fractions if followed else {}
    counts = [(shares[kind].starts, words) for kind, words in _OF_STARTS.items() if kind in shares]
    first, *others = [(count, words) for count, words in counts if count] or [(0, "followed")]
    came = f"{first[0]} of {followed} starts are {first[1]}"
    came += "".join(f", {count} {words}" for count, words in others)
    rate = lives.rate
    if rate.rate > 0:
        longest = in_full(1 / rate.low) if rate.low > 0 else "any number"
        between = f"{in_full(1 / rate.high)} to {longest}, 95 %"
        ends = f"Creep ends at 1 in {in_full(1 / rate.rate)} cycles ({between})"
    else:
        ends = "At which rate creep ends is not known"
        ends += f" ({rate.reason})" if rate.reason else ""
    return _because(f"{ends}; {came}", lives.reason)


def _because(said: str, reason: str) -> str:
    return f"{said}: {reason}" if reason else said
