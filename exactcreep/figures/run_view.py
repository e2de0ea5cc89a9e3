"""Portraits of a run: its course, its slips in space and time, its forces at one moment."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exactcreep.figures.style import DOTTED, INKS, picture
from exactcreep.model.contacts import Contacts
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import behaviour
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import Stretch, advance
from exactcreep.solvers.tables import joined

Floats = NDArray[np.float64]
WINDOW = 200
"""Half-cycles that a space-time diagram shows, unless asked for others."""
_SHADES = ("#FFFFFF", "#FEE391", "#FEC44F", "#FE9929", "#CC4C02", "#7F2704", "#2B0B00")


@dataclass(frozen=True, eq=False)
class Portrait:
    """A run seen around one half-cycle.

    Attributes
    ----------
    result : Creep
    half_cycle : int
        The one whose end is looked at; 0 is the start.
    first : int
        The first half-cycle of the window.
    theta, x_G : ndarray, shape (w + 1,)
        At the ends of the half-cycles of the window; the first entry is what was before it.
    slips : ndarray of int, shape (w, n)
        Slips of each slider within each half-cycle of the window.
    state : State
        At the end of `half_cycle`.
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
        tensions = np.diff(floats(self.state.tensions), prepend=0.0, append=0.0)
        return tensions + self.result.chain.sin_alpha

    @property
    def limits(self) -> Floats:
        """Largest force that each resting slider withstands, mu_s,n cos(alpha), unit m g."""
        chain = self.result.chain
        if self.result.solver == Sliding.name:
            return np.full(chain.n, chain.friction)
        return Contacts(chain).thresholds(floats(self.state.coefficients), FLOAT64)

    def bounds(self, coefficient: Any) -> tuple[Floats, Floats]:
        """Return the least and largest tension that a friction coefficient allows each spring.

        From ``|F_n| <= coefficient cos(alpha)`` for all sliders, added up from either end.
        """
        chain = self.result.chain
        b, s = chain.times_cosine(coefficient), chain.sin_alpha
        below = np.arange(1, chain.n)
        above = chain.n - below
        return -np.minimum(below * (b + s), above * (b - s)), np.minimum(
            below * (b - s), above * (b + s)
        )


def portrait(result: Creep, half_cycle: int | None = None, window: int = WINDOW) -> Portrait:
    """Return a portrait of a run around a half-cycle; what was not recorded is computed again.

    Parameters
    ----------
    result : Creep
    half_cycle : int, optional
        Whose end is looked at, 0 for the start; default the last.
    window : int
        Half-cycles that the space-time diagram shows, at most.

    Raises
    ------
    InputError
        If the run has no such half-cycle, or does not repeat what it recorded.

    Notes
    -----
    Guarantee: the run is followed from its start with the same parameters and the same disorder,
    hence through the same events, bit for bit.
    """
    total = result.half_cycles
    if half_cycle is None:
        half_cycle = total
    half_cycle = whole_number(half_cycle, "half_cycle", least=0, most=total)
    window = whole_number(window, "window", least=1)
    last = min(max(half_cycle + window // 2, window), total)
    first = max(last - window, 0) + 1
    experiment, drive = result.experiment, result.drive
    simulation = experiment.algorithm.simulation(
        experiment.chain, experiment.initial, experiment.seed, ("x_G", "slips")
    )
    states = {0: experiment.initial}
    shown: list[Any] = [{"x_G": np.empty(0), "slips": np.empty((0, experiment.chain.n), int)}]
    done = 0

    def take(stretch: Stretch) -> None:
        nonlocal done
        _check_repeats(result, done, floats(stretch.recorded["x_G"]))
        done += stretch.completed
        if done >= first:
            shown.append(stretch.recorded)

    for until in (first - 1, half_cycle, last):
        advance(simulation, drive, until, done=done, take=take)
        states.setdefault(until, simulation.state())
    recorded = joined(shown)
    x_G = np.append(floats(states[first - 1].displacements).mean(), floats(recorded["x_G"]))
    theta = drive.targets(max(first - 1, 1), x_G.size - (first == 1), result.seed)
    if first == 1:
        theta = np.append(as_float(experiment.initial.theta), theta)
    return Portrait(result, half_cycle, first, theta, x_G, recorded["slips"], states[half_cycle])


def _check_repeats(result: Creep, done: int, again: Floats) -> None:
    """Raise `InputError` if the run does not come to the x_G that it recorded."""
    recorded = floats(result.recorded.get("x_G", np.empty(0)))[done : done + again.size]
    for k in np.flatnonzero(again[: recorded.size] != recorded)[:1].tolist():
        raise InputError(
            "x_G",
            float(again[k]),
            f"was {float(recorded[k])!r} at half-cycle {done + k + 1} when the run was saved:"
            " this program computes it differently",
        )


# --- drawing -------------------------------------------------------------------------------------


def draw_portrait(seen: Portrait) -> Figure:
    """Draw x_G(t) and theta(t), the slips in space and time, and the forces at one moment."""
    figure = picture(7.4, 8.2)
    grid = figure.add_gridspec(4, 2, height_ratios=(0.75, 1.25, 1.7, 1.7), width_ratios=(1, 1))
    top = figure.add_subplot(grid[0, :])
    middle = figure.add_subplot(grid[1, :], sharex=top)
    space = figure.add_subplot(grid[2, :], sharex=top)
    figure.suptitle(_title(seen), fontsize=9)
    time = seen.first - 1 + np.arange(seen.theta.size)
    top.step(time, seen.theta, where="pre", color="0.25", linewidth=0.8)
    top.set_ylabel(r"$\theta$ at the end")
    middle.step(time, seen.x_G, where="pre", color=INKS[6], linewidth=1.2)
    middle.set_ylabel(r"$\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)")
    for axes in (top, middle, space):
        axes.axvline(seen.half_cycle, color=INKS[0], linewidth=0.8, linestyle=(0, (3, 2)))
        axes.tick_params(labelbottom=axes is space)
    _draw_slips(figure, space, seen)
    if seen.result.half_cycles > seen.slips.shape[0]:
        _inset_course(middle, seen)
    forces: Any = grid[3, :]
    if seen.result.chain.n > 1:
        _draw_tensions(figure.add_subplot(grid[3, 0]), seen)
        forces = grid[3, 1]
    bottom = figure.add_subplot(forces)
    draw_forces(bottom, seen.forces, seen.limits, seen.result.chain.friction)
    bottom.set_xlabel("slider $n$")
    bottom.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    bottom.set_title(_moment(seen), fontsize=8)
    return figure


def _title(seen: Portrait) -> str:
    chain, result = seen.result.chain, seen.result
    return (
        rf"$N={chain.n}$, $\tilde{{l}}_0={float(chain.l0):g}$,"
        rf" $\mu_\mathrm{{d}}={float(chain.mu_d):g}$, $\mu_\mathrm{{s}}={float(chain.mu_s):g}$,"
        rf" $\sigma_\mu={float(chain.sigma_mu):g}$, $\tan\alpha={float(chain.tan_alpha):g}$;"
        f" solver {result.solver}, seed {result.seed}:"
        f" {behaviour(result.outcome, result.direction)}"
    )


def _inset_course(axes: Axes, seen: Portrait) -> None:
    """Show the whole course of x_G, if it was recorded, with the window marked."""
    recorded = seen.result.recorded.get("x_G", np.empty(0))
    if not recorded.size:
        return
    inset = axes.inset_axes((0.68, 0.16, 0.3, 0.4))
    shown = np.unique(np.linspace(0, recorded.size - 1, 2000).astype(int))
    inset.plot(shown + 1, floats(recorded)[shown], color=INKS[6], linewidth=0.8)
    inset.axvspan(seen.first - 1, seen.first - 1 + seen.slips.shape[0], color=INKS[4], alpha=0.5)
    inset.set_xlim(0, recorded.size)
    inset.tick_params(labelsize=6)
    inset.set_title("whole run", fontsize=6, pad=2)


def _draw_slips(figure: Figure, axes: Axes, seen: Portrait) -> None:
    """Draw how often each slider slips within each half-cycle."""
    levels = _levels(int(seen.slips.max(initial=0)))
    shades = _SHADES[: len(levels) - 1]
    window, n = seen.slips.shape
    image = axes.pcolormesh(
        np.arange(seen.first - 1, seen.first + window), np.arange(n + 1) + 0.5, seen.slips.T,
        cmap=ListedColormap(list(shades)), norm=BoundaryNorm(np.array(levels) - 0.5, len(shades)),
        rasterized=True,
    )  # fmt: skip
    axes.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.set(ylabel="slider (1 uppermost)", xlabel=r"time $t/\tau_\mathrm{th}$ (half-cycles)",
             ylim=(n + 0.5, 0.5))  # fmt: skip
    bar = figure.colorbar(image, ax=axes, pad=0.01, aspect=16)
    classes = list(itertools.pairwise(levels))
    names = [str(a) if b - a == 1 else f"{a}-{b - 1}" for a, b in classes]
    bar.set_ticks([(a + b - 1) / 2 for a, b in classes], labels=names)
    bar.ax.tick_params(labelsize=7, length=0)
    bar.set_label("slips per half-cycle", fontsize=8)


def _levels(most: int) -> list[int]:
    """Return where the classes of a count from 0 to `most` begin, and where the last one ends."""
    classes = len(_SHADES)
    if most < classes:
        return list(range(most + 2))
    ratio = (most + 1) ** (1 / (classes - 1))
    levels = [0, 1]
    for k in range(1, classes):
        levels.append(max(levels[-1] + 1, math.ceil(ratio**k)))
    return levels


def _draw_tensions(axes: Axes, seen: Portrait) -> None:
    """Draw the tensions between the bounds that friction sets."""
    chain = seen.result.chain
    springs = np.arange(1, chain.n)
    for coefficient, dashes, name in (
        (chain.mu_d, "-", r"limit for $\mu_\mathrm{d}$"),
        (chain.mu_s, (0, (4, 2)), r"limit for $\mu_\mathrm{s}$"),
    ):
        for bound, label in zip(seen.bounds(coefficient), (name, None), strict=True):
            axes.plot(springs, bound, color="0.45", linewidth=0.9, linestyle=dashes, label=label)
    size = 3 if chain.n <= 60 else 1.5
    axes.plot(springs, floats(seen.state.tensions), color=INKS[0], marker="o", markersize=size,
              linewidth=0.9, label=r"$T_n$")  # fmt: skip
    axes.set(xlabel="spring $n$", ylabel=r"tension ($m\,g$)")
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.set_title(_moment(seen), fontsize=8)
    axes.margins(y=0.15)
    axes.legend(loc="best", fontsize=7)


def draw_forces(
    axes: Axes, forces: Floats, limits: Floats, friction: float
) -> tuple[BarContainer, Line2D]:
    """Draw the force on each slider between its static limits; return the limits and the marks."""
    n, highest = limits.size, max(float(limits.max()), float(np.abs(forces).max()))
    sliders = np.arange(1, n + 1)
    bars = axes.bar(sliders, 2 * limits, 0.84, bottom=-limits, color="0.88",
                    label=r"$|F_n| \leq \mu_{\mathrm{s},n}\cos\alpha$")  # fmt: skip
    (marks,) = axes.plot(sliders, forces, linestyle="none", marker="o", color=INKS[6],
                         markersize=4 if n <= 60 else 2, label=r"$F_n$")  # fmt: skip
    for force, label in ((-friction, None), (friction, r"$\pm\mu_\mathrm{d}\cos\alpha$")):
        axes.axhline(force, color=INKS[6], linewidth=0.7, linestyle=DOTTED, label=label)
    axes.set(xlim=(0.3, n + 0.7), ylim=(-1.1 * highest, 1.75 * highest))
    axes.set_ylabel(r"force $F_n$ ($m\,g$)")
    axes.legend(loc="upper center", ncols=3, fontsize=7, columnspacing=1.0, handlelength=1.5)
    return bars, marks


def _moment(seen: Portrait) -> str:
    theta = as_float(seen.state.theta)
    return rf"end of half-cycle {seen.half_cycle} ($\theta = {theta:.4g}$)"
