"""Say in one sentence up to which half-cycle the trajectories of runs are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep


def course_of(results: Sequence[Creep]) -> str:
    """Return one sentence: how far courses are known; "" where nothing was looked at.

    The course of a run is what happens when: x_G at every target, and all events.
    """
    lost = [one for one in results if one.followed is not None]
    many = len(results) > 1
    targets = "half-cycle" if all(one.drive.cyclic for one in results) else "target"
    if not lost:
        trusted = [one for one in results if one.trusted_half_cycles == one.half_cycles > 0]
        if not results or len(trusted) < len(results):
            return ""
        whole = all(one.half_cycles == one.drive.half_cycles for one in results)
        least = min(one.half_cycles for one in results)
        far = "to the end" if whole else f"for the first {least} {targets}s"
        return f"a copy that starts a few roundings off takes the same course {far}"
    ends = sorted({one.followed or 0 for one in lost})
    to = f"{targets} {ends[0]}" + (f" to {ends[-1]}" if len(ends) > 1 else "")
    of = f" ({len(lost)} of {len(results)} runs)" if many and len(lost) < len(results) else ""
    rules = any(one.undecided or one.long_rearrangements for one in lost)
    tie = ", or a rule has settled a comparison" if rules else ""
    return (
        f"beyond {to}{of} rounding errors have grown as large as slips{tie}:"
        " trust averages of x_G(t) and events only"
    )


def known_of(results: Sequence[Creep]) -> str:
    """Return one sentence: what outcome and velocity are worth, and how far courses are known.

    "" where there is nothing to say but the evidence.
    """
    course = course_of(results)
    lost = [one for one in results if one.followed is not None]
    if not lost:
        return course
    unknown = sum(math.isnan(one.velocity_error) for one in lost)
    if all(one.velocity_error == 0 for one in lost):
        worth = "outcome and velocity are what the course ended in"
    elif len(results) > 1:
        worth = "outcomes and velocities are statistics, the latter "
        worth += "of unknown errors" if unknown == len(lost) else "with their standard errors"
        worth += f" (of {unknown} not known)" * (0 < unknown < len(lost))
    else:
        worth = "outcome and velocity are statistics, the latter " + (
            "of unknown error" if unknown else "to within its standard error"
        )
    return f"{worth}; {course}"
