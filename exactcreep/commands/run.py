"""``exactcreep run``: drive the chain of a scene."""

from __future__ import annotations


def run() -> None:
    """Drive the chain of a scene."""
    raise NotImplementedError
