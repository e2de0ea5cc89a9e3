"""The rows of a rearrangement, and of its slips, from its events in any arithmetic.

An event says who starts or stops; how far the sliders have come by then completes what the tables
say. Every slip goes one way: friction takes ``mu_d cos(alpha)`` times its length, gravity gives
``sin(alpha)`` times its displacement, and the springs have the difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.motion.arithmetic import Arithmetic
from exactcreep.motion.replay import elastic_gain
from exactcreep.solvers.tables import RearrangementRow, SlipRow


@dataclass
class Avalanche:
    """A rearrangement under way.

    Attributes
    ----------
    number, half_cycle, theta, direction
        See `RearrangementRow`; `number` counts rearrangements from 0.
    tensions : ndarray, shape (n - 1,)
        At theta_c, before anything moves.
    moved : ndarray, shape (n,)
        Displacements since then of the sliders that have stopped.
    undecided : int
        Comparisons that were so up to the end of the rearrangement before.
    """

    number: int
    half_cycle: int
    theta: Any
    direction: int
    tensions: NDArray[Any]
    moved: NDArray[Any]
    undecided: int = 0
    began: list[int] = field(default_factory=list)
    sliders: set[int] = field(default_factory=set)
    under_way: dict[int, tuple[Any, Any]] = field(default_factory=dict)  # start and place
    events: int = 0
    slips: int = 0
    time: Any = 0
    path: Any = 0
    largest: Any = 0

    def take(
        self,
        event: Event,
        moved: NDArray[Any],
        coefficient: Callable[[int], Any],
        arithmetic: Arithmetic,
    ) -> list[SlipRow]:
        """Take in the next event; return the slips that it ends.

        Parameters
        ----------
        event : Event
        moved : ndarray, shape (n,)
            Displacements of its sliders since the start of the rearrangement.
        coefficient : callable
            Returns the static coefficient that a slider (from 0) has drawn at its stop.
        arithmetic : Arithmetic
        """
        self.events += 1
        self.time = event.time
        if event.kind is EventKind.START:
            self.began = self.began or list(event.sliders)
            self.sliders.update(event.sliders)
            for slider in event.sliders:
                self.under_way[slider] = event.time, moved[slider - 1]
            return []
        ended = []
        for slider in event.sliders:
            begun, place = self.under_way.pop(slider)
            way = moved[slider - 1] - place
            self.slips += 1
            self.moved[slider - 1] = moved[slider - 1]
            self.path = self.path + abs(way)
            self.largest = arithmetic.larger(abs(way), self.largest)
            drawn = float(coefficient(slider - 1))
            ended.append(SlipRow(slider, self.number, begun, event.time, way, drawn))
        return ended

    def row(self, chain: Chain, arithmetic: Arithmetic, undecided: int) -> RearrangementRow:
        """Return the row of the rearrangement, which has come to rest."""
        total = self.moved.sum()
        before = arithmetic.dot(self.tensions, self.tensions) / 2
        return RearrangementRow(
            half_cycle=self.half_cycle,
            theta=self.theta,
            direction=self.direction,
            began=len(self.began),
            began_first=min(self.began),
            began_last=max(self.began),
            duration=self.time,
            events=self.events,
            slips=self.slips,
            sliders=len(self.sliders),
            first=min(self.sliders),
            last=max(self.sliders),
            displacement=total / chain.n,
            largest_slip=self.largest,
            elastic_before=before,
            elastic_after=before + elastic_gain(arithmetic, self.tensions, self.moved),
            gravity=arithmetic.times_cosine(chain, chain.tan_alpha) * total,
            dissipation=arithmetic.times_cosine(chain, chain.mu_d) * self.path,
            undecided=undecided - self.undecided,
        )
