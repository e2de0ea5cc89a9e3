"""The interactive page: change a parameter, see the run, and play any of its rearrangements.

The page is one file that needs no other and no network. `exactcreep explore` serves it with sliders
for the parameters; `exactcreep animate --out FILE.html` writes it with one rearrangement inside.
"""

from __future__ import annotations

import base64
import json
import math
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from http import HTTPStatus
from importlib import resources
from socketserver import ThreadingMixIn
from threading import Lock
from typing import Any, NamedTuple
from urllib.parse import parse_qsl, urlsplit
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

import numpy as np
from numpy.typing import ArrayLike

from exactcreep.figures.animation import RunAvalanche, find_avalanche, moments_of
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import behaviour
from exactcreep.quasistatic.creep import PHYSICS, PhysicsWarning, run_members
from exactcreep.quasistatic.experiment import Experiment

HOST = "127.0.0.1"
MOST_EVENTS, MOST_SECONDS, MOST_SLIDERS = 40_000, 1, 200
"""Of an answer that is to be seen at once."""
_MOMENTS = 800  # equally spaced, at which a motion is taken from its closed form; events besides
_ALONE = Lock()  # a thread that silences warnings silences those of all threads


class Control(NamedTuple):
    """A slider, of exponents of ten if it is logarithmic, and its field, which takes any number."""

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

    A field that is unknown, or holds what the model does not allow, is an `InputError`.
    """
    values = {each.name: given.get(each.name, each.value).strip() for each in CONTROLS}
    for name in given.keys() - values.keys():
        raise InputError(name, given[name], "must be one of " + ", ".join(values))
    n = whole_number(values.pop("n"), "n", least=1, most=MOST_SLIDERS)
    cycles = whole_number(values.pop("cycles"), "cycles", least=1, most=10_000)
    seed = whole_number(values.pop("seed"), "seed", least=0)
    drive = Cycles(values.pop("amplitude"), cycles)
    return Experiment(Chain(n, 1000, **values), drive, seed=seed)


def course(experiment: Experiment) -> dict[str, Any]:
    """Return what a run does, ready for JSON: its displacements, its slips, its velocity.

    It ends after `MOST_EVENTS` events or `MOST_SECONDS` seconds, and says so.
    """
    recording = replace(experiment, record=("x_G", "rearrangements", "slip_table"))
    with _ALONE, warnings.catch_warnings(action="ignore", category=PhysicsWarning):  # it is told
        (run,) = run_members([recording], limits=Limits.of(MOST_EVENTS, MOST_SECONDS))
    kept, drive = run.recorded, experiment.drive
    half_cycle = kept["rearrangement_half_cycle"]
    reached = max(run.half_cycles, int(half_cycle.max(initial=1)))
    ramps = np.append(experiment.theta, drive.targets(1, reached, experiment.seed))
    passed = floats(kept["rearrangement_theta"]) - ramps[half_cycle - 1]
    span = np.where(np.diff(ramps) == 0, math.inf, np.diff(ramps))[half_cycle - 1]
    error = f" ± {run.velocity_error:.2g}" if run.velocity_error > 0 else ""
    velocity = f"mean velocity {run.velocity:.6g} per {drive.per}{error}"
    told = [
        f"{behaviour(run.outcome, run.direction)} ({run.evidence.value})",
        velocity if math.isfinite(run.velocity) else "",
        run.reason,
        *(f"{PHYSICS[name]} ({count} times)" for name, count in run.warnings.items()),
        f"{run.half_cycles} targets, {run.slip_count} slips, {run.event_count} events",
    ]
    slips = ("slider", "rearrangement", "displacement")
    return {
        "described": f"{experiment.chain}, {drive}, seed {experiment.seed}, {experiment.solver}",
        "n": experiment.chain.n,
        "half_cycles": reached,
        "when": _packed(half_cycle - 1 + np.clip(passed / span, 0, 1)),
        "displacement": _packed(kept["rearrangement_displacement"]),
        "slip": {name: _packed(kept[f"slip_{name}"]) for name in slips},
        "told": "; ".join(filter(None, told)) + ".",
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
        "ended": motion.reason and f"; {motion.reason}",
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

    "data" is the run, or one of its rearrangements; "saved" is a page that holds both. What the
    model does not allow, or takes too long, is an `InputError`.
    """
    if not what:
        return page()
    if what not in ("data", "saved"):
        return ""
    fields = dict(given)
    shown, asked = dict[str, Any](), fields.pop("rearrangement", None)
    experiment = experiment_of(fields)
    if asked is not None:
        number = whole_number(asked, "rearrangement", least=0)
        found = find_avalanche(experiment, number, Limits.of(MOST_EVENTS, MOST_SECONDS))
        shown["avalanche"] = avalanche(found)
    if asked is None or what == "saved":
        shown["course"] = course(experiment)
    return page(**shown) if what == "saved" else as_text(shown)


class _Server(ThreadingMixIn, WSGIServer):
    """Answers in threads, which keep nothing alive when it ends."""

    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a visitor that has gone in the middle of an answer."""


class _Quiet(WSGIRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of every request."""


def page_server(port: int = 0) -> WSGIServer:
    """Return a server of the page, which a `with` block closes, or raise `InputError`."""
    try:
        return make_server(HOST, port, _visit, _Server, _Quiet)
    except OSError as error:
        raise InputError("port", port, f"cannot be used: {error.strerror}") from None


def _visit(asked: Mapping[str, Any], start: Callable[..., Any]) -> list[bytes]:
    """Answer one question of the page: a WSGI application."""
    # not a page of somebody else, whose name was made to lead here, or which asks from elsewhere
    names = asked.get("HTTP_HOST", ""), urlsplit(asked.get("HTTP_ORIGIN", f"//{HOST}:0")).netloc
    own = all(re.fullmatch(r"(127\.0\.0\.1|localhost):\d+", name) for name in names)
    text, status = "", HTTPStatus.NOT_FOUND if own else HTTPStatus.FORBIDDEN
    refused = {"sentence": "there is no such page, or it is for this machine alone"}
    try:
        given = dict(parse_qsl(asked["QUERY_STRING"], keep_blank_values=True))
        text = answer(asked["PATH_INFO"][1:], given) if own else ""
    except InputError as error:
        status, refused = HTTPStatus.BAD_REQUEST, {"field": error.field, "sentence": str(error)}
    except Exception as error:
        status = HTTPStatus.INTERNAL_SERVER_ERROR
        refused = {"sentence": f"{type(error).__name__}: {error} (a defect)"}
    kind = "text/html" if text.startswith("<") else "application/json"
    about = [("Content-Type", f"{kind}; charset=utf-8"), ("Cache-Control", "no-store")]
    start("200 OK" if text else f"{status.value} {status.phrase}", about)
    return [(text or as_text(refused)).encode()]
