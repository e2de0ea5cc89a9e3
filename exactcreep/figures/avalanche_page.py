"""Write an HTML page that shows a run and animates one of its avalanches.

The page is a single file and needs no network. ``exactcreep animate`` and the explorer use it.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from exactcreep.figures.animation import RunAvalanche, moments_of
from exactcreep.figures.run import times_of
from exactcreep.laws import prediction
from exactcreep.model.enclosure import as_float, floats
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import frictions_of
from exactcreep.quasistatic.creep import PHYSICS, run_alone
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.sliding import tension_bounds
from exactcreep.watch.limits import Limits

MOST_EVENTS = 40_000
"""Most events of a run that the page draws; more slips would be too dense to see."""
_MOMENTS = 800  # equally spaced instants of a motion; its events are added to them


def run_to_draw(experiment: Experiment) -> Creep:
    """Return a run that recorded the data of the page, stopped after `MOST_EVENTS` events."""
    recording = replace(experiment, record=("x_G", "rearrangements", "slip_table"))
    return run_alone(recording, limits=Limits.of(MOST_EVENTS))


def description_of(experiment: Experiment) -> str:
    """Return the chain, its drive, its seed and its solver in one line."""
    seed = f", seed {experiment.seed}"
    return f"{experiment.chain}, {experiment.drive}{seed}, {experiment.solver}"


def sentence_of(run: Creep) -> str:
    """Return the outcome of a run, the reason why it ended, and its warnings, in a few words."""
    error = f" ± {run.velocity_error:.2g}" if run.velocity_error > 0 else ""
    velocity = f"mean velocity {run.velocity:.6g} per {run.drive.per}{error}"
    parts = [
        run.sentence,
        velocity if math.isfinite(run.velocity) else "",
        *(f"{PHYSICS[name]} ({count} times)" for name, count in run.warnings.items()),
        f"{run.half_cycles} targets, {run.slip_count} slips, {run.event_count} events",
    ]
    return "; ".join(filter(None, parts)) + "."


def run_data(run: Creep) -> dict[str, Any]:
    """Return the displacements, slips and velocity of a run, ready for JSON."""
    recorded = run.recorded
    half_cycle = recorded["rearrangement_half_cycle"]
    reached = max(run.half_cycles, int(half_cycle.max(initial=1)))
    slips = ("slider", "rearrangement", "displacement")
    law = prediction(run.chain, run.drive, run.experiment.start)
    return {
        "described": description_of(run.experiment),
        "n": run.chain.n,
        "half_cycles": reached,
        "law": [] if law is None else list(law.values),
        "burn_in": min(run.burn_in, reached),
        "when": _packed(times_of(run, recorded, reached)),
        "displacement": _packed(recorded["rearrangement_displacement"]),
        "slip": {name: _packed(recorded[f"slip_{name}"]) for name in slips},
        "sentence": sentence_of(run),
    }


def motion_data(avalanche: RunAvalanche) -> dict[str, Any]:
    """Return a rearrangement at its events and some hundred instants, ready for JSON."""
    motion, chain = avalanche.rearrangement, avalanche.experiment.chain
    events = np.array([float(event.time) for event in motion.events])
    spread = np.linspace(0.0, float(motion.duration), _MOMENTS)
    every = max(1, events.size // (2 * _MOMENTS))
    times = np.unique(np.concatenate([spread, events[::every]]))
    shown = moments_of(motion, times)
    tensions = floats(motion.initial.tensions)
    stretch = np.diff(shown.moved, axis=0) + tensions[:, None]
    bounds = {name: tension_bounds(chain, name) for name in ("mu_d", "mu_s")}
    return {
        "number": avalanche.number,
        "half_cycle": avalanche.half_cycle,
        "theta": as_float(motion.theta),
        "tan_alpha": float(chain.tan_alpha),
        "friction": _packed(frictions_of(FLOAT64, chain)),
        "events": len(motion.events),
        "ended": motion.reason and f"; {motion.reason}",
        "active": np.flatnonzero(shown.moving.any(axis=1)).tolist(),
        "highest": float(max(shown.held.max(), np.abs(shown.forces).max())),
        "tightest": [float(stretch.min(initial=0.0)), float(stretch.max(initial=0.0))],
        "times": _packed(times),
        "moved": _packed(shown.moved.T),
        "velocity": _packed(shown.velocities.T),
        "moving": _packed(shown.moving.T),
        "held": _packed(shown.held.T),
        "force": _packed(shown.forces[:, 0]),
        "tension": _packed(tensions),
        "bounds": {name: [_packed(side) for side in sides] for name, sides in bounds.items()},
    }


def _packed(values: ArrayLike) -> dict[str, str]:
    """Return an array as text; float32 is precise enough for a picture."""
    return {"f4": base64.b64encode(np.asarray(values, "<f4").tobytes()).decode("ascii")}


def page(run: Creep, avalanche: RunAvalanche | None = None, *, framed: bool = False) -> str:
    """Return the page as an HTML text.

    `run` comes from `run_to_draw`; `avalanche` is one of its rearrangements. A `framed` page stands
    inside another page: it has no title, and plays when it opens unless motion is to be reduced.
    """
    data: Mapping[str, Any] = {
        "run": run_data(run),
        "motion": None if avalanche is None else motion_data(avalanche),
        "framed": framed,
    }
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    form = resources.files("exactcreep.figures").joinpath("avalanche_page.html")
    # no text of the data may close the <script> element around it
    return form.read_text("utf-8").replace("{{data}}", text.replace("<", "\\u003c"))
