"""How a value shows itself: in one line, and as a small table with a picture in a notebook."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Context, Decimal
from enum import Enum
from fractions import Fraction
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.numbers import nearest_float, ratio_text

_EXACTLY = 40  # decimal digits; a rational that needs more is a ratio
_LONGEST = 60  # characters of a ratio
_LISTED = 6  # values of a list that are shown
_WIDTH, _HEIGHT, _MARGIN = 160, 48, 4  # of a picture, pixels
_MOST_POINTS = 320


class Shown:
    """Something with facts to show; its subclasses say which, and perhaps draw a picture."""

    def _facts(self) -> Mapping[str, Any]:
        """Return what is shown, by name; None and "" are left out."""
        raise NotImplementedError

    def _called(self) -> str:
        """Return the name of its class, as users know it."""
        return type(self).__name__

    def _picture(self) -> str:
        """Return a small SVG picture (see `drawn`), "" if there is none."""
        return ""

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={text(value)}" for name, value in _known(self._facts()))
        return f"{self._called()}({said})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f'<tr><th style="text-align:left">{escape(name)}</th>'
            f'<td style="text-align:left">{escape(_bare(value))}</td></tr>'
            for name, value in _known(self._facts())
        )
        return f"<div><b>{escape(self._called())}</b>{self._picture()}<table>{rows}</table></div>"


def _bare(value: Any) -> str:
    """Return a value in short without the quotes of a text."""
    return value if isinstance(value, str) else text(value).strip("'")


def _known(facts: Mapping[str, Any]) -> list[tuple[str, Any]]:
    missing = (None, "")
    return [
        (name, value)
        for name, value in facts.items()
        if isinstance(value, np.ndarray) or value not in missing
    ]


def text(value: Any) -> str:
    """Return a value in short: of a rational what makes it again, in decimals if they suffice.

    A rational is shown as the float that it is exactly, else as a quoted decimal or ratio. Of long
    lists and arrays the first and the last values are shown, of arrays with 6 digits.
    """
    if isinstance(value, Fraction):
        return _rational(value)
    if isinstance(value, np.ndarray):
        return _listed([_rounded(part) for part in _ends(value)], value.size)
    if isinstance(value, (list, tuple)):
        return _listed([text(part) for part in _ends(value)], len(value))
    if isinstance(value, Enum):
        return repr(value.value)
    if isinstance(value, (int, float, str)):
        return repr(value)
    return _rounded(value)


def _rational(value: Fraction) -> str:
    nearest = nearest_float(value)
    if math.isfinite(nearest) and Fraction(nearest) == value:
        whole = value.denominator == 1 and abs(value) < 10**15
        return str(value.numerator) if whole else repr(nearest)
    top, bottom = (Decimal(part) for part in value.as_integer_ratio())
    decimal = Context(prec=_EXACTLY, Emax=10**9, Emin=-(10**9)).divide(top, bottom)
    said = str(decimal) if Fraction(decimal) == value else ratio_text(value)
    return repr(said) if len(said) <= _LONGEST else f"{nearest!r}..."


def _rounded(value: Any) -> str:
    """Return 6 digits of any real number, an enclosure's middle."""
    middle = getattr(value, "middle", value)
    return f"{nearest_float(middle) if isinstance(middle, Fraction) else float(middle):.6g}"


def _ends(values: Sequence[Any] | NDArray[Any]) -> list[Any]:
    half = _LISTED // 2
    whole = len(values) <= _LISTED
    return list(values) if whole else [*values[:half], *values[-half:]]


def _listed(shown: list[str], size: int) -> str:
    if size > _LISTED:
        shown = [*shown[: _LISTED // 2], f"... {size} values ...", *shown[_LISTED // 2 :]]
    return f"[{', '.join(shown)}]"


def drawn(y: ArrayLike, x: ArrayLike | None = None, *, dots: bool = False) -> str:
    """Return a curve, or dots, as a small SVG picture without axes; "" of less than two points.

    Values that are not finite are left out; `x` counts them by default.
    """
    height = np.asarray(y, dtype=float)
    along = np.arange(height.size, dtype=float) if x is None else np.asarray(x, dtype=float)
    kept = np.flatnonzero(np.isfinite(height) & np.isfinite(along))
    if kept.size < 2:
        return ""
    if kept.size > _MOST_POINTS:
        kept = kept[np.linspace(0, kept.size - 1, _MOST_POINTS).astype(int)]
    across = _scaled(along[kept], _WIDTH)
    up = _HEIGHT - _scaled(height[kept], _HEIGHT)
    places = [f"{a:.1f},{b:.1f}" for a, b in zip(across.tolist(), up.tolist(), strict=True)]
    if dots:
        marks = (place.split(",") for place in places)
        inside = "".join(f'<circle cx="{a}" cy="{b}" r="2" fill="#2f8fd0"/>' for a, b in marks)
    else:
        inside = f'<polyline points="{" ".join(places)}" fill="none" stroke="#2f8fd0"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" height="{_HEIGHT}"'
        f' style="display:block">{inside}</svg>'
    )


def _scaled(values: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    low, high = float(values.min()), float(values.max())
    if low == high:
        return np.full(values.size, size / 2)
    # halves, so that the width of the largest floats is one
    share = (values / 2 - low / 2) / (high / 2 - low / 2)
    return _MARGIN + (size - 2 * _MARGIN) * share
