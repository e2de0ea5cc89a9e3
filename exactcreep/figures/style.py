"""The style of all pictures: readable in print and for the colour-blind, similar to the paper."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.text import Text

from exactcreep.model.numbers import in_short
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
MOST_NAMED = 16
"""Most families that a legend names."""
_SYMBOLS = {
    "n": "N", "l0": r"$l_0$", "mu_d": r"$\mu_\mathrm{d}$", "mu_s": r"$\mu_\mathrm{s}$",
    "sigma_mu": r"$\sigma_\mu$", "tan_alpha": r"$\tan\alpha$", "amplitude": r"$A_\theta$",
    "sigma_theta": r"$\sigma_\theta$",
}  # fmt: skip


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
    return f"{symbol_of(key)} = {in_short(value)}"
