"""The style of all pictures: readable in print and for the colour-blind, similar to the paper."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatterSciNotation

from exactcreep.quasistatic.writing import check_picture, write_file
from exactcreep.watch.terminal import printable

STYLE = mpl.rc_params_from_file(
    Path(__file__).with_name("style.mplstyle"), use_default_template=False
)
"""The settings in ``style.mplstyle``, as matplotlib's own functions take them."""
styled = mpl.rc_context(STYLE)
"""Decorator for functions that draw in this style."""
INKS: tuple[str, ...] = tuple(STYLE["axes.prop_cycle"].by_key()["color"])
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 2))
LENGTH = r"($g\,\tau_\mathrm{dyn}^2$)"
DISPLACEMENT = f"displacement $x_G$ {LENGTH}"
VELOCITY = r"$\tau_\mathrm{th}\langle v_G\rangle$  " + LENGTH
PLAIN = (1e-3, 2e4)
"""Range in which a logarithmic axis shows plain numbers instead of powers of ten."""
MOST_NAMED = 16
"""Most families that a legend names."""
_MOST_SIGNS = 40
"""Most characters of a start in a legend."""
_SYMBOLS = {
    "n": "N", "l0": r"$l_0$", "mu_d": r"$\mu_\mathrm{d}$", "mu_s": r"$\mu_\mathrm{s}$",
    "sigma_mu": r"$\sigma_\mu$", "tan_alpha": r"$\tan\alpha$", "amplitude": r"$A_\theta$",
    "sigma_theta": r"$\sigma_\theta$",
}  # fmt: skip


class PlainNumbers(LogFormatterSciNotation):
    """Labels of a logarithmic axis: plain numbers in the range `PLAIN`, else powers of ten."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick, empty if it has none."""
        low, high = PLAIN
        label = super().__call__(x, pos)
        least, largest = sorted(self.axis.get_view_interval())  # type: ignore[union-attr]
        return f"{x:g}" if label and low <= least and largest <= high else label


def new_figure(width: float, height: float, title: str = "", dpi: int | None = None) -> Figure:
    """Return an empty figure, size in inches; its title is plain text, never a formula."""
    dots = dpi or STYLE["savefig.dpi"]
    figure = Figure(figsize=(width, height), dpi=dots, layout="constrained")
    if title:
        plain = "$" not in title  # matplotlib breaks lines wrongly in a title with a dollar
        figure.suptitle(title, fontsize=10, parse_math=False, wrap=plain)
    return figure


def save_picture(figure: Figure, path: Path | str, *, force: bool = True) -> None:
    """Write a figure as PNG, PDF or SVG in one piece, or raise `InputError`."""
    target = Path(path)
    check_picture(target)
    drawn = io.BytesIO()
    for words in figure.findobj(Text):
        words.set_text(printable(words.get_text()))
    with mpl.rc_context(STYLE):
        figure.savefig(drawn, format=target.suffix[1:].lower(), dpi=figure.dpi)
    write_file(target, drawn.getvalue(), "plot", force=force)


def symbol_of(key: str) -> str:
    """Return the symbol of a varied quantity in a picture, by its key or the key's last part."""
    name = key.rpartition(".")[2]
    return _SYMBOLS.get(name, name)


def setting_label(key: str, value: Any) -> str:
    """Return a label for one setting of a member."""
    if isinstance(value, Mapping) and "size" in value:
        return f"{key.rpartition('.')[2]} {value.get('seed', 0)}"
    if isinstance(value, str) and key.rpartition(".")[2] == "start":
        words = re.sub(r'[{}\[\]":]', "", value)
        return words if len(words) <= _MOST_SIGNS else f"{words[:_MOST_SIGNS]}..."
    if isinstance(value, (list, Mapping)):
        return f"{symbol_of(key)} = ({len(value)} values)"
    try:
        return f"{symbol_of(key)} = {float(value):.6g}"
    except (TypeError, ValueError):
        return f"{symbol_of(key)} = {value}"
