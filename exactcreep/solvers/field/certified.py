"""The readable event solver in balls: every comparison is decided, or repeated with more bits.

A calculation with an undecided comparison or too few digits starts again at twice the precision,
from the last state that is exact in Q(c) or from the beginning. At the precision limit the model's
rules settle the comparison, and the result counts it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.uniform import EVERYTHING
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, Balls, Undecided, balls_of
from exactcreep.solvers.field.set_integrator import SetIntegrator
from exactcreep.solvers.field.simulation import (
    CertifiedSimulation,
    certificate,
    completed,
    require_digits,
)
from exactcreep.solvers.interface import Rearrangement, Simulation, Solver, Start
from exactcreep.watch.limits import Limits

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
                report = {**result.report, **certificate(mechanics)}
                return replace(result, decided=evidence, report=report)
        raise AssertionError("the last precision decides everything")

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        return CertifiedSimulation(start, record, self)
