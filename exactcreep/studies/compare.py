"""Measure what accuracy costs: the events, errors and times of solvers under the same disorder.

A method is the experiment with another solver. The true events are certified. Positions are
compared after each rearrangement, since the drive gets targets between rearrangements. Times are
processor times of repetitions in which the methods take turns. `comparison` evaluates the dataset.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import count, pairwise
from time import process_time
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from exactcreep.model.enclosure import enclosure
from exactcreep.model.keyed_disorder import valid_seed
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Evidence
from exactcreep.model.remarks import PhysicsWarning
from exactcreep.model.targets import Targets
from exactcreep.quasistatic.creep import Interrupted
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.statistics import standard_error
from exactcreep.solvers.interface import Stretch, compile_for, require_slips, simulate
from exactcreep.solvers.tables import LENGTH, NUMBER, joined
from exactcreep.studies.event_log import LoggedEvent, first_difference, numbered, rearrangements
from exactcreep.studies.needs import needs
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits, Stop
from exactcreep.watch.progress import Hearer, reporter

TIME_STEPS = ("0.1", "0.03", "0.01", "0.003")
"""Time steps of Verlet, unless methods are named."""
DIGITS = (20, 100)
"""Digits of the certified solver, unless methods are named."""
REPETITIONS = 5
"""Least repetitions whose median is a time."""
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
_OF_SEEDS: dict[str, tuple[Any, str, str]] = {
    "agreed": (math.nan, NUMBER, "events before the first wrong event"),
    "differs": (False, NUMBER, "whether an event is wrong"),
    "wrong": ("", "", "the first wrong event"),
    "rests": (0, NUMBER, "rests before the first wrong event"),
    "error": (math.nan, LENGTH, f"{_ERROR} wrong event"),
    "shared_error": (math.nan, LENGTH, f"{_ERROR} wrong event of any method"),
    "velocity": (math.nan, LENGTH, "mean displacement of x_G after the burn-in"),
    "evidence": ("", "", "of the events that were compared"),
}
"""The variables of each method and seed: value if missing, unit, meaning."""
_METHODS = 'must be experiments with other solvers: [replace(experiment, solver="exact"), ...]'


class Track(NamedTuple):
    """The events of a method and the displacements ``x`` at its targets, (targets, n).

    `ended`: the solver proved a runaway or gave up by itself.
    """

    events: list[LoggedEvent]
    x: NDArray[Any]
    ended: bool
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
        Approximate number of true events to compare for each seed; the drive may end earlier.
        Default: 300 for up to 30 sliders, else 100.
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
        If an argument is out of range, no slider moves, or the first rearrangement never ends or
        is too long for the truth.
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
    if not isinstance(methods, Sequence) or not methods:
        raise InputError("methods", methods, _METHODS)
    for method in methods:
        if not isinstance(method, Experiment):
            raise InputError("methods", method, _METHODS)
        if method.chain is not experiment.chain or method.drive is not experiment.drive:
            raise InputError("methods", label(method), f"has another chain or drive; {_METHODS}")
    labels = [label(method) for method in methods]
    if len(set(labels)) < len(labels):
        raise InputError("methods", labels, "must not name a method twice")
    return list(methods)


def _seeds(experiment: Experiment, seeds: Any) -> list[int]:
    """Return the seeds: a list, or counted from the experiment's."""
    random = experiment.chain.sigma_mu != 0 or experiment.drive.random
    if seeds is None:
        seeds = REPETITIONS if random and experiment.chain.n <= _MOST_SLIDERS else 1
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
    drive, ends = first.drive, [*range(1, min(first.drive.target_count, events) + 1)]
    enough = math.inf
    if not first.chain.slides:
        (drive, ends), enough = drive_with_rests(usual, events), events
    step(f"{label(truth)}: the truth")
    once = replace(truth, drive=drive)
    track(once, len(ends), _WARM, _WARM)  # compiles what only few events need
    known, spent = track(once, len(ends), beyond(MOST_EVENTS), enough)
    if not len(known.x):
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    # exact says how many half-cycles and events the velocity is of
    limit = max(min(_VELOCITY_EVENTS // first.chain.n, MOST_EVENTS), 2 * events)
    pilot = usual.simulation()
    (stretch,) = simulate(pilot, first.drive, [first.drive.target_count], Limits(limit))
    targets = stretch.completed - (stretch.completed % 2 if first.drive.cyclic else 0)
    pace = pilot.tally.events / max(stretch.completed, 1)
    copies = math.ceil(_TIMED_EVENTS / max(pilot.tally.events, targets, 20))
    rows, tracks = list[dict[str, Any]](), list[Track]()
    for method in methods:
        step(label(method))
        own, seconds = known, spent
        if label(method) != label(truth):
            most = beyond(len(known.events)) if known.events else None
            own, seconds = track(replace(method, drive=drive), len(known.x), most)
        row = agreement(own, known, ends) | {"evidence": own.evidence.value}
        row["seconds"] = seconds / len(own.events) * pace if own.events else math.nan
        if targets and method.solver in _COMPILED:
            row["x_G"], seconds = _timed(method, targets, copies)
            row["seconds"] = seconds / targets
        rows.append(row)
        tracks.append(own)
    shared = max(1, min(row["rests"] for row in rows))
    for row, own in zip(rows, tracks, strict=True):
        row["error"] = _error(own, known, row["rests"])
        row["shared_error"] = _error(own, known, shared)
    return {
        "rows": rows,
        "x_G": stretch.recorded["x_G"][:targets].astype(float),
        "events": sum(event.half_cycle <= len(known.x) for event in known.events),
        "half_cycles": targets,
        "truth_evidence": known.evidence.value,
    }


def _error(own: Track, known: Track, rests: int) -> float:
    """Return the largest error of a position at the first rests, or what is proved of it."""
    pairs = zip(own.x[:rests].flat, known.x[: len(own.x)][:rests].flat, strict=True)
    both = [(enclosure(a), enclosure(b)) for a, b in pairs]
    proved = own.evidence is Evidence.PROVED
    gaps = [a.radius if proved else abs(a.middle - b.middle) for a, b in both]
    return nearest_float(max(gaps)) if gaps else math.nan


def true_method(methods: Sequence[Experiment]) -> Experiment:
    """Return the method whose events count as true: `certified` with the most digits."""
    if methods[0].chain.slides:
        return replace(methods[0], solver="sliding", options={})
    certified = [method for method in methods if method.solver == "certified"]
    usual = replace(methods[0], solver="certified", options={"digits": 30})
    return max(certified, key=lambda method: method.digits or 0, default=usual)


def _timed(method: Experiment, targets: int, copies: int) -> tuple[NDArray[np.float64], float]:
    """Return x_G at so many targets, and the processor time of one of `copies` runs to them."""
    simulations = [method.simulation() for _ in range(copies)]
    begin = process_time()
    for simulation in simulations:
        (stretch,) = simulate(simulation, method.drive, [targets])
    return stretch.recorded["x_G"].astype(float), (process_time() - begin) / copies


def track(
    method: Experiment, until: int, most: int | None = None, enough: float = math.inf
) -> tuple[Track, float]:
    """Follow a method to target `until`, and return its track and the processor time.

    No target begins after `enough` events. The track is cut short after `most` events.
    """
    record = tuple(name for name in ("x", "events") if name in method.algorithm.records)
    compile_for(method.algorithm, method.chain, record)
    simulation, parts, begin = method.simulation(record), list[Stretch](), process_time()
    for stretch in simulate(simulation, method.drive, range(1, until + 1), Limits(most)):
        parts.append(stretch)
        if simulation.tally.events >= enough:
            break
    seconds, columns = process_time() - begin, joined([part.recorded for part in parts])
    events = numbered(rearrangements(columns)) if "events" in record else []
    x = columns.get("x", np.empty((sum(part.completed for part in parts), 0)))
    return Track(events, x, parts[-1].stop.final, simulation.evidence), seconds


def beyond(events: int) -> int:
    """Return the limit of events at which a run of about `events` events is cut short."""
    return 2 * events + 100


def drive_with_rests(experiment: Experiment, events: int) -> tuple[Targets, list[int]]:
    """Return the drive with a target between any two rearrangements, as far as is needed.

    Also returns the half-cycle of each target. Raises `InputError` if no slider ever slips.
    """
    drive, simulation = experiment.drive, experiment.simulation(("events",))
    theta: list[Any] = []  # a number, or one for each spring
    ends: list[int] = []
    for q in range(1, drive.target_count + 1):
        loads: list[float] = []  # theta_c of the rearrangements of this half-cycle
        for most in (beyond(events), beyond(MOST_EVENTS)):  # the second only for the first event
            left = Limits(most).after(simulation.tally.events)
            (stretch,) = simulate(simulation, drive, [q], left, done=q - 1)
            loads += [float(each.theta) for each in rearrangements(stretch.recorded)]
            if stretch.stop is not Stop.BUDGET or theta or len(set(loads)) > 1:
                break
        between: list[Any] = [(Fraction(a) + Fraction(b)) / 2 for a, b in pairwise(loads) if a != b]
        if (leg := drive.leg(q, experiment.initial.theta)) is not None:
            between = [leg.at(part, Fraction) for part in between]
        theta += between
        ends += [q] * len(between)
        if stretch.stop is Stop.BUDGET and theta:
            break  # more events in this half-cycle might not fit in memory
        theta.append(drive.exact_target(q, experiment.seed))
        ends.append(q)
        if stretch.stop is not Stop.DONE or simulation.tally.events >= events:
            break
    if simulation.tally.events == 0:
        raise InputError("scene", "no events", "must drive the chain so far that a slider slips")
    return Targets(theta), ends


def agreement(own: Track, known: Track, ends: Sequence[int]) -> dict[str, Any]:
    """Return how far a track agrees with the true one, in events and in rests.

    Events agree if their places, kinds, sliders and directions agree. An event after the point
    where a track was cut short is not lacking. `ends`: the half-cycle of each target.
    """
    agreed, mine, other = first_difference(own.events, known.events)
    for event, silent, telling in ((mine, known, own), (other, own, known)):
        if event is not None and None in (mine, other):
            last = max(len(telling.x) * silent.ended, len(silent.x))
            if event.half_cycle > last or not own.events:  # sliding has none
                mine = other = None
    differ = [event for event in (mine, other) if event is not None]
    rests = min([len(own.x), len(known.x), *(event.half_cycle - 1 for event in differ)])
    wrong = f"{_text(mine, ends)} instead of {_text(other, ends)}" if differ else ""
    found = {"agreed": agreed, "differs": bool(differ), "wrong": wrong} if own.events else {}
    return found | {"rests": rests}


def _text(event: LoggedEvent | None, ends: Sequence[int]) -> str:
    if event is None:
        return "no further event"
    kind, sliders, _ = event.event.signature
    return f"{kind} {', '.join(map(str, sliders))} in half-cycle {ends[event.half_cycle - 1]}"


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
    for own in rows:
        for row in own:
            row["velocity"] = _velocity(experiment, row.get("x_G", _NOTHING))
    biases = np.transpose([_bias(experiment, own, first) for own in rows])

    def about(meaning: str, units: str = NUMBER) -> dict[str, str]:
        return {"long_name": meaning} | ({"units": units} if units else {})

    data: dict[str, Any] = {
        name: (
            ("method", "seed"),
            [[row.get(name, missing) for row in own] for own in rows],
            about(meaning, units),
        )
        for name, (missing, units, meaning) in _OF_SEEDS.items()
    }
    data |= {name: ("seed", [one[name] for one in first]) for name in _OF_TRUTH}
    seconds = [[row["seconds"] for row in own] for own in every]
    spent = about("processor time per half-cycle, without compilation", "s")
    data["seconds"] = (("method", "repetition"), seconds, spent)
    data["bias"] = ("method", biases[0], about("of the velocity, relative to exact"))
    data["bias_error"] = ("method", biases[1], about("half the interval of 95 % of the bias"))
    steps = [nearest_float(exact_number(each.options.get("dt", 0), "dt")) for each in methods]
    coords = {
        "method": [label(method) for method in methods],
        "seed": np.array(seeds, np.uint64 if max(seeds) >= 2**63 else np.int64),
        "solver": ("method", [method.solver for method in methods]),
        "dt": ("method", [step or math.nan for step in steps], about("time step", "tau_dyn")),
    }
    lines = "\n".join(f"{name}: {text}" for name, text in needs(experiment).items())
    attributes = plain_data(experiment.chain.parameters()) | {"drive": experiment.drive.kind}
    attributes |= {"truth": label(true_method(methods)), "needs": lines}
    return xr.Dataset(data, coords, attributes)


def _after_burn_in(experiment: Experiment, x_G: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return x_G at the ends of cycles (or targets of other drives) from the burn-in on."""
    start, cycle = experiment.burn_in_of(x_G.size), 2 if experiment.drive.cyclic else 1
    return np.concatenate([np.zeros(min(x_G.size, 1)), x_G])[start::cycle]


def _velocity(experiment: Experiment, x_G: NDArray[np.float64]) -> float:
    known, cycle = _after_burn_in(experiment, x_G), 2 if experiment.drive.cyclic else 1
    return float(known[-1] - known[0]) / (known.size - 1) / cycle if known.size > 1 else math.nan


def _bias(
    experiment: Experiment, own: Sequence[dict[str, Any]], found: Sequence[dict[str, Any]]
) -> tuple[float, float]:
    """Return the bias of a mean velocity relative to `exact`, and half its interval of 95 %.

    The interval is Student's over the seeds, or for one seed from averages over blocks of the run.
    """
    if any("x_G" not in row for row in own):
        return math.nan, math.nan
    scale = abs(float(np.mean([_velocity(experiment, one["x_G"]) for one in found]))) or math.nan
    gaps = [row["x_G"] - one["x_G"] for row, one in zip(own, found, strict=True)]
    biases = [_velocity(experiment, gap) for gap in gaps]
    if len(gaps) > 1:
        error = float(stats.t.ppf(0.975, len(gaps) - 1) * stats.sem(biases))
    else:
        gap, cycle = _after_burn_in(experiment, gaps[0]), 2 if experiment.drive.cyclic else 1
        error = 1.96 * standard_error(gap, cycle * np.arange(gap.size, dtype=float))
    return float(np.mean(biases)) / scale, error / scale
