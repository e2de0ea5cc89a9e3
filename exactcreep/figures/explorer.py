"""A page to play with: what a run does, seen at once, and each of its rearrangements as it moves.

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
from numpy.typing import ArrayLike, NDArray

from exactcreep import laws
from exactcreep.figures.animation import RunAvalanche, find_avalanche, moments_of
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import as_float, floats
from exactcreep.model.numbers import InputError, nearest_float, whole_number
from exactcreep.model.outcome import Outcome, behaviour
from exactcreep.quasistatic.creep import PHYSICS, PhysicsWarning, run_members
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.studies.fates.fate import fate

MOST_EVENTS = 40_000
"""Of a run that is to be seen at once."""
MOST_SECONDS = 1
FATE_SECONDS = 3
MOST_SLIDERS = 200
_RECORD = ("x_G", "tension", "rearrangements", "slip_table")
_MOMENTS = 800  # equally spaced, at which a motion is taken from its closed form; events besides
_LAW_POINTS = 60
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
    chain = Chain(
        whole_number(values["n"], "n", least=1, most=MOST_SLIDERS),
        1000, values["mu_d"], values["mu_s"], values["sigma_mu"], tan_alpha=values["tan_alpha"],
    )  # fmt: skip
    cycles = whole_number(values["cycles"], "cycles", least=1, most=10_000)
    seed = whole_number(values["seed"], "seed", least=0)
    return Experiment.of(chain, Cycles(values["amplitude"], cycles), seed=seed)


# --- what is shown --------------------------------------------------------------------------------


def course(experiment: Experiment) -> dict[str, Any]:
    """Return what a run does, ready for JSON: where it goes, slips, tensions, velocity, the law.

    It ends after `MOST_EVENTS` events or `MOST_SECONDS` seconds, and says so.

    Raises
    ------
    InputError
        If the solver cannot follow the chain.
    """
    with _ALONE, warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # `told` says it
        limits = Limits.of(MOST_EVENTS, MOST_SECONDS)
        (run,) = run_members([replace(experiment, record=_RECORD)], limits=limits)
    kept = run.recorded
    half_cycle = kept["rearrangement_half_cycle"]
    reached = max(run.half_cycles, int(half_cycle.max(initial=1)))
    targets = experiment.drive.targets(1, reached, experiment.seed)
    ramps = np.append(experiment.theta, targets)
    span = np.diff(ramps)[half_cycle - 1]
    passed = floats(kept["rearrangement_theta"]) - ramps[half_cycle - 1]
    part = np.divide(passed, span, out=np.zeros_like(passed), where=span != 0)
    return {
        "described": f"{experiment.chain}, {experiment.drive}, seed {experiment.seed},"
        f" {experiment.solver}",
        "n": experiment.chain.n,
        "half_cycles": run.half_cycles,
        "when": _packed(half_cycle - 1 + np.clip(part, 0, 1)),
        "displacement": _packed(floats(kept["rearrangement_displacement"])),
        "slip": {
            name: _packed(floats(kept[f"slip_{name}"]))
            for name in ("slider", "rearrangement", "displacement")
        },
        "tension": _packed(floats(kept["tension"])),
        "velocity": run.velocity if math.isfinite(run.velocity) else None,
        "told": _told(run),
        "law": _law(experiment),
    }


def avalanche(found: RunAvalanche) -> dict[str, Any]:
    """Return a rearrangement as it moves, ready for JSON.

    Displacements and velocities are those of its closed form, `Rearrangement.sol`, at some hundred
    instants, its events among them; the page joins them by cubics.
    """
    motion = found.rearrangement
    chain = found.experiment.chain
    events = np.array([float(event.time) for event in motion.events])
    spread = np.linspace(0.0, float(motion.duration), _MOMENTS)
    every = max(1, events.size // (2 * _MOMENTS))
    times = np.unique(np.concatenate([spread, events[::every]]))
    shown = moments_of(motion, times)
    return {
        "number": found.number,
        "half_cycle": found.half_cycle,
        "theta": as_float(motion.theta),
        "friction": chain.friction,
        "ended": "" if motion.outcome is Outcome.AT_REST else motion.reason,
        "times": _packed(times),
        "moved": _packed(shown.moved.T),
        "velocity": _packed(shown.velocities.T),
        "moving": _packed(shown.moving.T),
        "held": _packed(shown.held.T),
        "force": _packed(shown.forces[:, 0]),
        "events": [
            [float(event.time), event.kind.value, list(event.sliders), list(event.signs)]
            for event in motion.events
        ],
    }


def fate_told(experiment: Experiment) -> str:
    """Return what the chain does in the end, as far as float64 tells, in one line."""
    drive, chain = experiment.drive, experiment.chain
    if not isinstance(drive, Cycles):
        return "Only under cycles does a chain settle."
    if chain.sigma_mu:
        return "With disorder no tension ever returns: the chain does not settle unless it rests."
    try:
        found = fate(chain, drive.amplitude, start=experiment.start, solver="exact",
                     max_seconds=FATE_SECONDS)  # fmt: skip
    except InputError as error:
        return str(error)
    told = f"{found.outcome.value} ({found.evidence.value})"
    if found.period is None:
        told += f" after {found.cycles} cycles"
    else:
        told += f": settled after {found.settled_after} cycles, period {found.period}"
        if found.advance:
            told += f", advance {found.advance:.6g} per period, {found.direction}"
    return told + (f"; {found.reason}" if found.reason else "")


def answer(what: str, given: Mapping[str, str]) -> str | None:
    """Return what the page asks its server for, as the text that is sent; None: nothing known.

    Raises
    ------
    InputError
        If a field holds what the model does not allow.
    """
    if not what:
        return page()
    if what in ("course", "fate"):
        experiment = experiment_of(given)
        return as_text(course(experiment) if what == "course" else {"told": fate_told(experiment)})
    if what not in ("avalanche", "saved"):
        return None
    fields = dict(given)
    number = whole_number(fields.pop("rearrangement", "0"), "rearrangement", least=0)
    found = find_avalanche(experiment_of(fields), number)
    return as_text(avalanche(found)) if what == "avalanche" else saved(found)


def saved(found: RunAvalanche) -> str:
    """Return the page as one file: a run, and one of its rearrangements as it moves."""
    return page(
        course=course(found.experiment),
        avalanche=avalanche(found),
        fate=fate_told(found.experiment),
    )


def page(**shown: Any) -> str:
    """Return the page, as one HTML text that shows what it is given."""
    text = resources.files("exactcreep.figures").joinpath("explorer.html").read_text("utf-8")
    data = {"controls": [control._asdict() for control in CONTROLS], **shown}
    # no text inside may end the element that holds it
    return text.replace("{{data}}", as_text(data).replace("<", "\\u003c"))


def as_text(data: Mapping[str, Any]) -> str:
    """Return data of the page as JSON."""
    return json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


# --- parts ----------------------------------------------------------------------------------------


def _packed(values: ArrayLike) -> dict[str, str]:
    """Return an array as text: its numbers are to be seen, and float32 is fine enough."""
    array: NDArray[Any] = np.asarray(values)
    array = array.astype("u1" if array.dtype == bool else "<f4")
    return {"type": array.dtype.str[1:], "data": base64.b64encode(array.tobytes()).decode("ascii")}


def _told(run: Creep) -> str:
    """Return what a run came to, in one line."""
    told = f"{behaviour(run.outcome, run.direction)} ({run.evidence.value})"
    if math.isfinite(run.velocity):
        told += f", mean velocity {run.velocity:.6g} per {run.experiment.drive.per}"
        if run.velocity_error > 0:
            told += f" ± {run.velocity_error:.2g}"
    if run.reason:
        told += f"; {run.reason}"
    told += "".join(f"; {PHYSICS[name]} ({count} times)" for name, count in run.warnings.items())
    return f"{told}. {run.half_cycles} targets, {run.slip_count} slips, {run.event_count} events."


def _law(experiment: Experiment) -> dict[str, Any] | None:
    """Return the law's velocity over the amplitude, None where theory has none."""
    chain, drive = experiment.chain, experiment.drive
    if not isinstance(drive, Cycles):
        return None
    threshold = float(chain.n * (abs(chain.mu_d) - abs(chain.tan_alpha)) / (2 * chain.l0))
    here = nearest_float(drive.amplitude)
    amplitudes = np.linspace(0, max(1.25 * here, 2 * threshold, 1e-9), _LAW_POINTS + 1)[1:]
    every = [laws.prediction(chain, Cycles(a, 1), experiment.start) for a in amplitudes.tolist()]
    told = [one for one in every if one is not None]
    if len(told) < len(every):
        return None
    steps: list[tuple[float, ...]] = [
        () if one.staircase is None else (one.staircase,) for one in told
    ]
    values = {"printed": [one.printed for one in told], "staircase": steps}
    # what is printed holds from the threshold on
    bound = max if chain.tan_alpha >= 0 else min
    curves = {
        name: [[bound(value, 0.0) for value in line] for line in zip(*rows, strict=True)]
        for name, rows in values.items()
    }
    return {"amplitude": here, "amplitudes": amplitudes.tolist(), "curves": curves}


# --- the server -----------------------------------------------------------------------------------

HOST = "127.0.0.1"
_KINDS = {"<": "text/html", "{": "application/json"}  # by how a text begins


def page_server(port: int = 0) -> ThreadingHTTPServer:
    """Return a server of the page, which a `with` block closes.

    Raises
    ------
    InputError
        If the port is taken, or not allowed.
    """
    try:
        server = ThreadingHTTPServer((HOST, port), _Visit)
    except OSError as error:
        raise InputError("port", port, f"cannot be used: {error.strerror}") from None
    server.daemon_threads = True  # an answer that is being computed keeps nothing alive
    return server


class _Visit(BaseHTTPRequestHandler):
    """One question of the page."""

    def reply(self) -> None:
        """Answer it."""
        if (self.headers["Host"] or "").rpartition(":")[0] not in (HOST, "localhost"):
            # a page of somebody else, whose name was made to lead here
            self._answer(403, "this page is for this machine alone")
            return
        asked = urlsplit(self.path)
        given = dict(parse_qsl(asked.query, keep_blank_values=True))
        try:
            text = answer(asked.path.removeprefix("/"), given)
            self._answer(404 if text is None else 200, text or "there is no such page")
        except InputError as error:
            told = {"field": error.field, "sentence": str(error)}
            self._answer(400, as_text(told))
        except (BrokenPipeError, ConnectionResetError):
            pass  # the reader has gone
        except Exception as error:
            told = {"sentence": f"{type(error).__name__}: {error} (a defect)"}
            self._answer(500, as_text(told))

    do_GET = reply  # the name by which the library calls it

    def _answer(self, status: int, text: str) -> None:
        body, kind = text.encode(), _KINDS.get(text[:1], "text/plain")
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of every request."""
