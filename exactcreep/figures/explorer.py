"""The contents of the explorer: a run of the chain that its sliders describe, its law, its fate.

The app is `exactcreep.figures.explorer_app`; this module does not need marimo. Every computation
ends after a number of events, on any machine, and says so.
"""

from __future__ import annotations

import io
import math
import re
import threading
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from exactcreep.figures.run import draw_run
from exactcreep.figures.style import new_figure, styled
from exactcreep.figures.sweep import Point, draw_families
from exactcreep.laws import prediction, threshold_amplitude, threshold_width
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.numbers import InputError, exact_number, nearest_float, with_error
from exactcreep.quasistatic.creep import run_alone
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.fates.fate import fate
from exactcreep.watch.limits import Limits

DRIVES = ("cycles", "Gaussian")
"""Kinds of drives: cycles +A, -A, or independent normal dilations."""
PRESETS: Mapping[str, float] = {"below": 0.75, "at": 1.0, "above": 1.5}
"""Sizes of the drive relative to the paper's threshold, by the names of their buttons."""
_POINTS, _SPAN = 15, 2.5  # number of velocities, and their range in thresholds (or the given size)
_POINT_EVENTS = 60_000  # most events of a velocity
_FATE_EVENTS, _FATE_CYCLES = 400_000, 2_000  # limits of the search for a fate
_DRAWING = threading.Lock()  # each page has a thread; matplotlib has one style for all of them
MOST_EVENTS = 40_000
"""Most events of a run; more would take longer than a visitor waits."""


class Slider(NamedTuple):
    """A slider of the explorer: its values, and its initial value."""

    name: str
    label: str
    values: tuple[float, ...]
    start: float
    logarithmic: bool = False


def _decades(least: int, most: int, each: int = 20) -> tuple[float, ...]:
    places = range(least * each, most * each + 1)
    return tuple(float(f"{10 ** (place / each):.3g}") for place in places)


SIZES = _decades(-2, 2)
"""Values of the slider of the drive: amplitude or standard deviation, in thousandths."""
START = 2.0
"""The initial size of the drive."""
SLIDERS = (
    Slider("n", "sliders: n", tuple(range(2, 101)), 10),
    Slider("tan_alpha", "slope: tan_alpha", tuple(k / 200 for k in range(121)), 0.25),
    Slider("mu_d", "dynamical friction: mu_d", tuple(k / 100 for k in range(101)), 0.5),
    Slider("mu_s", "static friction: mu_s", tuple(k / 100 for k in range(101)), 0.6),
    Slider("sigma_mu", "its disorder: sigma_mu", tuple(k / 500 for k in range(51)), 0.01),
    Slider("l0", "length of a spring: l0", _decades(1, 5), 1000.0, True),
    Slider("length", "cycles, or Gaussian dilations", tuple(range(2, 201)), 80),
    Slider("seed", "seed", tuple(range(101)), 0),
)
"""Every slider in order, without the size of the drive."""


def experiment_of(values: Mapping[str, Any]) -> Experiment:
    """Return the experiment that the explorer's sliders describe.

    `values`: by the names of `SLIDERS`, with ``drive``, one of `DRIVES`, and its ``size`` (the
    amplitude of cycles, or the standard deviation of Gaussian dilations) in thousandths. Raises
    `InputError` with the name of the field if a value is out of range.
    """
    decimals = {name: repr(value) for name, value in values.items()}  # decimals, as displayed
    numbers = {name: decimals[name] for name in ("l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha")}
    make = Cycles if values["drive"] == DRIVES[0] else GaussianSteps
    drive = make(exact_number(decimals["size"], "size") / 1000, values["length"])
    return Experiment(Chain(values["n"], **numbers), drive, seed=values["seed"])


def prepare() -> None:
    """Load and compile the code for the first picture in advance."""
    first = {slider.name: slider.start for slider in SLIDERS} | {"drive": DRIVES[0], "size": START}
    experiment = experiment_of(first)
    view_of(experiment)
    velocity_picture(next(velocity_points(experiment)), experiment)


def preset_size(values: Mapping[str, Any], name: str) -> float:
    """Return the size of the drive for one of `PRESETS`, in thousandths; nan if there is none."""
    try:
        threshold = threshold_of(experiment_of({**values, "size": 1.0}))
    except InputError:
        return math.nan
    wanted = float(f"{1000 * PRESETS[name] * threshold:.3g}")
    return wanted if SIZES[0] <= wanted <= SIZES[-1] else math.nan


def threshold_of(experiment: Experiment) -> float:
    """Return the amplitude of Eq. 22, or the deviation by Eq. 24; nan if the chain may run away."""
    chain = experiment.chain
    if chain.may_run_away:
        return math.nan
    known = chain.parameters()
    numbers = {name: known[name] for name in ("n", "l0", "mu_d", "tan_alpha")}
    cyclic = isinstance(experiment.drive, Cycles)
    return float((threshold_amplitude if cyclic else threshold_width)(**numbers))


class View(NamedTuple):
    """The picture and the sentences of one experiment.

    `run`: as far as it was computed; `picture`: of the run, as SVG text; `law`, `fate`, `cut`:
    sentences about the law that holds, the chain's fate, and where the run was stopped.
    """

    run: Creep
    picture: str
    law: str
    fate: str
    cut: str


def view_of(experiment: Experiment) -> View:
    """Return the picture and the sentences of an experiment."""
    run = run_alone(replace(experiment, record=("x_G",)), limits=Limits.of(MOST_EVENTS))
    cut, targets = "", experiment.drive.target_count
    if run.half_cycles < targets and run.reason:
        cut = f"The run was cut after {run.half_cycles} of {targets} targets: {run.reason}."
    with _DRAWING:
        figure = draw_run(run)
        figure.set_size_inches(7.2, 7.6)  # beside the sliders
        picture = _svg(figure, f"displacements of {experiment.chain} under {experiment.drive}")
    return View(run, picture, law_sentence(run), fate_sentence(run), cut)


def law_sentence(run: Creep) -> str:
    """Return the mean velocity of a run with its error, and the law for it with its deviation."""
    per, measured = f"g τ² per {run.drive.per}", run.velocity
    said = f"Mean velocity: {measured:.4g} {per} ({run.velocity_reason})."
    if run.velocity_error >= 0:
        said = f"Mean velocity: {with_error(measured, run.velocity_error)} {per}."
    law = prediction(run.chain, run.drive, run.experiment.start)
    if law is None:
        return f"{said} No law: friction does not hold the chain, which may run away."
    return f"{said} Law that holds: {law}."


def fate_sentence(run: Creep) -> str:
    """Return the fate of a chain, if float64 finds it in less than a second, in a sentence."""
    chain, drive = run.chain, run.drive
    if not isinstance(drive, Cycles):
        return "Fate: none, since the dilations never repeat."
    if chain.sigma_mu != 0:
        return "Fate: none that lasts, since every slip draws a new coefficient (survival)."
    if chain.slides or chain.may_run_away:
        return ""
    each = max(run.event_count / max(run.half_cycles, 1), 1)  # events of a half-cycle
    most = min(max(int(_FATE_EVENTS / (2 * each)), 1), _FATE_CYCLES)
    found = fate(chain, drive.amplitude, cycles=most, solver="exact")
    proves = "" if found.settled_after is None else "; exactcreep fate proves it"
    return f"Fate: {found.finding}{proves}."


# --- the velocity over the amplitude --------------------------------------------------------------


def velocity_points(experiment: Experiment) -> Iterator[list[Point]]:
    """Yield all points of the velocity over the amplitude, each time with one more velocity.

    Amplitudes go up to the drive's size, or to some thresholds. An unknown velocity is nan.
    """
    chain, drive = experiment.chain, experiment.drive
    make, name = (Cycles, "amplitude") if drive.cyclic else (GaussianSteps, "sigma_theta")
    length = drive.target_count // (2 if drive.cyclic else 1)
    own, threshold = nearest_float(getattr(drive, name)), threshold_of(experiment)
    last = max(own, _SPAN * threshold) if threshold > 0 else 2 * own
    sizes = sorted({own, *(float(f"{last * k / _POINTS:.3g}") for k in range(1, _POINTS + 1))})
    drives = [make(repr(size), length) for size in sizes]
    points = [
        Point({name: size}, math.nan, parameters={**chain.parameters(), name: getattr(each, name)})
        for size, each in zip(sizes, drives, strict=True)
    ]
    yield list(points)
    for place in sorted(range(len(sizes)), key=lambda place: (place % 3 != 1, place)):
        run = run_alone(
            replace(experiment, drive=drives[place], record=()), limits=Limits.of(_POINT_EVENTS)
        )
        points[place] = replace(points[place], measured=run.velocity, error=run.velocity_error)
        yield list(points)


def velocity_picture(points: list[Point], experiment: Experiment) -> str:
    """Return the picture of `velocity_points`, with the experiment marked, as SVG text."""
    with _DRAWING:
        return _svg(_velocity_picture(points, experiment), "the mean velocity, and its laws")


@styled
def _velocity_picture(points: list[Point], experiment: Experiment) -> Figure:
    (name,) = points[0].varied
    figure = new_figure(4.8, 3.1)
    axes = figure.subplots()
    draw_families(axes, points, name)
    threshold = threshold_of(experiment)
    if threshold > 0:
        axes.axvline(threshold, color="0.5", linewidth=0.8, linestyle=":")
        equation = "Eq. 22" if name == "amplitude" else "Eq. 24"
        axes.text(threshold, 0.98, f" {equation}", transform=axes.get_xaxis_transform(), va="top",
                  fontsize=8)  # fmt: skip
    own = nearest_float(getattr(experiment.drive, name))
    axes.axvline(own, color="0.5", linewidth=0.8)
    axes.set_xlim(0, 1.02 * points[-1].varied[name])
    return figure


@styled
def _svg(figure: Figure, said: str) -> str:
    """Return a figure as SVG text as wide as its place, in the colour of the page's words."""
    drawn = io.StringIO()
    figure.savefig(drawn, format="svg", transparent=True, metadata={"Date": None})
    text = re.sub("#(000000|404040)", "currentColor", drawn.getvalue())
    _, _, picture = text.partition("<svg")
    size = "width:100%;height:auto"  # in place of inches
    return f'<svg role="img" aria-label="{said}" style="{size};fill:currentColor"{picture}'
