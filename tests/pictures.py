"""What tests of pictures share: a picture shows its data, or it fails."""

from __future__ import annotations

import re

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

SPECK = 40
"""Pixels: what fewer of them is no line, no mark and no bar."""


def pixels(figure: Figure) -> np.ndarray:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba()).astype(int)[..., :3]


def inks(figure: Figure) -> dict[Axes, int]:
    """Return how many pixels inside each axes change if what is drawn of data is taken away.

    A page with labels, ticks, grid and legend alone has none.
    """
    with mpl.rc_context():
        pixels(figure)
        figure.set_layout_engine("none")
        drawn = [one for axes in figure.axes for one in (*axes.lines, *axes.collections,
                                                         *axes.patches, *axes.images)]  # fmt: skip
        for axes in figure.axes:
            for guide in axes.lines:  # a broken line across the axes marks a place, and is no data
                if guide.get_transform() != axes.transData and guide.get_linestyle() != "-":
                    guide.set_visible(False)
        full = pixels(figure)
        visible = [one for one in drawn if one.get_visible()]
        for one in visible:
            one.set_visible(False)
        gone = (full != pixels(figure)).any(axis=-1)[::-1]  # from below, as places in the figure
        for one in visible:
            one.set_visible(True)
    counts = {}
    for axes in figure.axes:
        left, bottom, right, top = (int(side) for side in axes.bbox.extents)
        counts[axes] = int(gone[bottom:top, left:right].sum())
    return counts


MEASURED = re.compile("(displacement|descent|velocity|force|tension|temperature|energy)[^/]*$")
"""Labels that begin with a quantity that has a unit."""


def shares(axes: Axes) -> list[tuple[float, float]]:
    """Return where the data of axes begin and end, as parts of each of their sides."""
    data = axes.transData.transform(axes.dataLim) - axes.bbox.min
    ends = np.sort(data / axes.bbox.size, axis=0).T
    return [(low, high) for low, high in ends.tolist() if np.isfinite(high - low) and high > low]


def line(axes: Axes, which: str | int) -> np.ndarray:
    """Return the places of a line, by number or by words of its label alone, shape (2, points)."""
    named = [one for one in axes.lines if str(which) in str(one.get_label())]
    (found,) = [axes.lines[which]] if isinstance(which, int) else named
    return np.asarray(found.get_xydata()).T


def assert_shows_data(figure: Figure, *, framed: bool = False) -> Figure:
    """Fail where axes are blank, do not name a unit, or reach beyond the picture.

    If the picture is `framed`, its axes also hold their data, closely.
    """
    assert figure.axes
    FigureCanvasAgg(figure).draw()
    around = figure.get_tightbbox()
    assert around.width * figure.dpi < figure.bbox.width + 1, "cut at a side"
    assert around.x0 > -0.01
    for axes, ink in inks(figure).items():
        assert ink > SPECK, axes.get_ylabel() or axes.get_title()
        named = [*axes.get_shared_x_axes().get_siblings(axes), axes]
        assert any(each.get_xlabel() or each.get_ylabel() for each in named)
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert "(" in label or not MEASURED.match(label), label
        for low, high in shares(axes) if framed else ():
            assert -0.01 < low < 0.3, (axes.get_ylabel(), low)
            assert 0.7 < high < 1.01, (axes.get_ylabel(), high)
    return figure
