"""Pictures of runs: x_G and theta over time, half-cycles from inside, and a solid's descent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exactcreep.figures.style import (
    DASHED,
    DASHES,
    INKS,
    LENGTH,
    STYLE,
    new_figure,
    setting_label,
    styled,
)
from exactcreep.laws import prediction
from exactcreep.model.enclosure import floats
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.solvers.interface import Rearrangement, simulate
from exactcreep.solvers.sliding import Sliding
from exactcreep.studies.avalanches import MEASURES, avalanches_of, distribution
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import Hearer, reporter

Floats = NDArray[np.float64]
WINDOW = 4
"""Half-cycles that are drawn from inside."""
_SLIDERS = tuple(ink for ink in INKS if ink not in (INKS[1], INKS[6]))
"""Colours of sliders; x_G is black, and the law has a colour of its own."""
_MOST_EVENTS = 200_000  # most events that are computed again for them
_MOST_STEPS = 20_000  # most rearrangements that are drawn as steps
_AT_ONCE = 100  # half-cycles that are computed again before their slips are dropped
_INSTANTS = 400  # instants at which a rearrangement is drawn
_WHOLE = partial(MaxNLocator, integer=True, min_n_ticks=1)  # whole numbers along an axis
_ALONG = ("mu_d", "mu_s", "expansion")


# --- one run -------------------------------------------------------------------------------------


@styled
def draw_run(run: Creep, title: str = "", seen: Inside | None = None) -> Figure:
    """Draw theta and x_G of a run that recorded x_G, and some of its half-cycles from inside.

    Default for `seen`: the first half-cycles. If the run recorded rearrangements, draw how their
    sizes and durations are distributed.
    """
    with suppress(InputError):  # none happened after the burn-in
        if seen is None and "rearrangements" in run.experiment.record:
            return _draw_sizes(run, title)
    seen = seen or inside(run, limits=Limits.of(_MOST_EVENTS))
    figure = new_figure(*((6.4, 5.2) if seen is None else (9.6, 6.0)), title)
    rows = "theta, whole" if seen is None else "theta ramps, whole inside, whole slips, whole last"
    layout: list[Any] = [row.split() for row in rows.split(",")]
    panels = figure.subplot_mosaic(layout, height_ratios=(1, 3.5, 1.5, 1)[: len(layout)])
    top, bottom = panels["theta"], panels["whole"]
    top.sharex(bottom)
    _draw_theta(top, run, 1, run.half_cycles)
    top.set_title(parameters_text(run, 5), fontsize=8, loc="left")
    top.set_ylabel(r"dilation $\theta$")
    if not np.size(run.recorded.get("x_G", ())):
        words = f"{run.finding}\nbefore the end of a first half-cycle"
        bottom.text(0.5, 0.5, words, transform=bottom.transAxes, ha="center", va="center")
        return figure
    draw_one(bottom, run)
    _draw_law(bottom, run)
    if seen is not None:
        _draw_inside(panels, run, seen)
    lines = [line for axes in panels.values() for line in axes.lines]
    named = {str(line.get_label()): line for line in lines if line.get_label()[:1] not in "_"}
    bottom.get_legend().remove()
    figure.legend(named.values(), named, loc="outside lower center", ncols=5)
    return figure


def _theta(run: Creep, first: int, last: int) -> NDArray[Any]:
    """Return theta before a half-cycle, and at the ends of it and the following half-cycles."""
    begin = run.drive.targets(max(first - 1, 1), 1, run.seed)
    begin = begin if first > 1 else np.full_like(begin, run.experiment.theta)
    return np.concatenate([begin, run.drive.targets(first, last + 1 - first, run.seed)])


def _draw_theta(axes: Axes, run: Creep, first: int, last: int) -> None:
    theta = _theta(run, first, last)
    axes.plot(np.arange(first - 1, last + 1), theta, color="0.25",
              linewidth=0.7 if theta.size < 2000 else 0.3)  # fmt: skip
    axes.margins(x=0.01)
    axes.ticklabel_format(axis="y", style="plain")
    axes.tick_params(labelbottom=False)


def _draw_sizes(run: Creep, title: str) -> Figure:
    """Draw the distributions of sizes and durations; `InputError` if there are no avalanches."""
    figure = new_figure(8.4, 4.0, title)
    for axes, measure in zip(figure.subplots(1, 2), ("size", "duration"), strict=True):
        Plots(run).avalanches(measure, axes)
    figure.axes[0].set_title(parameters_text(run, 5), fontsize=8, loc="left")
    return figure


class Inside(NamedTuple):
    """Half-cycles from inside: displacements change in a step at each rearrangement.

    `first`, `last`: half-cycles; `time`: the begin, the rearrangements, and the end, in
    half-cycles; `durations` of the rearrangements, unit tau_dyn; `moved` (ndarray, shape
    (m, r + 2)): x_G, and each slider of a short chain that recorded its slips, from each time on;
    `slips` (ndarray, shape (3, s)): time, slider and displacement of each slip.
    """

    first: int
    last: int
    time: Floats
    durations: Floats
    moved: Floats
    slips: Floats


def inside(
    run: Creep, half_cycle: int = 0, window: int = WINDOW, limits: Limits = NO_LIMITS,
    progress: Hearer = None,
) -> Inside | None:  # fmt: skip
    """Return what happens in the half-cycles around one, computed again bit for bit.

    None if nothing or too much happens, or if the solver does not record rearrangements. Raises
    `InputError` if the repeated run differs from the recorded one.
    """
    experiment, drive, record = run.experiment, run.drive, ("x_G", "rearrangements", "slip_table")
    if not {*record} <= {*experiment.algorithm.records}:
        return None
    last = min(max(half_cycle + window // 2, window), run.half_cycles)
    first, begun, before, start = max(last - window, 0) + 1, 0, 0, _start(run)
    simulation = experiment.simulation(record)
    targets = sorted({*range(_AT_ONCE, first, _AT_ONCE), first - 1, last} - {0})
    say = reporter(progress)
    for target, seen in zip(targets, simulate(simulation, drive, targets, limits), strict=False):
        if seen.stop is Stop.DEADLINE:
            raise OutOfTime(f"{seen.reason} before half-cycle {last} was computed again")
        say("computing again", target, last, "half-cycles")
        _check_repeats(run, begun, floats(seen.recorded["x_G"]))
        if target == first - 1:
            before, start = simulation.tally.rearrangements, simulation.state().displacements
        begun += seen.completed
    return _course(run, seen.recorded, first, begun, floats(start), before)


def _check_repeats(run: Creep, done: int, again: Floats) -> None:
    recorded = floats(run.recorded.get("x_G", np.empty(0)))[done : done + again.size]
    for k in np.flatnonzero(again[: recorded.size] != recorded)[:1].tolist():
        was = f"was {float(recorded[k])!r} at half-cycle {done + k + 1} when the run was saved"
        raise InputError("x_G", float(again[k]), f"{was}: this program computes it differently")


def _course(
    run: Creep, recorded: Mapping[str, NDArray[Any]], first: int, last: int, start: Floats,
    before: int = 0,
) -> Inside | None:  # fmt: skip
    """Return recorded half-cycles from inside, with the number of rearrangements before them."""
    place = recorded.get("rearrangement_half_cycle", np.empty(0))
    count = int((place <= last).sum())
    if not 0 < count <= _MOST_STEPS:
        return None
    kept = {name: values[:count] for name, values in recorded.items() if "rearr" in name[:5]}
    times, steps = _times(run, kept, first, last), [floats(kept["rearrangement_displacement"])]
    slips = np.empty((3, 0))
    if "slip_slider" in recorded:
        number = recorded["slip_rearrangement"] - before
        own, number = number < count, number[number < count]
        sliders, moved = (floats(recorded[f"slip_{name}"])[own]
                          for name in ("slider", "displacement"))  # fmt: skip
        slips = np.array([times[number], sliders, moved])
        for slider in range(1, 1 + run.chain.n * (run.chain.n <= len(_SLIDERS))):
            steps.append(np.bincount(number, moved * (sliders == slider), count).astype(float))
    begin = np.array([start.mean(), *start][: len(steps)])[:, None]
    moved = np.cumsum(np.hstack([begin, steps, np.zeros_like(begin)]), axis=1)
    time = np.concatenate([[first - 1], times, [last]])
    return Inside(first, last, time, floats(kept["rearrangement_duration"]), moved, slips)


def _times(run: Creep, kept: Mapping[str, NDArray[Any]], first: int, last: int) -> Floats:
    """Return when rearrangements happen, in half-cycles since the start of the run."""
    place = kept["rearrangement_half_cycle"]
    passed, span = floats(kept["rearrangement_theta"]), np.ones(place.size)
    if not run.drive.springs:  # else theta is the part of the way that has passed
        ramps = _theta(run, first, last)
        passed = passed - ramps[place - first]
        span = np.where(np.diff(ramps) == 0, math.inf, np.diff(ramps))[place - first]
    times: Floats = place - 1 + np.clip(passed / span, 0, 1)
    return times


def _draw_inside(panels: Mapping[str, Axes], run: Creep, seen: Inside) -> None:
    """Draw theta, displacements, slips and durations of rearrangements in some half-cycles."""
    top, middle, slips, below = (panels[name] for name in ("ramps", "inside", "slips", "last"))
    _draw_theta(top, run, seen.first, seen.last)
    top.set_title(f"inside {_target(run)} {seen.first} to {seen.last}", fontsize=8, loc="right")
    _draw_lines(middle, {}, seen)
    for sign, ink, way in ((1, INKS[1], "down"), (-1, INKS[0], "up")):
        own = np.sign(seen.slips[2]) == sign
        slips.plot(*seen.slips[:2, own], "|", color=ink, markersize=min(6, 72 / run.chain.n),
                   label=f"slips {way}hill")  # fmt: skip
    slips.set(ylabel="slips of\nslider", ylim=(run.chain.n + 0.5, 0.5))
    slips.yaxis.set_major_locator(_WHOLE(4))
    below.vlines(seen.time[1:-1], 0, seen.durations, color=INKS[0], linewidth=0.6)
    below.set_ylim(0, 1.05 * seen.durations.max())
    below.set_ylabel("duration\n" + r"($\tau_\mathrm{dyn}$)")
    below.xaxis.set_major_locator(_WHOLE(8))
    _name_time(below, run)
    for each in (top, middle, slips):
        each.sharex(below)
        each.tick_params(labelbottom=False)


def parameters_text(run: Creep, each: int = 99) -> str:
    """Return the parameters of a run, so many in a line; a list as its least and largest value."""
    known = run.chain.parameters() | run.drive.parameters()
    parts = [setting_label(key, value) for key, value in known.items()
             if key in _ALONG or isinstance(value, (int, Fraction))]  # fmt: skip
    return ",\n".join(", ".join(parts[k : k + each]) for k in range(0, len(parts), each))


def _draw_law(axes: Axes, run: Creep, ink: str = INKS[1]) -> None:
    """Draw the displacement by the law from the burn-in on; not for the solver `sliding`."""
    law = prediction(run.chain, run.drive, run.experiment.start)
    if law is None or not law.values or run.solver == Sliding.name:
        return
    off = f" (± {law.deviation:.2g} per {run.drive.per})" if law.deviation > 0 else ""
    labels = [f"law: {law.law}{off}", *[""] * (len(law.values) - 1)]
    begin = min(run.burn_in, run.half_cycles - 1)
    time = np.array([begin, run.half_cycles])
    height = np.insert(run.recorded["x_G"], 0, _start(run).mean())[begin]
    lines = height + np.outer(time - begin, law.values)
    axes.plot(time, lines, color=ink, linestyle=DASHED, linewidth=1, label=labels, zorder=4)
    wide = np.nan_to_num(law.deviation) * (time - begin)
    low, high = lines.min(axis=1) - wide, lines.max(axis=1) + wide
    axes.fill_between(time, low, high, color=ink, alpha=0.2, linewidth=0)


def _start(run: Creep) -> Floats:
    return floats(run.experiment.initial.displacements)


def draw_one(axes: Axes, run: Creep) -> None:
    """Draw x_G of a run over time, and every slider of a short chain.

    Where rearrangements are recorded, x_G changes in steps; where slips are, so do the sliders.
    """
    start, recorded = _start(run), run.recorded
    moved = {0: np.insert(recorded["x_G"], 0, start.mean())}
    if "x" in recorded and run.chain.n <= len(_SLIDERS):
        moved |= {n + 1: np.insert(x, 0, start[n]) for n, x in enumerate(recorded["x"].T)}
    ends = {n: (np.arange(x.size), x) for n, x in moved.items()}
    _draw_lines(axes, ends, _course(run, recorded, 1, run.half_cycles, start))
    _name_time(axes, run)
    axes.legend(loc="best")


def _draw_lines(axes: Axes, ends: Mapping[int, Any], course: Inside | None) -> None:
    """Draw x_G (number 0) and sliders, at the ends of half-cycles, or in steps where known."""
    steps = {} if course is None else {n: (course.time, x) for n, x in enumerate(course.moved)}
    for n, line in {**ends, **steps}.items():
        style = "steps-post" if n in steps else "default"
        look: dict[str, Any] = {"color": INKS[6], "linewidth": 1.6, "zorder": 3}
        if n:
            look = {"color": _SLIDERS[n - 1], "linewidth": 0.9,
                    "linestyle": DASHES[(n - 1) % len(DASHES)]}  # fmt: skip
        label = f"$x_{{{n}}}$" if n else "$x_G$"
        axes.plot(*line, drawstyle=style, label=label, **look)
    axes.set_ylabel(f"displacement {LENGTH}")


def _name_time(axes: Axes, run: Creep) -> None:
    axes.set_xlabel(rf"time $t/\tau_\mathrm{{th}}$ ({_target(run)})")
    axes.margins(x=0.01)


def _target(run: Creep) -> str:
    return "half-cycles" if run.drive.cyclic else "targets"


# --- with pyplot ---------------------------------------------------------------------------------


class Plots:
    """The pictures of one run; call it for x_G over time."""

    def __init__(self, result: Creep) -> None:
        self._result = result

    @styled
    def __call__(self, ax: Axes | None = None) -> Axes:
        """Draw x_G, and every slider of a short chain, over time; return the axes.

        Time is in half-cycles.

        Raises
        ------
        InputError
            If the run did not record x_G.
        """
        if "x_G" not in self._result.recorded:
            raise InputError("plot", "x_G", 'was not recorded: the run needs record = ["x_G"]')
        axes = ax or plt.subplots(layout="constrained")[1]
        draw_one(axes, self._result)
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
    above.yaxis.set_major_locator(_WHOLE(8))
    dashes = ("-", "-", "--", "-")  # the work of gravity and the loss of the springs may coincide
    for (name, values), dash in zip(motion.energy(times)._asdict().items(), dashes, strict=True):
        below.plot(times, values - values[0], dash, label=name)
    below.set(xlabel=r"time ($\tau_\mathrm{dyn}$)", ylabel=r"energy ($m g^2 \tau_\mathrm{dyn}^2$)")
    below.legend(title="since the start", fontsize=8)
    return above, below
