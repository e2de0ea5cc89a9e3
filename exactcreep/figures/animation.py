"""Animate one avalanche; every frame is computed from the closed form of the motion."""

from __future__ import annotations

import io
import itertools
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image

from exactcreep.figures.style import DOTTED, INKS, LENGTH, new_figure, styled
from exactcreep.model.contacts import Contacts, EventKind
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import frictions_of
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.writing import write_file
from exactcreep.solvers.interface import Rearrangement, simulate
from exactcreep.solvers.tables import logged_events
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import Hearer, reporter

Floats = NDArray[np.float64]
LOOKED_AT = 100
"""Number of half-cycles that `largest_avalanche` searches."""
_MILLISECONDS, _LINGER = 50, 1500  # how long a frame stays, and how long the last frame stays
_FINENESS = 600  # points of a curve: about one per pixel
_NAMED = 8  # most sliders that a legend names
_DOWN, _UP, _REST = INKS[1], INKS[0], "#DDDDDD"


class RunAvalanche(NamedTuple):
    """Rearrangement `number` of a run, from 0; it happens in `half_cycle`, from 1."""

    experiment: Experiment
    number: int
    half_cycle: int
    rearrangement: Rearrangement


def largest_avalanche(
    experiment: Experiment, half_cycles: int = LOOKED_AT, limits: Limits = NO_LIMITS
) -> int:
    """Return the number of the largest rearrangement in the first half-cycles, or `InputError`."""
    total = min(half_cycles, experiment.drive.target_count)
    (seen,) = simulate(experiment.simulation(("events",)), experiment.drive, [total], limits)
    numbers, events = np.unique(seen.recorded.get("event_rearrangement", ()), return_counts=True)
    if seen.stop is Stop.DEADLINE and not events.size:
        raise OutOfTime(f"{seen.reason} in half-cycle 1, before a rearrangement was found")
    if not events.size:
        reason = f"nothing moves in {seen.completed} half-cycles"
        raise InputError("scene", experiment.solver, reason)
    return int(numbers[events.argmax()])


def find_avalanche(experiment: Experiment, number: int, limits: Limits = NO_LIMITS) -> RunAvalanche:
    """Return rearrangement `number` of a run in closed form (its itinerary is checked)."""
    simulation, state = experiment.simulation(("events",)), experiment.initial
    targets = range(1, experiment.drive.target_count + 1)
    for stretch in simulate(simulation, experiment.drive, targets, limits):
        numbers = np.asarray(stretch.whole.get("event_rearrangement", ()))
        if number in numbers:
            break
        state = simulation.state()
    if number not in numbers:
        count = simulation.tally.rearrangements
        reason = f"must be one of the run's {count}, from 0"
        if early := limits.reason(stretch.stop):
            raise OutOfTime(f"rearrangement {number} was not found: {early} after {count} others")
        raise InputError("rearrangement", number, reason)
    logged, half_cycle = logged_events(stretch.whole), int(stretch.whole["event_half_cycle"][0])
    itinerary = tuple(event.signature for row, event in logged if row.rearrangement == number)
    motions = _rearrangements(experiment, state, half_cycle)
    motion = next(itertools.islice(motions, number - int(numbers[0]), None))
    if motion.itinerary != itinerary:
        reason = "is computed differently alone and within its run"
        raise InputError("rearrangement", number, reason)
    return RunAvalanche(experiment, number, half_cycle, motion)


def _rearrangements(
    experiment: Experiment, state: State, half_cycle: int
) -> Iterator[Rearrangement]:
    """Yield the rearrangements up to the next target and after it, given the state before."""
    chain, seed, rearrange = experiment.chain, experiment.seed, experiment.algorithm.rearrange
    if half_cycle == 1:  # a start that is not at rest is rearranged at its own theta
        still = rearrange(chain, state, 0, seed)
        if still.events:
            yield still
            state = still.state
    leg = experiment.drive.leg(half_cycle, experiment.initial.theta)
    if leg is None:
        target = experiment.drive.exact_target(half_cycle, seed)
    else:  # as `Leg` says
        chain, target = replace(chain, expansion=leg.expansion(chain)), Fraction(1)
        state = replace(state, theta=0)
    direction = 1 if target > as_float(state.theta) else -1
    while True:
        motion = rearrange(chain, state, direction, seed)
        yield motion
        state = motion.state


class Moments(NamedTuple):
    """A rearrangement at some instants; arrays of shape (n, instants).

    `moved`: displacements since the start; `velocities`; `forces`: non-frictional forces; `moving`:
    which sliders move; `held`: the forces on the resting sliders.
    """

    moved: Floats
    velocities: Floats
    forces: Floats
    moving: NDArray[np.bool_]
    held: Floats


def moments_of(motion: Rearrangement, times: Floats) -> Moments:
    """Return a rearrangement at the given times, from its closed form."""
    n, contacts = motion.chain.n, Contacts(motion.chain, motion.seed)
    draws, moving = motion.initial.draws.tolist(), np.zeros((n, times.size), dtype=bool)
    held = np.repeat(
        contacts.thresholds(motion.initial.coefficients, FLOAT64)[:, None], times.size, 1
    )
    for event in motion.events:
        later = times >= float(event.time)
        for m in (slider - 1 for slider in event.sliders):
            moving[m, later] = event.kind is EventKind.START
            if event.kind is EventKind.STOP:
                drawn = contacts.coefficient(m + 1, draws[m])
                held[m, later], draws[m] = contacts.holds(m, drawn, FLOAT64), draws[m] + 1
    known = motion.sol(times)
    positions, velocities, forces = (
        floats(np.asarray(values)) for values in (known.positions, known.velocities, known.forces)
    )
    start = floats(motion.initial.displacements)[:, None]
    return Moments(positions - start, velocities, forces, moving, held)


# --- drawing -------------------------------------------------------------------------------------

Move = Callable[[int], object]
"""Moves the picture to an instant, given its index."""


@styled
def draw_avalanche(
    found: RunAvalanche, path: str | os.PathLike[str], *, frames: int = 120, force: bool = True,
    progress: Hearer = None,
) -> None:  # fmt: skip
    """Write the avalanche as an animated GIF; `InputError` if the file cannot be written."""
    motion, chain = found.rearrangement, found.experiment.chain
    times = np.linspace(float(motion.sol.t_min), float(motion.sol.t_max), frames)
    fine = np.linspace(times[0], times[-1], max(_FINENESS, frames))
    shown, curves = moments_of(motion, times), moments_of(motion, fine).moved
    figure = new_figure(6.6, 6.2, dpi=100)
    above, middle, below = figure.subplots(3, 1, height_ratios=(1.3, 1.3, 1.5))
    moves = (
        _draw_chain(above, shown, float(np.abs(curves).max()), float(chain.tan_alpha)),
        _draw_forces(middle, shown, frictions_of(FLOAT64, chain)),
        _draw_curves(below, times, shown.moved, fine, curves),
    )
    events = [float(event.time) for event in motion.events]
    below.vlines(events, *below.get_ylim(), color="0.9", linewidth=0.5, zorder=0)
    heading = figure.suptitle(" ", fontsize=9)

    def move(k: int) -> None:
        for each in moves:
            each(k)
        heading.set_text(
            rf"rearrangement {found.number} (half-cycle {found.half_cycle},"
            rf" $\theta_\mathrm{{c}} = {as_float(motion.theta):.6g}$):"
            rf" $t = {times[k]:.2f}\,\tau_\mathrm{{dyn}}$,"
            rf" {int(shown.moving[:, k].sum())} of {chain.n} move"
        )

    move(0)
    figure.draw_without_rendering()
    say = reporter(progress)
    figure.set_layout_engine("none")  # all frames keep the layout of the first
    canvas: Any = FigureCanvasAgg(figure)
    made = io.BytesIO()

    def picture(k: int) -> Image.Image:
        say("drawing", k, frames, "pictures")
        move(k)
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())

    picture(0).save(
        made, "GIF", save_all=True, append_images=map(picture, range(1, frames)), loop=0,
        duration=[_MILLISECONDS] * (frames - 1) + [_LINGER],
    )  # fmt: skip
    write_file(path, made.getbuffer(), "out", force=force)


def _draw_chain(axes: Axes, shown: Moments, widest: float, tan_alpha: float) -> Move:
    n, slope = len(shown.moved), math.atan(tan_alpha)
    along, up = np.array([math.cos(slope), -math.sin(slope)]), [math.sin(slope), math.cos(slope)]
    places = np.arange(1, n + 1, dtype=float)
    scale = 0.42 / max(widest, 1e-300)  # the distance between two sliders is drawn as 1
    half = 0.16 if n <= 12 else 0.26  # half of a slider's side
    (springs,) = axes.plot([], [], color="0.45", linewidth=0.8, zorder=1)
    corners = half * np.array([[-1, 0], [1, 0], [1, 2], [-1, 2]])
    shape = corners[:, :1] * along + corners[:, 1:] * up
    sliders = PolyCollection([shape] * n, edgecolors="black", linewidths=0.6, zorder=2)
    axes.add_collection(sliders)
    ends = np.outer([0.2, n + 0.8], along)
    axes.fill([*ends[:, 0], ends[0, 0]], [*ends[:, 1], ends[1, 1]], color="0.93", zorder=0)
    axes.plot(*ends.T, color="0.45", linewidth=0.8, zorder=0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xticks=[], yticks=[])
    axes.margins(0.02, 0.12)
    about = f"sliders 1 (the uppermost) to {n}; displacements times {scale:.3g}"
    axes.set_xlabel(about, fontsize=8)
    inks = {"moves down": (_DOWN, 0.52), "moves up": (_UP, 0.7), "rests": ("0.45", 0.86)}
    for name, (ink, where) in inks.items():
        axes.text(where, 0.9, f"■ {name}", color=ink, transform=axes.transAxes, fontsize=8,
                  va="center", family="DejaVu Sans")  # fmt: skip
    teeth = 9 if n <= 12 else 5
    across = np.full((n - 1, teeth + 2), half)
    across[:, 2:-2:2] += half
    across[:, 3:-2:2] -= half

    def move(k: int) -> None:
        here = places + scale * shown.moved[:, k]
        sliders.set_verts(list(shape + here[:, None, None] * along))
        ways = np.where(shown.velocities[:, k] >= 0, _DOWN, _UP)
        sliders.set_facecolor(np.where(shown.moving[:, k], ways, _REST).tolist())
        coils = np.linspace(here[:-1] + half, here[1:] - half, teeth + 2, axis=1).ravel()
        springs.set_data(*(coils[:, None] * along + across.ravel()[:, None] * up).T)

    return move


def _draw_forces(axes: Axes, shown: Moments, friction: Floats) -> Move:
    """Draw the force on each slider between its static limits."""
    n, highest = len(friction), max(float(shown.held.max()), float(np.abs(shown.forces).max()))
    sliders, edges = np.arange(1, n + 1), np.arange(n + 1) + 0.5
    bars = axes.bar(sliders, 0, 0.84, color="0.88",
                    label=r"$|F_n| \leq \mu_{\mathrm{s},n}\cos\alpha$")  # fmt: skip
    (marks,) = axes.plot(sliders, 0 * friction, linestyle="none", marker="o", color=INKS[6],
                         markersize=4 if n <= 60 else 2, label=r"$F_n$")  # fmt: skip
    for force, label in ((-friction, None), (friction, r"$\pm\mu_\mathrm{d}\cos\alpha$")):
        axes.step(edges, [*force, force[-1]], where="post", color=INKS[6], linewidth=0.7,
                  linestyle=DOTTED, label=label)  # fmt: skip
    axes.set(xlim=(0.3, n + 0.7), ylim=(-1.1 * highest, 1.75 * highest))
    axes.set_ylabel(r"force $F_n$ ($m\,g$)")
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.legend(loc="upper center", ncols=3, fontsize=7, columnspacing=1.0, handlelength=1.5)

    def move(k: int) -> None:
        limits = np.where(shown.moving[:, k], 0.0, shown.held[:, k])
        for bar, limit in zip(bars, limits.tolist(), strict=True):
            bar.set(y=-limit, height=2 * limit)
        marks.set_ydata(shown.forces[:, k])

    return move


def _draw_curves(axes: Axes, times: Floats, moved: Floats, fine: Floats, curves: Floats) -> Move:
    active = np.flatnonzero(np.abs(curves).max(axis=1) > 0).tolist()
    named = len(active) <= _NAMED
    ramp = colormaps["cividis"](np.linspace(0, 1, len(active)))
    labels = [f"slider {n + 1}" if named else None for n in active]
    lines = [axes.plot([], [], color=ink, linewidth=1.1, label=label)[0]
             for ink, label in zip(ramp, labels, strict=True)]  # fmt: skip
    clock = axes.axvline(0, color=INKS[0], linewidth=0.8)
    low, high = float(curves.min()), float(curves.max())
    margin = 0.06 * (high - low)
    axes.set(xlim=(0, times[-1]), ylim=(low - margin, high + margin))
    axes.set_xlabel(r"time $t/\tau_\mathrm{dyn}$ (grey: events)")
    axes.set_ylabel(f"displacement {LENGTH}")
    if active and named:
        axes.legend(loc="best", fontsize=7)
    elif active:
        axes.text(0.01, 0.95, f"sliders {active[0] + 1} (dark) to {active[-1] + 1} (light)",
                  transform=axes.transAxes, fontsize=7, va="top")  # fmt: skip

    def move(k: int) -> None:
        now, passed = times[k], fine <= times[k]
        for n, line in zip(active, lines, strict=True):
            line.set_data(np.append(fine[passed], now), np.append(curves[n, passed], moved[n, k]))
        clock.set_xdata([now, now])

    return move
