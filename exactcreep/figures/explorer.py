"""What the explorer shows: a run of the chain that its sliders ask for, its law, its fate.

The app itself is `exactcreep.figures.explorer_app`; nothing here needs marimo. Every computation
ends after a number of events, whatever the machine, and says so.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np

from exactcreep.figures.animation import RunAvalanche, find_avalanche
from exactcreep.figures.avalanche_page import page, run_to_draw
from exactcreep.figures.style import STYLE, new_figure, styled
from exactcreep.figures.sweep import Point, draw_families
from exactcreep.laws import prediction, threshold_amplitude, threshold_width
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.quasistatic.creep import run_alone
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.fates.fate import fate
from exactcreep.watch.limits import Limits

DRIVES = ("cycles", "Gaussian")
"""What heats and cools the chain: cycles +A, -A, or independent normal dilations."""
PRESETS: Mapping[str, float] = {"below": 0.75, "at": 1.0, "above": 1.5}
"""Sizes of the drive, as parts of the paper's threshold, by the names of their buttons."""
_POINTS, _SPAN = 15, 2.5  # velocities, up to so many thresholds, or to the size that is asked for
_POINT_EVENTS = 60_000  # of one of them
_FATE_EVENTS, _FATE_CYCLES = 400_000, 2_000  # after which a fate is not waited for
_TRIED = 20  # avalanches that are tried, the largest first


class Slider(NamedTuple):
    """A slider of the explorer: the values that it takes, and the one that it starts with."""

    name: str
    label: str
    values: tuple[float, ...]
    start: float
    logarithmic: bool = False


def _decades(least: int, most: int, each: int = 20) -> tuple[float, ...]:
    places = range(least * each, most * each + 1)
    return tuple(float(f"{10 ** (place / each):.3g}") for place in places)


SIZES = _decades(-2, 2)
"""Amplitudes, or standard deviations, in thousandths, that the slider of the drive takes."""
START = 2.0
"""The first of them."""
SLIDERS = (
    Slider("n", "sliders: n", tuple(range(2, 101)), 10),
    Slider("tan_alpha", "slope: tan_alpha", tuple(k / 200 for k in range(121)), 0.25),
    Slider("mu_d", "dynamical friction: mu_d", tuple(k / 100 for k in range(101)), 0.5),
    Slider("mu_s", "static friction: mu_s", tuple(k / 100 for k in range(101)), 0.6),
    Slider("sigma_mu", "its disorder: sigma_mu", tuple(k / 500 for k in range(51)), 0.01),
    Slider("l0", "length of a spring: l0", _decades(1, 5), 1000.0, True),
    Slider("length", "cycles, or Gaussian dilations", tuple(range(2, 201)), 40),
    Slider("seed", "seed", tuple(range(101)), 0),
)
"""Every slider in order, without the size of the drive."""


def experiment_of(values: Mapping[str, Any]) -> Experiment:
    """Return the experiment that the explorer's sliders ask for.

    Parameters
    ----------
    values : mapping of str to value
        By the names of `SLIDERS`, and ``drive``, one of `DRIVES`, and its ``size``: the amplitude
        of cycles, or the standard deviation of Gaussian dilations, in thousandths.

    Returns
    -------
    Experiment

    Raises
    ------
    InputError
        If the model does not allow a value; it names the field as the model does.

    Examples
    --------
    >>> values = {slider.name: slider.start for slider in SLIDERS}
    >>> experiment_of(values | {"drive": "cycles", "size": 2.0}).drive
    Cycles(amplitude='0.002', cycles=40)
    """
    decimals = {name: repr(value) for name, value in values.items()}  # as it is read, in decimals
    numbers = {name: decimals[name] for name in ("l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha")}
    make = Cycles if values["drive"] == DRIVES[0] else GaussianSteps
    drive = make(exact_number(decimals["size"], "size") / 1000, values["length"])
    return Experiment(Chain(values["n"], **numbers), drive, seed=values["seed"])


def prepare() -> None:
    """Load and compile what the first picture needs, before anybody waits for it."""
    first = {slider.name: slider.start for slider in SLIDERS} | {"drive": DRIVES[0], "size": START}
    experiment = experiment_of(first)
    view_of(experiment)
    velocity_picture(next(velocity_points(experiment)), experiment)


def preset_size(values: Mapping[str, Any], name: str) -> float:
    """Return the size of the drive that a preset stands for, in thousandths, to three digits.

    Parameters
    ----------
    values : mapping of str to value
        Values of the sliders, as for `experiment_of`; their size is ignored.
    name : str
        One of `PRESETS`.

    Returns
    -------
    float
        nan where the chain has no threshold, or is none.
    """
    try:
        threshold = threshold_of(experiment_of({**values, "size": 1.0}))
    except InputError:
        return math.nan
    wanted = float(f"{1000 * PRESETS[name] * threshold:.3g}")
    return wanted if SIZES[0] <= wanted <= SIZES[-1] else math.nan


def threshold_of(experiment: Experiment) -> float:
    """Return the amplitude, or the standard deviation, at which the paper lets creep begin.

    Parameters
    ----------
    experiment : Experiment

    Returns
    -------
    float
        Of Eq. 22, or what Eq. 24 makes of it; nan for a chain that may run away.
    """
    chain = experiment.chain
    if chain.may_run_away:
        return math.nan
    known = chain.parameters()
    numbers = {name: known[name] for name in ("n", "l0", "mu_d", "tan_alpha")}
    cyclic = isinstance(experiment.drive, Cycles)
    return float((threshold_amplitude if cyclic else threshold_width)(**numbers))


class View(NamedTuple):
    """The pictures and sentences of one experiment.

    Attributes
    ----------
    run : Creep
        As far as it was computed.
    page : str
        The HTML page of the run, its largest avalanche playing.
    law, fate, cut : str
        A sentence each: which law holds where, what becomes of the chain, where the run was cut.
    """

    run: Creep
    page: str
    law: str
    fate: str
    cut: str


def view_of(experiment: Experiment) -> View:
    """Return what the explorer shows of an experiment.

    Parameters
    ----------
    experiment : Experiment

    Returns
    -------
    View
    """
    run = run_to_draw(experiment)
    avalanche, passed_over = _largest(run)
    cut = ""
    if run.half_cycles < experiment.drive.half_cycles and run.reason:
        cut = f"The run was cut after {run.half_cycles} of {experiment.drive.half_cycles}"
        cut += f" targets: {run.reason}."
    if passed_over:
        cut += f" {passed_over} larger avalanches cannot be shown: roundings decide their order."
    return View(
        run, page(run, avalanche, framed=True), law_sentence(run), fate_sentence(run),
        cut.strip(),
    )  # fmt: skip


def _largest(run: Creep) -> tuple[RunAvalanche | None, int]:
    """Return the avalanche of most events that can be shown, and how many larger ones cannot."""
    events = np.asarray(run.recorded["rearrangement_events"])
    numbers = np.argsort(-events, kind="stable")[:_TRIED].tolist()
    for place, number in enumerate(numbers):
        try:
            return find_avalanche(run.experiment, number, Limits.of(run.event_count)), place
        except InputError:  # it is computed differently alone than within its run
            continue
    return None, len(numbers)


def law_sentence(run: Creep) -> str:
    """Return which law holds for the mean velocity of a run, what it gives, and its deviation."""
    known = prediction(run.chain, run.drive, run.experiment.start)
    if known is None:
        if run.chain.expansion:
            return "No law: the springs expand by different weights."
        return "No law: friction does not hold the chain, which may run away."
    values = " or ".join(f"{value:.4g}" for value in known.values)
    off = f", off by {known.deviation:.2g} (root mean square)"
    if math.isnan(known.deviation):
        off = ""  # the name of the law says so
    elif known.deviation == 0:
        off = ", exactly"
    return f"Law that holds ({known.law}): {values} g τ² per {run.drive.per}{off}."


def fate_sentence(run: Creep) -> str:
    """Return what becomes of a chain for ever, where float64 tells it in less than a second."""
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
    """Yield the velocities over the amplitude as they become known, one more each time.

    Parameters
    ----------
    experiment : Experiment
        Its drive's size is the last of the amplitudes, or on the way to some thresholds.

    Yields
    ------
    list of Point
        All points; the velocity is nan where it is not known yet, and where there is none.
    """
    chain, drive = experiment.chain, experiment.drive
    make, name = (Cycles, "amplitude") if drive.cyclic else (GaussianSteps, "sigma_theta")
    length = drive.half_cycles // (2 if drive.cyclic else 1)
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


@styled
def velocity_picture(points: list[Point], experiment: Experiment) -> str:
    """Return the picture of `velocity_points` as SVG text that takes the colour of its page.

    Parameters
    ----------
    points : list of Point
    experiment : Experiment
        Where the chain itself stands is a vertical line.

    Returns
    -------
    str
    """
    (name,) = points[0].varied
    figure = new_figure(4.8, 3.4)
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
    drawn = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(drawn, format="svg", transparent=True, metadata={"Date": None})
    text = drawn.getvalue()
    text = text[text.index("<svg") :].replace("#000000", "currentColor")
    said = "the mean velocity over the amplitude, and its laws"
    style = f'role="img" aria-label="{said}" style="width:100%;max-width:640px;fill:currentColor"'
    head, rest = text.split(">", 1)
    sized = " ".join(part for part in head.split(" ") if not part.startswith(("width=", "height=")))
    return f"{sized} {style}>{rest}"
