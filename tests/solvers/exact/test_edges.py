"""Starts within a few floats of an edge of the itinerary: what is computed there is right.

In `edges.json` chains are short; the slow test makes others anew, and long ones with disorder.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise

import pytest

from exactcreep import Evidence
from tests.data.make_edges import (
    EDGES,
    FILE,
    SEED,
    Start,
    digest,
    long_chain,
    read,
    short_chain,
    starts,
)

STORED = read(FILE.read_text(encoding="utf-8"))


def verdicts(held: Iterable[Start], solver: str) -> Counter[Evidence]:
    """Require of every start that what is said of it is true; count what is said."""
    said: Counter[Evidence] = Counter()
    for start in held:
        result = start.begun.rearranged(start.tension, solver)
        pairs = zip(result.state.displacements.tolist(), start.places, strict=True)
        off = [Fraction(float(a)) - Fraction(b) for a, b in pairs]
        error = max(map(abs, [*off, *(b - a for a, b in pairwise(off))]))
        about = f"{start.begun}, tension {start.tension!r}"
        if result.evidence is Evidence.COMPUTED:
            assert digest(result.itinerary) == start.events, about
        assert error <= result.error, about
        said[result.evidence] += 1
    return said


@pytest.mark.parametrize("solver", ["exact", "reference"])
def test_next_to_an_edge_what_is_computed_is_right(solver: str) -> None:
    assert len({(start.begun.seed, start.begun.spring) for start in STORED}) == EDGES
    said = verdicts(STORED, solver)
    assert said.total() >= 190
    assert said[Evidence.COMPUTED] >= said.total() // 5  # not all is in doubt


def test_the_stored_starts_are_what_their_generator_makes() -> None:
    made = starts(SEED, 1)
    assert [next(made) for _ in range(2)] == STORED[:2]


@pytest.mark.slow
@pytest.mark.timeout(36_000)
@pytest.mark.parametrize("solver", ["exact", "reference"])
@pytest.mark.parametrize(("drawn", "edges"), [(short_chain, 2500), (long_chain, 250)])
def test_next_to_other_edges_what_is_computed_is_right(
    drawn: object, edges: int, solver: str
) -> None:
    said = verdicts(starts(SEED + 1, edges, drawn), solver)
    assert said.total() > 7 * edges
