"""``exactcreep scenes``: the built-in scenes."""

from __future__ import annotations


def scenes() -> None:
    """List the built-in scenes."""
    raise NotImplementedError
