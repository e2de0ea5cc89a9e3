"""The readable event solver in balls: every comparison is decided, or repeated with more bits.

A calculation with an undecided comparison or too few digits starts again at twice the precision,
from the last state that is exact in Q(c) or from the beginning. At the precision limit the model's
rules settle the comparison, and the result counts it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.model.uniform import EVERYTHING
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, Balls, Undecided, balls_of, objects
from exactcreep.solvers.field.integrator import ChainIntegrator
from exactcreep.solvers.field.set_integrator import Kind, SetIntegrator
from exactcreep.solvers.field.simulation import (
    FieldSimulation,
    completed,
    mechanics_report,
)
from exactcreep.solvers.interface import (
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
)
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

GUARD_BITS = 128
"""Initial number of additional bits."""


@dataclass(frozen=True)
class Certified(Solver):
    """The readable solver in balls.

    A start in balls means any of the states that they enclose. Successive calls of `rearrange`
    lose digits, and end undecided; a run does not.

    Parameters
    ----------
    digits : int
        Correct significant digits required (of displacements; absolute below 1).
    most_digits : int or None
        The precision limit; None: 2000 digits, or four times `digits` if that is more.
    """

    digits: int = 30
    most_digits: int | None = None
    on_file: ClassVar[bool] = False
    takes: ClassVar[frozenset[str]] = EVERYTHING
    name: ClassVar[str] = "certified"
    summary: ClassVar[str] = "readable event solver in balls: every comparison proved"

    def __post_init__(self) -> None:
        digits = whole_number(self.digits, "digits", least=1, most=100_000)
        most = max(2000, 4 * digits)
        if self.most_digits is not None:
            most = whole_number(self.most_digits, "most_digits", least=1, most=1_000_000)
        if most < digits:
            raise InputError("most_digits", most, f"must be at least digits = {digits}")
        object.__setattr__(self, "digits", digits)
        object.__setattr__(self, "most_digits", most)

    def arithmetic(self) -> Balls:
        """Return balls of the initial precision."""
        return balls_of(math.ceil(self.digits * BITS_PER_DIGIT) + GUARD_BITS)

    @property
    def most_bits(self) -> int:
        """The precision limit in bits."""
        assert self.most_digits is not None
        return math.ceil(self.most_digits * BITS_PER_DIGIT) + GUARD_BITS

    def precisions(self) -> Iterator[tuple[int, bool]]:
        """Yield the precisions to try, and whether to settle undecided comparisons there."""
        bits = self.arithmetic().bits
        while bits < self.most_bits:
            yield bits, False
            bits *= 2
        yield self.most_bits, False
        yield self.most_bits, True

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange in balls; repeat with more bits if a comparison is undecided."""
        for bits, assume in self.precisions():
            arithmetic = balls_of(bits)
            with arithmetic.active():
                try:
                    mechanics = SetIntegrator(start, arithmetic, assume=assume)
                    result = completed(mechanics, direction, self.name, limits)
                    if not (assume or limits.passed()):
                        mechanics.steadily(partial(require_digits, mechanics, self.digits))
                except Undecided:
                    continue
                evidence = Evidence.of(mechanics.tally.undecided, Evidence.PROVED)
                kinds = {kind.value: mechanics.kinds[kind] for kind in Kind}
                report = {**result.report, **certificate(mechanics), "crossings": kinds}
                return replace(result, decided=evidence, report=report)
        raise AssertionError("the last precision decides everything")

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        return CertifiedSimulation(start, record, self)


def require_digits(mechanics: ChainIntegrator, digits: int) -> None:
    """Raise `Undecided` if a displacement is known to fewer digits."""
    allowed = mechanics.arithmetic.number(10) ** -digits
    for x in mechanics.state().displacements.tolist():
        if not x.rad() <= allowed * (1 + abs(x)):
            raise Undecided(f"fewer than {digits} digits are left")


def certificate(mechanics: ChainIntegrator) -> dict[str, Any]:
    """Return radius, digits and bits lost, and assumed ties of a calculation in balls."""
    arithmetic, places = mechanics.arithmetic, mechanics.state().displacements.tolist()
    radii = [0.0 if x.is_exact() else math.nextafter(float(x.rad()), math.inf) for x in places]
    largest = max(radii)
    relative = max(r / (1 + abs(float(x.mid()))) for r, x in zip(radii, places, strict=True))
    lost = 0.0
    if largest > 0:
        mantissa, exponent = max(places, key=lambda x: x.rad()).rad().man_exp()
        lost = max(arithmetic.bits + float(exponent) + math.log2(int(mantissa)), 0.0)
    return {
        "ties_assumed": mechanics.tally.undecided,
        "largest_radius": largest,
        "digits_left": math.floor(-math.log10(relative)) if relative > 0 else None,
        "bits_lost": lost,
        "bits_lost_per_event": lost / max(mechanics.tally.events, 1),
        "exact_in_q_c": mechanics.rest.exact,
    }


class CertifiedSimulation(FieldSimulation):
    """A simulation in balls, which goes back to its anchor when a comparison is undecided."""

    kind = SetIntegrator
    mechanics: SetIntegrator
    leap: ClassVar[int] = 2
    """Factor by which the precision grows."""

    def __init__(self, start: Start, record: tuple[str, ...], solver: Certified) -> None:
        super().__init__(start, record, solver.arithmetic())
        self.solver = solver
        self.restarts = 0
        self.settles = False  # at the precision limit
        self.ahead: int | None = None  # the next target of the chain; None: any
        self.reached: tuple[int, State, Tally] | None = None  # the last target, state and counts
        if (kept := start.unrounded) is not None:
            self._begin(kept["bits"])
            with self.mechanics.arithmetic.active():
                self.mechanics.go_on_from(kept["rest"].copy())
            self.theta_target, self.tally = kept["theta_target"], self.mechanics.tally
            if (leg := kept["rest"].leg) is not None:
                self.begin = objects(leg.end)
        self._drop_anchor(None)

    def _drop_anchor(self, target: int | None) -> None:
        """Make the present state, which is known exactly, the state to go back to."""
        self.anchor = self.mechanics.rest.copy()
        self.anchor_target: list[Any] = [target, self.theta_target]

    @property
    def behind(self) -> bool:
        """Whether the last target has to be reached again."""
        return self.reached is not None and self.ahead is not None and self.ahead <= self.reached[0]

    def _to_target(
        self, drive: Drive, q: int, limits: Limits, early: Callable[[], Stop | None]
    ) -> Stop | None:
        if self.ahead is None:
            self.ahead = q
        if self.anchor_target[0] is None:
            self.anchor_target[0] = q - 1
        while self.ahead <= q:
            try:
                stop = super()._to_target(drive, self.ahead, limits, early)
            except Undecided:
                self._go_back()
                continue
            if self.ahead < q:
                self._forget_rows()
            if stop is not None:
                return stop
            self.ahead += 1
        with self.mechanics.arithmetic.active():
            self.reached = q, self.mechanics.state(), replace(self.tally)
        if self.mechanics.rest.exact:
            self._drop_anchor(q)
        return None

    def _arrive(self, target: Any) -> None:
        if not self.settles:
            self.mechanics.steadily(partial(require_digits, self.mechanics, self.solver.digits))
        super()._arrive(target)

    def _go_back(self) -> None:
        """Start again from the anchor with more bits."""
        self.restarts += 1
        bits = self.mechanics.arithmetic.bits
        self.settles = bits >= self.solver.most_bits
        self._begin(min(self.leap * bits, self.solver.most_bits))
        with self.mechanics.arithmetic.active():
            self.mechanics.go_on_from(self.anchor.copy())
        self.tally = self.mechanics.tally
        target, self.theta_target = self.anchor_target
        self.ahead = target + 1
        self.undecided = self.tally.undecided

    def _begin(self, bits: int) -> None:
        arithmetic = balls_of(bits)
        with arithmetic.active():
            self.mechanics = self.kind(self.start, arithmetic, assume=self.settles)
        self._begin_log()

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        self.tally = self.mechanics.tally
        stretch = super().follow(drive, first, count, limits)
        if self.behind and self.reached is not None:
            self.tally = self.reached[2]
        return stretch

    def state(self) -> State:
        """Return the present state, or the last target's if that has to be reached again."""
        return self.reached[1] if self.behind and self.reached is not None else super().state()

    @property
    def evidence(self) -> Evidence:
        """Proved, unless a tie had to be assumed at the precision limit."""
        return Evidence.of(self.tally.undecided, Evidence.PROVED)

    @property
    def at_rest(self) -> bool:
        """Whether the chain is at a target."""
        return not self.behind and super().at_rest

    def snapshot(self) -> dict[str, Any]:
        return super().snapshot() | {
            "bits": self.mechanics.arithmetic.bits,
            "anchor": self.anchor,
            "anchor_target": self.anchor_target,
            "settles": self.settles,
            "restarts": self.restarts,
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        self.settles, self.restarts = snapshot["settles"], snapshot["restarts"]
        self._begin(snapshot["bits"])
        super().restore(snapshot)
        self.anchor, self.anchor_target = snapshot["anchor"], snapshot["anchor_target"]

    def report(self) -> dict[str, Any]:
        """Return precision, enclosure radius, bits lost, ties assumed and work counts."""
        with self.mechanics.arithmetic.active():
            certified = certificate(self.mechanics)
        return mechanics_report(self.mechanics) | certified | {"restarts": self.restarts}
