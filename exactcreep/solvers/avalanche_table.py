"""Make the tables of rearrangements and slips of what solvers log: slips, and rests.

Every slip goes one way: friction takes ``mu_d cos(alpha)`` times its length, gravity gives
``sin(alpha)`` times its displacement, and the springs have the difference. The elastic energies
come from tensions, not from the other two: that the three add up shows that each slip ended at
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.replay import elastic_gain
from exactcreep.solvers.tables import REARRANGEMENT_TABLE

_DERIVED = ("displacement", "gravity", "dissipation")
_LOGGED = tuple(name for name in REARRANGEMENT_TABLE.fields if name not in _DERIVED)
REST_LOG = np.dtype(
    [(name, REARRANGEMENT_TABLE.fields[name].dtype) for name in _LOGGED]
    + [("moved", "float64"), ("path", "float64")],
    align=True,
)
"""A row for each rearrangement, at its end; `moved`: sum of all displacements, `path`: of their
sizes, slip by slip."""


def finished(rests: Any, chain: Chain, arithmetic: Arithmetic = FLOAT64) -> dict[str, Any]:
    """Return the fields of the table of rearrangements, of rows of REST_LOG or of one of them."""
    weight, friction = (arithmetic.times_cosine(chain, x) for x in (chain.tan_alpha, chain.mu_d))
    return {name: rests[name] for name in _LOGGED} | {
        "displacement": rests["moved"] / chain.n,
        "gravity": np.multiply(weight, rests["moved"]),
        "dissipation": np.multiply(friction, rests["path"]),
    }


class Avalanche:
    """A rearrangement under way, in any arithmetic: makes slips, and its row, of its events.

    `known` are its `half_cycle`, `theta`, and the `direction` of the ramp; `tensions`, shape (n -
    1,), those at theta_c.
    """

    def __init__(
        self, chain: Chain, arithmetic: Arithmetic, known: Mapping[str, Any], tensions: NDArray[Any]
    ) -> None:
        self.known, self.tensions = known, tensions
        self.moved = arithmetic.zeros(chain.n)
        self._chain, self._arithmetic = chain, arithmetic
        self._under_way: dict[int, tuple[Any, ...]] = {}  # since when and from where
        self._slips: list[tuple[Any, ...]] = []
        self._began: tuple[int, ...] = ()
        self._events = 0

    def take(
        self, event: Event, number: int, moved: NDArray[Any], coefficient: Callable[[int], Any]
    ) -> list[tuple[Any, ...]]:
        """Take in an event of rearrangement `number`; return the rows of slips it ends.

        `moved` are displacements since its start; `coefficient(k)` is what slider k (from 0) draws.
        """
        before = len(self._slips)
        self._began = self._began or event.sliders
        self._events += 1
        for k in (slider - 1 for slider in event.sliders):
            if event.kind is EventKind.START:
                self._under_way[k] = event.time, moved[k]
            else:
                start, place = self._under_way.pop(k)
                slip, drawn = moved[k] - place, float(coefficient(k))
                self.moved[k] = moved[k]
                self._slips.append((k + 1, number, start, event.time, slip, drawn))
        return self._slips[before:]

    def row(self, undecided: int) -> tuple[Any, ...]:
        arithmetic, tensions = self._arithmetic, self.tensions
        sliders, lengths = [slip[0] for slip in self._slips], [abs(slip[4]) for slip in self._slips]
        before = arithmetic.dot(tensions, tensions) / 2
        rest = dict(self.known) | {
            "began": len(self._began),
            "began_first": min(self._began),
            "began_last": max(self._began),
            "duration": self._slips[-1][3],
            "events": self._events,
            "slips": len(sliders),
            "sliders": len(set(sliders)),
            "first": min(sliders),
            "last": max(sliders),
            "moved": self.moved.sum(),
            "path": reduce(add, lengths),
            "largest_slip": reduce(arithmetic.larger, lengths),
            "elastic_before": before,
            "elastic_after": before + elastic_gain(arithmetic, tensions, self.moved),
            "undecided": undecided,
        }
        found = finished(rest, self._chain, arithmetic)
        return tuple(found[name] for name in REARRANGEMENT_TABLE.fields)
