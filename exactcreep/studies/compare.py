"""Measure what accuracy costs: the events, errors and times of solvers under the same disorder.

A method is the experiment with another solver. The true events are certified. Positions are
compared after each rearrangement, as sums of slips; the sliding limit, which has no slips, is
compared with `exact` at the targets. Times are processor times of repetitions in which the methods
take turns. `comparison` evaluates the dataset.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import count, zip_longest
from time import process_time
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from exactcreep.model.enclosure import enclosure
from exactcreep.model.keyed_disorder import valid_seed
from exactcreep.model.numbers import InputError, nearest_float, plain_data, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.remarks import PhysicsWarning
from exactcreep.motion.arithmetic import BITS_PER_DIGIT
from exactcreep.quasistatic.creep import Interrupted
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.statistics import standard_error
from exactcreep.solvers.interface import compile_for, require_slips, simulate
from exactcreep.solvers.tables import LENGTH, NUMBER, logged_events
from exactcreep.studies.needs import needs
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from exactcreep.watch.progress import Hearer, reporter

TIME_STEPS = ("0.1", "0.03", "0.01", "0.003")
"""Time steps of Verlet, unless methods are named."""
DIGITS = (20, 100)
"""Digits of the certified solver, unless methods are named."""
REPETITIONS = 5
"""Least repetitions whose median is a time, and the usual number of seeds."""
MOST_EVENTS = 100_000
"""Most certified events that are compared: some minutes of the certified solver."""
_MOST_SLIDERS = 30  # up to which several seeds and many events take seconds
_VELOCITY_EVENTS = 600_000  # over the sliders: events of `exact` over which a velocity is measured
_TIMED_EVENTS = 20_000  # least events of a repetition
_WARM = 50  # events of a run that is not timed
_COMPILED = ("exact", "sliding", "verlet")  # fast enough to measure a velocity
_ERROR = "largest error of a position at the rests before the first"
_NOTHING = np.empty(0)
_OF_TRUTH = ("events", "half_cycles", "truth_evidence")
_OF_SEEDS = {
    "agreed": (NUMBER, "events before the first wrong event"),
    "differs": (NUMBER, "whether an event is wrong"),
    "wrong": ("", "the first wrong event"),
    "rests": (NUMBER, "rests before the first wrong event"),
    "error": (LENGTH, f"{_ERROR} wrong event"),
    "shared_error": (LENGTH, f"{_ERROR} wrong event of any method"),
    "velocity": (LENGTH, "mean displacement of x_G after the burn-in"),
    "evidence": ("", "of the events that were compared"),
}
"""Units and meanings of the variables of each method and seed."""
_METHODS = 'must be experiments with other solvers: [replace(experiment, solver="exact"), ...]'


class Track(NamedTuple):
    """The events of a method, each with its place, and the moves between its rests.

    `moved`: middles and radii of the displacements of each slider in each rearrangement, (2, rests,
    n); without events, between targets. `done`: whether the drive has ended.
    """

    events: list[tuple[Any, ...]]
    moved: NDArray[Any]
    done: bool
    evidence: Evidence


@shows_progress
def compare(
    experiment: Experiment,
    methods: Sequence[Experiment] | None = None,
    *,
    seeds: int | Sequence[int] | None = None,
    events: int | None = None,
    progress: Hearer = None,
) -> xr.Dataset:
    """Compare the events, errors, velocities and times of solvers, with the same disorder.

    Parameters
    ----------
    experiment : Experiment
        Chain, drive and start. Its solver and record are ignored.
    methods : sequence of Experiment, optional
        The experiment with other solvers: ``replace(experiment, solver=..., options=...)``.
        Default: `exact`, `certified` with 20 and 100 digits, Verlet with steps 0.1, 0.03, 0.01 and
        0.003, and the sliding limit. Without slips (mu_s = mu_d): only `sliding`.
    seeds : int or sequence of int, optional
        A list, or a number of seeds that starts at the experiment's own. Default: 5 for up to 30
        sliders, else 1; and 1 if nothing is random.
    events : int, optional
        Number of true events to compare for each seed; the drive may end earlier. Default: 300 for
        up to 30 sliders, else 100.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.

    Returns
    -------
    Dataset
        Over ``method`` and ``seed``: ``agreed`` events before the first wrong event, whether an
        event ``differs`` and which (``wrong``), the number of ``rests`` before it, the largest
        ``error`` of a position at them (proved for `certified`), and at the rests before a wrong
        event of any method (``shared_error``), ``velocity`` and ``evidence``. Over ``method`` and
        ``repetition``: processor ``seconds`` per half-cycle. Over ``method``: ``bias`` of the
        velocity relative to `exact`, with ``bias_error`` (95 %). Over ``seed``: ``events``
        compared, ``half_cycles`` of the velocity, and ``truth_evidence``. The attributes say what
        the scene ``needs``.

    Raises
    ------
    InputError
        If an argument is out of range, or no slider moves.
    Interrupted
        After Ctrl-C; `partial` is the dataset of the finished seeds.

    Notes
    -----
    Guarantee: events agree if their kind, sliders, directions and order agree; times may differ.
    The true events are those of `certified` with the most digits. Where ``truth_evidence`` is
    ``proved``, they solve the equations. Velocities are of the whole drive, or of the half-cycles
    of the first 100 000 events (less for more than six sliders) of `exact`.

    Examples
    --------
    >>> from dataclasses import replace
    >>> given = Experiment(pair, Cycles("0.001", 5))
    >>> verlet = replace(given, solver="verlet", options={"dt": "0.1"})
    >>> compare(given, [given, verlet], events=20).agreed.values.tolist()
    [[20], [20]]
    """
    if not isinstance(experiment, Experiment):
        raise InputError("experiment", experiment, "must be an Experiment, e.g. Experiment(...)")
    chosen = ladder(experiment) if methods is None else _valid(methods, experiment)
    if events is None:
        events = 300 if experiment.chain.n <= _MOST_SLIDERS else 100
    most = whole_number(events, "events", least=1, most=MOST_EVENTS)
    own, say, done = _seeds(experiment, seeds), reporter(progress), count()
    rounds = max(len(own), REPETITIONS)
    total = rounds * (len(chosen) + 1)
    found: list[dict[str, Any]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the user's own run will warn
        try:
            for k in range(rounds):
                seed = own[k % len(own)]

                def step(text: str, seed: int = seed) -> None:
                    say("comparing", next(done), total, "runs", text=f"seed {seed}, {text}")

                given = [replace(each, seed=seed, record=()) for each in chosen]
                found.append(_measured(given, most, step))
        except KeyboardInterrupt:
            if not found:
                raise
            raise Interrupted(_dataset(experiment, chosen, own[: len(found)], found)) from None
    return _dataset(experiment, chosen, own, found)


def ladder(
    experiment: Experiment, time_steps: Sequence[Any] = TIME_STEPS, digits: Sequence[Any] = DIGITS
) -> list[Experiment]:
    """Return the methods that can follow an experiment; without slips only the sliding limit."""
    chain, sliding = experiment.chain, replace(experiment, solver="sliding", options={})
    if chain.slides:
        if chain.mu_s != chain.mu_d:
            require_slips(chain, chain.rates)
        return [sliding]
    wanted = [("exact", {}), *(("certified", {"digits": each}) for each in digits)]
    wanted += [("verlet", {"dt": dt}) for dt in time_steps]
    found = [replace(experiment, solver=solver, options=own) for solver, own in wanted]
    return _valid([*found, *([] if chain.may_run_away else [sliding])], experiment)


def label(method: Experiment) -> str:
    """Return the name of a method in tables and pictures: its solver and options."""
    forms = {"digits": "{1} digits", "locate": "located"}
    options = [(name, value) for name, value in method.options.items() if value]
    words = [forms.get(name, "{0} = {1}").format(name, value) for name, value in options]
    return ", ".join([method.solver, *words])


def _valid(methods: Any, experiment: Experiment) -> list[Experiment]:
    given = list(methods) if isinstance(methods, Sequence) else []
    if not given or not all(isinstance(method, Experiment) for method in given):
        raise InputError("methods", methods, _METHODS)
    for method in given:
        if method.chain is not experiment.chain or method.drive is not experiment.drive:
            raise InputError("methods", label(method), f"has another chain or drive; {_METHODS}")
    labels = [label(method) for method in given]
    if len(set(labels)) < len(labels):
        raise InputError("methods", labels, "must not name a method twice")
    return given


def _seeds(experiment: Experiment, seeds: Any) -> list[int]:
    """Return the seeds: a list, or counted from the experiment's."""
    random = experiment.chain.sigma_mu != 0 or experiment.drive.random
    if seeds is None:
        seeds = REPETITIONS if random and experiment.chain.n <= _MOST_SLIDERS else 1
    if not isinstance(seeds, (list, tuple, range)):
        many = range(whole_number(seeds, "seeds", least=1, most=100_000))
        seeds = [(experiment.seed + k) % 2**64 for k in many]
    named = [valid_seed(seed) for seed in seeds]
    if not named or len(set(named)) < len(named):
        raise InputError("seeds", seeds, "must be one seed at least, and none twice")
    if len(named) > 1 and not random:
        allowed = "must not be given: without disorder and random dilations all runs are the same"
        raise InputError("seeds", seeds, allowed)
    return named


# --- one seed -------------------------------------------------------------------------------------


def _measured(
    methods: Sequence[Experiment], events: int, step: Callable[[str], None]
) -> dict[str, Any]:
    """Return what one repetition measures: a row for each method, and what is true."""
    first, truth = methods[0], true_method(methods)
    usual = truth if first.chain.slides else replace(first, solver="exact", options={})
    for method in (*methods, truth, usual):
        compile_for(method.algorithm, method.chain)
    # exact says how many half-cycles and events the velocity is of
    limit = max(min(_VELOCITY_EVENTS // first.chain.n, MOST_EVENTS), 2 * events)
    pilot = usual.simulation(("x",))
    (stretch,) = simulate(pilot, first.drive, [first.drive.target_count], Limits(limit))
    if pilot.tally.events == 0 and not first.chain.slides:
        raise InputError("scene", "no events", "must drive the chain so far that a slider slips")
    if stretch.stop.final and pilot.tally.rearrangements <= 1:
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    targets = stretch.completed - (stretch.completed % 2 if first.drive.cyclic else 0)
    pace = pilot.tally.events / max(stretch.completed, 1)
    copies = math.ceil(_TIMED_EVENTS / max(pilot.tally.events, targets, 20))
    step(f"{label(truth)}: the truth")
    track(truth, _WARM)  # compiles what only few events need
    known, spent = track(truth, events)
    ends = _moved(stretch.recorded["x"][: known.events[-1][0] if known.events else events])
    rows = list[dict[str, Any]]()
    for method in methods:
        step(label(method))
        own, seconds = known, spent
        if label(method) != label(truth):
            slips = method.solver != "sliding"
            own, seconds = track(method, len(known.events) + 1 if slips else ends.shape[1])
        x_G, seconds = _NOTHING, seconds / (len(own.events) or math.nan) * pace
        if targets and method.solver in _COMPILED:
            x_G, seconds = _timed(method, targets, copies)
        row = agreement(own, known) | {"track": own, "evidence": own.evidence.value}
        rows.append(row | {"seconds": seconds, "advances": _advances(method, x_G)})
    shared = min([row["rests"] for row in rows if row["track"].events] or [0])
    for row in rows:
        own, rests = row["track"], row["rests"]
        true, both = (known.moved, max(shared, 1)) if own.events else (ends, rests)
        row |= {"error": _error(own, true, rests), "shared_error": _error(own, true, both)}
        row["velocity"] = _mean(row["advances"])
    return {
        "rows": rows,
        "advances": _advances(first, stretch.recorded["x_G"][:targets].astype(float)),
        "events": len(known.events),
        "half_cycles": targets,
        "truth_evidence": known.evidence.value,
    }


def _error(own: Track, true: NDArray[Any], rests: int) -> float:
    """Return the largest error of a position at the first rests, or what is proved of it."""
    (middles, radii), middle = own.moved[:, :rests], true[0, :rests]
    count = min(len(middles), len(middle))
    if not count:
        return math.nan
    gaps = radii if own.evidence is Evidence.PROVED else middles[:count] - middle[:count]
    return nearest_float(abs(gaps.cumsum(axis=0)).max())


def true_method(methods: Sequence[Experiment]) -> Experiment:
    """Return the method whose events count as true: `certified` with the most digits."""
    if methods[0].chain.slides:
        return replace(methods[0], solver="sliding", options={})
    certified = [method for method in methods if method.solver == "certified"]
    usual = replace(methods[0], solver="certified", options={"digits": 30})
    return max(certified, key=lambda method: method.digits or 0, default=usual)


def _timed(method: Experiment, targets: int, copies: int) -> tuple[NDArray[np.float64], float]:
    """Return x_G at so many targets, and the time to each in the mean of `copies` runs."""
    simulations = [method.simulation() for _ in range(copies)]
    begin = process_time()
    for simulation in simulations:
        (stretch,) = simulate(simulation, method.drive, [targets])
    spent = (process_time() - begin) / copies / targets
    return stretch.recorded["x_G"].astype(float), spent


def track(method: Experiment, events: int) -> tuple[Track, float]:
    """Follow a method for so many events, and return its track and the processor time.

    A method without events is followed for so many targets.
    """
    records, drive = method.algorithm.records, method.drive
    record = ("events", "slip_table") if "events" in records else ("x",)
    compile_for(method.algorithm, method.chain, record)
    simulation, until, limits = method.simulation(record), drive.target_count, Limits(events)
    if "x" in record:
        until, limits = min(until, events), NO_LIMITS
    begin = process_time()
    (stretch,) = simulate(simulation, drive, [until], limits)
    seconds, columns = process_time() - begin, stretch.whole
    if "x" in record:
        return Track([], _moved(columns["x"]), True, simulation.evidence), seconds
    log = [(*row[:3], *event.signature) for row, event in logged_events(columns)]
    done = stretch.stop is Stop.DONE and len(log) <= events
    log = log[:events]
    moved = np.full((2, log[-1][1] + 1 if log else 0, method.chain.n), Fraction(0))
    bits = 128 + math.ceil(BITS_PER_DIGIT * (method.digits or 0))
    for kind, lengths in zip(moved, _parts(columns["slip_displacement"], bits), strict=True):
        slips = zip(columns["slip_rearrangement"], columns["slip_slider"], lengths, strict=True)
        for rest, slider, length in slips:
            if rest < len(kind):
                kind[rest, slider - 1] += length
    ended = moved[:, : len(moved[0]) if done else -1]  # else the last rearrangement is not at rest
    return Track(log, ended, done, simulation.evidence), seconds


def _moved(x: NDArray[Any]) -> NDArray[Any]:
    """Return how far sliders have moved between targets; see `Track`."""
    return np.diff(_parts(x), axis=1, prepend=0)


def _parts(values: NDArray[Any], bits: int = 128) -> NDArray[Any]:
    """Return the middles and the radii of numbers, (2, ...); irrational ones to so many bits."""
    each = [x.bracket(bits) if hasattr(x, "bracket") else enclosure(x) for x in values.flat]
    return np.array(each, dtype=object).reshape(-1, 2).T.reshape(2, *values.shape)


def agreement(own: Track, known: Track) -> dict[str, Any]:
    """Return how far a track agrees with the true one, in events and in rests.

    Events agree if their places, kinds, sliders and directions agree. A track that has ended early,
    or goes on where the true one ends, differs there; beyond a limit of events neither does.
    """
    if not own.events:  # sliding has none
        nothing = {"agreed": math.nan, "differs": False, "wrong": ""}
        return nothing | {"rests": own.moved.shape[1]}
    both = [*zip_longest(own.events, known.events)][: len(known.events) + known.done]
    agreed = next((k for k, (a, b) in enumerate(both) if a != b), len(both))
    differ = both[agreed] if agreed < len(both) else ()
    rests = min([own.moved.shape[1], known.moved.shape[1], *(one[1] for one in differ if one)])
    wrong = " instead of ".join(map(_text, differ))
    return {"agreed": agreed, "differs": bool(differ), "wrong": wrong, "rests": rests}


def _text(event: tuple[Any, ...] | None) -> str:
    if event is None:
        return "no further event"
    half_cycle, *_, kind, sliders, _ = event
    return f"{kind} {', '.join(map(str, sliders))} in half-cycle {half_cycle}"


# --- all seeds ------------------------------------------------------------------------------------


def _dataset(
    experiment: Experiment,
    methods: Sequence[Experiment],
    seeds: Sequence[int],
    found: Sequence[dict[str, Any]],
) -> xr.Dataset:
    every = [[one["rows"][k] for one in found] for k in range(len(methods))]
    first = found[: len(seeds)]
    rows = [own[: len(seeds)] for own in every]

    def about(units: str, meaning: str) -> dict[str, str]:
        return {"long_name": meaning} | ({"units": units} if units else {})

    data: dict[str, Any] = {
        name: (("method", "seed"), [[row[name] for row in own] for own in rows], about(*known))
        for name, known in _OF_SEEDS.items()
    }
    data |= {name: ("seed", [one[name] for one in first]) for name in _OF_TRUTH}
    seconds = [[row["seconds"] for row in own] for own in every]
    spent = about("s", "processor time per half-cycle, without compilation")
    data["seconds"] = (("method", "repetition"), seconds, spent)
    bias, error = np.transpose([_bias(own, first) for own in rows])
    data["bias"] = ("method", bias, about(NUMBER, "of the velocity, relative to exact"))
    data["bias_error"] = ("method", error, about(NUMBER, "half the interval of 95 % of the bias"))
    coords = {
        "method": [label(method) for method in methods],
        "seed": np.array(seeds, np.uint64 if max(seeds) >= 2**63 else np.int64),
        "solver": ("method", [method.solver for method in methods]),
    }
    lines = "\n".join(f"{name}: {text}" for name, text in needs(experiment).items())
    attributes = plain_data(experiment.chain.parameters()) | {"drive": experiment.drive.kind}
    attributes |= {"truth": label(true_method(methods)), "needs": lines}
    return xr.Dataset(data, coords, attributes)


def _advances(experiment: Experiment, x_G: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the advance per half-cycle in each cycle, or target, after the burn-in."""
    start, cycle = experiment.burn_in_of(x_G.size), 2 if experiment.drive.cyclic else 1
    return np.diff(np.append(0.0, x_G)[start::cycle]) / cycle


def _mean(values: NDArray[np.float64]) -> float:
    return float(values.mean()) if values.size else math.nan


def _bias(own: Sequence[dict[str, Any]], found: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """Return the bias of a mean velocity relative to `exact`, and half its interval of 95 %.

    The interval is Student's over the seeds, or for one seed from averages over blocks of the run.
    """
    pairs = [(row["advances"], one["advances"]) for row, one in zip(own, found, strict=True)]
    if not all(mine.size == true.size for mine, true in pairs):
        return math.nan, math.nan
    scale = abs(_mean(np.array([_mean(true) for _, true in pairs]))) or math.nan
    biases = np.array([_mean(mine - true) for mine, true in pairs])
    if len(pairs) > 1:
        error = float(stats.t.ppf(0.975, len(pairs) - 1) * stats.sem(biases))
    else:
        gap = np.append(0.0, np.subtract(*pairs[0]).cumsum())
        error = 1.96 * standard_error(gap, np.arange(gap.size, dtype=float))
    return _mean(biases) / scale, error / scale
