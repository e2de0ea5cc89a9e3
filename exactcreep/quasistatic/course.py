"""Say in one sentence up to which half-cycle the trajectories of runs are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exactcreep.quasistatic.creep_result import Creep


def known_of(results: Sequence[Creep]) -> str:
    """Say up to which half-cycle trajectories are known, and what holds later, or ""."""
    lost = [run for run in results if run.known_half_cycles < run.half_cycles]
    targets = "half-cycle" if all(run.drive.cyclic for run in results) else "target"
    if not lost:
        return _known_throughout(results, targets)
    ends = sorted(run.known_half_cycles for run in lost)
    reach = f"{targets} {ends[0]}" if ends[0] == ends[-1] else f"{targets} {ends[0]} to {ends[-1]}"
    if len(lost) < len(results):
        reach += f" ({len(lost)} of {len(results)} runs)"
    return f"known to 1e-9 up to {reach}; {_beyond(lost, len(results))}"


def _known_throughout(results: Sequence[Creep], targets: str) -> str:
    """Say how long perturbed copies have stayed close to all runs; "" if they did not in some."""
    if not results or any(run.half_cycles != run.trusted_half_cycles for run in results):
        return ""
    least = min(run.half_cycles for run in results)
    if not least:
        return ""
    if all(run.half_cycles == run.drive.half_cycles for run in results):
        return "known to 1e-9 to the end"
    return f"known to 1e-9 for the first {least} {targets}s"


def _beyond(lost: Sequence[Creep], runs: int) -> str:
    """Say what holds for runs beyond the half-cycle up to which they are known."""
    if all(run.velocity_error == 0 for run in lost):
        return "the outcome is where float64 ended"
    short = sum(math.isnan(run.velocity_error) for run in lost)
    holds = "averages hold for the whole run"
    if not short:
        return holds
    return f"{holds}, {'with' if runs == 1 else f'{short} of them with'} an unknown standard error"
