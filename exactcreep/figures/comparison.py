"""Pictures of solvers beside each other: where they part, and what time buys which accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import INKS, Style, new_figure
from exactcreep.studies.compare import Comparison
from exactcreep.studies.partings import Interval, Partings
from exactcreep.studies.tradeoff import Score, Tradeoff

_FLOOR = 1e-18
"""Smaller errors, and none at all, are drawn there: at the lower edge."""
_OFTEN_WRONG = 0.05  # share of rearrangements with other events
_FAMILIES = (
    ("verlet", False, "Verlet", INKS[0], "o"),
    ("verlet", True, "Verlet, events located", INKS[4], "s"),
    ("exact", False, "exact", INKS[1], "*"),
    ("certified", False, "certified", INKS[2], "D"),
    ("mpmath", False, "mpmath", INKS[5], "v"),
    ("sliding", False, "sliding limit", INKS[3], "^"),
)
"""Solver, whether it locates events, what a legend calls it, and its style."""


def draw_comparison(comparison: Comparison, path: Path | str, *, title: str = "") -> None:
    """Draw position errors until and after the first event that differs, and what x_G is off.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with new_figure(path, 6.0, 6.0, title) as figure:
        above, below = figure.subplots(2, 1)
        for standing, ink in zip(comparison.contestants, INKS, strict=False):
            errors = np.maximum(standing.errors, _FLOOR)
            rests = np.arange(1, errors.size + 1)
            above.plot(rests, errors, color=ink, label=standing.contestant.label)
            if standing.compared < errors.size:
                label = f"{standing.contestant.solver}: first event that differs"
                place = standing.compared + 0.5
                above.axvline(place, color=ink, linestyle="--", linewidth=0.8, label=label)
        above.set(yscale="log", xlabel="rest states, one after each rearrangement")
        above.set_ylabel(r"largest error of $\tilde{x}_n$ ($g\,\tau_\mathrm{dyn}^2$)")
        above.legend(loc="best")
        exact, verlet = (c.creep.recorded["x_G"] for c in comparison.contestants)
        size = min(exact.size, verlet.size)
        keep = np.unique(np.linspace(0, size - 1, 4000).astype(int))
        below.axhline(0.0, color=INKS[7], linewidth=0.8)
        below.plot(keep + 1, (verlet[:size] - exact[:size])[keep], color=INKS[1],
                   marker="o" if size <= 50 else None, markersize=3)  # fmt: skip
        below.xaxis.set_major_locator(MaxNLocator(integer=True))
        below.set_xlabel("half-cycles")
        below.set_ylabel(r"$\tilde{x}_G$, verlet minus exact ($g\,\tau_\mathrm{dyn}^2$)")


def draw_partings(found: Sequence[Partings], path: Path | str, *, title: str = "") -> None:
    """Draw against the time step where Verlet parts, how far off it is before, and its bias.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with new_figure(path, 10.0, 4.4, title) as figure:
        turns, errors, biases = figure.subplots(1, 3)
        for axes in (turns, errors):
            axes.set_yscale("log")
        beside = 1.0  # so that intervals at one time step do not cover each other
        for one, ink in zip(found, INKS, strict=False):
            for locate, mark, line in ((False, "o", "-"), (True, "s", "--")):
                beside *= 1.04
                family = one.family(locate=locate)
                steps = [part.dt * beside for part in family]
                style: Style = {"color": ink, "marker": mark, "linestyle": line, "capsize": 2,
                                "markersize": 4, "linewidth": 1.0,
                                "markerfacecolor": "white" if locate else ink}  # fmt: skip
                label = f"N = {one.experiment.chain.n}" + ", events located" * locate
                _draw_spans(turns, steps, [part.rate for part in family], label, style)
                order = one.order(locate=locate)
                label = f"order {order.value:.2f} ({order.lower:.2f} to {order.upper:.2f})"
                label *= not math.isnan(order.value)
                _draw_spans(errors, steps, [part.error for part in family], label, style)
                shares = [Interval(*(100 * x for x in part.bias)) for part in family]
                _draw_spans(biases, steps, shares, "", style)
        for axes in (turns, errors, biases):
            axes.set(xscale="log", xlabel=r"time step ($\tau_\mathrm{dyn}$)")
        turns.set_ylabel("wrong turns per event (95 %)")
        errors.set_ylabel(r"largest error before ($g\,\tau_\mathrm{dyn}^2$), quartiles")
        biases.set_ylabel("bias of the mean velocity (%), 95 %")
        biases.axhline(0.0, color=INKS[7], linewidth=0.8, zorder=0)
        if errors.get_legend_handles_labels()[0]:
            errors.legend(fontsize=7)
        _name_below(figure, turns)


def _draw_spans(
    axes: Axes, steps: Sequence[float], spans: Sequence[Interval], label: str, style: Style
) -> None:
    """Draw numbers with their intervals against the time steps; on a log scale 0 as its bound."""
    known = [(dt, *span) for dt, span in zip(steps, spans, strict=True)
             if all(map(math.isfinite, span))]  # fmt: skip
    zeros = [one for one in known if axes.get_yscale() == "log" and one[1] == 0]
    if shown := [one for one in known if one not in zeros]:
        dt, value, lower, upper = np.array(shown).T
        axes.errorbar(dt, value, [value - lower, upper - value], label=label or None, **style)
    for dt_of_zero, _, _, bound in zeros:
        axes.plot(dt_of_zero, bound, marker=7, color=style["color"], markersize=6)


def _name_below(figure: Figure, *panels: Axes) -> None:
    """Write one legend of the panels below them, each name once."""
    known = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    if known:
        handles, columns = list(known.values()), len(known)
        figure.legend(handles, list(known), loc="outside lower center", ncols=columns)


def draw_tradeoff(measured: Tradeoff, path: Path | str, *, title: str = "") -> None:
    """Draw error against time: of single rearrangements, and of the mean velocity.

    Raises
    ------
    InputError
        If the file cannot be written, or its ending is none of a picture.
    """
    with new_figure(path, 9.0, 4.6, title) as figure:
        left, right = figure.subplots(1, 2)
        timed = [one for one in measured.scores if not math.isnan(one.seconds)]
        for solver, locate, label, ink, mark in _FAMILIES:
            scores = [
                one
                for one in timed
                if one.contestant.solver == solver
                and bool(one.contestant.options.get("locate")) is locate
            ]
            style: Style = {"color": ink, "marker": mark, "label": label, "capsize": 2,
                            "markersize": 9 if mark == "*" else 5}  # fmt: skip
            _draw_errors(left, [one for one in scores if one.error > 0], style)
            if measured.velocity and not math.isnan(measured.velocity):
                biased = [one for one in scores if not math.isnan(one.bias)]
                _draw_bias(right, biased, 100 / abs(measured.velocity), style)
        for axes in (left, right):
            axes.set(xscale="log", xlabel="time per half-cycle (s)")
            axes.margins(x=0.12)
        left.set(
            yscale="log", ylabel=r"position error of a rearrangement ($g\,\tau_\mathrm{dyn}^2$)"
        )
        left.set_title("median and largest; open: other events in more than 5 %", fontsize=8)
        if any(one.error > _FLOOR for one in measured.scores):
            left.set_ylim(bottom=_FLOOR / 3)
        right.axhline(0.0, color=INKS[7], linewidth=0.8, zorder=0)
        right.set_ylabel("bias of the mean velocity (%)")
        right.set_title("against exact, same disorder; bars: standard error", fontsize=8)
        _name_below(figure, left, right)


def _draw_errors(axes: Axes, scores: list[Score], style: Style) -> None:
    if not scores:
        return
    x = [one.seconds for one in scores]
    y = np.maximum([one.error for one in scores], _FLOOR)
    above = np.maximum([one.error_high for one in scores], _FLOOR) - y
    axes.errorbar(x, y, yerr=[np.zeros_like(y), above], linewidth=1.0, **style)
    located = style["marker"] == "s"
    for place, one in enumerate(scores):
        if one.wrong > _OFTEN_WRONG:
            axes.plot(x[place], y[place], marker=style["marker"], markersize=5, zorder=5,
                      markerfacecolor="white", markeredgecolor=style["color"])  # fmt: skip
        # of two lines that fall, the upper one is labelled above, the lower one below
        words, offset = _option_text(one), (-5, -8) if located else (6, 3)
        if one.error < _FLOOR:
            words, offset = f"{words} digits: {one.error:.0e}", (-5, 9 * place)
        side = "right" if offset[0] < 0 else "left"
        _write(axes, words, (x[place], y[place]), offset, style["color"], side)


def _draw_bias(axes: Axes, scores: list[Score], scale: float, style: Style) -> None:
    if not scores:
        return
    x = [one.seconds for one in scores]
    bias, error = (scale * np.array([getattr(one, name) for one in scores])
                   for name in ("bias", "bias_error"))  # fmt: skip
    axes.errorbar(x, bias, yerr=error, linestyle="none", **style)
    for place, one in enumerate(scores):
        if style["marker"] == "s":  # located steps take about as long as each other
            where, offset, side = (x[place], bias[place]), (6, -2), "left"
        else:
            where, offset, side = (x[place], bias[place] + error[place]), (0, 3), "center"
        _write(axes, _option_text(one), where, offset, style["color"], side)


def _option_text(score: Score) -> str:
    options = score.contestant.options
    return str(options.get("dt", options.get("digits", "")))


def _write(axes: Axes, words: str, where: Any, offset: Any, ink: str, side: str) -> None:
    axes.annotate(words, where, xytext=offset, textcoords="offset points", fontsize=6, color=ink,
                  ha=side)  # fmt: skip


def draw_compared(found: Comparison | Partings, path: Path | str, *, title: str = "") -> None:
    """Draw one comparison, or that of many seeds."""
    if isinstance(found, Partings):
        draw_partings([found], path, title=title)
    else:
        draw_comparison(found, path, title=title)
