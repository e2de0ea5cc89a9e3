"""The benchmark drawn: error against time, time per half-cycle, time to an answer."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes

from exactcreep.figures.style import INKS, STYLE, picture, save_picture
from tests.benchmarks.measurements import TIME_STEPS, HalfCycles
from tests.benchmarks.questions import Answer
from tests.benchmarks.rearrangements import Rearrangements
from tests.benchmarks.report import LABELS, Results

_MARKS = {
    "exact": (INKS[1], "*"),
    "Verlet": (INKS[0], "o"),
    "Verlet, located": (INKS[4], "s"),
    "heyoka": (INKS[2], "D"),
    "SciPy": (INKS[3], "^"),
}
_FLOOR = 1e-16
_LOST = 0.1  # where settings are drawn with which more than one in ten takes a wrong turn


def draw(results: Results, path: Path) -> None:
    """Draw error against time of the longest chain's rearrangements, and times per half-cycle."""
    with mpl.rc_context(STYLE):
        figure = picture(9.0, 4.2)
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1))
        _draw_errors(left, results.rearrangements[-1])
        _draw_half_cycles(right, results.half_cycles)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=7)
        save_picture(figure, path)


def _draw_errors(axes: Axes, single: Rearrangements) -> None:
    for family, (ink, mark) in _MARKS.items():
        lost = [m for m in single.family(family) if m.quantile(0.9) == math.inf]
        axes.plot(
            [m.seconds * 1e6 for m in lost],
            [_LOST] * len(lost),
            color=ink,
            marker=mark,
            markersize=5,
            markerfacecolor="white",
            linestyle="none",
        )
        for method in lost:
            setting = method.setting.rpartition("= ")[2]
            axes.annotate(
                f"{setting}: {100 * method.wrong:.0f} %",
                (method.seconds * 1e6, _LOST),
                xytext=(0, 6),
                textcoords="offset points",
                fontsize=6,
                color=ink,
                rotation=90,
                ha="center",
                va="bottom",
            )
        shown = [m for m in single.family(family) if m.quantile(0.9) < math.inf]
        x = [m.seconds * 1e6 for m in shown]
        y = [max(m.quantile(0.9), _FLOOR) for m in shown]
        axes.plot(
            x,
            y,
            color=ink,
            marker=mark,
            markersize=11 if mark == "*" else 5,
            linestyle="-" if len(shown) > 1 else "none",
            label=LABELS[family],
        )
        for method, a, b in zip(shown, x, y, strict=True):
            words = method.setting.rpartition("= ")[2]
            if family == "exact":
                words = f"{a:.2g} µs"
            if family.startswith("Verlet"):
                words = f"{float(words):g}"
            above = family in ("Verlet", "SciPy", "heyoka")
            axes.annotate(
                words,
                (a, b),
                xytext=(6 if above else -6, 2 if above else -7),
                textcoords="offset points",
                fontsize=6,
                color=ink,
                ha="left" if above else "right",
            )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.14)
    axes.set_ylim(_FLOOR / 3, _LOST * 2e4)
    axes.set_yticks([10.0**k for k in range(-15, 0, 2)])
    axes.axhline(_LOST, color=INKS[7], linewidth=0.6, linestyle=":", zorder=0)
    axes.set_xlabel("processor time per rearrangement (µs)")
    axes.set_ylabel(r"error of nine in ten rearrangements ($g\,\tau_\mathrm{dyn}^2$)", fontsize=9)
    axes.set_title(
        f"N = {single.n}; numbers: dt or tolerance; open: in so many % wrong events",
        fontsize=8,
    )


def _draw_half_cycles(axes: Axes, half_cycles: list[HalfCycles]) -> None:
    bars = [("exact", INKS[1])] + [
        (f"Verlet, dt = {dt}", ink)
        for dt, ink in zip(reversed(TIME_STEPS), ("#B3CDE3", "#6497B1", INKS[0]), strict=True)
    ]
    width = 0.8 / len(bars)
    for k, (label, ink) in enumerate(bars):
        heights = []
        for one in half_cycles:
            place = [c.label for c in one.contestants].index(label)
            heights.append(one.seconds(place) * 1e6)
        x = [i + (k - (len(bars) - 1) / 2) * width for i in range(len(heights))]
        axes.bar(x, heights, width, color=ink, label=label, edgecolor="black", linewidth=0.4)
        if label == f"Verlet, dt = {TIME_STEPS[0]}":
            for i, one in enumerate(half_cycles):
                place = [c.label for c in one.contestants].index(label)
                axes.annotate(
                    f"×{one.ratio(place):.2g}",
                    (x[i], heights[i]),
                    xytext=(0, 2),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7,
                    color=ink,
                )
    axes.set_yscale("log")
    axes.margins(y=0.12)
    axes.tick_params(axis="x", which="both", top=False, bottom=False)
    axes.set_xticks(
        range(len(half_cycles)),
        [f"N = {one.n}\nA = {one.amplitude}" for one in half_cycles],
        fontsize=7,
    )
    axes.set_ylabel("processor time per half-cycle (µs)")
    axes.set_title("whole half-cycles; ×: Verlet at dt = 0.01 against exact", fontsize=8)
    axes.legend(loc="upper left", fontsize=7)


def draw_answers(answers: list[Answer], path: Path) -> None:
    """Draw the time of every answer, a row for each question and size."""
    rows = list(dict.fromkeys((one.question, one.n) for one in answers))
    methods = list(dict.fromkeys(one.method for one in answers))
    with mpl.rc_context(STYLE):
        figure = picture(7.0, 0.8 + 0.24 * len(rows))
        axes = figure.subplots()
        for k, method in enumerate(methods):
            shown = [one for one in answers if one.method == method and one.seconds > 0]
            axes.plot(
                [one.seconds for one in shown],
                [rows.index((one.question, one.n)) for one in shown],
                color=INKS[k % len(INKS)],
                marker="os^Dv*<>P"[k % 9],
                markersize=6,
                linestyle="none",
                label=method,
            )
        axes.set_xscale("log")
        axes.set_yticks(range(len(rows)), [f"{what}, N = {n}" for what, n in rows], fontsize=7)
        axes.invert_yaxis()
        axes.grid(axis="y", linewidth=0.3)
        axes.set_xlabel("processor time to the answer (s)")
        figure.legend(loc="outside lower center", ncols=min(len(methods), 5), fontsize=7)
        save_picture(figure, path)
