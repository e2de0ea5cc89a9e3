"""The base of all results: numbers by name, a labelled dataset, a table in a notebook."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from exactcreep.model.enclosure import same, same_numbers
from exactcreep.model.numbers import Shown, plain_data

if TYPE_CHECKING:
    import xarray as xr


class Result(Shown):
    """Base of results, which are frozen dataclasses (``eq=False, repr=False``).

    A subclass names in `told` what its summary holds, or overrides `_numbers`, `_facts` and the
    dataset. Results are equal if they hold the same values, whatever the time they took.
    """

    units_in_line = True
    told: ClassVar[tuple[str, ...]] = ()
    """Attributes that the summary holds; default: all fields."""

    worded: ClassVar[tuple[str, ...]] = ("reason",)
    """Entries of the summary that `sentence` says: a table beside it leaves them out."""

    @property
    def finding(self) -> str:
        """What was found and how well that is known, in a line; "" if no line says it."""
        return ""

    @property
    def sentence(self) -> str:
        """The finding and its `reason`, if there is one, as commands print them."""
        reason = getattr(self, "reason", "")
        return self.finding + (f": {reason}" if reason else "")

    def _numbers(self) -> Mapping[str, Any]:
        return {name: getattr(self, name) for name in self.told or _names(self)}

    def summary(self) -> dict[str, Any]:
        """Return the numbers by name, ready for JSON: a number that is not finite is None.

        Returns
        -------
        dict
            What `json.dumps` takes.
        """
        return plain_data(self._numbers())

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The summary as attributes of a dataset, lists and mappings as JSON; None is left out."""
        known = {name: value for name, value in self.summary().items() if value is not None}
        texts = {name: json.dumps(value) for name, value in known.items()
                 if isinstance(value, (bool, list, dict))}  # fmt: skip
        made: xr.Dataset = import_module("xarray").Dataset(attrs=known | texts)
        return made

    @property
    def plot(self) -> Any:
        """Its pictures, as xarray and pandas have them: ``plot()`` draws the result.

        A run has ``plot(ax=None)``, x_G over time, and ``plot.avalanches("size")``, how the size of
        its avalanches is distributed (or their ``"duration"``, ``"energy"``, ``"extent"``), which
        return the axes; a rearrangement its velocities and energies, two axes; a fate, a survival,
        a threshold and an intercept the figure of their commands' ``--plot``.

        Returns
        -------
        callable

        Raises
        ------
        AttributeError
            If no picture of such a result is known.
        """
        # by name, as pandas loads its backend: what draws stands on a floor below
        return import_module("exactcreep.figures.pictures").plots_of(self)

    def _facts(self) -> Mapping[str, Any]:
        return self._numbers()

    def _caption(self) -> str:
        return super()._caption() + (f": {self.finding}" if self.finding else "")

    def _compared(self) -> Mapping[str, Any]:
        return {name: getattr(self, name) for name in _names(self) if name != "seconds"}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return alike(self._compared(), other._compared())

    __hash__: ClassVar[Any] = None  # what they hold can be changed


def _names(result: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(result))


def alike(a: Any, b: Any) -> bool:
    """Return whether two values, arrays, mappings or lists are the same; nan is nan."""
    if hasattr(a, "identical"):
        return hasattr(b, "identical") and bool(a.identical(b))
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return type(a) is type(b) and same_numbers(a, b)
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(alike(a[name], b[name]) for name in a)
    if isinstance(a, (list, tuple)) and isinstance(b, (list, tuple)):
        return len(a) == len(b) and all(map(alike, a, b))
    return same(a, b)
