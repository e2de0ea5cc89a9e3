"""Say in one sentence up to which half-cycle the trajectories of runs are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep


def known_of(results: Sequence[Creep]) -> str:
    """Return one sentence: what outcome and velocity are worth, and how far courses are known.

    The course of a run is what happens when. "" where there is nothing to say but the evidence.
    """
    ends = sorted(one.followed for one in results if one.followed is not None)
    targets = "half-cycle" if all(one.drive.cyclic for one in results) else "target"
    if not ends:
        trusted = [0 < one.half_cycles == one.trusted_half_cycles for one in results]
        if not all(trusted) or not trusted:
            return ""
        whole = all(one.half_cycles == one.drive.half_cycles for one in results)
        least = min(one.half_cycles for one in results)
        far = "to the end" if whole else f"for the first {least} {targets}s"
        return f"a copy that starts a few roundings off takes the same course {far}"
    lost = [one for one in results if one.followed is not None]
    unknown = sum(math.isnan(one.velocity_error) for one in lost)
    if all(one.velocity_error == 0 for one in lost):
        worth = "outcome and velocity are what the course ended in"
    elif len(results) > 1:
        worth = "outcomes and velocities are statistics, the latter "
        worth += "of unknown errors" if unknown == len(lost) else "with their standard errors"
        worth += f" (of {unknown} not known)" * (0 < unknown < len(lost))
    else:
        error = "of unknown error" if unknown else "to within its standard error"
        worth = f"outcome and velocity are statistics, the latter {error}"
    to = f" to {ends[-1]}" * (ends[0] < ends[-1])
    of = f" ({len(lost)} of {len(results)} runs)" * (len(lost) < len(results))
    rules = any(one.undecided or one.long_rearrangements for one in lost)
    tie = ", or a rule has settled a comparison" * rules
    return (
        f"{worth}; beyond {targets} {ends[0]}{to}{of} rounding errors have grown as large as"
        f" slips{tie}: trust averages of x_G(t) and events only"
    )
