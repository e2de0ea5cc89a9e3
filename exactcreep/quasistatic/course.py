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
    targets = "half-cycle" if all(run.drive.cyclic for run in results) else "target"
    if not lost:
        return _followed_throughout(results, targets)
    ends = sorted(run.followed or 0 for run in lost)
    reach = f"{targets} {ends[0]}" if ends[0] == ends[-1] else f"{targets} {ends[0]} to {ends[-1]}"
    if len(lost) < len(results):
        reach += f" ({len(lost)} of {len(results)} runs)"
    return (
        f"{_worth(lost, len(results))}; positions are known to 1e-9 up to {reach}{_events(lost)}:"
        " beyond that trust averages of x_G(t) and events only"
    )


def _followed_throughout(results: Sequence[Creep], targets: str) -> str:
    """Return how far copies of the runs have taken the same course; "" unless that is all of it."""
    if not results or any(run.half_cycles != run.trusted_half_cycles for run in results):
        return ""
    least = min(run.half_cycles for run in results)
    if not least:
        return ""
    same = "copies that are a few roundings off take the same course"
    if all(run.half_cycles == run.drive.half_cycles for run in results):
        return f"{same} to the end"
    return f"{same} for the first {least} {targets}s"


def _worth(lost: Sequence[Creep], runs: int) -> str:
    """Return what outcomes and velocities are worth where the course of a run is lost."""
    if all(run.velocity_error == 0 for run in lost):
        return "outcome and velocity are what the course ended in"
    unknown = sum(math.isnan(run.velocity_error) for run in lost)
    if runs == 1:
        error = "of unknown error" if unknown else "to within its standard error"
        return f"outcome and velocity are statistics, the latter {error}"
    several = "outcomes and velocities are statistics, the latter"
    if unknown == len(lost):
        return f"{several} of unknown errors"
    if unknown:
        return f"{several} with their standard errors (of {unknown} not known)"
    return f"{several} with their standard errors"


def _events(lost: Sequence[Creep]) -> str:
    """Return how much further than positions the events of runs are known."""
    if any(run.undecided or run.long_rearrangements for run in lost):
        return ", unless a rule that settled a comparison, or a long avalanche, ended it there"
    return ", events until somewhat later"
