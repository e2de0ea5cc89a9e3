"""What a result claims: how well it is known, and why the computation stopped."""

from __future__ import annotations

from enum import Enum


class Evidence(Enum):
    """How well a result is known."""

    PROVED = "proved"
    """Every comparison was decided in proved (ball or rational) arithmetic."""
    COMPUTED = "computed"
    """Floating-point arithmetic; every comparison was decided by more than its rounding bound."""
    UNDECIDED = "undecided"
    """A comparison lay inside its rounding bound and was settled by the model's rules."""


class Outcome(Enum):
    """What the chain does, or why the computation stopped."""

    CREEPING = "creeping"
    CYCLING = "cycling"
    AT_REST = "at_rest"
    RUNAWAY = "runaway"
    LIMIT = "limit"
