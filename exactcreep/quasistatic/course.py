"""Say in one sentence up to which half-cycle the trajectories of runs are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exactcreep.quasistatic.creep_result import Creep


def known_of(results: Sequence[Creep]) -> str:
    """Return one sentence: what outcome and velocity are worth, and how far courses are known.

    The course of a run is what happens when. "" where there is nothing to say but the evidence.
    """
    lost = [run for run in results if run.followed is not None and run.followed < run.half_cycles]
    ends = sorted(run.followed or 0 for run in lost)
    targets = "half-cycle" if all(one.drive.cyclic for one in results) else "target"
    if not ends:
        trusted = [0 < one.half_cycles == one.trusted_half_cycles for one in results]
        if not all(trusted) or not trusted:
            return ""
        whole = all(one.half_cycles == one.drive.half_cycles for one in results)
        least = min(one.half_cycles for one in results)
        far = "to the end" if whole else f"for the first {least} {targets}s"
        return f"copies that are a few roundings off take the same course {far}"
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
    rules = any(run.undecided or run.long_rearrangements for run in lost)
    later = ", events until somewhat later"
    if rules:
        later = ", unless a rule that settled a comparison, or a long avalanche, ended it there"
    return (
        f"{worth}; positions are known to 1e-9 up to {targets} {ends[0]}{to}{of}{later}:"
        " beyond that trust averages of x_G(t) and events only"
    )
