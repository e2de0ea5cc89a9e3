"""Compare solvers with a more accurate solver, under the same disorder.

The drive gets additional targets between rearrangements, so that positions can be compared after
each rearrangement. `comparison` evaluates the dataset.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.enclosure import enclosure
from exactcreep.model.keyed_disorder import valid_seed
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Outcome
from exactcreep.model.path import Path
from exactcreep.quasistatic.creep import Interrupted, PhysicsWarning, creep
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.interface import require_slips
from exactcreep.solvers.tables import LENGTH, NUMBER
from exactcreep.studies.event_log import LoggedEvent
from exactcreep.studies.trajectory import (
    MOST_EVENTS,
    Method,
    Trajectory,
    agree,
    beyond,
    drive_with_rests,
    trajectory,
)
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits
from exactcreep.watch.preparation import clock
from exactcreep.watch.progress import Hearer, reporter

TIME_STEPS = ("0.1", "0.03", "0.01")
"""Time steps of Verlet, unless methods are named."""
DIGITS = 30
"""Digits of the certified solver, unless a truth is named."""
VELOCITY_EVENTS = 100_000
"""Events of the run of `exact` that measures a velocity; others run as many half-cycles."""
COMPILED = ("exact", "sliding", "verlet")
"""Solvers that are fast enough to measure a velocity; for others only the time is measured."""

_LONG = "largest distance of a slider's position from the true one"
_VARIABLES: dict[str, tuple[Any, str, str]] = {
    "agreed": (math.nan, NUMBER, "events before the first that differs, or all compared"),
    "differs": (False, NUMBER, "whether an event differs"),
    "own_event": ("", "", "the method's first event that differs"),
    "true_event": ("", "", "the true event in its place"),
    "rests": (0, NUMBER, "rests before the first event that differs"),
    "error": (math.nan, LENGTH, f"{_LONG}, at these rests"),
    "error_after": (math.nan, LENGTH, f"{_LONG}, at any rest"),
    "velocity": (math.nan, LENGTH, "mean displacement of x_G, as of `creep`"),
    "velocity_error": (math.nan, LENGTH, "standard error of the velocity"),
    "bias": (math.nan, LENGTH, "velocity minus the velocity of exact with the same disorder"),
    "half_cycles": (0, NUMBER, "targets that the velocity was measured over"),
    "outcome": ("", "", "of the run for the velocity"),
    "evidence": ("", "", "of the events that were compared"),
    "seconds": (math.nan, "s", "wall time per half-cycle, without compilation"),
}
"""The columns of each method and seed: value if missing, unit, meaning."""


@shows_progress
def compare(
    experiment: Experiment,
    methods: Sequence[Method] | None = None,
    *,
    truth: Method | None = None,
    seeds: int | Sequence[int] | None = None,
    events: int | None = None,
    progress: Hearer = None,
) -> xr.Dataset:
    """Compare solvers and time steps with the true events, for every seed, with the same disorder.

    Parameters
    ----------
    experiment : Experiment
        Chain, drive and start. Its solver and record are ignored.
    methods : sequence of Method, optional
        Default: `exact`, `certified`, Verlet with steps 0.1, 0.03 and 0.01 and with and without
        located events, and the sliding limit. Without slips (mu_s = mu_d): only `sliding`.
    truth : Method, optional
        Method whose events count as true. Default: `certified` with 30 digits.
    seeds : int or sequence of int, optional
        A list, or a number of seeds that starts at the experiment's own. Default: by the number of
        sliders, and 1 if nothing is random.
    events : int, optional
        Approximate number of true events to compare for each seed; the drive may end earlier.
        Default: by the number of sliders.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.

    Returns
    -------
    Dataset
        Over ``method`` and ``seed``: ``agreed`` events, whether an event ``differs`` and which
        (``own_event``, ``true_event``), the number of ``rests`` before it and the largest ``error``
        of a position at them, ``velocity``, its ``bias`` against `exact`, ``half_cycles``, and
        ``seconds`` per half-cycle. Along ``rest``: ``errors``, the largest after each
        rearrangement. Over ``seed``: ``events`` compared, and ``truth_evidence``.

    Raises
    ------
    InputError
        If an argument is out of range, no slider moves, or the first rearrangement never ends or
        is too long for the truth.
    Interrupted
        After Ctrl-C; `partial` is the dataset of the finished seeds.

    Notes
    -----
    Guarantee: events agree if their kind, sliders, directions and order agree; times may differ.
    Where ``truth_evidence`` is ``proved``, the events of the certified truth solve the equations.
    Velocities come from `creep`, with its burn-in, over the whole drive or the half-cycles of the
    first 100 000 events of `exact`; nan if there are none.

    Examples
    --------
    >>> given = Experiment(pair, Cycles("0.001", 5))
    >>> data = compare(given, [Method("exact"), Method("verlet", dt="0.1")], events=20)
    >>> data.agreed.values.tolist()
    [[20.0], [20.0]]
    """
    if not isinstance(experiment, Experiment):
        raise InputError("experiment", experiment, "must be an Experiment, e.g. Experiment(...)")
    chain = experiment.chain
    chosen = ladder(chain) if methods is None else _valid(methods)
    best = _best(chain) if truth is None else _valid([truth])[0]
    few = 300 if chain.n <= 30 else 100  # take `certified` some seconds
    most = whole_number(few if events is None else events, "events", least=1, most=MOST_EVENTS)
    members = _members(experiment, seeds)
    say, done, total = reporter(progress), count(), len(members) * (len(chosen) + 2)
    rows: list[xr.Dataset] = []

    def dataset() -> xr.Dataset:
        about = plain_data(chain.parameters()) | {"drive": experiment.drive.kind}
        how: Any = {"data_vars": "all", "coords": "minimal", "compat": "override"}
        data = xr.concat(rows, "seed", join="outer", **how).transpose("method", "seed", "rest")
        named = [member.seed for member in members[: len(rows)]]
        kind = np.uint64 if max(named) >= 2**63 else np.int64
        data = data.assign_coords(seed=np.array(named, kind))
        return data.assign_attrs(about, truth=best.label, events=most)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the user's own run will warn
        try:
            for member in members:

                def step(text: str, seed: int = member.seed) -> None:
                    say("comparing", next(done), total, "runs", text=f"seed {seed}, {text}")

                rows.append(_compared(member, chosen, best, most, step))
        except KeyboardInterrupt:
            if not rows:
                raise
            raise Interrupted(dataset()) from None
    return dataset()


def ladder(
    chain: Chain, time_steps: Sequence[Any] = TIME_STEPS, best: Method | None = None
) -> list[Method]:
    """Return the methods that can follow a chain; without slips only the sliding limit."""
    if _only_slides(chain):
        return [Method("sliding")]
    plain = [Method("verlet", dt=dt) for dt in time_steps]
    located = [Method("verlet", dt=dt, locate=True) for dt in time_steps]
    sliding = [] if chain.may_run_away else [Method("sliding")]
    return [Method("exact"), best or _best(chain), *plain, *located, *sliding]


def _best(chain: Chain) -> Method:
    return Method("sliding") if _only_slides(chain) else Method("certified", digits=DIGITS)


def _only_slides(chain: Chain) -> bool:
    """Return whether only `sliding` follows a chain; raise `InputError` if no solver does."""
    if chain.slides and chain.mu_s != chain.mu_d:
        require_slips(chain, chain.rates)
    return chain.slides


def _members(experiment: Experiment, seeds: Any) -> list[Experiment]:
    """Return one experiment for each seed: seeds are a list, or counted from the experiment's."""
    random = experiment.chain.sigma_mu != 0 or experiment.drive.random
    if seeds is None:
        seeds = 4 if random and experiment.chain.n <= 30 else 1
    if isinstance(seeds, (list, tuple, range)):
        named = [valid_seed(seed) for seed in seeds]
    else:
        many = range(whole_number(seeds, "seeds", least=1, most=100_000))
        named = [(experiment.seed + k) % 2**64 for k in many]
    if not named or len(set(named)) < len(named):
        raise InputError("seeds", seeds, "must be one seed at least, and none twice")
    if len(named) > 1 and not random:
        allowed = "must not be given: without disorder and random dilations all runs are the same"
        raise InputError("seeds", seeds, allowed)
    return [replace(experiment, seed=seed) for seed in named]


def _valid(methods: Any) -> list[Method]:
    if not isinstance(methods, Sequence) or not methods:
        raise InputError("methods", methods, 'must be a list of methods, e.g. [Method("exact")]')
    for method in methods:
        if not isinstance(method, Method):
            raise InputError("methods", method, 'must be a Method, e.g. Method("verlet", dt=0.01)')
        method.algorithm()
    labels = [method.label for method in methods]
    if len(set(labels)) < len(labels):
        raise InputError("methods", labels, "must not name a method twice")
    return list(methods)


def _compared(
    member: Experiment,
    methods: Sequence[Method],
    truth: Method,
    events: int,
    step: Callable[[str], None],
) -> xr.Dataset:
    step(f"{truth.label}: the truth")
    broken, ends, enough = member, list[int](), math.inf
    targets, slides = min(member.drive.half_cycles, events), member.chain.slides
    if not slides:
        path, ends = drive_with_rests(member, events)
        broken, enough, targets = replace(member, drive=path), events, path.half_cycles

    def followed(method: Method, until: int, most: int | None, enough: float = math.inf) -> Any:
        begin = clock()
        own = trajectory(method, broken, until, enough=enough, limits=Limits(most))
        return own, clock() - begin

    true = followed(truth, targets, beyond(MOST_EVENTS), enough)
    true_run: Trajectory = true[0]
    if true_run.reached == 0:
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    usual = Method("sliding" if slides else "exact")
    step(f"{usual.solver}: mean velocity")
    best, shorter = _velocity_run(usual, member, VELOCITY_EVENTS), member
    limited = best.half_cycles < member.drive.half_cycles and best.outcome is Outcome.LIMIT
    has_velocity = not limited or best.half_cycles > 0
    if limited and has_velocity:
        shorter = replace(member, drive=shortened(member.drive, best.half_cycles))
        best = _velocity_run(usual, shorter, 2 * VELOCITY_EVENTS)
    rows: list[dict[str, Any]] = []
    for method in methods:
        step(method.label)
        most = beyond(len(true_run.events)) if true_run.events else None
        own, seconds = true if method == truth else followed(method, true_run.reached, most)
        row = _agreement(own, true_run, ends)
        if method.solver in COMPILED and has_velocity:
            row |= _of_velocity(method, shorter, best)
        elif own.events:
            pace = best.event_count / max(best.half_cycles, 1)
            row["seconds"] = seconds / len(own.events) * pace
        rows.append(row)
    return _dataset(methods, rows, true_run)


def _agreement(own: Trajectory, true_run: Trajectory, ends: Sequence[int]) -> dict[str, Any]:
    """Return how far a trajectory agrees with the truth, and its errors at all rests."""
    agreement, row = agree(own, true_run), dict[str, Any](evidence=own.evidence.value)
    row |= {"errors": agreement.errors, "rests": agreement.errors.size}
    if own.log:  # without events none can differ
        row |= {
            "agreed": agreement.agreed,
            "differs": agreement.differs,
            "rests": agreement.compared,
        }
    if row.get("differs"):
        row |= {"own_event": _text(agreement.own, ends), "true_event": _text(agreement.known, ends)}
    largest = {"error": agreement.errors[: row["rests"]], "error_after": agreement.errors}
    return row | {name: part.max() for name, part in largest.items() if part.size}


def _velocity_run(method: Method, experiment: Experiment, most: int | None = None) -> Creep:
    return creep(
        experiment.chain, experiment.drive, seed=experiment.seed, start=experiment.start,
        burn_in=experiment.burn_in, solver=method.solver, record=(), max_events=most,
        progress=False, **method.options,
    )  # fmt: skip


def _of_velocity(method: Method, experiment: Experiment, best: Creep) -> dict[str, Any]:
    run = best if method.solver == best.solver else _velocity_run(method, experiment)
    known = {name: getattr(run, name) for name in ("half_cycles", "velocity", "velocity_error")}
    known |= {"outcome": run.outcome.value, "seconds": run.seconds / max(run.half_cycles, 1)}
    same = best.half_cycles == run.half_cycles
    return known | ({"bias": run.velocity - best.velocity} if same else {})


def shortened(drive: Drive, targets: int) -> Drive:
    """Return a drive of the first targets, at least one (for cycles: one whole cycle)."""
    targets = min(max(targets, 1), drive.half_cycles)
    if isinstance(drive, Cycles):
        return Cycles(drive.amplitude, max(targets // 2, 1))
    if isinstance(drive, GaussianSteps):
        return GaussianSteps(drive.sigma_theta, targets)
    return Path([drive.exact_target(q) for q in range(1, targets + 1)])


def _text(event: LoggedEvent | None, ends: Sequence[int]) -> str:
    if event is None:
        return "no further event"
    kind, sliders, _ = event.event.signature
    who = ", ".join(map(str, sliders))
    return f"{kind} {who} in half-cycle {ends[event.half_cycle - 1]}"


def _dataset(
    methods: Sequence[Method], rows: Sequence[dict[str, Any]], true_run: Trajectory
) -> xr.Dataset:
    variables: dict[str, Any] = {}
    for name, (missing, unit, meaning) in _VARIABLES.items():
        values = np.array([row.get(name, missing) for row in rows], dtype=type(missing))
        about = {"long_name": meaning} | ({"units": unit} if unit else {})
        variables[name] = ("method", values, about)
    by_method = [pd.Series(row["errors"], dtype=float) for row in rows]
    errors = pd.DataFrame(by_method).to_numpy(dtype=float)
    about = {"units": LENGTH, "long_name": f"{_LONG}, after each rearrangement"}
    variables["errors"] = (("method", "rest"), errors, about)
    radii = [enclosure(value).radius for value in true_run.x.ravel().tolist()]
    variables["events"] = sum(event.half_cycle <= true_run.reached for event in true_run.events)
    variables["truth_evidence"] = true_run.evidence.value
    variables["truth_radius"] = nearest_float(max(radii))
    dt = [nearest_float(exact_number(method.options.get("dt") or 0, "dt")) for method in methods]
    coords = {
        "method": [method.label for method in methods],
        "solver": ("method", [method.solver for method in methods]),
        "dt": ("method", [step or math.nan for step in dt],
               {"units": "tau_dyn", "long_name": "time step"}),
        "locate": ("method", [bool(method.options.get("locate")) for method in methods]),
        "rest": np.arange(1, errors.shape[1] + 1),
    }  # fmt: skip
    return xr.Dataset(variables, coords)
