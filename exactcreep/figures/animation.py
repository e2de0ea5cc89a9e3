"""One avalanche exactly as it moves: every picture is taken from the closed form of the motion."""

from __future__ import annotations

import io
import itertools
import os
from collections import Counter
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray
from PIL import Image

from exactcreep.figures.style import INKS, STYLE, picture
from exactcreep.model.contacts import Itinerary
from exactcreep.model.numbers import InputError
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.solution import Motion
from exactcreep.quasistatic.decimals import floats
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.files import write_file
from exactcreep.solvers.solver import Rearrangement, Simulation, Stretch, advance
from exactcreep.solvers.tables import logged_events

LOOKED_AT = 100
"""Half-cycles among which `largest_avalanche` looks."""
_PERIOD = 50  # milliseconds of one picture
_LINGER = 1500  # milliseconds of the last one
_FINENESS = 600  # points of a curve: about one per pixel


@dataclass(frozen=True, eq=False)
class Avalanche:
    """One rearrangement of a run.

    Attributes
    ----------
    experiment : Experiment
    number : int
        Of the rearrangement, from 0.
    half_cycle : int
        In which it happens, from 1.
    rearrangement : Rearrangement
    """

    experiment: Experiment
    number: int
    half_cycle: int
    rearrangement: Rearrangement


def largest_avalanche(experiment: Experiment, half_cycles: int = LOOKED_AT) -> int:
    """Return the number of the rearrangement with most events in the first half-cycles.

    Raises
    ------
    InputError
        If there is none.
    """
    simulation = _simulation(experiment)
    events: Counter[int] = Counter()

    def take(stretch: Stretch) -> None:
        there = np.unique(stretch.recorded["event_rearrangement"], return_counts=True)
        for number, count in zip(*there, strict=True):
            events[int(number)] += int(count)

    total = min(half_cycles, experiment.drive.half_cycles)
    looked_at = advance(simulation, experiment.drive, total, take=take).completed
    if not events:
        raise InputError("scene", experiment.solver, f"nothing moves in {looked_at} half-cycles")
    return events.most_common(1)[0][0]


def find_avalanche(experiment: Experiment, number: int) -> Avalanche:
    """Return rearrangement `number` of a run, with its motion in closed form.

    Raises
    ------
    InputError
        If the run has no such rearrangement.

    Notes
    -----
    Guarantee: its itinerary is that of the run itself (checked).
    """
    half_cycle, first, itinerary = _place(experiment, number)
    simulation = _simulation(experiment, ())
    done = advance(simulation, experiment.drive, half_cycle - 1).completed
    state = simulation.state() if done else experiment.initial
    target = experiment.drive.exact_target(half_cycle, experiment.seed)
    chain, seed = experiment.chain, experiment.seed
    if not done:  # a start that is not at rest is rearranged where it stands
        still = experiment.algorithm.rearrange(chain, state, 0, seed)
        if still.events:
            if number == first:
                return _checked(Avalanche(experiment, number, half_cycle, still), itinerary)
            state, first = still.state, first + 1
    direction = 1 if target > floats(np.array([state.theta]))[0] else -1
    for current in range(first, number + 1):
        motion = experiment.algorithm.rearrange(chain, state, direction, seed)
        if current == number:
            return _checked(Avalanche(experiment, number, half_cycle, motion), itinerary)
        state = motion.state
    raise InputError("rearrangement", number, "is not found again")


def _simulation(experiment: Experiment, record: tuple[str, ...] = ("events",)) -> Simulation:
    return experiment.algorithm.simulation(
        experiment.chain, experiment.initial, experiment.seed, record
    )


def _place(experiment: Experiment, number: int) -> tuple[int, int, Itinerary]:
    """Return the half-cycle of a rearrangement, the first one there, and its itinerary."""
    simulation = _simulation(experiment)
    first_there: dict[int, int] = {}
    half_cycle = 0
    itinerary: list[Any] = []

    def take(stretch: Stretch) -> str:
        nonlocal half_cycle
        for row, event in logged_events(stretch.recorded):
            if row.rearrangement > number:
                return "found"
            first_there.setdefault(row.half_cycle, row.rearrangement)
            if row.rearrangement == number:
                half_cycle = row.half_cycle
                itinerary.append(event.signature)
        return ""

    advance(simulation, experiment.drive, experiment.drive.half_cycles, take=take)
    if not itinerary:
        count = simulation.tally.rearrangements
        raise InputError("rearrangement", number, f"must be one of the run's {count}, from 0")
    return half_cycle, first_there[half_cycle], tuple(itinerary)


def _checked(avalanche: Avalanche, itinerary: Itinerary) -> Avalanche:
    if avalanche.rearrangement.itinerary != itinerary:
        raise InputError(
            "rearrangement", avalanche.number, "is computed differently alone and within its run"
        )
    return avalanche


# --- drawing -------------------------------------------------------------------------------------


def draw_avalanche(
    avalanche: Avalanche, path: str | os.PathLike[str], *, frames: int = 120
) -> None:
    """Write the avalanche as an animated GIF: the chain, the forces, the displacements.

    The pictures are equally spaced in time, with one more at the end that stays.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    motion = avalanche.rearrangement
    times = np.linspace(float(motion.sol.t_min), float(motion.sol.t_max), frames)
    with mpl.rc_context(STYLE):
        stage = _Stage(avalanche, times)
        pictures = [stage.picture(k) for k in range(frames)]
    palette = pictures[frames // 2].quantize(128, dither=Image.Dither.NONE)
    shown = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    drawn = io.BytesIO()
    shown[0].save(
        drawn,
        format="GIF",
        save_all=True,
        append_images=shown[1:],
        duration=[_PERIOD] * (frames - 1) + [_LINGER],
        loop=0,
        optimize=False,
    )
    write_file(path, drawn.getbuffer(), "out")


class _Stage:
    """The figure whose artists move from picture to picture."""

    def __init__(self, avalanche: Avalanche, times: NDArray[np.float64]) -> None:
        self.avalanche = avalanche
        self.motion = avalanche.rearrangement
        self.chain = avalanche.experiment.chain
        self.times = times
        self.moments: Motion = self.motion.sol(times)
        positions = floats(np.asarray(self.moments.positions))
        start = floats(self.motion.initial.displacements)[:, None]
        self.displacements = positions - start
        self.course_times = np.linspace(times[0], times[-1], max(_FINENESS, times.size))
        course = self.motion.sol(self.course_times)
        self.courses_moved = floats(np.asarray(course.positions)) - start
        self.velocities = floats(np.asarray(self.moments.velocities))
        self.forces = floats(np.asarray(self.moments.forces))
        self.moving, self.held = contacts_at(self.motion, times)
        widest = max(float(np.abs(self.courses_moved).max()), 1e-300)
        self.scale = 0.42 / widest  # the distance of two sliders is drawn as 1
        self.figure = picture(6.6, 5.6, dpi=100)
        grid = self.figure.add_gridspec(3, 1, height_ratios=(0.8, 1.3, 1.5))
        self._build_chain(self.figure.add_subplot(grid[0]))
        self._build_forces(self.figure.add_subplot(grid[1]))
        self._build_course(self.figure.add_subplot(grid[2]))
        self.heading = self.figure.suptitle(" ", fontsize=9)

    def _build_chain(self, axes: Axes) -> None:
        n = self.chain.n
        self.places = np.arange(1, n + 1, dtype=float)
        (self.springs,) = axes.plot([], [], color="0.45", linewidth=0.8, zorder=1)
        size = float(np.clip(900 / n, 8, 160))
        self.sliders = axes.scatter(
            self.places, np.zeros(n), s=size, marker="s", edgecolors="black", linewidths=0.6,
            zorder=2,
        )  # fmt: skip
        axes.set_xlim(0.3, n + 0.7)
        axes.set_ylim(-1, 1)
        axes.set_yticks([])
        axes.set_xlabel(
            f"slider (downhill to the right; displacements times {self.scale:.3g})", fontsize=8
        )
        for ink, name, where in (
            (_DOWN, "moves down", 0.0), (_UP, "moves up", 0.22), ("0.45", "rests", 0.40),
        ):  # fmt: skip
            axes.text(where + 0.02, 0.86, f"■ {name}", color=ink, transform=axes.transAxes,
                      fontsize=8, va="center", family="DejaVu Sans")  # fmt: skip

    def _build_forces(self, axes: Axes) -> None:
        n = self.chain.n
        highest = max(float(self.held.max()), float(np.abs(self.forces).max()))
        name = r"$|F_n| \leq \mu_{\mathrm{s},n}\cos\alpha$ at rest"
        self.limits = axes.bar(self.places, np.ones(n), 0.84, color="0.88", label=name)
        (self.force_marks,) = axes.plot([], [], linestyle="none", marker="o", color=INKS[6],
                                        markersize=4 if n <= 60 else 2, label=r"$F_n$")  # fmt: skip
        friction = self.chain.friction
        for sign in (-1, 1):
            axes.axhline(sign * friction, color=INKS[6], linewidth=0.7, linestyle=(0, (1, 2)),
                         label=r"$\pm\mu_\mathrm{d}\cos\alpha$" if sign == 1 else None)  # fmt: skip
        axes.set_xlim(0.3, n + 0.7)
        axes.set_ylim(-1.1 * highest, 1.75 * highest)
        axes.set_ylabel(r"force $F_n$ ($m\,g$)")
        axes.legend(loc="upper center", ncols=3, fontsize=7)

    def _build_course(self, axes: Axes) -> None:
        active = np.flatnonzero(np.abs(self.courses_moved).max(axis=1) > 0)
        self.courses = []
        for order, n in enumerate(active.tolist()):
            ink = _RAMP(order / max(len(active) - 1, 1))
            label = f"slider {n + 1}" if len(active) <= 8 else None
            (line,) = axes.plot([], [], color=ink, linewidth=1.1, label=label)
            self.courses.append((n, line))
        moments = [float(event.time) for event in self.motion.events]
        self.clock = axes.axvline(0, color=INKS[0], linewidth=0.8)
        axes.set_xlim(0, float(self.times[-1]))
        low, high = float(self.courses_moved.min()), float(self.courses_moved.max())
        room = 0.06 * (high - low)
        axes.set_ylim(low - room, high + room)
        axes.vlines(moments, low - room, high + room, color="0.9", linewidth=0.5, zorder=0)
        axes.set_xlabel(r"time $t/\tau_\mathrm{dyn}$ (grey: events)")
        axes.set_ylabel(r"displacement ($g\,\tau_\mathrm{dyn}^2$)")
        if 0 < len(active) <= 8:
            axes.legend(loc="best", fontsize=7)
        elif len(active):
            axes.text(0.01, 0.95, f"sliders {active[0] + 1} (dark) to {active[-1] + 1} (light)",
                      transform=axes.transAxes, fontsize=7, va="top")  # fmt: skip

    def picture(self, k: int) -> Image.Image:
        """Return picture `k`."""
        moving = self.moving[:, k]
        here = self.places + self.scale * self.displacements[:, k]
        self.sliders.set_offsets(np.column_stack([here, np.zeros_like(here)]))
        down = self.velocities[:, k] >= 0
        inks = np.where(moving, np.where(down, _DOWN, _UP), _REST)
        self.sliders.set_facecolor(inks.tolist())
        self.springs.set_data(*_zigzag(here))
        for bar, limit in zip(self.limits, np.where(moving, 0.0, self.held[:, k]), strict=True):
            bar.set_y(-limit)
            bar.set_height(2 * limit)
        self.force_marks.set_data(self.places, self.forces[:, k])
        now = float(self.times[k])
        passed = self.course_times <= now
        for n, line in self.courses:
            line.set_data(
                np.append(self.course_times[passed], now),
                np.append(self.courses_moved[n, passed], self.displacements[n, k]),
            )
        self.clock.set_xdata([now, now])
        self.heading.set_text(
            rf"rearrangement {self.avalanche.number} (half-cycle {self.avalanche.half_cycle},"
            rf" $\theta_\mathrm{{c}} = {float(self._theta()):.6g}$):"
            rf" $t = {now:.2f}\,\tau_\mathrm{{dyn}}$, {int(moving.sum())} of {self.chain.n} move"
        )
        canvas = self.figure.canvas
        assert isinstance(canvas, FigureCanvasAgg)
        canvas.draw()  # type: ignore[no-untyped-call]
        self.figure.set_layout_engine("none")  # the layout of the first picture serves for all
        shown = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        return Image.fromarray(np.asarray(shown)).convert("RGB")

    def _theta(self) -> float:
        return float(floats(np.array([self.motion.theta]))[0])


_DOWN, _UP, _REST = INKS[1], INKS[0], "#DDDDDD"
_RAMP = mpl.colormaps["cividis"]


def contacts_at(
    motion: Rearrangement, times: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which sliders move, and the forces that hold the others, at the given times."""
    replay = motion.replay(FLOAT64)
    n = motion.chain.n
    moving = np.zeros((n, times.size), dtype=bool)
    held = np.repeat(np.array([[replay.threshold(m)] for m in range(n)]), times.size, axis=1)
    for phase in replay:
        phase.finish()
        later = times >= phase.time
        for m in {slider - 1 for event in phase.events for slider in event.sliders}:
            moving[m, later] = replay.flow.signs[m] != 0
            held[m, later] = replay.threshold(m)
    return moving, held


def _zigzag(places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the line of the springs between sliders at `places`."""
    teeth = 9 if places.size <= 12 else 5
    x, y = [], []
    for left, right in itertools.pairwise(places):
        along = np.linspace(left, right, teeth + 2)
        across = np.zeros(teeth + 2)
        across[2:-2:2], across[3:-2:2] = 0.22, -0.22
        x.append(along)
        y.append(across)
    if not x:
        return np.empty(0), np.empty(0)
    return np.concatenate(x), np.concatenate(y)
