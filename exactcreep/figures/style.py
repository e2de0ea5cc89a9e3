"""Pictures in the manner of the paper: readable in print, and for the colour-blind."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.model.temperature_record import TemperatureRecord
from exactcreep.quasistatic.files import check_picture, write_file
from exactcreep.quasistatic.result import Creep
from exactcreep.solid import DAYS_PER_YEAR, FRICTION, Descent

INKS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
"""Okabe and Ito's colours, which everybody can tell apart."""
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
Style = dict[str, Any]
"""Of lines and marks, by the names that matplotlib gives its arguments."""
DASHED, DOTTED = (0, (4, 1.5)), (0, (1, 2))
GUIDE: Style = {"color": "0.55", "linewidth": 0.7, "linestyle": DOTTED}
"""How a place on an axis is marked."""
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
def page(path: Path | str, width: float, height: float, title: str = "") -> Iterator[Figure]:
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


def draw_run(
    results: Sequence[Creep],
    path: Path | str,
    *,
    settings: Sequence[Mapping[str, Any]] = (),
    title: str = "",
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
    with page(path, 6.4, 5.2, title) as figure:
        # the band of many cycles says less than a trace, and needs less room
        band = all(result.drive.cyclic and result.half_cycles > 400 for result in results)
        ratios = (1, 5) if band else (1, 2.4)
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=ratios)
        _draw_theta(top, results, band=band)
        if len(results) == 1:
            draw_one(bottom, results[0])
        else:
            _draw_members(bottom, results, settings)
        target = "half-cycles" if results[0].drive.cyclic else "targets"
        bottom.set_xlabel(rf"time $t/\tau_\mathrm{{th}}$ ({target})")


def draw_descent(descent: Descent, path: Path | str, *, title: str = "") -> None:
    """Draw temperatures in time, and how far the solid comes down, in millimetres.

    Beside it stands what the sliding limit comes to at the end on the solid's contacts and on many,
    each with a bar from a tenth more to a tenth less friction.

    Raises
    ------
    InputError
        If x_G was not recorded, or the file's name does not end like a picture's.
    """
    drive, moved = descent.result.drive, descent.millimetres
    dates = drive.dates
    time: NDArray[Any] = descent.elapsed if dates is None else dates[: moved.size]
    called = "above\n" + r"that of $\theta=0$ (K)"
    if isinstance(drive, TemperatureRecord):
        called = "(\N{DEGREE SIGN}C)" if drive.unit == "C" else "(K)"
    with page(path, 7.2, 5.2, title) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=(1, 1.7), width_ratios=(5.5, 1))
        bottom = figure.add_subplot(grid[1, 0])
        top = figure.add_subplot(grid[0, 0], sharex=bottom)
        side = figure.add_subplot(grid[1, 1], sharey=bottom)
        top.plot(*_thinned(time, descent.temperatures), color="0.25", linewidth=0.4)
        top.set_ylabel(f"temperature {called}")
        bottom.plot(*_thinned(time, moved), color=INKS[6], linewidth=1.6)
        bottom.set_ylabel("descent of the centre of mass (mm)")
        bottom.set_xlabel("days" if dates is None else "date")
        bottom.set_title(f"N = {descent.contacts[0]}, solver {descent.result.solver}", fontsize=8)
        for place, n in enumerate(descent.contacts):
            years = descent.days / float(DAYS_PER_YEAR)
            less, same, more = (descent.rates[n, factor] * years for factor in FRICTION)
            if np.isfinite([less, same, more]).all():
                side.plot([place] * 2, [more, less], color=INKS[place], linewidth=3, alpha=0.5)
            side.plot(place, same, marker="o", color=INKS[place])
        side.set_xticks((0, 1), [f"N={n}" for n in descent.contacts], fontsize=8)
        side.set_xlim(-0.6, 1.6)
        side.set_title("at the end,\nfriction \N{PLUS-MINUS SIGN}10 %", fontsize=8)
        side.tick_params(labelleft=False)
        top.tick_params(labelbottom=False)
        bottom.margins(x=0.01)
        if dates is not None:
            locator: Any = AutoDateLocator()  # type: ignore[no-untyped-call]
            bottom.xaxis.set_major_locator(locator)
            formatter: Any = ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
            bottom.xaxis.set_major_formatter(formatter)


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


def _draw_theta(axes: Axes, results: Sequence[Creep], *, band: bool) -> None:
    axes.set_ylabel(r"dilation $\theta$")
    axes.margins(x=0.01)
    longest = max(results, key=lambda result: result.half_cycles)
    if band:
        # the lines of so many cycles merge: the band that they fill says as much
        for level in sorted({_largest_theta(result) for result in results}, reverse=True):
            axes.fill_between(
                [0, longest.half_cycles], -level, level, facecolor="0.85", edgecolor="0.3"
            )
        axes.text(
            0.5, 0.5, rf"cycles between $\pm A_\theta$ ({longest.half_cycles} half-cycles)",
            transform=axes.transAxes, ha="center", va="center", fontsize=8,
        )  # fmt: skip
        return
    drives = _distinct_drives(results)
    if len(drives) > len(INKS):
        axes.set_title(f"the first {len(INKS)} of {len(drives)} drives", fontsize=8)
    for number, result in enumerate(drives[: len(INKS)]):
        theta = np.concatenate([[0.0], result.drive.targets(1, result.half_cycles, result.seed)])
        width = 0.7 if theta.size <= 2000 else 0.3
        time, values = _thinned(np.arange(theta.size), theta)
        axes.plot(time, values, color="0.25" if number == 0 else INKS[number], linewidth=width)


def _distinct_drives(results: Sequence[Creep]) -> list[Creep]:
    """Return one run for each drive."""
    found: dict[Any, Creep] = {}
    for result in results:
        key = (str(result.drive), result.seed if result.drive.random else None)
        found.setdefault(key, result)
    return list(found.values())


def _largest_theta(result: Creep) -> float:
    if not result.half_cycles:
        return 0.0
    count = min(result.half_cycles, 100_000)
    return float(np.abs(result.drive.targets(1, count, result.seed)).max())


def _course(values: NDArray[Any], start: float) -> tuple[NDArray[Any], NDArray[Any]]:
    return _thinned(np.arange(values.size + 1), np.concatenate([[start], values]))


def draw_one(axes: Axes, result: Creep) -> None:
    """Draw x_G of a run, and every slider where there are few."""
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


def _draw_members(
    axes: Axes, results: Sequence[Creep], settings: Sequence[Mapping[str, Any]]
) -> None:
    families: dict[str, list[tuple[Creep, str]]] = {}
    known = settings or [{}] * len(results)
    # what all members share does not tell them apart
    telling = [key for key in known[0] if any(one.get(key) != known[0][key] for one in known)]
    for result, setting in zip(results, known, strict=False):
        if "x_G" in result.recorded and result.recorded["x_G"].size:
            texts = [setting_text(key, setting[key]) for key in telling]
            families.setdefault(texts[0] if texts else "", []).append(
                (result, ", ".join(texts[1:]))
            )
    legend = len(families) <= 16
    ends: list[tuple[float, str, str]] = []
    for number, (name, family) in enumerate(families.items()):
        ink = INKS[number % len(INKS)]
        shown = name if len(family) == 1 else f"{name} ({len(family)} members)"
        for k, (result, own) in enumerate(family):
            axes.plot(
                *_course(result.recorded["x_G"], 0.0),
                color=ink,
                linestyle=DASHES[number // len(INKS) % len(DASHES)],
                linewidth=1.4 if k == 0 else 0.8,
                alpha=1.0 if k == 0 else 0.8,
                label=shown if k == 0 else None,
            )
            said = own if legend else ", ".join(filter(None, (name, own)))
            ends.append((float(result.recorded["x_G"][-1]), said, ink))
    axes.set_ylabel(r"displacement $\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)")
    axes.margins(x=0.01)
    if legend:
        axes.legend(loc="upper left")
    if any(own for _, own, _ in ends) and len(ends) <= 32:
        _name_ends(axes, ends)


def _name_ends(axes: Axes, ends: list[tuple[float, str, str]]) -> None:
    """Write each line's own setting beside its end, moved apart where they would overlap."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    apart = 1 / 36  # of the height of the axes: one line of text
    at = -1.0
    for value, own, ink in sorted(ends):
        at = max((value - low) / (high - low), at + apart)
        axes.annotate(
            own, (1.0, at), xycoords="axes fraction", xytext=(4, 0), textcoords="offset points",
            color=ink, fontsize=6.5, va="center", annotation_clip=False,
        )  # fmt: skip
