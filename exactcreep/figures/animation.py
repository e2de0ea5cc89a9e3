"""Animate one avalanche; every frame is computed from the closed form of the motion."""

from __future__ import annotations

import io
import itertools
import math
import os
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Patch, Rectangle
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray
from PIL import Image

from exactcreep.figures.style import INKS, LENGTH, new_figure, styled
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.writing import write_file
from exactcreep.solvers.interface import Rearrangement, compile_for, simulate
from exactcreep.solvers.tables import logged_events
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import Hearer, reporter

Floats = NDArray[np.float64]
_LOOKED_AT = 100  # half-cycles in which the largest avalanche is searched
_MILLISECONDS, _LINGER = 50, 1500  # how long a frame stays, and how long the last frame stays
_FINENESS = 600  # points of a curve: about one per pixel
_NAMED = 8  # most sliders that a legend names; of more it names the first and the last
_DOWN, _UP, _REST = INKS[1], INKS[0], "#DDDDDD"


class RunAvalanche(NamedTuple):
    """Rearrangement `number` of a run, from 0; it happens in `half_cycle`, from 1."""

    number: int
    half_cycle: int
    rearrangement: Rearrangement


def find_avalanche(
    experiment: Experiment, number: int | None = None, limits: Limits = NO_LIMITS,
    *, progress: Hearer = None,
) -> RunAvalanche:  # fmt: skip
    """Return a rearrangement of a run in closed form (its itinerary is checked).

    Default for `number`: the rearrangement with most events in the first 100 half-cycles.
    """
    say, record = reporter(progress), ("events",)
    compile_for(experiment.algorithm, experiment.chain, record, partial(say, "compiling", 0))
    drive, simulation = experiment.drive, experiment.simulation(record)
    last = drive.target_count if number is not None else min(drive.target_count, _LOOKED_AT)
    state, found, most = experiment.initial, None, 0
    for reached, stretch in enumerate(simulate(simulation, drive, range(1, last + 1), limits), 1):
        say("searching", reached, last, "half-cycles")
        of = np.asarray(stretch.whole.get("event_rearrangement", ()))
        numbers, counts = np.unique(of[of == number] if number is not None else of,
                                    return_counts=True)  # fmt: skip
        if counts.max(initial=0) > most:
            most, chosen = int(counts.max()), int(numbers[counts.argmax()])
            found = stretch.whole, state, chosen, chosen - int(of[0])
        if found and number is not None:
            break
        state = simulation.state()
    count = simulation.tally.rearrangements
    if found is None:
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(f"{stretch.reason} after {count} other rearrangements")
        if number is None:
            raise InputError("scene", experiment.solver, f"nothing moves in {last} half-cycles")
        raise InputError("rearrangement", number, f"must be one of the run's {count}, from 0")
    recorded, state, number, place = found
    half_cycle = int(recorded["event_half_cycle"][0])
    motion = next(itertools.islice(_rearrangements(experiment, state, half_cycle), place, None))
    logged = (event.signature for row, event in logged_events(recorded)
              if row.rearrangement == number)  # fmt: skip
    if motion.itinerary != tuple(logged):
        reason = "is computed differently alone and within its run"
        raise InputError("rearrangement", number, reason)
    return RunAvalanche(number, half_cycle, motion)


def _rearrangements(
    experiment: Experiment, state: State, half_cycle: int
) -> Iterator[Rearrangement]:
    """Yield the rearrangements up to the next target and after it, given the state before."""
    target = experiment.drive.exact_target(half_cycle, experiment.seed)
    ramp = 1 if target > as_float(state.theta) else -1
    begin = [0] * (half_cycle == 1)  # a start that is not at rest is rearranged at its own theta
    for direction in itertools.chain(begin, itertools.repeat(ramp)):
        motion = experiment.algorithm.rearrange(experiment.chain, state, direction, experiment.seed)
        if motion.events:
            yield motion
            state = motion.state


# --- drawing -------------------------------------------------------------------------------------

Move = Callable[[int], object]
"""Moves the picture to an instant, given its index."""


@styled
def draw_avalanche(
    found: RunAvalanche, path: str | os.PathLike[str], *, frames: int = 120, force: bool = True,
    limits: Limits = NO_LIMITS, progress: Hearer = None,
) -> None:  # fmt: skip
    """Write the avalanche as an animated GIF; `InputError` if the file cannot be written."""
    motion = found.rearrangement
    times = np.linspace(float(motion.sol.t_min), float(motion.sol.t_max), frames)
    velocities = floats(motion.sol(times).velocities).round(9)  # at a stop they are rounding errors
    figure = new_figure(6.6, 5.0, dpi=100)
    above, below = figure.subplots(2, 1, height_ratios=(1.2, 1.5))
    slope = float(motion.chain.tan_alpha)
    move_chain = _draw_chain(above, _moved(motion, times), velocities, slope)
    _draw_curves(below, motion, max(_FINENESS, frames))
    clock, heading = below.axvline(0, color=INKS[0], linewidth=0.8), figure.suptitle(" ", size=9)
    canvas: Any = FigureCanvasAgg(figure)
    made, say = io.BytesIO(), reporter(progress)

    def picture(k: int) -> Image.Image:
        limits.require()
        say("drawing", k, frames, "pictures")
        move_chain(k)
        clock.set_xdata([times[k]] * 2)
        heading.set_text(
            rf"rearrangement {found.number} (half-cycle {found.half_cycle},"
            rf" $\theta_\mathrm{{c}} = {as_float(motion.theta):.6g}$):"
            rf" $t = {times[k]:.2f}\,\tau_\mathrm{{dyn}}$,"
            rf" {np.count_nonzero(velocities[:, k])} of {motion.chain.n} move"
        )
        canvas.draw()
        figure.set_layout_engine("none")  # all frames keep the layout of the first
        return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())

    picture(0).save(
        made, "GIF", save_all=True, append_images=map(picture, range(1, frames)), loop=0,
        duration=[_MILLISECONDS] * (frames - 1) + [_LINGER],
    )  # fmt: skip
    write_file(path, made.getbuffer(), "out", force=force)


def _moved(motion: Rearrangement, times: Floats) -> Floats:
    """Return the displacement of each slider since the start, shape (n, instants)."""
    return floats(motion.sol(times).positions) - floats(motion.initial.displacements)[:, None]


def _draw_chain(axes: Axes, moved: Floats, velocities: Floats, tan_alpha: float) -> Move:
    """Draw the chain on its incline, and return what moves it to an instant."""
    n, slope = len(moved), math.atan(tan_alpha)
    turned = Affine2D().rotate(-slope) + axes.transData
    scale = 0.42 / max(float(np.abs(moved).max()), 1e-300)  # two sliders are drawn 1 apart
    half = 0.16 if n <= 12 else 0.26  # half of a slider's side
    places, ground = np.arange(1, n + 1) - half, (n + 1) * np.array([0, math.cos(slope)])
    axes.fill_between(ground, -ground * tan_alpha, -ground[1] * max(tan_alpha, 0), color="0.9")
    (springs,) = axes.plot([], [], color="0.45", linewidth=0.8, zorder=1, transform=turned)
    sliders = [Rectangle((0, 0), 2 * half, 2 * half, edgecolor="black", linewidth=0.6,
                         transform=turned) for _ in places]  # fmt: skip
    for slider in sliders:
        axes.add_patch(slider)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xticks=[], yticks=[])
    axes.margins(0.02, 0.3)
    about = f"sliders 1 (the uppermost) to {n}; displacements times {scale:.3g}"
    axes.set_xlabel(about, fontsize=8)
    inks = {"moves down": _DOWN, "moves up": _UP, "rests": _REST}
    axes.legend([Patch(color=ink) for ink in inks.values()], [*inks], ncols=3,
                loc="upper right" if slope >= 0 else "upper left")  # fmt: skip
    heights = half * np.array([1, 1, 2, 0, 2, 0, 1, 1])  # of a spring from slider to slider

    def move(k: int) -> None:
        here = places + scale * moved[:, k]
        for slider, place, velocity in zip(sliders, here, velocities[:, k], strict=True):
            slider.set(x=place, facecolor=(_REST, _DOWN, _UP)[int(np.sign(velocity))])
        coils = np.linspace(here[:-1] + 2 * half, here[1:], heights.size, axis=1)
        springs.set_data(coils.ravel(), np.tile(heights, n - 1))

    return move


def _draw_curves(axes: Axes, motion: Rearrangement, count: int) -> None:
    """Draw the displacements of the sliders that move, and the times of the events."""
    times = np.linspace(float(motion.sol.t_min), float(motion.sol.t_max), count)
    curves = _moved(motion, times)
    active = np.flatnonzero(np.abs(curves).max(axis=1) > 0).tolist()
    ramp = colormaps["cividis"](np.linspace(0, 0.8, len(active)))  # yellow is faint
    for slider, ink in zip(active, ramp, strict=True):
        few = len(active) <= _NAMED or slider in (active[0], active[-1])
        label = f"slider {slider + 1}" if few else None
        axes.plot(times, curves[slider], color=ink, linewidth=1.1, label=label)
    for event in motion.events:
        axes.axvline(float(event.time), color="0.9", linewidth=0.5, zorder=0)
    axes.set(xlim=(0, times[-1]), xlabel=r"time $t/\tau_\mathrm{dyn}$ (grey: events)",
             ylabel=f"displacement {LENGTH}")  # fmt: skip
    axes.legend(loc="best", fontsize=7)
