"""Chains whose runs several files look at, and what refuses a file."""

from __future__ import annotations

from exactcreep import Targets
from tests.paper import paper_chain

TWO, THREE, SIX, THIRTY = map(paper_chain, (2, 3, 6, 30))
TWO_SURE = paper_chain(2, "0")
RECORDS = ("x_G", "x", "tension", "slips", "events")
VECTORS = Targets([["0.004", "0.002"], ["-0.003", "0.001"], [0, "0.004"], ["0.002", "-0.002"]])
"""A dilation for each of two springs."""
