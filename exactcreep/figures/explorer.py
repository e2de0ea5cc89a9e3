"""The interactive page: change a parameter, see the run, and play any of its rearrangements.

The page is one file that needs no other and no network. `exactcreep explore` serves it with sliders
for the parameters; `exactcreep animate --out FILE.html` writes it with one rearrangement inside.
"""

from __future__ import annotations

import base64
import json
import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from threading import Lock
from typing import Any, NamedTuple
from urllib.parse import parse_qsl, urlsplit

import numpy as np
from numpy.typing import ArrayLike

from exactcreep.figures.animation import RunAvalanche, find_avalanche, moments_of
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import Outcome, behaviour
from exactcreep.quasistatic.creep import PHYSICS, PhysicsWarning, run_members
from exactcreep.quasistatic.experiment import Experiment

HOST = "127.0.0.1"
MOST_EVENTS, MOST_SECONDS, MOST_SLIDERS = 40_000, 1, 200
"""Of an answer that is to be seen at once."""
_MOMENTS = 800  # equally spaced, at which a motion is taken from its closed form; events besides
_ALONE = Lock()  # a thread that silences warnings silences those of all threads


class Control(NamedTuple):
    """A slider of the page; its field takes any number that the model allows.

    A logarithmic one has the exponents of ten.
    """

    name: str
    label: str
    least: float
    most: float
    step: float
    value: str
    logarithmic: bool = False


CONTROLS = (
    Control("n", "sliders N", 2, 100, 1, "30"),
    Control("tan_alpha", "slope tan α", 0, 0.6, 0.005, "0.25"),
    Control("amplitude", "amplitude A", -5, -1.5, 0.01, "0.004", True),
    Control("mu_s", "static friction μ_s", 0, 1, 0.01, "0.6"),
    Control("mu_d", "dynamical friction μ_d", 0, 1, 0.01, "0.5"),
    Control("sigma_mu", "disorder σ_μ", 0, 0.1, 0.002, "0.01"),
    Control("seed", "seed", 0, 100, 1, "0"),
    Control("cycles", "cycles", 2, 200, 1, "10"),
)
"""The sliders of the page, in order."""


def experiment_of(given: Mapping[str, str]) -> Experiment:
    """Return the experiment that the fields of the page ask for; l0 = 1000 as in the paper.

    Raises
    ------
    InputError
        If a field is unknown, or its text is not a number that the model allows.
    """
    values = {control.name: control.value for control in CONTROLS}
    for name, text in given.items():
        if name not in values:
            raise InputError(name, text, "must be one of " + ", ".join(values))
        values[name] = text.strip()
    n = whole_number(values["n"], "n", least=1, most=MOST_SLIDERS)
    friction = (values[name] for name in ("mu_d", "mu_s", "sigma_mu"))
    chain = Chain(n, 1000, *friction, tan_alpha=values["tan_alpha"])
    cycles = whole_number(values["cycles"], "cycles", least=1, most=10_000)
    seed = whole_number(values["seed"], "seed", least=0)
    return Experiment.of(chain, Cycles(values["amplitude"], cycles), seed=seed)


def course(experiment: Experiment) -> dict[str, Any]:
    """Return what a run does, ready for JSON: its displacements, its slips, its velocity.

    It ends after `MOST_EVENTS` events or `MOST_SECONDS` seconds, and says so.

    Raises
    ------
    InputError
        If the solver cannot follow the chain.
    """
    recording = replace(experiment, record=("x_G", "rearrangements", "slip_table"))
    with _ALONE, warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # `told` says it
        (run,) = run_members([recording], limits=Limits.of(MOST_EVENTS, MOST_SECONDS))
    kept, drive = run.recorded, experiment.drive
    half_cycle = kept["rearrangement_half_cycle"]
    reached = max(run.half_cycles, int(half_cycle.max(initial=1)))
    ramps = np.append(experiment.theta, drive.targets(1, reached, experiment.seed))
    passed = floats(kept["rearrangement_theta"]) - ramps[half_cycle - 1]
    span = np.diff(ramps)
    part = passed / np.where(span, span, math.inf)[half_cycle - 1]
    told = f"{behaviour(run.outcome, run.direction)} ({run.evidence.value})"
    if known := math.isfinite(run.velocity):
        told += f", mean velocity {run.velocity:.6g} per {drive.per}"
        told += f" ± {run.velocity_error:.2g}" if run.velocity_error > 0 else ""
    told += f"; {run.reason}" if run.reason else ""
    told += "".join(f"; {PHYSICS[name]} ({count} times)" for name, count in run.warnings.items())
    told += f". {run.half_cycles} targets, {run.slip_count} slips, {run.event_count} events."
    slips = ("slider", "rearrangement", "displacement")
    return {
        "described": f"{experiment.chain}, {drive}, seed {experiment.seed}, {experiment.solver}",
        "n": experiment.chain.n,
        "half_cycles": reached,
        "when": _packed(half_cycle - 1 + np.clip(part, 0, 1)),
        "displacement": _packed(kept["rearrangement_displacement"]),
        "slip": {name: _packed(kept[f"slip_{name}"]) for name in slips},
        "velocity": run.velocity if known else None,
        "told": told,
    }


def avalanche(found: RunAvalanche) -> dict[str, Any]:
    """Return a rearrangement as it moves, ready for JSON.

    Displacements and velocities are those of its closed form, `Rearrangement.sol`, at some hundred
    instants, its events among them; the page joins them by cubics.
    """
    motion = found.rearrangement
    events = np.array([float(event.time) for event in motion.events])
    spread = np.linspace(0.0, float(motion.duration), _MOMENTS)
    every = max(1, events.size // (2 * _MOMENTS))
    times = np.unique(np.concatenate([spread, events[::every]]))
    shown = moments_of(motion, times)
    return {
        "number": found.number,
        "half_cycle": found.half_cycle,
        "theta": as_float(motion.theta),
        "friction": found.experiment.chain.friction,
        "events": len(motion.events),
        "ended": "" if motion.outcome is Outcome.AT_REST else motion.reason,
        "active": np.flatnonzero(shown.moving.any(axis=1)).tolist(),
        "highest": float(max(shown.held.max(), np.abs(shown.forces).max())),
        "times": _packed(times),
        "moved": _packed(shown.moved.T),
        "velocity": _packed(shown.velocities.T),
        "moving": _packed(shown.moving.T),
        "held": _packed(shown.held.T),
        "force": _packed(shown.forces[:, 0]),
    }


def _packed(values: ArrayLike) -> dict[str, str]:
    """Return an array as text: its numbers are to be seen, and float32 is fine enough."""
    return {"f4": base64.b64encode(np.asarray(values, "<f4").tobytes()).decode("ascii")}


def saved(found: RunAvalanche) -> str:
    """Return the page as one file: a run, and one of its rearrangements as it moves."""
    return page(course=course(found.experiment), avalanche=avalanche(found))


def page(**shown: Any) -> str:
    """Return the page, as one HTML text that shows what it is given."""
    text = resources.files("exactcreep.figures").joinpath("explorer.html").read_text("utf-8")
    data = {"controls": [control._asdict() for control in CONTROLS], **shown}
    # no text inside may end the element that holds it
    return text.replace("{{data}}", as_text(data).replace("<", "\\u003c"))


def as_text(data: Mapping[str, Any]) -> str:
    """Return data of the page as JSON."""
    return json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


# --- the server -----------------------------------------------------------------------------------


def answer(what: str, given: Mapping[str, str]) -> str:
    """Return what the page asks its server for, as the text that is sent; "" if it is not known.

    Raises
    ------
    InputError
        If a field holds what the model does not allow, or the answer would take too long.
    """
    if not what:
        return page()
    if what == "course":
        return as_text(course(experiment_of(given)))
    if what not in ("avalanche", "saved"):
        return ""
    fields = dict(given)
    number = whole_number(fields.pop("rearrangement", "0"), "rearrangement", least=0)
    limits = Limits.of(MOST_EVENTS, MOST_SECONDS)
    found = find_avalanche(experiment_of(fields), number, limits)
    return as_text(avalanche(found)) if what == "avalanche" else saved(found)


class _Server(ThreadingHTTPServer):
    """Answers in threads, which keep nothing alive when it ends."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a visitor that has gone in the middle of an answer."""


def page_server(port: int = 0) -> ThreadingHTTPServer:
    """Return a server of the page, which a `with` block closes, or raise `InputError`."""
    try:
        return _Server((HOST, port), _Visit)
    except OSError as error:
        raise InputError("port", port, f"cannot be used: {error.strerror}") from None


class _Visit(BaseHTTPRequestHandler):
    """One question of the page."""

    def do_GET(self) -> None:
        """Answer it."""
        status, text = self._reply()
        kind = {"<": "text/html", "{": "application/json"}.get(text[0], "text/plain")
        body = text.encode()
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def _reply(self) -> tuple[int, str]:
        # a page of somebody else, whose name was made to lead here, or which asks from elsewhere
        asking = [self.headers["Host"] or ""]
        asking += [urlsplit(origin).netloc for origin in self.headers.get_all("Origin", ())]
        if any(name.rpartition(":")[0] not in (HOST, "localhost") for name in asking):
            return 403, "this page is for this machine alone"
        wanted = urlsplit(self.path)
        try:
            text = answer(wanted.path[1:], dict(parse_qsl(wanted.query, keep_blank_values=True)))
        except InputError as error:
            return 400, as_text({"field": error.field, "sentence": str(error)})
        except Exception as error:
            return 500, as_text({"sentence": f"{type(error).__name__}: {error} (a defect)"})
        return (200, text) if text else (404, "there is no such page")

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of every request."""
