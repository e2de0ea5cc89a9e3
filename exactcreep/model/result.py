"""The base class of results: numbers by name, a labelled dataset, a table in a notebook."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property, partial
from importlib import import_module
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from exactcreep.model.drawn import DRAWN
from exactcreep.model.enclosure import same, same_numbers
from exactcreep.model.numbers import Shown, plain_data

if TYPE_CHECKING:
    import xarray as xr


class Result(Shown):
    """Base of results, which are frozen dataclasses (``eq=False, repr=False``).

    A subclass names the entries of its summary in `_told`, or overrides `_numbers`, `_facts` and
    the dataset. Results are equal if they hold the same values, whatever their time.
    """

    _units_in_line = True
    _told: ClassVar[tuple[str, ...]] = ()
    """Attributes in the summary; default: all fields."""

    @property
    def finding(self) -> str:
        """The result and its evidence in one line, or ""."""
        return ""

    @property
    def sentence(self) -> str:
        """The finding and its `reason`, if there is one, as commands print them."""
        reason = getattr(self, "reason", "")
        return self.finding + (f": {reason}" if reason else "")

    def _numbers(self) -> Mapping[str, Any]:
        return {name: getattr(self, name) for name in self._told or _names(self)}

    def summary(self) -> dict[str, Any]:
        """Return the numbers by name, ready for JSON; None for numbers that are not finite.

        Returns
        -------
        dict
            For `json.dumps`.
        """
        return plain_data(self._numbers())

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The summary as attributes of a dataset, lists and mappings as JSON, without None."""
        known = {name: value for name, value in self.summary().items() if value is not None}
        texts = {name: json.dumps(value) for name, value in known.items()
                 if isinstance(value, (bool, list, dict))}  # fmt: skip
        made: xr.Dataset = import_module("xarray").Dataset(attrs=known | texts)
        return made

    @property
    def plot(self) -> Any:
        """The pictures of the result: ``plot()`` draws it, ``plot.avalanches()`` of a run as well.

        Runs and rearrangements return axes, other results the figure of their command's ``--plot``.
        """
        for kind in type(self).__mro__:
            if kind.__name__ in DRAWN:
                draw = resolve_name(DRAWN[kind.__name__])  # imports matplotlib
                return draw(self) if isinstance(draw, type) else partial(draw, self)
        raise AttributeError(f"{type(self).__name__} has no picture")

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

    __hash__: ClassVar[Any] = None  # their contents may change


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
