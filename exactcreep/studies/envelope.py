"""The envelope: every extreme of the model, one at a time, and how well each solver stands it.

For each extreme every solver follows the same few half-cycles with the same disorder. Its
displacements at the end are held against those of the certified solver (in the sliding limit:
against the closed solution in rational arithmetic). What it promises of one rearrangement is
measured apart: from the same state at rest, so that no error of the past hides or makes one. A
solver either keeps what it promises, or says by itself that it does not: an undecided comparison,
a limit, or a refusal. Where the truth itself is not known, nothing is said of the others.

Runs are limited by their events, never by the clock: every machine comes to the same verdicts.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import pandas as pd

from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, Path
from exactcreep.model.enclosure import enclosure, floats
from exactcreep.model.numbers import InputError, Number, nearest_float, plain_data, whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.runaway import LARGEST_DEVIATE
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.creep import PhysicsWarning
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.exact.layout import TENSION_TOLERANCE
from exactcreep.solvers.registry import rearrange
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.contest import Contestant, Rest, Walk, agree, apart, rests_along, settled
from exactcreep.studies.energy import energy_ledger

ROUNDING = 32 * 2.0**-52
"""What a displacement of float64 may be off at the end of a run, over the largest force, for each
event of the run: errors add up, and the rearrangements of these runs have few events."""

CONTESTANTS = (
    Contestant("exact"),
    Contestant("reference"),
    Contestant("mpmath", {"digits": 30}),
    Contestant("verlet", {"dt": "0.01"}),
)
"""Solvers that are held against the truth."""

MOST_EVENTS = 20_000
"""Events of the certified solver at each extreme: a minute of it. What is longer has no truth."""

WITHIN, FLAGGED, REFUSED, STEPPED, BROKEN = "within", "flagged", "refused", "stepped", "broken"
NO_TRUTH = "no truth"
"""Verdicts of a trial.

``within`` its promise; ``flagged`` by the program itself (undecided comparisons, an estimated
error or a number of events beyond the promise, or a limit);
``refused`` with a sentence; ``stepped``: Verlet promises no more than its order in dt;
``broken``: a promise that was neither kept nor flagged, which is a defect; ``no truth``: the
certified run has more events than it may have, is undecided or was refused.
"""


_SEED = 1  # of the disorder
_LONGEST = 2000  # events of a rearrangement that is compared
_ASTRAY = 2_000_000  # events of a run that is given up: exact proves a runaway after a million
_SHORT = 30  # sliders of a chain whose ends move like those of a longer one


@dataclass(frozen=True)
class Extreme:
    """One extreme: a chain and a drive that take one quantity to its end.

    Attributes
    ----------
    quantity, value : str
        What is extreme, and how much.
    chain : Chain
    drive : Drive
    tension : Fraction
        Of every spring at the start.
    known : callable or None
        Where a law knows the result (a chain too long, or a run too long, for balls): takes it and
        returns the error of its displacements.
    promise : float or None
        What is asked of that error; None: what the solver promises, rearrangement by rearrangement.
    """

    quantity: str
    value: str
    chain: Chain
    drive: Drive
    tension: Fraction = Fraction(0)
    known: Callable[[Creep], float] | None = None
    promise: float | None = None

    @property
    def experiment(self) -> Experiment:
        """The chain, prepared, on its way along the drive."""
        start = State.prepared(self.chain, [self.tension] * (self.chain.n - 1), seed=_SEED)
        return Experiment.of(self.chain, self.drive, seed=_SEED, start=start, record=())


@dataclass(frozen=True)
class Trial:
    """How one solver stands one extreme.

    Attributes
    ----------
    error, allowed : float
        Largest error of a displacement at the end, unit ``g tau_dyn**2``, and what the solver
        promises of it; nan if the itinerary is another one, or there is no truth.
    worst : float
        Largest error of a tension or a displacement after one rearrangement from the same rest,
        over the largest force; nan if none was compared.
    compared, astray : int
        Rearrangements compared, and those of them with other events than the certified ones.
    verdict, remark : str
        One of `WITHIN`, `FLAGGED`, `REFUSED`, `STEPPED`, `BROKEN` and `NO_TRUTH`, and why.
    """

    quantity: str
    value: str
    solver: str
    error: float = math.nan
    allowed: float = math.nan
    worst: float = math.nan
    compared: int = 0
    astray: int = 0
    events: int = 0
    half_cycles: int = 0
    seconds: float = 0.0
    outcome: str = ""
    evidence: str = ""
    verdict: str = NO_TRUTH
    remark: str = ""

    def summary(self) -> dict[str, Any]:
        """Return the trial, ready for JSON: a number that is not finite is None."""
        return plain_data(vars(self))


def extremes(*, quick: bool = False) -> list[Extreme]:
    """Return the extremes of the model, one quantity at a time; if `quick` with short runs."""
    return list(_extremes(quick))


def _chain(n: int = 3, l0: Any = 1000, **changed: Any) -> Chain:
    usual: dict[str, Any] = {"mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
    return Chain(n, l0, **usual | changed)


def _cycles(chain: Chain, reach: Any, cycles: int = 2) -> Cycles:
    """Return cycles of the amplitude at which ``l0 A = reach``."""
    return Cycles(Fraction(reach) / chain.l0, cycles)


def _extremes(quick: bool) -> Iterator[Extreme]:
    for n, reach in ((1, "1.5"), (2, "1.5"), (3, "1.5"), (30, "2")):
        chain = _chain(n)
        yield Extreme("N", str(n), chain, _cycles(chain, reach))
    for n in (1000, 100_000):
        chain = _chain(n, sigma_mu=0)
        yield Extreme("N", str(n), chain, _cycles(chain, 2), known=_apart_from_a_short_chain)
    for l0 in ("1e-6", "1", "1e6", "1e15"):
        chain = _chain(3, l0)
        yield Extreme("l0", l0, chain, _cycles(chain, 2))
    for l0 in ("1e-6", "1e15"):
        chain = _chain(2, l0)
        yield Extreme("l0 A", f"100 (l0 = {l0})", chain, _cycles(chain, 100, 1))
    for l0, amplitude in (("1000", "1e-15"), ("1e15", "1e-15"), ("1e15", "2e-15")):
        yield Extreme("A", f"{amplitude} (l0 = {l0})", _chain(3, l0), Cycles(amplitude, 2))
    for gap in ("1e-12", "1e-9", "1e-6", "1e-3", "1", "10"):
        for n in (2, 3):
            chain = _chain(n, mu_s=Fraction(1, 2) + Fraction(gap), sigma_mu=0)
            onset = Fraction(chain.times_cosine(chain.mu_s - chain.tan_alpha))
            theta = (onset + (6 * n + Fraction(1, 3)) * Fraction(chain.excess)) / chain.l0
            yield Extreme("mu_s - mu_d", f"{gap} (N = {n})", chain, Path([theta, -theta]))
    chain = _chain(3, mu_s="0.5", sigma_mu=0)
    yield Extreme("mu_s - mu_d", "0", chain, _cycles(chain, 2))
    yield Extreme("mu_s - mu_d", "0, sigma_mu = 0.01", _chain(3, mu_s="0.5"), Path(["0.001"]))
    for steep, sigma in (("0", "0.01"), ("0", "0"), ("0.05", "0.01")):
        chain = _chain(2, mu_d=0, mu_s="0.1", sigma_mu=sigma, tan_alpha=steep)
        value = f"0 (tan_alpha = {steep}, sigma_mu = {sigma})"
        yield Extreme("mu_d", value, chain, _cycles(chain, "0.2", 1))
    for sigma in ("0", "1e-12", "0.1", "0.3", "1", "10"):
        chain = _chain(3, sigma_mu=sigma)
        yield Extreme("sigma_mu", sigma, chain, _cycles(chain, 2))
    beside = {"mu_d - 1e-12": "-1e-12", "mu_d": "0", "mu_d + 1e-12": "1e-12", "mu_d + 0.05": "0.05"}
    slopes = {"0": Fraction(0), "1e-15": Fraction("1e-15")}
    slopes |= {name: Fraction(1, 2) + Fraction(off) for name, off in beside.items()}
    for name, slope in slopes.items():
        for sigma in ("0", "0.01"):
            chain = _chain(2, sigma_mu=sigma, tan_alpha=slope)
            # near mu_d one avalanche is long enough
            drive = Path([Fraction("0.3") / chain.l0]) if name in beside else _cycles(chain, 1)
            yield Extreme("tan_alpha", f"{name} (sigma_mu = {sigma})", chain, drive)
    repeated: list[Number] = ["0.001", "0.001", "0.002", "0.002", "0.002", "-0.001", "-0.001", 0, 0]
    yield Extreme("repeated targets", str(len(repeated)), _chain(3), Path(repeated))
    for n in (3, 4, 6):
        chain = _chain(n, sigma_mu=0, tan_alpha=0)
        yield Extreme("tie by symmetry", f"N = {n}", chain, _cycles(chain, 1))
    chain = _chain(3, sigma_mu=0, tan_alpha="0.2")
    yield Extreme("tie by numbers", "tan_alpha = 1/5", chain, _cycles(chain, 1))
    chain = _chain(4, 5, mu_d=1, mu_s="1.2", sigma_mu=0, tan_alpha="3/4")
    yield Extreme("tie by numbers", "tan_alpha = 3/4", chain, _cycles(chain, 2))
    tension, slips = Fraction(1, 32), 10**5 if quick else 10**6
    chain = _chain(2, "1e15", sigma_mu=0)
    jump = Path([Fraction(slips) * Fraction(chain.excess) * 2 / chain.l0])
    yield Extreme("slips in one half-cycle", f"{slips:.0e}", chain, jump, tension, remainder_error)
    chain, slips = _chain(2, sigma_mu=0), 10**7 if quick else 10**9
    # 100 slips in a half-cycle; its first ones take up what the one before has left
    drive = _cycles(chain, Fraction(chain.excess) * 104, slips // 200)
    for what, error, promise in (("", remainder_error, 1e-9), ("energy of ", energy_error, 1e-12)):
        quantity = f"{what}slips at N = 2"
        yield Extreme(quantity, f"{slips:.0e}", chain, drive, tension, error, promise)


def remainder_error(result: Creep) -> float:
    """Return how far ``r0 = (x_2 - x_1 - l0) mod 2D`` of two sliders is from where it began.

    In rational arithmetic, of the final tension and dilation.
    """
    chain, state, begin = result.chain, result.state, result.experiment.initial
    stretched = Fraction(float(state.tensions[0])) + chain.l0 * enclosure(state.theta).middle
    before = Fraction(begin.tensions[0]) + chain.l0 * enclosure(begin.theta).middle
    period = 2 * Fraction(chain.excess)
    left = (stretched - before) / period
    return nearest_float(abs(left - round(left)) * period)


def energy_error(result: Creep) -> float:
    """Return what is left over in the energy ledger of a run, relative to friction's part.

    inf if the ledger's own run did not end in the same state, bit for bit.
    """
    ledger, end = energy_ledger(result.experiment)
    same = np.array_equal(end.displacements, result.state.displacements)
    return max(ledger.balance, ledger.apart / ledger.slips) if same else math.inf


@cache
def _short_chain(chain: Chain, drive: Drive) -> Creep:
    """Return the certified run of a chain like this one, but short."""
    short = Experiment.of(Chain(**chain.parameters() | {"n": _SHORT}), drive, record=())
    return Contestant("certified", {"digits": 30}).run(short)


def _apart_from_a_short_chain(result: Creep) -> float:
    """Return the error of a long chain without disorder of which only the ends move.

    They move like those of a short chain, which the certified solver can follow.
    """
    truth = _short_chain(result.chain, result.drive)
    proved, moved = truth.state.displacements, result.state.displacements.tolist()
    half = proved.size // 2
    if truth.evidence is not Evidence.PROVED or floats(proved[half - 2 : half + 2]).any():
        return math.nan  # the two ends may feel each other
    return apart(moved[:half] + moved[-half:], proved) if not any(moved[half:-half]) else math.inf


def envelope(
    *,
    quick: bool = False,
    most_events: int = MOST_EVENTS,
    most_compared: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    chosen: Sequence[Extreme] | None = None,
) -> list[Trial]:
    """Return how every solver stands every extreme.

    Parameters
    ----------
    quick : bool
        Whether long runs are shortened, and fewer rearrangements compared.
    most_events : int
        Of the certified solver at each extreme, in its run, and in the rearrangements that are
        compared one by one. What has more has no truth.
    most_compared : int, optional
        Rearrangements of each extreme that are compared one by one; default 20 if quick, else 200.
    progress : callable, optional
        Called with a `Progress` before each extreme.
    chosen : sequence of Extreme, optional
        Default: `extremes`.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    most = whole_number(most_events, "most_events", least=1)
    if most_compared is None:
        most_compared = 20 if quick else 200
    singles = whole_number(most_compared, "most_compared", least=0)
    every = extremes(quick=quick) if chosen is None else chosen
    report = reporter(progress)
    found: list[Trial] = []
    for number, extreme in enumerate(every):
        text = f"{extreme.quantity} = {extreme.value}"
        report("running", number, len(every), "extremes", text=text)
        found.extend(_trials(extreme, most, singles))
    return found


def _trials(extreme: Extreme, most_events: int, most_compared: int) -> Iterator[Trial]:
    """Yield how every solver stands an extreme; where the law knows the end, `exact` alone.

    The other solvers need hours there.
    """
    experiment, exact = extreme.experiment, CONTESTANTS[0]
    if extreme.known is not None:
        yield _trial(extreme, exact, _ran(experiment, exact, None), None)
        return
    slides = extreme.chain.slides
    best = Contestant("sliding") if slides else Contestant("certified", {"digits": 30})
    ran, singles = _ran(experiment, best, most_events), []
    missing = untold(ran)
    truth = None if isinstance(ran, InputError) or missing else ran
    yield _trial(extreme, best, ran, truth, missing)
    if not slides and not isinstance(ran, InputError):
        singles = list(_proved_rests(experiment, best, most_events, most_compared))
    for contestant in CONTESTANTS:
        ran = _ran(experiment, contestant, most_events if truth is None else _ASTRAY)
        trial = _trial(extreme, contestant, ran, truth, missing)
        yield _judged_singly(trial, extreme.chain, singles, contestant)


def untold(ran: Creep | InputError) -> str:
    """Return why others cannot be held against a run: it was refused, cut short, or assumes ties.

    "" if it can be the truth.
    """
    if isinstance(ran, InputError):
        return str(ran)
    if ran.outcome is Outcome.LIMIT:
        return ran.reason
    return f"{ran.undecided} comparisons undecided" if ran.undecided else ""


def _ran(
    experiment: Experiment, contestant: Contestant, most_events: int | None
) -> Creep | InputError:
    """Return a solver's run, or why it refused."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # they are counted in the result
            return contestant.run(experiment, Limits(most_events))
    except InputError as refusal:
        return refusal


def _rearranged(chain: Chain, rest: Rest, contestant: Contestant) -> Rearrangement:
    return rearrange(
        chain, rest.state, direction=rest.way, seed=_SEED, solver=contestant.solver,
        max_events=2 * _LONGEST, **contestant.options,
    )  # fmt: skip


def _proved_rests(
    experiment: Experiment, best: Contestant, most_events: int, most: int
) -> Iterator[tuple[Rest, Walk]]:
    """Yield the first rests along the way of the exact solver, and what is proved to follow."""
    events = 0
    for rest in islice(rests_along(experiment, _LONGEST), most):
        found = _rearranged(experiment.chain, rest, best)
        if settled(found):
            yield rest, Walk.of(found, tensions=True)
        events += len(found.events)
        if events >= most_events:
            return


def _judged_singly(
    trial: Trial, chain: Chain, singles: Sequence[tuple[Rest, Walk]], contestant: Contestant
) -> Trial:
    """Return a trial with what comes of single rearrangements, and judged by it, too."""
    errors: list[float] = []  # nan where other events happened
    unsaid = False  # whether one is astray or beyond the promise, and not called undecided
    force = _largest_force(chain)
    for rest, proved in singles:
        found = _rearranged(chain, rest, contestant)
        errors.append(agree(Walk.of(found, tensions=True), proved).error_before / force)
        unsaid |= not errors[-1] <= TENSION_TOLERANCE and found.evidence is not Evidence.UNDECIDED
    right = [error for error in errors if not math.isnan(error)]
    worst, verdict = max(right, default=math.nan), trial.verdict
    if verdict in (WITHIN, FLAGGED, NO_TRUTH) and unsaid:
        verdict = BROKEN
    elif verdict == WITHIN and worst > TENSION_TOLERANCE:
        verdict = FLAGGED
    compared, astray = len(singles), len(singles) - len(right)
    return replace(trial, worst=worst, compared=compared, astray=astray, verdict=verdict)


def _trial(
    extreme: Extreme, contestant: Contestant, ran: Creep | InputError, truth: Creep | None,
    missing: str = "",
) -> Trial:  # fmt: skip
    """Return how a run stands beside the truth, or why there is none."""
    name = (extreme.quantity, extreme.value, contestant.solver)
    if isinstance(ran, InputError):
        return Trial(*name, verdict=REFUSED, remark=str(ran))
    error, remark = _error(extreme, ran, truth, missing)
    allowed = _allowed(extreme, contestant.solver, ran)
    told = ", ".join(f"{name}: {count}" for name, count in ran.warnings.items())
    return Trial(
        *name,
        error,
        allowed,
        events=ran.event_count,
        half_cycles=ran.half_cycles,
        seconds=ran.seconds,
        outcome=ran.outcome.value,
        evidence=ran.evidence.value,
        verdict=_verdict(ran, error, allowed, truth),
        remark="; ".join(filter(None, (remark, told))),
    )


def _largest_force(chain: Chain) -> float:
    """Return the largest force at a contact, unit m g."""
    force = nearest_float((chain.mu_s + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha))
    return force + LARGEST_DEVIATE * nearest_float(chain.sigma_mu)


def _allowed(extreme: Extreme, solver: str, result: Creep) -> float:
    """Return what a solver promises of the displacements at the end of a run."""
    if solver == "verlet":
        return math.inf
    if extreme.promise is not None:
        return extreme.promise
    each = 1e-25 if solver in ("mpmath", "certified") else ROUNDING
    # a sum of displacements is good to its last place, however small each one's error
    travelled = float(np.abs(floats(result.state.displacements)).max(initial=0.0)) * 2**-52
    return (1 + result.event_count) * each * _largest_force(extreme.chain) + travelled


def _error(extreme: Extreme, result: Creep, truth: Creep | None, missing: str) -> tuple[float, str]:
    """Return the error of a run's displacements at its end, and a remark."""
    if extreme.known is not None:
        return extreme.known(result), ""
    if truth is None:
        return math.nan, f"no truth: {missing}"
    if result is truth:
        radius = result.report.get("largest_radius", 0.0)
        return (float(radius) if result.outcome is not Outcome.RUNAWAY else math.nan), ""
    if result.outcome is truth.outcome is Outcome.RUNAWAY:
        return math.nan, "proved to run away"
    if (result.event_count, result.half_cycles) != (truth.event_count, truth.half_cycles):
        return math.nan, f"{result.event_count} events, certified {truth.event_count}"
    return apart(floats(result.state.displacements), floats(truth.state.displacements)), ""


def _verdict(result: Creep, error: float, allowed: float, truth: Creep | None) -> str:
    if result.solver == "verlet":
        return STEPPED
    if error <= allowed:
        return WITHIN
    if truth is None and math.isnan(error):
        return NO_TRUTH
    if result.outcome is Outcome.LIMIT or result.evidence is Evidence.UNDECIDED:
        return FLAGGED
    if result.outcome is Outcome.RUNAWAY and (truth is None or truth.outcome is Outcome.RUNAWAY):
        return WITHIN  # the moment of the proof is the solver's own
    return BROKEN


def defects(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials in which a promise was neither kept nor flagged."""
    return [one for one in trials if one.verdict == BROKEN]


def to_csv(trials: Sequence[Trial]) -> str:
    """Return the table as CSV, one row for each extreme and solver."""
    table = pd.DataFrame([vars(one) for one in trials])
    text: str = table.to_csv(index=False, float_format="%.6g", na_rep="nan", lineterminator="\n")
    return text
