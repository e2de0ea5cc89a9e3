"""Pictures of runs: theta and x_G over time, and how far a solid comes down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from numpy.typing import NDArray

from exactcreep.figures.style import DASHES, INKS, Style, new_figure, setting_text
from exactcreep.model.temperature_record import TemperatureRecord
from exactcreep.quasistatic.result import Creep
from exactcreep.solid import DAYS_PER_YEAR, FRICTION, Descent

_MOST_POINTS = 20_000  # of a line; more cannot be told apart
_LONGEST_TRACE = 400  # half-cycles; the band of more says less than a trace, and needs less room
_MOST_FAMILIES = 16  # that a legend can name
_MOST_ENDS = 32  # of lines, that words can be written beside


def draw_run(
    results: Sequence[Creep],
    path: Path | str,
    *,
    settings: Sequence[Mapping[str, Any]] = (),
    title: str = "",
) -> None:
    """Draw theta(t) and x_G(t) of one or several runs that recorded x_G, time in half-cycles.

    A single run that recorded the positions shows every slider as well, as the paper's
    Fig. position2sliders; several runs show x_G of all, one line each, coloured by the first
    quantity that varies.

    Raises
    ------
    InputError
        If the file cannot be written, or its name does not end like a picture's.
    """
    with new_figure(path, 6.4, 5.2, title) as figure:
        band = all(one.drive.cyclic and one.half_cycles > _LONGEST_TRACE for one in results)
        ratios = (1, 5) if band else (1, 2.4)
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=ratios)
        (_draw_band if band else _draw_theta)(top, results)
        top.set_ylabel(r"dilation $\theta$")
        top.margins(x=0.01)
        if len(results) == 1:
            draw_one(bottom, results[0])
        else:
            _draw_members(bottom, results, settings)


def _draw_band(axes: Axes, results: Sequence[Creep]) -> None:
    """Draw what the lines of so many cycles fill."""
    longest = max(result.half_cycles for result in results)
    levels = {abs(float(result.drive.targets(1, 1, result.seed)[0])) for result in results}
    for level in sorted(levels, reverse=True):
        axes.fill_between([0, longest], -level, level, facecolor="0.85", edgecolor="0.3")
    text = rf"cycles between $\pm A_\theta$ ({longest} half-cycles)"
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=8)


def _draw_theta(axes: Axes, results: Sequence[Creep]) -> None:
    """Draw theta over time, one line for each drive."""
    drives: dict[Any, Creep] = {}
    for result in results:
        key = (str(result.drive), result.seed if result.drive.random else None)
        drives.setdefault(key, result)
    if len(drives) > len(INKS):
        axes.set_title(f"the first {len(INKS)} of {len(drives)} drives", fontsize=8)
    for result, ink in zip(drives.values(), ("0.25", *INKS[1:]), strict=False):
        theta = result.drive.targets(1, result.half_cycles, result.seed)
        width = 0.7 if theta.size < 2000 else 0.3
        axes.plot(*_course(theta, 0.0), color=ink, linewidth=width)


def draw_one(axes: Axes, result: Creep) -> None:
    """Draw x_G of a run over time, and every slider where there are few."""
    start = result.experiment.initial.displacements.astype(float)
    course = _course(result.recorded["x_G"], float(start.mean()))
    axes.plot(*course, color=INKS[6], linewidth=1.6, label=r"$\Delta\tilde{x}_G$", zorder=3)
    if "x" in result.recorded and result.chain.n <= 6:
        for n in range(result.chain.n):
            course = _course(result.recorded["x"][:, n], float(start[n]))
            label = rf"$\Delta\tilde{{x}}_{{{n + 1}}}$"
            dashes = DASHES[n % len(DASHES)]
            axes.plot(*course, color=INKS[n], linestyle=dashes, linewidth=0.9, label=label)
    _label(axes, r"displacement ($g\,\tau_\mathrm{dyn}^2$)", result)
    axes.legend(loc="best")


def _label(axes: Axes, name: str, result: Creep) -> None:
    target = "half-cycles" if result.drive.cyclic else "targets"
    axes.set(xlabel=rf"time $t/\tau_\mathrm{{th}}$ ({target})", ylabel=name)
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
            name, *others = [setting_text(key, setting[key]) for key in telling] or [""]
            families.setdefault(name, []).append((result, ", ".join(others)))
    legend = len(families) <= _MOST_FAMILIES
    ends: list[tuple[float, str, str]] = []
    for number, (name, family) in enumerate(families.items()):
        ink = INKS[number % len(INKS)]
        shown = name if len(family) == 1 else f"{name} ({len(family)} members)"
        style: Style = {"color": ink, "linestyle": DASHES[number // len(INKS) % len(DASHES)]}
        for k, (result, own) in enumerate(family):
            first = (
                {"linewidth": 1.4, "label": shown} if k == 0 else {"linewidth": 0.8, "alpha": 0.8}
            )
            axes.plot(*_course(result.recorded["x_G"], 0.0), **style, **first)
            said = own if legend else ", ".join(filter(None, (name, own)))
            ends.append((float(result.recorded["x_G"][-1]), said, ink))
    _label(axes, r"displacement $\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)", results[0])
    if legend:
        axes.legend(loc="upper left")
    if any(own for _, own, _ in ends) and len(ends) <= _MOST_ENDS:
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


def draw_descent(descent: Descent, path: Path | str, *, title: str = "") -> None:
    """Draw temperatures in time, and how far the solid comes down: of some years, in each of them.

    Beside it stands what the sliding limit comes to on the solid's contacts and on many, each with
    a bar from a tenth more to a tenth less friction, and what was measured.

    Raises
    ------
    InputError
        If x_G was not recorded, or the file's name does not end like a picture's.
    """
    drive, moved = descent.result.drive, descent.millimetres
    dates, yearly = drive.dates, descent.stretches(DAYS_PER_YEAR)
    time: NDArray[Any] = descent.elapsed if dates is None else dates[: moved.size]
    called = "above\n" + r"that of $\theta=0$ (K)"
    if isinstance(drive, TemperatureRecord):
        called = "(\N{DEGREE SIGN}C)" if drive.unit == "C" else "(K)"
    several = yearly.size > 4
    years = 1.0 if several else descent.days / float(DAYS_PER_YEAR)
    with new_figure(path, 7.2, 5.2, title) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=(1, 1.7), width_ratios=(5.5, 1))
        bottom = figure.add_subplot(grid[1, 0])
        top = figure.add_subplot(grid[0, 0], sharex=bottom)
        side = figure.add_subplot(grid[1, 1], sharey=bottom)
        top.plot(*_thinned(time, descent.temperatures), color="0.25", linewidth=0.4)
        top.set_ylabel(f"temperature {called}")
        top.tick_params(labelbottom=False)
        if several:
            places = np.linspace(0, time.size - 1, yearly.size + 1)[:-1].astype(int)
            bottom.plot(time[places], yearly, color=INKS[6], linewidth=0.8, marker=".")
            bottom.set_ylim(0, 1.25 * yearly.max())
            bottom.set_ylabel("descent in each year (mm)")
        else:
            bottom.plot(*_thinned(time, moved), color=INKS[6], linewidth=1.6)
            bottom.set_ylabel("descent of the centre of mass (mm)")
        bottom.set_xlabel("days" if dates is None else "date")
        said = f"N = {descent.contacts[0]}, solver {descent.result.solver}"
        if descent.solid.measured:
            said += f"; dashed: {float(descent.solid.measured):.4g} mm a year, measured"
        bottom.set_title(said, fontsize=8)
        bottom.margins(x=0.01)
        for place, n in enumerate(descent.contacts):
            less, same, more = (descent.rates[n, factor] * years for factor in FRICTION)
            if np.isfinite([less, same, more]).all():
                side.plot([place] * 2, [more, less], color=INKS[place], linewidth=3, alpha=0.5)
            side.plot(place, same, marker="o", color=INKS[place])
        if descent.solid.measured:
            level = float(descent.solid.measured) * years
            for axes in (bottom, side):
                axes.axhline(level, color=INKS[1], linestyle="--", linewidth=1)
        side.set_xticks((0, 1), [f"N=\n{n}" for n in descent.contacts], fontsize=8)
        side.set_xlim(-0.6, 1.6)
        when = "mean" if several else "at the end"
        side.set_title(f"{when},\nfriction \N{PLUS-MINUS SIGN}10 %", fontsize=8)
        side.tick_params(labelleft=False)
        if dates is not None:
            locator: Any = AutoDateLocator()  # type: ignore[no-untyped-call]
            bottom.xaxis.set_major_locator(locator)
            formatter: Any = ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
            bottom.xaxis.set_major_formatter(formatter)


def _course(values: NDArray[Any], start: float) -> tuple[NDArray[Any], NDArray[Any]]:
    return _thinned(np.arange(values.size + 1), np.append(start, values))


def _thinned(time: NDArray[Any], values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return at most `_MOST_POINTS` points that keep the smallest and largest of each stretch."""
    if time.size <= _MOST_POINTS:
        return time, values
    width = -(-2 * time.size // _MOST_POINTS)
    kept = {time.size - 1}
    for start in range(0, time.size, width):
        stretch = values[start : start + width]
        kept |= {start + int(stretch.argmin()), start + int(stretch.argmax())}
    shown = sorted(kept)
    return time[shown], values[shown]
