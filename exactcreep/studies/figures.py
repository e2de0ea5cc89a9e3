"""Pictures in the manner of the paper: readable in print, and for the colour-blind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.result import Creep

INKS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
"""Okabe and Ito's colours, which everybody can tell apart."""
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
FORMATS = ("png", "pdf", "svg")
STYLE: dict[Any, Any] = {
    "font.family": "serif",
    "font.size": 10,
    "mathtext.fontset": "dejavuserif",
    "axes.linewidth": 0.8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.dpi": 150,
    "savefig.dpi": 150,
}
_MOST_POINTS = 20_000  # of a line; more cannot be told apart


def picture(width: float = 6.0, height: float = 4.0) -> Figure:
    """Return an empty figure in the house's style, size in inches; see `save_picture`."""
    figure = Figure(figsize=(width, height), layout="constrained")
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
    try:
        with mpl.rc_context(STYLE):
            figure.savefig(target)
    except OSError as error:
        raise InputError("plot", str(path), f"cannot be written: {error.strerror}") from None


def check_picture(path: Path) -> None:
    """Raise `InputError` unless the name ends like a picture's."""
    if path.suffix.lower().removeprefix(".") not in FORMATS:
        raise InputError("plot", str(path), "must end in ." + ", .".join(FORMATS))


def label_of(settings: Mapping[str, Any]) -> str:
    """Return a label for a member from what it sets."""
    parts = []
    for key, value in settings.items():
        symbol = _SYMBOLS.get(key, key.partition(".")[2] or key)
        parts.append(f"{symbol} = {_value_text(value)}")
    return ", ".join(parts)


_SYMBOLS = {
    "chain.n": "N",
    "chain.l0": r"$\tilde{l}_0$",
    "chain.mu_d": r"$\mu_\mathrm{d}$",
    "chain.mu_s": r"$\mu_\mathrm{s}$",
    "chain.sigma_mu": r"$\sigma_\mu$",
    "chain.tan_alpha": r"$\tan\alpha$",
    "drive.amplitude": r"$A_\theta$",
    "drive.sigma_theta": r"$\sigma_\theta$",
}


def _value_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return " ".join(f"{key} {_value_text(part)}" for key, part in value.items())
    if isinstance(value, list):
        return f"[{len(value)} values]"
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError):
        return str(value)


def draw_run(
    results: Sequence[Creep], path: Path | str, *, labels: Sequence[str] = (), title: str = ""
) -> None:
    """Draw theta(t) and x_G(t) of one or several runs, time in half-cycles.

    A single run that recorded the positions shows every slider as well, as the paper's
    Fig. position2sliders; several runs show x_G of all, one line each, coloured by the first
    quantity that varies.

    Raises
    ------
    InputError
        If no run recorded x_G, or the file's name does not end like a picture's.
    """
    if not any("x_G" in result.recorded for result in results):
        raise InputError("plot", str(path), 'needs x_G: record = ["x_G"]')
    check_picture(Path(path))
    with mpl.rc_context(STYLE):
        figure = picture(6.4, 5.2)
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2.4))
        if title:
            figure.suptitle(title, fontsize=10)
        _draw_theta(top, results)
        if len(results) == 1:
            _draw_one(bottom, results[0])
        else:
            _draw_members(bottom, results, labels)
        target = "half-cycles" if results[0].drive.cyclic else "targets"
        bottom.set_xlabel(rf"time $t/\tau_\mathrm{{th}}$ ({target})")
        save_picture(figure, path)


def _thinned(time: NDArray[Any], values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return at most `_MOST_POINTS` points that keep the smallest and largest of each stretch."""
    if time.size <= _MOST_POINTS:
        return time, values
    width = -(-2 * time.size // _MOST_POINTS)
    starts = np.arange(0, time.size, width)
    chosen: set[int] = {time.size - 1}
    for start in starts.tolist():
        stretch = values[start : start + width]
        chosen |= {start + int(np.argmin(stretch)), start + int(np.argmax(stretch))}
    kept = np.array(sorted(chosen))
    return time[kept], values[kept]


def _draw_theta(axes: Axes, results: Sequence[Creep]) -> None:
    axes.set_ylabel(r"dilation $\theta$")
    largest = max(results, key=_largest_theta)
    theta = np.concatenate([[0.0], largest.drive.targets(1, largest.half_cycles, largest.seed)])
    time = np.arange(theta.size)
    if largest.drive.cyclic and theta.size > 400:
        # the lines of so many cycles merge: the band that they fill says as much
        levels = sorted({_largest_theta(result) for result in results}, reverse=True)
        for level, shade in zip(levels, ("0.75", "0.55", "0.4"), strict=False):
            axes.fill_between([0, time[-1]], -level, level, color=shade, linewidth=0)
        axes.text(
            0.99, 0.5, rf"$\theta$ cycles between $\pm A_\theta$, {theta.size - 1} half-cycles",
            transform=axes.transAxes, ha="right", va="center", fontsize=8,
        )  # fmt: skip
    elif theta.size > 2000:
        axes.plot(*_thinned(time, theta), color="0.35", linewidth=0.4)
    else:
        axes.plot(time, theta, color="0.2", linewidth=0.7)
    axes.margins(x=0.01)


def _largest_theta(result: Creep) -> float:
    if not result.half_cycles:
        return 0.0
    count = min(result.half_cycles, 100_000)
    return float(np.abs(result.drive.targets(1, count, result.seed)).max())


def _course(values: NDArray[Any], start: float) -> tuple[NDArray[Any], NDArray[Any]]:
    return _thinned(np.arange(values.size + 1), np.concatenate([[start], values]))


def _draw_one(axes: Axes, result: Creep) -> None:
    start = result.experiment.initial.displacements.astype(float)
    axes.plot(
        *_course(result.recorded["x_G"], float(start.mean())),
        color=INKS[6],
        linewidth=1.6,
        label=r"$\Delta\tilde{x}_G$",
        zorder=3,
    )
    if "x" in result.recorded and result.chain.n <= 6:
        for n in range(result.chain.n):
            axes.plot(
                *_course(result.recorded["x"][:, n], float(start[n])),
                color=INKS[n],
                linestyle=DASHES[n % len(DASHES)],
                linewidth=0.9,
                label=rf"$\Delta\tilde{{x}}_{{{n + 1}}}$",
            )
    axes.set_ylabel(r"displacement ($g\,\tau_\mathrm{dyn}^2$)")
    axes.legend(loc="best")
    axes.margins(x=0.01)


def _draw_members(axes: Axes, results: Sequence[Creep], labels: Sequence[str]) -> None:
    families: dict[str, list[tuple[Creep, str]]] = {}
    for result, label in zip(results, labels or [""] * len(results), strict=False):
        if "x_G" in result.recorded and result.recorded["x_G"].size:
            first, _, rest = label.partition(", ")
            families.setdefault(first, []).append((result, rest))
    single = all(len(family) == 1 for family in families.values())
    for number, (name, family) in enumerate(families.items()):
        ink = INKS[number % len(INKS)]
        dashes = DASHES[number // len(INKS) % len(DASHES)]
        shown = name if single else f"{name} ({len(family)} members)"
        for k, (result, _) in enumerate(family):
            axes.plot(
                *_course(result.recorded["x_G"], 0.0),
                color=ink,
                linestyle=dashes,
                linewidth=1.4 if k == 0 else 0.8,
                alpha=1.0 if k == 0 else 0.75,
                label=shown if k == 0 else None,
            )
        _mark_ends(axes, family, ink)
    axes.set_ylabel(r"displacement $\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)")
    if len(families) <= 16:
        axes.legend(loc="best")
    axes.margins(x=0.01)


def _mark_ends(axes: Axes, family: Sequence[tuple[Creep, str]], ink: str) -> None:
    """Write each member's own setting at the end of its line, where there is room for it."""
    if len(family) == 1:
        return
    ends = sorted(
        ((float(r.recorded["x_G"][-1]), r.recorded["x_G"].size, rest) for r, rest in family),
        reverse=True,
    )
    for value, time, rest in ends:
        axes.annotate(
            rest, (time, value), xytext=(3, 0), textcoords="offset points", color=ink,
            fontsize=5, va="center", annotation_clip=False,
        )  # fmt: skip
