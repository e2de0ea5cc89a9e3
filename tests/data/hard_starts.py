"""Starts from which rounding decides what happens, with what the certified solver proved of them.

`hard_starts.json` holds near-grazes and near-ties (a power of ten from where the events change),
edges (a few floats from there), hard avalanches, and speeds and forces that touch their edges
within rounding. A tension of a random chain was bisected with the certified solver down to two
neighbouring floats between which the events of the rearrangement change.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exactcreep import Chain, State, rearrange
from exactcreep.model.contacts import Itinerary
from exactcreep.solvers.rearrangement import Rearrangement

FILE = Path(__file__).with_name("hard_starts.json")


@dataclass(frozen=True)
class Start:
    """A start, and the truth: a name of the events, and the displacements at the end.

    A `direction` of 0 lets the sliders start that exceed their thresholds as the chain stands.
    """

    kind: str
    chain: dict[str, Any]
    tensions: list[Any]
    direction: int
    seed: int
    most_events: int
    events: str = ""
    places: tuple[str, ...] = ()

    def rearranged(self) -> Rearrangement:
        """Return the rearrangement from there; the truth is that of `certified` with 25 digits."""
        chain = Chain(**self.chain)
        state = State.prepared(chain, self.tensions, seed=self.seed)
        known = {"seed": self.seed, "max_events": self.most_events}
        return rearrange(chain, state, direction=self.direction, **known)


def stored(kind: str) -> list[Start]:
    """Return the starts of a kind: near-graze, edge, hard, or touch."""
    known = json.loads(FILE.read_text(encoding="utf-8"))
    return [Start(**each) for each in known if each["kind"] == kind]


def digest(itinerary: Itinerary) -> str:
    """Return a name of an itinerary."""
    return hashlib.sha256(repr(itinerary).encode()).hexdigest()[:16]
