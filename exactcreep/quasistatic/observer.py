"""What looks at a run on its way: what it needs, what it takes, what a checkpoint keeps of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.solvers.solver import Simulation, Stretch, require

NUMBER = enclosure(0)
"""Stands for any enclosure in `Observer.state`."""
NEVER = 1 << 62
_MOST = 2**60  # of a count


class Observer:
    """Looks at every target of a run, and knows no other observer.

    Attributes
    ----------
    needs : tuple of str
        What the simulation has to record for it.
    """

    needs: tuple[str, ...] = ()

    @property
    def state(self) -> dict[str, Any]:
        """The attributes that a checkpoint keeps, each with a value of its kind.

        An array without rows stands for any number of rows, a list of one for lists of such, 0 for
        a count, None for anything.
        """
        raise NotImplementedError

    def next(self, done: int) -> int:
        """Return the next target at which it wants to look, if not at the last."""
        return NEVER

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over what happened on the way to the targets from `first` on."""
        raise NotImplementedError

    def check(self, done: int) -> None:
        """Raise `ValueError` unless what was taken over can be known after `done` targets."""

    def kept(self) -> dict[str, Any]:
        """Return what a checkpoint keeps of it."""
        return {name: getattr(self, name) for name in self.state}

    def restore(self, kept: Any, done: int) -> None:
        """Take over what `kept` returned after `done` targets, or raise `ValueError`."""
        require_like(self.state, kept)
        for name, value in kept.items():
            setattr(self, name, value)
        self.check(done)


def require_like(like: Any, given: Any, name: str = "it") -> None:
    """Raise `ValueError` unless a value has the kind, shape and range of another."""
    if like is None:
        return
    if isinstance(like, Mapping):
        require(isinstance(given, Mapping) and like.keys() == given.keys(), f"{name} lacks a name")
        for key, value in like.items():
            require_like(value, given[key], key)
    elif isinstance(like, np.ndarray):
        fits = isinstance(given, np.ndarray) and given.dtype == like.dtype
        fits = fits and given.shape[len(like) == 0 :] == like.shape[len(like) == 0 :]
        require(fits and given.ndim == like.ndim, f"{name} has another shape")
        require(bool(np.isfinite(given).all()), f"{name} holds what is no number")
    elif isinstance(like, (list, tuple)) and not isinstance(like, Enclosure):
        likes = like * len(given) if isinstance(like, list) and isinstance(given, list) else like
        fits = isinstance(given, (list, tuple)) and len(given) == len(likes)
        require(fits and isinstance(given, list) == isinstance(like, list), f"{name} is not whole")
        for kind, value in zip(likes, given, strict=True):
            require_like(kind, value, name)
    else:
        require(type(given) is type(like), f"{name} is of another kind")
        if type(given) is int:
            require(0 <= given < _MOST, f"{name} is out of range")
