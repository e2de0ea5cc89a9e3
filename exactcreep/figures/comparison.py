"""Pictures of solvers beside each other: where they part, and what time buys which accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import INKS, page
from exactcreep.studies.compare import Comparison, Standing
from exactcreep.studies.partings import Interval, Parting, Partings
from exactcreep.studies.tradeoff import Score, Tradeoff

_FLOOR = 1e-18
"""Smaller errors, and none at all, are drawn there: at the lower edge."""


def draw_comparison(comparison: Comparison, path: Path | str, *, title: str = "") -> None:
    """Draw position errors until and after the first event that differs, and what x_G is off.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with page(path, 6.0, 6.0, title) as figure:
        above, below = figure.subplots(2, 1)
        for standing, ink in zip(comparison.contestants, INKS, strict=False):
            _draw_course(above, standing, ink)
        above.set_yscale("log")
        above.set_xlabel("rest states, one after each rearrangement")
        above.set_ylabel(r"largest error of $\tilde{x}_n$ ($g\,\tau_\mathrm{dyn}^2$)")
        above.legend(loc="best")
        exact, verlet = (c.creep.recorded["x_G"] for c in comparison.contestants)
        size = min(exact.size, verlet.size)
        keep = np.unique(np.linspace(0, size - 1, 4000).astype(int))
        below.axhline(0.0, color=INKS[7], linewidth=0.8)
        below.plot(
            keep + 1, (verlet[:size] - exact[:size])[keep], color=INKS[1],
            marker="o" if size <= 50 else None, markersize=3,
        )  # fmt: skip
        below.xaxis.set_major_locator(MaxNLocator(integer=True))
        below.set_xlabel("half-cycles")
        below.set_ylabel(r"$\tilde{x}_G$, verlet minus exact ($g\,\tau_\mathrm{dyn}^2$)")


def _draw_course(axes: Axes, standing: Standing, ink: str) -> None:
    errors = np.maximum(standing.errors, _FLOOR)
    axes.plot(np.arange(1, errors.size + 1), errors, color=ink, label=standing.contestant.label)
    if standing.compared < errors.size:
        axes.axvline(
            standing.compared + 0.5,
            color=ink,
            linestyle="--",
            linewidth=0.8,
            label=f"{standing.contestant.solver}: first event that differs",
        )


def draw_partings(found: Sequence[Partings], path: Path | str, *, title: str = "") -> None:
    """Draw against the time step where Verlet parts, how far off it is before, and its bias.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with page(path, 10.0, 4.4, title) as figure:
        turns, errors, biases = figure.subplots(1, 3)
        for axes in (turns, errors):
            axes.set_yscale("log")
        beside = 1.0  # so that intervals at one time step do not cover each other
        for one, ink in zip(found, INKS, strict=False):
            for locate, mark, line in ((False, "o", "-"), (True, "s", "--")):
                beside *= 1.04
                family = one.family(locate=locate)
                order = one.order(locate=locate)
                label = f"N = {one.experiment.chain.n}" + ", events located" * locate
                about = {"color": ink, "marker": mark, "linestyle": line, "capsize": 2,
                         "markersize": 4, "linewidth": 1.0}  # fmt: skip
                if locate:
                    about["markerfacecolor"] = "white"
                about["place"] = beside
                _draw_spans(turns, family, [part.rate for part in family], about, label=label)
                fitted = "" if math.isnan(order.value) else f"order {_of_order(order)}"
                _draw_spans(errors, family, [part.error for part in family], about, label=fitted)
                shares = [Interval(*(100 * x for x in part.bias)) for part in family]
                _draw_spans(biases, family, shares, about)
        for axes in (turns, errors, biases):
            axes.set(xscale="log", xlabel=r"time step ($\tau_\mathrm{dyn}$)")
        turns.set_ylabel("wrong turns per event (95 %)")
        errors.set_ylabel(r"largest error before ($g\,\tau_\mathrm{dyn}^2$), quartiles")
        biases.set_ylabel("bias of the mean velocity (%), 95 %")
        biases.axhline(0.0, color=INKS[7], linewidth=0.8, zorder=0)
        if errors.get_legend_handles_labels()[0]:
            errors.legend(fontsize=7)
        known = turns.get_legend_handles_labels()
        if known[0]:
            figure.legend(*known, loc="outside lower center", ncols=len(known[0]), fontsize=8)


def _of_order(order: Interval) -> str:
    return f"{order.value:.2f} ({order.lower:.2f} to {order.upper:.2f})"


def _draw_spans(
    axes: Axes, family: Sequence[Parting], spans: Sequence[Interval], about: Any, label: str = ""
) -> None:
    """Draw numbers with their intervals against the time steps; on a log scale 0 as its bound."""
    place = about["place"]
    about = {name: value for name, value in about.items() if name != "place"}
    known = [
        (one.dt * place, *span)
        for one, span in zip(family, spans, strict=True)
        if all(map(math.isfinite, span))
    ]
    none = [one for one in known if axes.get_yscale() == "log" and one[1] == 0]
    if shown := [one for one in known if one not in none]:
        dt, value, lower, upper = np.array(shown).T
        axes.errorbar(dt, value, [value - lower, upper - value], label=label or None, **about)
    for dt_of_none, _, _, bound in none:
        axes.plot(dt_of_none, bound, marker=7, color=about["color"], markersize=6)


def draw_tradeoff(measured: Tradeoff, path: Path | str, *, title: str = "") -> None:
    """Draw error against time: of single rearrangements, and of the mean velocity.

    Raises
    ------
    InputError
        If the file cannot be written, or its ending is none of a picture.
    """
    with page(path, 9.0, 4.6, title) as figure:
        left, right = figure.subplots(1, 2)
        for solver, locate, label, ink, mark in _FAMILIES:
            chosen = [
                one
                for one in measured.scores
                if one.contestant.solver == solver
                and (locate is None or bool(one.contestant.options.get("locate")) is locate)
            ]
            _draw_errors(left, chosen, label, ink, mark)
            _draw_bias(right, chosen, measured.velocity, label, ink, mark)
        for axes in (left, right):
            axes.set_xscale("log")
            axes.margins(x=0.12)
            axes.set_xlabel("time per half-cycle (s)")
        left.set_yscale("log")
        left.set_ylabel(r"position error of a rearrangement ($g\,\tau_\mathrm{dyn}^2$)")
        left.set_title("median and largest; open: other events in more than 5 %", fontsize=8)
        if any(one.error > _FLOOR for one in measured.scores):
            left.set_ylim(bottom=_FLOOR / 3)
        right.axhline(0.0, color=INKS[7], linewidth=0.8, zorder=0)
        right.set_ylabel("bias of the mean velocity (%)")
        right.set_title("against exact, same disorder; bars: standard error", fontsize=8)
        known = {
            label: handle
            for axes in (left, right)
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        if known:
            figure.legend(
                list(known.values()), list(known), loc="outside lower center", ncols=len(known)
            )


_OFTEN_WRONG = 0.05
_FAMILIES = (
    ("verlet", False, "Verlet", INKS[0], "o"),
    ("verlet", True, "Verlet, events located", INKS[4], "s"),
    ("exact", None, "exact", INKS[1], "*"),
    ("certified", None, "certified", INKS[2], "D"),
    ("mpmath", None, "mpmath", INKS[5], "v"),
    ("sliding", None, "sliding limit", INKS[3], "^"),
)


def _draw_errors(axes: Axes, scores: list[Score], label: str, ink: str, mark: str) -> None:
    shown = [one for one in scores if one.error > 0 and not math.isnan(one.seconds)]
    if not shown:
        return
    x = [one.seconds for one in shown]
    y = [max(one.error, _FLOOR) for one in shown]
    above = [max(one.error_high, _FLOOR) - low for one, low in zip(shown, y, strict=True)]
    axes.errorbar(
        x,
        y,
        yerr=[[0.0] * len(y), above],
        color=ink,
        marker=mark,
        label=label,
        capsize=2,
        markersize=9 if mark == "*" else 5,
        linewidth=1.0,
    )
    for place, one in enumerate(shown):
        if one.wrong > _OFTEN_WRONG:
            axes.plot(
                x[place],
                y[place],
                marker=mark,
                markersize=5,
                markerfacecolor="white",
                markeredgecolor=ink,
                zorder=5,
            )
        # of two lines that fall, the upper one is labelled above, the lower one below
        words, offset, side = _option_text(one), (6, 3), "left"
        if mark == "s":
            offset, side = (-5, -8), "right"
        if one.error < _FLOOR:
            words, offset, side = f"{words} digits: {one.error:.0e}", (-5, 9 * place), "right"
        axes.annotate(
            words,
            (x[place], y[place]),
            xytext=offset,
            textcoords="offset points",
            fontsize=6,
            color=ink,
            ha=side,
        )


def _option_text(score: Score) -> str:
    options = score.contestant.options
    return str(options.get("dt", options.get("digits", "")))


def _draw_bias(
    axes: Axes, scores: list[Score], velocity: float, label: str, ink: str, mark: str
) -> None:
    shown = [one for one in scores if not math.isnan(one.bias) and not math.isnan(one.seconds)]
    if not shown or not velocity or math.isnan(velocity):
        return
    scale = 100 / abs(velocity)
    axes.errorbar(
        [one.seconds for one in shown],
        [one.bias * scale for one in shown],
        yerr=[one.bias_error * scale for one in shown],
        color=ink,
        marker=mark,
        label=label,
        capsize=2,
        linestyle="none",
        markersize=9 if mark == "*" else 5,
    )
    for one in shown:
        top = (one.bias + one.bias_error) * scale
        beside = mark == "s"  # located steps take about as long as each other
        axes.annotate(
            _option_text(one),
            (one.seconds, one.bias * scale if beside else top),
            xytext=(6, -2) if beside else (0, 3),
            textcoords="offset points",
            fontsize=6,
            color=ink,
            ha="left" if beside else "center",
        )
