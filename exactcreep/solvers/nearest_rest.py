"""Relax a start that friction cannot hold to the nearest state at rest, by elastic energy.

A rate-independent chain makes this step: without inertia it slides until the forces balance.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Any


def partial_sums(steps: Sequence[Any]) -> list[Any]:
    """Return the sums of the first 1, 2, ... numbers; floats are rounded once from exact sums."""
    if not isinstance(steps[0], float):
        return list(accumulate(steps))
    if min(steps) == max(steps):
        return [count * steps[0] for count in range(1, len(steps) + 1)]
    return [float(total) for total in accumulate(map(Fraction, steps))]


class _Half:
    """The derivative of a convex function on one side of its root, as a stack of pieces.

    A piece is (outer end, slope) or a jump (place, None, height). A step shifts all pieces by
    `shift` and adds one to all slopes; both are done lazily.
    """

    def __init__(self, zero: Any) -> None:
        self.shift = zero
        self.steps = 0
        self.pieces: list[tuple[Any, int | None, Any]] = []

    def step(self, shift: Any) -> None:
        self.shift = shift
        self.steps += 1

    def push(self, end: Any, slope: int | None, jump: Any = None) -> None:
        stored = None if slope is None else slope - self.steps
        self.pieces.append((end - self.shift, stored, jump))

    def cross(self, place: Any, rise: Any, other: _Half) -> Any:
        """Return the place where the derivative has changed by `rise`, outwards from `place`."""
        while self.pieces:
            end, stored, jump = self.pieces.pop()
            end = end + self.shift
            if stored is None:
                if jump >= rise:
                    self.push(end, None, jump - rise)
                    other.push(end, None, rise)
                    return end
                other.push(end, None, jump)
                rise = rise - jump
            else:
                slope = stored + self.steps
                other.push(place, slope)
                gain = slope * abs(end - place)
                if gain >= rise:
                    self.push(end, slope)
                    step = rise / slope
                    return place - step if end < place else place + step
                rise = rise - gain
            place = end
        other.push(place, None, rise)  # a jump marks the end of the admissible range
        return place


def nearest_at_rest(
    tensions: Sequence[Any], uphill: Sequence[Any], downhill: Sequence[Any]
) -> list[Any]:
    """Return the nearest tensions with ``-uphill_n <= T_n - T_(n-1) <= downhill_n``.

    Nearest means the least elastic energy ``sum (T_n - given_n)^2``, with T_0 = T_N = 0. This is
    dynamic programming over the springs: the derivative of the least energy up to spring n is
    piecewise linear with jumps, and its root is the best T_n. From spring to spring its two halves
    move apart by the two bounds. Each half is a stack with the piece next to the root on top.
    """
    best: list[Any] = []
    root = zero = uphill[0] - uphill[0]
    below, above = _Half(zero), _Half(zero)
    steps = zip(
        tensions, uphill, downhill, partial_sums(uphill), partial_sums(downhill), strict=False
    )
    for tension, fall, rise, fallen, risen in steps:
        # where the bounds leave a choice, only the present spring counts
        low, high = root - fall, root + rise
        below.step(-fallen)
        above.step(risen)
        if tension < low:
            above.push(high, 1)
            root = below.cross(low, low - tension, above)
        elif tension > high:
            below.push(low, 1)
            root = above.cross(high, tension - high, below)
        else:
            below.push(low, 1)
            above.push(high, 1)
            root = tension
        best.append(root)
    after, nearest = zero, []
    for value, fall, rise in zip(best[::-1], uphill[:0:-1], downhill[:0:-1], strict=True):
        after = min(max(value, after - rise), after + fall)
        nearest.append(after)
    return nearest[::-1]


def brought_to_rest(
    tensions: Sequence[Any], uphill: Sequence[Any], downhill: Sequence[Any], share: Any
) -> tuple[list[Any], list[Any], Any]:
    """Return the tensions at which friction holds the chain, and the displacements to them.

    `uphill` is ``b + s`` and `downhill` ``b - s`` of each slider, with its sliding friction b and
    its weight s including an end force: the most that the tension may fall or rise from spring to
    spring. If every slider moves (those at -b uphill, those at +b downhill), the balance of forces
    does not fix the place of the whole chain. The third result is the range of places (else zero),
    and the chain ends the `share` of it further up. All is exact in exact arithmetic.
    """
    zero = uphill[0] - uphill[0]
    nearest = nearest_at_rest(tensions, uphill, downhill)
    x = [zero]
    for tension, reached in zip(tensions, nearest, strict=True):
        x.append(x[-1] + (reached - tension))
    steps = [after - before for before, after in pairwise([zero, *nearest, zero])]
    rooms = [
        (step + fall, rise - step) for step, fall, rise in zip(steps, uphill, downhill, strict=True)
    ]
    margins = [min(room) for room in rooms]
    anchor, room = x[margins.index(max(margins))], zero  # a slider inside its limits rests
    if not max(margins) > 0:
        falls = [low > high for low, high in rooms]
        anchor = max(v for v, fell in zip(x, falls, strict=True) if not fell)
        room = min(v for v, fell in zip(x, falls, strict=True) if fell) - anchor
        anchor = anchor + room * share
    return nearest, [v - anchor for v in x], room
