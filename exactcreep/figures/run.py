"""Pictures of runs: x_G and theta over time, a solid's descent, and a run around one half-cycle."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.container import BarContainer
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exactcreep.figures.style import (
    DASHED,
    DASHES,
    DISPLACEMENT,
    DOTTED,
    INKS,
    LENGTH,
    STYLE,
    PlainNumbers,
    new_figure,
    setting_label,
    styled,
    symbol_of,
)
from exactcreep.laws import prediction
from exactcreep.model.contacts import Contacts
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import frictions_of
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.records.temperature_record import TemperatureRecord
from exactcreep.solvers import tables
from exactcreep.solvers.interface import Rearrangement, simulate
from exactcreep.solvers.sliding import Sliding, tension_bounds
from exactcreep.studies.avalanches import MEASURES, avalanches_of, distribution
from exactcreep.walk import DAYS_PER_YEAR, FRICTION, Walk
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import Hearer, reporter

Floats = NDArray[np.float64]
WINDOW = 200
"""Half-cycles in a space-time diagram. The default of `portrait`."""
_SLIDERS = tuple(ink for ink in INKS if ink not in (INKS[1], INKS[6]))
"""Colours of sliders; x_G is black, and the law has a colour of its own."""
_LONGEST_TRACE = 400  # most half-cycles of theta drawn as a line; more are drawn as a band
_INSIDE = 4  # half-cycles at the beginning of a run that are drawn from inside
_MOST_EVENTS = 200_000  # most events that are computed again for them
_MOST_STEPS = 20_000  # most rearrangements that are drawn as steps
_NUMBERS_AT_ONCE = 1 << 20  # slips that `portrait` computes again before it drops them
_REPORTS = 200  # of the progress of `portrait`, at least, in a long run
_INSTANTS = 400  # instants at which a rearrangement is drawn
_WHOLE = partial(MaxNLocator, 8, integer=True, min_n_ticks=1)  # whole numbers along an axis
_SHADES = ("#FFFFFF", "#FEE391", "#FEC44F", "#FE9929", "#CC4C02", "#7F2704", "#2B0B00")
_ALONG = ("mu_d", "mu_s", "expansion")
_UNITS = {"C": "\N{DEGREE SIGN}C", "K": "K"}


# --- one or several runs -------------------------------------------------------------------------


@styled
def draw_run(run: Creep, title: str = "") -> Figure:
    """Draw theta and x_G of a run that recorded x_G, and its beginning inside half-cycles.

    If the run recorded rearrangements, draw how their sizes and durations are distributed.
    """
    with suppress(InputError):  # none happened after the burn-in
        if "rearrangements" in run.experiment.record:
            return _draw_sizes(run, title)
    begun = _beginning(run)
    figure = new_figure(6.4 if begun is None else 9.6, 5.2, title)
    rows = "theta, whole" if begun is None else "theta ramps, whole inside, whole durations"
    layout: list[Any] = [row.split() for row in rows.split(",")]
    panels = figure.subplot_mosaic(layout, height_ratios=(1, 4, 1.2)[: len(layout)])
    top, bottom = panels["theta"], panels["whole"]
    top.sharex(bottom)
    if run.drive.cyclic and run.half_cycles > _LONGEST_TRACE:
        _draw_band(top, run)
    else:
        _draw_theta(top, run, run.half_cycles)
    top.set_title(parameters_text(run), fontsize=8, loc="left")
    top.set_ylabel(r"dilation $\theta$")
    for each in layout[0]:
        panels[each].yaxis.set_major_formatter(_theta_label)
        panels[each].tick_params(labelbottom=False)
    if not np.size(run.recorded.get("x_G", ())):
        words = f"{run.finding}\nbefore the end of a first half-cycle"
        bottom.text(0.5, 0.5, words, transform=bottom.transAxes, ha="center", va="center")
        top.set(xticks=[], yticks=[])
        bottom.set(xticks=[], yticks=[])
        return figure
    draw_one(bottom, run)
    _draw_law(bottom, run)
    if begun is not None:
        _draw_beginning(panels, run, begun)
    lines = [line for axes in panels.values() for line in axes.lines]
    named = {str(line.get_label()): line for line in lines if line.get_label()[:1] not in "_"}
    bottom.get_legend().remove()
    figure.legend(named.values(), named, loc="outside lower center", ncols=8)
    return figure


def _draw_theta(axes: Axes, run: Creep, until: int) -> None:
    theta = run.drive.targets(1, until, run.seed)
    axes.plot(*_trajectory(theta), color="0.25", linewidth=0.7 if theta.size < 2000 else 0.3)
    axes.margins(x=0.01)


def _draw_sizes(run: Creep, title: str) -> Figure:
    """Draw the distributions of sizes and durations; `InputError` if there are no avalanches."""
    figure = new_figure(8.4, 4.0, title)
    for axes, measure in zip(figure.subplots(1, 2), ("size", "duration"), strict=True):
        Plots(run).avalanches(measure, axes)
    figure.axes[0].set_title(parameters_text(run), fontsize=8, loc="left")
    return figure


class _Course(NamedTuple):
    """Displacements within half-cycles; they change in a step at each rearrangement.

    `time`: the start, the rearrangements, and the end, in half-cycles; `durations` of the
    rearrangements, unit tau_dyn; `moved` (ndarray, shape (m, r + 2)): x_G, and each slider of a
    short chain that recorded its slips, from each time on.
    """

    until: int
    time: Floats
    durations: Floats
    moved: Floats


def times_of(run: Creep, recorded: Mapping[str, NDArray[Any]], until: int) -> Floats:
    """Return when the rearrangements up to a target happen, in half-cycles since the start."""
    place = recorded["rearrangement_half_cycle"]
    passed, span = floats(recorded["rearrangement_theta"]), np.ones(place.size)
    if not run.drive.springs:  # else theta is the part of the way that has passed
        ramps = np.append(run.experiment.theta, run.drive.targets(1, until, run.seed))
        passed = passed - ramps[place - 1]
        span = np.where(np.diff(ramps) == 0, math.inf, np.diff(ramps))[place - 1]
    times: Floats = place - 1 + np.clip(passed / span, 0, 1)
    return times


def _beginning(run: Creep) -> _Course | None:
    """Return what happens in the first half-cycles, computed again; None if nothing is known."""
    experiment, record = run.experiment, ("x_G", "rearrangements", "slip_table")
    if not {*record} <= {*experiment.algorithm.records}:
        return None
    until, limits = min(_INSIDE, run.half_cycles), Limits.of(_MOST_EVENTS)
    (seen,) = simulate(experiment.simulation(record), run.drive, [until], limits)
    return _course(run, seen.recorded, seen.completed)


def _course(run: Creep, recorded: Mapping[str, NDArray[Any]], until: int) -> _Course | None:
    """Return the displacements up to a target; None without rearrangements, or with too many."""
    place = recorded.get("rearrangement_half_cycle", np.empty(0))
    count = int((place <= until).sum())
    if not 0 < count <= _MOST_STEPS:
        return None
    kept = {name: values[:count] for name, values in recorded.items() if "rearr" in name[:5]}
    start, steps = _start(run), [floats(kept["rearrangement_displacement"])]
    if "slip_slider" in recorded and run.chain.n <= len(_SLIDERS):
        place, slip = recorded["slip_rearrangement"], floats(recorded["slip_displacement"])
        for slider in range(1, run.chain.n + 1):
            own = (recorded["slip_slider"] == slider) & (place < count)
            steps.append(np.bincount(place[own], slip[own], count).astype(float))
    before = np.array([start.mean(), *start][: len(steps)])[:, None]
    moved = np.cumsum(np.hstack([before, steps, np.zeros_like(before)]), axis=1)
    time = np.concatenate([[0], times_of(run, kept, until), [until]])
    return _Course(until, time, floats(kept["rearrangement_duration"]), moved)


def _draw_beginning(panels: Mapping[str, Axes], run: Creep, begun: _Course) -> None:
    """Draw theta, the displacements and how long rearrangements last in the first half-cycles."""
    top, middle, below = (panels[name] for name in ("ramps", "inside", "durations"))
    _draw_theta(top, run, begun.until)
    named = f"the beginning, inside {_target(run)} 1 to {begun.until}"
    top.set_title(named, fontsize=8, loc="right")
    _draw_lines(middle, {}, begun)
    middle.tick_params(labelbottom=False)
    below.vlines(begun.time[1:-1], 0, begun.durations, color=INKS[0], linewidth=0.6)
    below.set_ylim(0, 1.05 * begun.durations.max())
    below.set_ylabel("duration\n" + r"($\tau_\mathrm{dyn}$)")
    below.xaxis.set_major_locator(_WHOLE())
    _name_time(below, run)
    for each in (top, middle):
        each.sharex(below)


def _theta_label(theta: float, _: object) -> str:
    """Return a tick label without a factor 10**k, which would overlap the title."""
    return f"{round(theta, 12) + 0.0:g}".replace("-", "\N{MINUS SIGN}")


def parameters_text(run: Creep) -> str:
    """Return the parameters of a run in one line; a list as its least and largest value."""
    known = run.chain.parameters() | run.drive.parameters()
    ends = {key: [min(value), max(value)] for key, value in known.items()
            if key in _ALONG and isinstance(value, list)}  # fmt: skip
    return ", ".join(
        [setting_label(key, value) for key, value in known.items()
         if isinstance(value, (int, Fraction))]
        + [f"{symbol_of(key)} = {float(low):g} to {float(high):g}"
           for key, (low, high) in ends.items()]
    )  # fmt: skip


def _draw_law(axes: Axes, run: Creep, ink: str = INKS[1]) -> None:
    """Draw the displacement by the law from the burn-in on.

    The sliding limit is never drawn: it does not hold for sliders that stick.
    """
    law = prediction(run.chain, run.drive, run.experiment.start)
    if law is None or not law.values or run.solver == Sliding.name:
        return
    off = f" (± {law.deviation:.2g} per {run.drive.per})" if law.deviation > 0 else ""
    begin = min(run.burn_in, run.half_cycles - 1)
    time = np.array([begin, run.half_cycles])
    height = _trajectory(run.recorded["x_G"], _start(run).mean())[1][begin]
    for number, velocity in enumerate(law.values):
        axes.plot(time, height + velocity * (time - begin), color=ink, linestyle=DASHED,
                  linewidth=1, label="" if number else f"law: {law.law}{off}",
                  zorder=4)  # fmt: skip
        if law.deviation > 0:
            low, high = (height + (velocity + sign * law.deviation) * (time - begin)
                         for sign in (-1, 1))  # fmt: skip
            axes.fill_between(time, low, high, color=ink, alpha=0.2, linewidth=0)


def _start(run: Creep) -> Floats:
    return floats(run.experiment.initial.displacements)


def _draw_band(axes: Axes, run: Creep) -> None:
    longest, level = run.half_cycles, abs(run.drive.targets(1, 1, run.seed)[0])
    axes.fill_between([0, longest], -level, level, facecolor="0.85", edgecolor="0.3")
    text = rf"cycles between $\pm A_\theta$ ({longest} half-cycles)"
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=8)


def draw_one(axes: Axes, run: Creep) -> None:
    """Draw x_G of a run over time, and every slider of a short chain.

    Where rearrangements are recorded, x_G changes in steps; where slips are, so do the sliders.
    """
    start, recorded = _start(run), run.recorded
    ends: dict[int, Any] = {0: _trajectory(recorded["x_G"], start.mean())}
    if "x" in recorded and run.chain.n <= len(_SLIDERS):
        ends |= {n + 1: _trajectory(x, start[n]) for n, x in enumerate(recorded["x"].T)}
    _draw_lines(axes, ends, _course(run, recorded, run.half_cycles))
    _name_time(axes, run)
    axes.legend(loc="best")


def _draw_lines(axes: Axes, ends: Mapping[int, Any], course: _Course | None) -> None:
    """Draw x_G (number 0) and sliders, at the ends of half-cycles, or in steps where known."""
    steps = {} if course is None else {n: (course.time, x) for n, x in enumerate(course.moved)}
    for n, line in {**ends, **steps}.items():
        style = "steps-post" if n in steps else "default"
        look: dict[str, Any] = {"color": INKS[6], "linewidth": 1.6, "zorder": 3}
        if n:
            look = {"color": _SLIDERS[n - 1], "linewidth": 0.9,
                    "linestyle": DASHES[(n - 1) % len(DASHES)]}  # fmt: skip
        label = rf"$\Delta\tilde{{x}}_{{{n}}}$" if n else r"$\Delta\tilde{x}_G$"
        axes.plot(*line, drawstyle=style, label=label, **look)
    axes.set_ylabel(f"displacement {LENGTH}")


def _name_time(axes: Axes, run: Creep) -> None:
    axes.set_xlabel(rf"time $t/\tau_\mathrm{{th}}$ ({_target(run)})")
    axes.margins(x=0.01)


def _target(run: Creep) -> str:
    return "half-cycles" if run.drive.cyclic else "targets"


def _trajectory(values: NDArray[Any], start: float = 0.0) -> tuple[NDArray[Any], NDArray[Any]]:
    begin = np.full_like(values, start, shape=(1, *values.shape[1:]))
    return np.arange(len(values) + 1), np.concatenate([begin, values])


# --- a solid -------------------------------------------------------------------------------------


@styled
def draw_descent(walk: Walk, title: str = "") -> Figure:
    """Draw temperatures and descent over time, beside many contacts and the measured walk."""
    drive, moved = walk.run.drive, walk.millimetres
    dates, yearly = drive.dates, walk.stretches(DAYS_PER_YEAR)
    time: NDArray[Any] = walk.elapsed if dates is None else dates[: moved.size]
    called = "above\n" + r"$\theta=0$ (K)"
    if isinstance(drive, TemperatureRecord):
        called = f"({_UNITS[drive.unit]})"
    several = yearly.size > 4
    years = 1.0 if several else walk.days / float(DAYS_PER_YEAR)
    figure = new_figure(7.2, 5.2, title)
    axes = figure.subplot_mosaic(
        [["top", "."], ["bottom", "side"]], height_ratios=(1, 1.7), width_ratios=(5.5, 1)
    )
    top, bottom, side = (axes[name] for name in ("top", "bottom", "side"))
    top.sharex(bottom)
    side.sharey(bottom)
    top.plot(time, walk.temperatures, color="0.25", linewidth=0.4)
    top.set_ylabel(f"temperature {called}")
    top.tick_params(labelbottom=False)
    if several:
        places = np.linspace(0, time.size - 1, yearly.size + 1)[:-1].astype(int)
        bottom.plot(time[places], yearly, color=INKS[6], linewidth=0.8, marker=".")
        bottom.set(ylim=(0, 1.25 * yearly.max()), ylabel="descent in each year (mm)")
    else:
        bottom.plot(time, moved, color=INKS[6], linewidth=1.6)
        bottom.set_ylabel("descent of the centre of mass (mm)")
    bottom.set_xlabel("days" if dates is None else "date")
    said = f"N = {walk.contacts[0]}, solver {walk.run.solver}"
    if walk.body.measured:
        said += f"; dashed: {float(walk.body.measured):.4g} mm a year, measured"
        for each in (bottom, side):
            level = float(walk.body.measured) * years
            each.axhline(level, color=INKS[1], linestyle="--", linewidth=1)
    bottom.set_title(said, fontsize=8)
    bottom.margins(x=0.01)
    for place, n in enumerate(walk.contacts):
        less, same, more = (walk.rates[n, factor] * years for factor in walk.body.friction)
        ends = [rate for rate in (less, same, more) if np.isfinite(rate)]
        side.plot([place] * len(ends), ends, color=INKS[place], linewidth=3, alpha=0.5)
        if not np.isfinite(less):  # with less friction the solid runs away
            edge = side.get_xaxis_transform()
            side.plot(place, 0.96, marker="^", color=INKS[place], transform=edge)
            side.text(place, 0.9, "no\nbound", fontsize=7, ha="center", va="top", transform=edge)
        low, high = bottom.get_ylim()
        room = 0.3 * (high - low) if len(ends) < 3 else 0.0
        bottom.set_ylim(low, max(1.05 * max(ends, default=0.0) + room, high))
        side.plot(place, same, marker="o", color=INKS[place])
    side.set_xticks((0, 1), [str(n) for n in walk.contacts], fontsize=8)
    side.set_xlabel("N", fontsize=8)
    side.set_xlim(-0.6, 1.6)
    when = "mean" if several else "at the end"
    usual = walk.body.friction == FRICTION
    about = "\N{PLUS-MINUS SIGN}10 %" if usual else "low to high"
    side.set_title(f"{when},\nfriction\n{about}", fontsize=8)
    side.tick_params(labelleft=False)
    if dates is not None:
        locator: Any = AutoDateLocator()  # type: ignore[no-untyped-call]
        bottom.xaxis.set_major_locator(locator)
        bottom.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    return figure


# --- a run around one half-cycle -----------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Portrait:
    """A run seen around one half-cycle.

    `half_cycle`: the half-cycle whose end is drawn (0 is the start); `first`: the first half-cycle
    of the window; `theta`, `x_G` (ndarray, shape (w + 1,)): values before the window and at the
    ends of its half-cycles; `slips` (ndarray of int, shape (w, n)): slips of each slider within
    each half-cycle of the window; `state`: at the end of `half_cycle`.
    """

    result: Creep
    half_cycle: int
    first: int
    theta: Floats
    x_G: Floats
    slips: NDArray[np.int64]
    state: State

    @property
    def forces(self) -> Floats:
        """Non-frictional force on each slider at the end of `half_cycle`, unit m g."""
        tensions = floats(self.state.tensions)
        return replace(self.state, tensions=tensions).forces(self.result.chain)

    @property
    def limits(self) -> Floats:
        """Largest force on each slider that static friction holds, mu_s,n cos(alpha), unit m g."""
        chain = self.result.chain
        if self.result.solver == Sliding.name:
            return frictions_of(FLOAT64, chain)
        return Contacts(chain).thresholds(floats(self.state.coefficients), FLOAT64)


def portrait(
    result: Creep, half_cycle: int | None = None, window: int = WINDOW,
    limits: Limits = NO_LIMITS, progress: Hearer = None,
) -> Portrait:  # fmt: skip
    """Return a run around the end of a half-cycle (0: the start; default: the last).

    Values that the run did not record are computed again, bit for bit. Raises `InputError` if the
    run has no such half-cycle, or if the repeated run differs from the recorded one.
    """
    total, experiment, drive = result.half_cycles, result.experiment, result.drive
    asked = total if half_cycle is None else half_cycle
    asked = whole_number(asked, "half_cycle", least=0, most=total)
    window = whole_number(window, "window", least=1)
    last = min(max(asked + window // 2, window), total)
    first = max(last - window, 0) + 1
    simulation, states = experiment.simulation(("x_G", "slips")), {0: experiment.initial}
    shown: list[Any] = [{"x_G": np.empty(0), "slips": np.empty((0, experiment.chain.n), int)}]
    short = max(min(_NUMBERS_AT_ONCE // experiment.chain.n, last // _REPORTS), 1)
    say = reporter(progress)
    targets = sorted({*range(0, last, short), first - 1, asked, last})
    for done, stretch in zip(targets, simulate(simulation, drive, targets, limits), strict=True):
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(f"{stretch.reason} before half-cycle {last} was computed again")
        say("computing again", done, last, "half-cycles")
        _check_repeats(result, done - stretch.completed, floats(stretch.recorded["x_G"]))
        if done >= first:
            shown.append(stretch.recorded)
        if done in (first - 1, asked):
            states.setdefault(done, simulation.state())
    recorded = tables.joined(shown)
    x_G = np.append(floats(states[first - 1].displacements).mean(), floats(recorded["x_G"]))
    theta = drive.targets(max(first - 1, 1), x_G.size - (first == 1), result.seed)
    if first == 1:
        theta = np.concatenate([np.zeros((1, *theta.shape[1:])) + experiment.theta, theta])
    return Portrait(result, asked, first, theta, x_G, recorded["slips"], states[asked])


def _check_repeats(result: Creep, done: int, again: Floats) -> None:
    recorded = floats(result.recorded.get("x_G", np.empty(0)))[done : done + again.size]
    for k in np.flatnonzero(again[: recorded.size] != recorded)[:1].tolist():
        was = f"was {float(recorded[k])!r} at half-cycle {done + k + 1} when the run was saved"
        raise InputError("x_G", float(again[k]), f"{was}: this program computes it differently")


@styled
def draw_portrait(seen: Portrait) -> Figure:
    """Draw x_G(t) and theta(t), the slips in space and time, and the forces at one moment."""
    chain, result = seen.result.chain, seen.result
    title = f"{parameters_text(result)}; {result.solver}, seed {result.seed}\n{result.finding}"
    figure = new_figure(7.4, 8.2)
    figure.suptitle(title, fontsize=9)
    rows = "top top, middle middle, space space, tensions forces"
    if chain.n == 1:
        rows = rows.replace("tensions", "forces")
    panels: list[Any] = [row.split() for row in rows.split(",")]
    axes = figure.subplot_mosaic(panels, height_ratios=(0.75, 1.25, 1.7, 1.7))
    top, middle, space = (axes[name] for name in ("top", "middle", "space"))
    time = seen.first - 1 + np.arange(len(seen.theta))
    top.step(time, seen.theta, where="pre", color="0.25", linewidth=0.8)
    top.set_ylabel(r"$\theta$ at the end")
    middle.step(time, seen.x_G, where="pre", color=INKS[6], linewidth=1.2)
    middle.set_ylabel(rf"$\Delta\tilde{{x}}_G$ {LENGTH}")
    _draw_slips(figure, space, seen)
    for each in (top, middle, space):
        each.axvline(seen.half_cycle, color=INKS[0], linewidth=0.8, linestyle=(0, (3, 2)))
        each.tick_params(labelbottom=each is space)
        each.set_xlim(time[0], time[-1])
    if result.half_cycles > len(seen.slips) and "x_G" in result.recorded:
        _draw_whole(middle.inset_axes((0.68, 0.16, 0.3, 0.4)), seen)
    moment = f"end of half-cycle {seen.half_cycle}"
    if not result.drive.springs:
        moment += rf" ($\theta = {as_float(seen.state.theta):.4g}$)"
    if chain.n > 1:
        _draw_tensions(axes["tensions"], seen)
        axes["tensions"].set_title(moment, fontsize=8)
    draw_forces(axes["forces"], seen.forces, seen.limits, frictions_of(FLOAT64, chain))
    axes["forces"].set_xlabel("slider $n$")
    axes["forces"].set_title(moment, fontsize=8)
    return figure


def _draw_whole(inset: Axes, seen: Portrait) -> None:
    recorded = seen.result.recorded["x_G"]
    shown = np.unique(np.linspace(0, recorded.size - 1, 2000).astype(int))
    inset.plot(shown + 1, floats(recorded)[shown], color=INKS[6], linewidth=0.8)
    inset.axvspan(seen.first - 1, seen.first - 1 + len(seen.slips), color=INKS[4], alpha=0.5)
    inset.set_xlim(0, recorded.size)
    inset.tick_params(labelsize=6)
    inset.set_title("whole run", fontsize=6, pad=2)


def _draw_slips(figure: Figure, axes: Axes, seen: Portrait) -> None:
    """Draw how often each slider slips within each half-cycle, in at most seven classes."""
    most = int(seen.slips.max(initial=0))
    edges = np.arange(most + 2)
    if most >= len(_SHADES):
        fewest = int(seen.slips[seen.slips > 0].min())
        above = np.geomspace(fewest, most + 1, len(_SHADES)).round()
        edges = np.unique([0, *above]).astype(int)
    shades = _SHADES[: edges.size - 1]
    window, n = seen.slips.shape
    image = axes.pcolormesh(
        np.arange(seen.first - 1, seen.first + window), np.arange(n + 1) + 0.5, seen.slips.T,
        cmap=ListedColormap(list(shades)), norm=BoundaryNorm(edges - 0.5, len(shades)),
        rasterized=True,
    )  # fmt: skip
    axes.set(ylabel="slider (1 uppermost)", xlabel=r"time $t/\tau_\mathrm{th}$ (half-cycles)",
             ylim=(n + 0.5, 0.5))  # fmt: skip
    axes.yaxis.set_major_locator(_WHOLE())
    bar = figure.colorbar(image, ax=axes, pad=0.01, aspect=16)
    classes = list(itertools.pairwise(edges.tolist()))
    named = [str(a) if b - a == 1 else f"{a}-{b - 1}" for a, b in classes]
    names = ["0", *named[1:]]  # no number of slips lies between 0 and the smallest
    bar.set_ticks([(a + b - 1) / 2 for a, b in classes], labels=names)
    bar.ax.tick_params(labelsize=7, length=0)
    bar.set_label("slips per half-cycle", fontsize=8)


def _draw_tensions(axes: Axes, seen: Portrait) -> None:
    chain = seen.result.chain
    springs = np.arange(1, chain.n)
    for coefficient, dashes, name in (("mu_d", "-", "d"), ("mu_s", (0, (4, 2)), "s")):
        label = rf"limit for $\mu_\mathrm{{{name}}}$"
        both = np.transpose(tension_bounds(chain, coefficient))
        over = springs
        if chain.n == 2:  # a single tension needs a marker, because it makes no line
            over, both = np.array([0.8, 1.2]), np.repeat(both, 2, axis=0)
        axes.plot(over, both, color="0.45", linewidth=0.9, linestyle=dashes, label=[label, ""])
    axes.plot(springs, floats(seen.state.tensions), color=INKS[0], marker="o", linewidth=0.9,
              markersize=3 if chain.n <= 60 else 1.5, label=r"$T_n$")  # fmt: skip
    axes.set(xlabel="spring $n$", ylabel=r"tension ($m\,g$)")
    axes.xaxis.set_major_locator(_WHOLE())
    axes.margins(y=0.15)
    axes.legend(loc="best", fontsize=7)


def draw_forces(
    axes: Axes, forces: Floats, limits: Floats, friction: Floats
) -> tuple[BarContainer, Line2D]:
    """Draw the force on each slider between its static limits; return the limits and the marks."""
    n, highest = limits.size, max(float(limits.max()), float(np.abs(forces).max()))
    sliders = np.arange(1, n + 1)
    bars = axes.bar(sliders, 2 * limits, 0.84, bottom=-limits, color="0.88",
                    label=r"$|F_n| \leq \mu_{\mathrm{s},n}\cos\alpha$")  # fmt: skip
    (marks,) = axes.plot(sliders, forces, linestyle="none", marker="o", color=INKS[6],
                         markersize=4 if n <= 60 else 2, label=r"$F_n$")  # fmt: skip
    edges = np.arange(n + 1) + 0.5
    for force, label in ((-friction, None), (friction, r"$\pm\mu_\mathrm{d}\cos\alpha$")):
        axes.step(edges, [*force, force[-1]], where="post", color=INKS[6], linewidth=0.7,
                  linestyle=DOTTED, label=label)  # fmt: skip
    axes.set(xlim=(0.3, n + 0.7), ylim=(-1.1 * highest, 1.75 * highest))
    axes.set_ylabel(r"force $F_n$ ($m\,g$)")
    axes.xaxis.set_major_locator(_WHOLE())
    axes.legend(loc="upper center", ncols=3, fontsize=7, columnspacing=1.0, handlelength=1.5)
    return bars, marks


# --- with pyplot ---------------------------------------------------------------------------------


class Plots:
    """The pictures of one run; call it for x_G over time."""

    def __init__(self, result: Creep) -> None:
        self._result = result

    @styled
    def __call__(self, ax: Axes | None = None) -> Axes:
        """Draw x_G, and every slider of a short chain, over time; return the axes.

        Time is in half-cycles. For a record of temperatures the axis shows dates, with the
        temperatures in degrees.

        Raises
        ------
        InputError
            If the run did not record x_G.
        """
        result, drive = self._result, self._result.drive
        if "x_G" not in result.recorded:
            raise InputError("plot", "x_G", 'was not recorded: the run needs record = ["x_G"]')
        axes = ax or plt.subplots(layout="constrained")[1]
        if not isinstance(drive, TemperatureRecord):
            draw_one(axes, result)
            return axes
        reached, moved = result.half_cycles, floats(result.recorded["x_G"])
        time = drive.clock(np.arange(1, reached + 1))
        over = time if drive.dates is None else drive.dates[:reached]
        beside = axes.twinx()
        beside.plot(over, drive.temperatures[:reached], color="0.7", linewidth=0.6)
        beside.set_ylabel(f"temperature ({_UNITS[drive.unit]})", color="0.5")
        axes.plot(over, moved, color=INKS[6], linewidth=1.6)
        axes.set_zorder(beside.get_zorder() + 1)
        axes.patch.set_visible(False)
        axes.set(xlabel="time" if drive.dates is None else "date", ylabel=DISPLACEMENT)
        return axes

    def avalanches(self, measure: str = "size", ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the distribution of a `measure` of the avalanches after the burn-in.

        Parameters
        ----------
        measure : str
            ``size``, ``duration``, ``energy`` or ``extent``. The axes are logarithmic, and zeros
            are left out.
        ax : Axes, optional
            Default: new axes.
        **style
            Passed to matplotlib's `errorbar`.

        Returns
        -------
        Axes
            With the densities and their standard errors.

        Raises
        ------
        InputError
            If the measure is unknown or always zero, or the run recorded no rearrangements.
        """
        if measure not in MEASURES:
            raise InputError("measure", measure, f"must be one of {', '.join(MEASURES)}")
        counted = avalanches_of(self._result, measure)
        if not counted.block.size:
            burnt = f"the burn-in of {self._result.burn_in} half-cycles"
            raise InputError("avalanches", 0, f"none in a whole cycle after {burnt}")
        binned = distribution(counted, measure)
        if binned.zeros == counted.block.size:
            raise InputError("measure", measure, f"is zero of all {binned.zeros} avalanches")
        with mpl.rc_context(STYLE):
            axes = ax or plt.subplots(layout="constrained")[1]
            if ax is None:
                axes.set_title(parameters_text(self._result), fontsize=8)
        kept = binned.density > 0
        y, error = binned.density[kept], np.nan_to_num(binned.error[kept])
        points = {"marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7}
        axes.errorbar(binned.middle[kept], y, error, **{**points, **style})
        axes.set(xscale="log", yscale="log", xlabel=MEASURES[measure])
        without = f", without {binned.zeros} of 0" if binned.zeros else ""
        axes.set_ylabel(f"density of {measure}{without}")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(PlainNumbers())
            axis.set_minor_formatter(PlainNumbers(minor_thresholds=(1.6, 0.5)))
        # an error bar as long as its value would reach down to zero on a logarithmic axis
        axes.set_ylim(float(y.min()) / 3, max(2 * float(y.max()), axes.get_ylim()[1]))
        return axes


@styled
def plot_rearrangement(motion: Rearrangement) -> tuple[Axes, Axes]:
    """Draw velocities in space and time, and the energies; return the axes."""
    n, times = motion.chain.n, np.linspace(0.0, float(motion.duration), _INSTANTS)
    velocities = floats(motion.sol(times).velocities)
    figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
    most = float(np.abs(velocities).max()) or 1.0
    image = above.pcolormesh(times, np.arange(1, n + 1), velocities, shading="nearest",
                             cmap="RdBu_r", vmin=-most, vmax=most)  # fmt: skip
    figure.colorbar(image, ax=above, label=r"velocity ($g\,\tau_\mathrm{dyn}$)")
    above.set(ylabel="slider (1 uppermost)", ylim=(n + 0.5, 0.5))
    above.yaxis.set_major_locator(_WHOLE())
    dashes = ("-", "-", "--", "-")  # the work of gravity and the loss of the springs may coincide
    for (name, values), dash in zip(motion.energy(times)._asdict().items(), dashes, strict=True):
        below.plot(times, values - values[0], dash, label=name)
    below.set(xlabel=r"time ($\tau_\mathrm{dyn}$)", ylabel=r"energy ($m g^2 \tau_\mathrm{dyn}^2$)")
    below.legend(title="since the start", fontsize=8)
    return above, below
