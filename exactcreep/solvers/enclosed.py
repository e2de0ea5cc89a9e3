"""Mechanics in balls whose enclosures grow no faster than nearby motions part.

Beside the balls, which prove the order of events for every state of the set, the middle of the
set is taken through the same events as a point; at rest the set is put together again from that
point and the derivative of the rearrangement (see `exactcreep.motion.enclosure`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contact import Event, EventKind
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided, balls_of
from exactcreep.motion.enclosure import Box, Passage, Spread
from exactcreep.motion.modes import Flow, Run
from exactcreep.motion.roots import FirstEvent
from exactcreep.solvers.mechanics import Mechanics

DERIVATIVE_BITS = 96
BITS_PER_EVENT = 5
"""Of the derivative's own balls: precision kept for each event of a rearrangement."""


class Enclosed(Mechanics):
    """`Mechanics` in balls with a set kept beside them; see the module."""

    def __init__(
        self,
        chain: Chain,
        seed: int,
        arithmetic: Arithmetic,
        state: State,
        *,
        assume: bool = False,
        keep: bool = False,
    ) -> None:
        super().__init__(chain, seed, arithmetic, state, assume=assume, keep=keep)
        self.box: Box | None = None  # rows: the forces at rest, then l0 theta
        self.centre: Mechanics | None = None
        self.reach: list[Any] = []  # how uncertain the displacements are
        self.origin = state
        self.passages: list[Passage] | None = []
        self.signatures: list[Any] = []
        self.aim: tuple[int, Any] = (0, None)
        self.departure: dict[str, Any] | None = None

    # -- at rest -------------------------------------------------------------------------------

    def ramp(self, way: int, target: Any) -> bool:
        """Ramp theta, the set and its middle along with the balls; see `Mechanics.ramp`."""
        self.aim = (way, target)
        self.departure = self._at_rest() if self.flow is None else self.departure
        self.passages, self.signatures = [], []
        moves = super().ramp(way, target)
        if self.box is None or self.centre is None:
            return moves
        if self.centre.ramp(way, target) != moves:
            raise Undecided("the middle of the set does something else")
        rows = list(self.box.axes)
        first, last, theta = rows[0], rows[-2], rows[-1]
        zero = [flint.arb(0)] * len(first)
        if not moves and target is not None and self.chain.n > 1:
            rows[0] = [a + b for a, b in zip(first, theta, strict=True)]
            rows[-2] = [a - b for a, b in zip(last, theta, strict=True)]
            rows[-1] = zero
        elif moves and self.flow is not None:
            both = [a + b for a, b in zip(first, last, strict=True)]
            if self.flow.signs[0] != 0:  # l0 theta moved by what slider 1 lacked
                rows[0], rows[-2] = zero, both
                rows[-1] = [a + b for a, b in zip(theta, first, strict=True)]
            else:
                rows[0], rows[-2] = both, zero
                rows[-1] = [a - b for a, b in zip(theta, last, strict=True)]
            if self.flow.signs[0] != 0 and self.flow.signs[-1] != 0:
                self.passages = None  # a tie that was assumed
        self.box = Box(rows, self.box.widths)
        return moves

    def _event(self, kind: EventKind, sliders: list[int], signs: list[int], residual: Any) -> Event:
        event = super()._event(kind, sliders, signs, residual)
        self.signatures.append(event.signature)
        return event

    def advance(self, flow: Flow, runs: list[Run], found: FirstEvent) -> NDArray[Any]:
        """Let the sliders move to the event, and note what the derivative needs."""
        signs = flow.signs.copy()
        arrived = super().advance(flow, runs, found)
        if self.box is None or self.passages is None or bool(found.time == 0):
            return arrived
        if len(found.stops) + len(found.starts) > 1:
            self.passages = None  # a tie that was assumed
            return arrived
        slider, side = (found.stops[0], 0) if found.stops else found.starts[0]
        shapes = tuple((run.first, run.motion.p, run.motion.ends) for run in runs)
        accelerations = flow.forces - self.friction * signs
        velocities = flow.velocities.copy()
        self.passages.append(Passage(shapes, found.time, slider, side, velocities, accelerations))
        return arrived

    def rest(self, flow: Flow) -> None:
        """End the rearrangement, and put the set together again."""
        super().rest(flow)
        if self.exact is not None or self.mirrored:
            return
        if self.box is None or self.centre is None or self.passages is None:
            self._enclose()
            return
        centre = self.centre
        if [e.signature for e in centre.rearrangement() if e is not None] != self.signatures:
            raise Undecided("the middle of the set does something else")
        derivative = balls_of(DERIVATIVE_BITS + BITS_PER_EVENT * len(self.passages))
        with derivative.active():
            spread = Spread(self.box.axes[:-1], derivative)
            for passage in self.passages:
                spread.pass_through(passage)
            noise = [x.rad() for x in (*centre.forces, self.l0 * centre.theta)]
            moved = self.box.radii(spread.moved)
            self.reach = [
                (a + b + x.rad()).upper()
                for a, b, x in zip(self.reach, moved, centre.displacements, strict=True)
            ]
            self.box = self.box.carried([*spread.forces, self.box.axes[-1]], noise)
        self._recentre(centre)

    def _enclose(self) -> None:
        """Begin a set at the present balls."""
        centre = Mechanics(self.chain, self.seed, self.arithmetic, self.origin, assume=self.assume)
        centre.exact, centre.fresh, centre.mirrored = None, False, False
        for name in ("forces", "displacements", "tensions"):
            setattr(centre, name, getattr(self, name).copy())
        centre.theta, centre.way = self.theta, self.way
        centre.pinned = dict(self.pinned)
        centre.coefficients, centre.draws = self.coefficients.copy(), self.draws.copy()
        centre.thresholds = self.thresholds.copy()
        self.centre = centre
        self.box = Box.of([x.rad() for x in (*self.forces, self.l0 * self.theta)])
        self.reach = [x.rad() for x in self.displacements]
        self._recentre(centre)

    def _recentre(self, centre: Mechanics) -> None:
        """Take the middle as a point, and the balls around it as wide as the set."""
        assert self.box is not None
        for name in ("forces", "displacements"):
            numbers = getattr(centre, name)
            getattr(centre, name)[:] = [x.mid() for x in numbers]
        centre.theta = centre.theta.mid()
        radii = self.box.radii()
        ball = flint.arb
        self.forces[:] = [ball(m, r) for m, r in zip(centre.forces, radii[:-1], strict=True)]
        self.theta = ball(centre.theta, (radii[-1] / self.l0).upper())
        pairs = zip(centre.displacements, self.reach, strict=True)
        self.displacements[:] = [ball(m, r) for m, r in pairs]
        self.tensions = self.arithmetic.vector(np.cumsum(self.forces - self.weight)[:-1])

    # -- to go on later ------------------------------------------------------------------------

    def _at_rest(self) -> dict[str, Any]:
        """Return copies of everything that determines the future, at rest."""
        centre = self.centre.snapshot() if self.centre is not None else None
        return {
            "mechanics": self.snapshot(),
            "box": self.box,
            "reach": self.reach,
            "centre": centre,
        }

    def captured(self) -> dict[str, Any]:
        """Return the last state at rest, and how many events were done since then."""
        moving = self.flow is not None and self.departure is not None
        kept = self.departure if moving and self.departure is not None else self._at_rest()
        out: dict[str, Any] = {"mechanics": self.as_plain(kept["mechanics"]), "set": None}
        if kept["box"] is not None:
            plain, box = self.arithmetic.plain, kept["box"]
            out["set"] = {
                "axes": [plain(self.arithmetic.vector(row)) for row in box.axes],
                "widths": plain(self.arithmetic.vector(box.widths)),
                "reach": plain(self.arithmetic.vector(kept["reach"])),
                "centre": self.as_plain(kept["centre"]),
            }
        out["events"] = self.event_number if moving else -1
        out["way"], out["target"] = self.aim if moving else (0, None)
        return out

    def take_over(self, captured: Mapping[str, Any]) -> None:
        """Take over what `captured` returned, and go through the events again that were done."""
        super().take_over(captured["mechanics"])
        self.box = self.centre = None
        kept = captured["set"]
        if kept is not None:
            number = self.arithmetic.from_plain
            self._enclose()
            assert self.centre is not None
            self.box = Box(
                [list(number(row)) for row in kept["axes"]], list(number(kept["widths"]))
            )
            self.reach = list(number(kept["reach"]))
            self.centre.take_over(kept["centre"])
            super().take_over(captured["mechanics"])
        if captured["events"] >= 0:
            self.ramp(captured["way"], captured["target"])
            for event in self.rearrangement():
                if event is None and self.event_number >= captured["events"]:
                    break
