"""``exactcreep resume``: go on from a checkpoint."""

from __future__ import annotations


def resume() -> None:
    """Go on from a checkpoint."""
    raise NotImplementedError
