"""Pictures in the manner of the paper: readable in print, and for the colour-blind."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from exactcreep.quasistatic.files import check_picture, write_file

DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
Style = dict[str, Any]
"""Of lines and marks, by the names that matplotlib gives its arguments."""
DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 2))
GUIDE: Style = {"color": "0.55", "linewidth": 0.7, "linestyle": DOTTED}
"""How a place on an axis is marked."""
STYLE = mpl.rc_params_from_file(
    Path(__file__).with_name("exactcreep.mplstyle"), use_default_template=False
)
"""The house's style: the file ``exactcreep.mplstyle``, which matplotlib's own functions take."""
INKS: tuple[str, ...] = tuple(STYLE["axes.prop_cycle"].by_key()["color"])
_ASKED: ContextVar[tuple[tuple[float, float] | None, int | None]] = ContextVar(
    "_ASKED", default=(None, None)
)
"""Size and dots per inch of all pictures of a command, where they were asked for."""


@contextmanager
def printed(size: tuple[float, float] | None = None, dpi: int | None = None) -> Iterator[None]:
    """Give the pictures that are made within a block this size in inches, and dots per inch.

    Parameters
    ----------
    size : pair of float, optional
        Width and height; default: what each picture is made for.
    dpi : int, optional
        Default 150, of animations 100.
    """
    token = _ASKED.set((size, dpi))
    try:
        yield
    finally:
        _ASKED.reset(token)


def picture(width: float = 6.0, height: float = 4.0, dpi: int = STYLE["savefig.dpi"]) -> Figure:
    """Return an empty figure in the house's style, size in inches; see `save_picture`.

    `printed` may ask for another size, and other dots per inch.
    """
    size, dots = _ASKED.get()
    figure = Figure(figsize=size or (width, height), dpi=dots or dpi, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_picture(figure: Figure, path: Path | str) -> None:
    """Write a figure as PNG, PDF or SVG, by the name's ending.

    Raises
    ------
    InputError
        If the ending is another one, or the file cannot be written.
    """
    target = Path(path)
    check_picture(target)
    drawn = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(drawn, format=target.suffix[1:].lower(), dpi="figure")
    write_file(target, drawn.getbuffer(), "plot")


@contextmanager
def new_figure(path: Path | str, width: float, height: float, title: str = "") -> Iterator[Figure]:
    """Yield an empty figure in the house's style, which is written to `path` at the end."""
    check_picture(Path(path))
    with mpl.rc_context(STYLE):
        figure = picture(width, height)
        if title:
            figure.suptitle(title, fontsize=10, parse_math=False)
        yield figure
        save_picture(figure, path)


def symbol_of(key: str) -> str:
    """Return how a quantity that varies is called in a picture, by its key or its last part."""
    name = key.rpartition(".")[2]
    return _SYMBOLS.get(name, name)


def setting_text(key: str, value: Any) -> str:
    """Return a label for one setting of a member."""
    if isinstance(value, Mapping) and "size" in value:
        return f"{key.rpartition('.')[2]} {value.get('seed', 0)}"
    if isinstance(value, str) and key == "run.start":
        return value
    return f"{symbol_of(key)} = {_value_text(value)}"


_SYMBOLS = {
    "n": "N",
    "l0": r"$\tilde{l}_0$",
    "mu_d": r"$\mu_\mathrm{d}$",
    "mu_s": r"$\mu_\mathrm{s}$",
    "sigma_mu": r"$\sigma_\mu$",
    "tan_alpha": r"$\tan\alpha$",
    "amplitude": r"$A_\theta$",
    "sigma_theta": r"$\sigma_\theta$",
}


def _value_text(value: Any) -> str:
    if isinstance(value, (list, Mapping)):
        return f"({len(value)} values)"
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError):
        return str(value)
