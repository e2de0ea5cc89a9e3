"""The envelope: every extreme of the model, one at a time, and how well each solver stands it.

For each extreme every solver follows the same few half-cycles with the same disorder. Its
displacements at the end are held against those of the certified solver (in the sliding limit:
against the closed solution in rational arithmetic). What it promises of one rearrangement is
measured apart: from the same state at rest, so that no error of the past hides or makes one. A
solver either keeps what it promises, or says by itself that it does not: an undecided comparison,
a limit, or a refusal.
"""

from __future__ import annotations

import csv
import io
import math
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, Path
from exactcreep.model.numbers import InputError, nearest_float, whole_number
from exactcreep.model.state import State
from exactcreep.model.verdict import Evidence, Outcome
from exactcreep.motion.condition import PROMISE
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.decimals import enclosure, floats
from exactcreep.quasistatic.loop import PhysicsWarning, creep
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.registry import rearrange
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.energy import two_slider_ledger

ROUNDING = 32 * 2.0**-52
"""The same of one event, in a run whose rearrangements have few of them: errors add up."""

CONTESTANTS: dict[str, dict[str, Any]] = {
    "exact": {},
    "reference": {},
    "mpmath": {"digits": 30},
    "verlet": {"dt": "0.01"},
}
"""Solvers that are held against the certified one, and their options."""

WITHIN, FLAGGED, REFUSED, STEPPED, BROKEN = "within", "flagged", "refused", "stepped", "broken"
"""Verdicts of a cell.

``within`` its promise; ``flagged`` by the program itself (undecided comparisons, an estimated
error or a number of events beyond the promise, or a limit);
``refused`` with a sentence; ``stepped``: Verlet promises no more than its order in dt;
``broken``: a promise that was neither kept nor flagged, which is a defect.
"""


_LONGEST = 2000
"""Events of a rearrangement that is compared."""
_SHORT = 30
"""Sliders of a chain whose ends move like those of a longer one."""


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
    truth : str
        ``certified``; ``sliding`` where there are no slips; ``law`` where the result is known in
        closed form (a chain too long, or a run too long, for balls).
    known : callable or None
        For ``law``: takes a result and returns the error of its displacements.
    promise : float or None
        What is asked of that error; None: what the solver promises, rearrangement by rearrangement.
    """

    quantity: str
    value: str
    chain: Chain
    drive: Drive
    tension: Fraction = Fraction(0)
    truth: str = "certified"
    known: Callable[[Creep], float] | None = None
    promise: float | None = None

    def start(self, seed: int) -> State:
        """Return the state it starts from."""
        return State.prepared(self.chain, [self.tension] * (self.chain.n - 1), seed=seed)


@dataclass(frozen=True)
class Cell:
    """How one solver stands one extreme.

    Attributes
    ----------
    quantity, value, solver : str
    error : float
        Largest error of a displacement at the end, unit ``g tau_dyn**2``; nan if the itinerary
        is another one or nothing was computed.
    allowed : float
        What the solver promises of it; inf for Verlet.
    worst : float
        Largest error of a tension or a displacement after one rearrangement from the same rest,
        over the largest force; nan if none was compared.
    compared, astray : int
        Rearrangements compared, and those of them with other events than the certified ones.
    events, half_cycles : int
    seconds : float
    outcome, evidence : str
    verdict : str
        One of `WITHIN`, `FLAGGED`, `REFUSED`, `STEPPED` and `BROKEN`.
    remark : str
        Why, if there is more to say.
    """

    quantity: str
    value: str
    solver: str
    error: float
    allowed: float
    worst: float
    compared: int
    astray: int
    events: int
    half_cycles: int
    seconds: float
    outcome: str
    evidence: str
    verdict: str
    remark: str = ""

    def summary(self) -> dict[str, Any]:
        """Return the cell, ready for JSON: a number that is not finite is None."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in vars(self).items()
        }


def extremes(*, quick: bool = False) -> list[Extreme]:
    """Return the extremes of the model, one quantity at a time.

    Parameters
    ----------
    quick : bool
        Leave out what takes longer than a few seconds, and shorten the long runs.
    """
    return list(_extremes(quick))


def _chain(n: int = 3, l0: Any = 1000, mu_d: Any = "0.5", mu_s: Any = "0.6", sigma_mu: Any = "0.01",
           tan_alpha: Any = "0.25") -> Chain:  # fmt: skip
    return Chain(n, l0, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)


def _cycles(chain: Chain, reach: Any, cycles: int = 2) -> Cycles:
    """Return cycles of the amplitude at which ``l0 A = reach``."""
    return Cycles(Fraction(reach) / chain.l0, cycles)


def _extremes(quick: bool) -> Iterator[Extreme]:
    for n in (1, 2, 3, 30):
        chain = _chain(n)
        yield Extreme("N", str(n), chain, _cycles(chain, "1.5" if n < 30 else "2"))
    for n in (1000, 100_000):
        chain = _chain(n, sigma_mu=0)
        yield Extreme("N", str(n), chain, _cycles(chain, 2, 2), truth="law",
                      known=_apart_from_a_short_chain)  # fmt: skip
    for l0 in ("1e-6", "1", "1e6", "1e15"):
        chain = _chain(3, l0)
        yield Extreme("l0", l0, chain, _cycles(chain, 2))
    for l0 in ("1e-6", "1e15"):
        chain = _chain(2, l0)
        yield Extreme("l0 A", f"100 (l0 = {l0})", chain, _cycles(chain, 100, 1))
    for l0, amplitude in (("1000", "1e-15"), ("1e15", "1e-15"), ("1e15", "2e-15")):
        chain = _chain(3, l0)
        yield Extreme("A", f"{amplitude} (l0 = {l0})", chain, Cycles(amplitude, 2))
    for gap in ("1e-12", "1e-9", "1e-6", "1e-3", "1", "10"):
        for n in (2, 3):
            chain = _chain(n, mu_s=Fraction(1, 2) + Fraction(gap), sigma_mu=0)
            onset = Fraction(chain.times_cosine(chain.mu_s - chain.tan_alpha))
            theta = (onset + (6 * n + Fraction(1, 3)) * Fraction(chain.excess)) / chain.l0
            yield Extreme("mu_s - mu_d", f"{gap} (N = {n})", chain, Path([theta, -theta]))
    chain = _chain(3, mu_s="0.5", sigma_mu=0)
    yield Extreme("mu_s - mu_d", "0", chain, _cycles(chain, 2), truth="sliding")
    chain = _chain(3, mu_s="0.5")
    yield Extreme("mu_s - mu_d", "0, sigma_mu = 0.01", chain, Path([Fraction(1, 1000)]))
    for steep, sigma in (("0", "0.01"), ("0", "0"), ("0.05", "0.01")):
        chain = _chain(2, mu_d=0, mu_s="0.1", sigma_mu=sigma, tan_alpha=steep)
        yield Extreme("mu_d", f"0 (tan_alpha = {steep}, sigma_mu = {sigma})", chain,
                      _cycles(chain, "0.2", 1))  # fmt: skip
    for sigma in ("0", "1e-12", "0.1", "0.3", "1", "10"):
        chain = _chain(3, sigma_mu=sigma)
        yield Extreme("sigma_mu", sigma, chain, _cycles(chain, 2))
    for name, slope in (
        ("0", Fraction(0)),
        ("1e-15", Fraction("1e-15")),
        ("mu_d - 1e-12", Fraction(1, 2) - Fraction("1e-12")),
        ("mu_d", Fraction(1, 2)),
        ("mu_d + 1e-12", Fraction(1, 2) + Fraction("1e-12")),
        ("mu_d + 0.05", Fraction(11, 20)),
    ):
        for sigma in ("0", "0.01"):
            chain = _chain(2, sigma_mu=sigma, tan_alpha=slope)
            drive: Drive = _cycles(chain, 1)
            if slope > Fraction(2, 5):  # short: near mu_d one avalanche is long enough
                drive = Path([Fraction("0.3") / chain.l0])
            yield Extreme("tan_alpha", f"{name} (sigma_mu = {sigma})", chain, drive)
    chain = _chain(3)
    repeated = ["0.001", "0.001", "0.002", "0.002", "0.002", "-0.001", "-0.001", 0, 0]
    yield Extreme("repeated targets", str(len(repeated)), chain, Path(repeated))
    for n in (3, 4, 6):
        chain = _chain(n, sigma_mu=0, tan_alpha=0)
        yield Extreme("tie by symmetry", f"N = {n}", chain, _cycles(chain, 1))
    chain = _chain(3, sigma_mu=0, tan_alpha="0.2")
    yield Extreme("tie by numbers", "tan_alpha = 1/5", chain, _cycles(chain, 1))
    chain = _chain(4, 5, 1, "1.2", 0, "3/4")
    yield Extreme("tie by numbers", "tan_alpha = 3/4", chain, _cycles(chain, 2))
    slips = 10**5 if quick else 10**6
    chain = _chain(2, "1e15", sigma_mu=0)
    jump = Path([Fraction(slips) * Fraction(chain.excess) * 2 / chain.l0])
    yield Extreme("slips in one half-cycle", f"{slips:.0e}", chain, jump, Fraction(1, 32), "law",
                  remainder_error)  # fmt: skip
    slips = 10**7 if quick else 10**9
    chain = _chain(2, sigma_mu=0)
    per_half_cycle = 100
    cycles = slips // (2 * per_half_cycle)
    # the first slips of a half-cycle take up what the one before has left
    drive = _cycles(chain, Fraction(chain.excess) * (per_half_cycle + 4), cycles)
    yield Extreme("slips at N = 2", f"{slips:.0e}", chain, drive, Fraction(1, 32), "law",
                  remainder_error, 1e-9)  # fmt: skip
    yield Extreme("energy of slips at N = 2", f"{slips:.0e}", chain, drive, Fraction(1, 32), "law",
                  energy_error, 1e-12)  # fmt: skip


def remainder_error(result: Creep) -> float:
    """Return how far ``r0 = (x_2 - x_1 - l0) mod 2D`` of two sliders is from where it began.

    Notes
    -----
    Guarantee: in rational arithmetic, of the final tension and dilation.
    """
    chain, state, begin = result.chain, result.state, result.experiment.initial
    stretched = Fraction(float(state.tensions[0])) + chain.l0 * Fraction(state.theta)
    before = Fraction(begin.tensions[0]) + chain.l0 * Fraction(begin.theta)
    period = 2 * Fraction(chain.excess)
    left = (stretched - before) / period
    return nearest_float(abs(left - round(left)) * period)


def energy_error(result: Creep) -> float:
    """Return what is left over in the energy ledger of two sliders, relative to friction's part.

    inf if the ledger's own run did not end in the same state, bit for bit.
    """
    ledger, end = two_slider_ledger(
        result.chain, result.drive, start=result.experiment.initial, seed=result.seed
    )
    same = np.array_equal(end.displacements, result.state.displacements)
    return max(ledger.balance, ledger.apart / ledger.slips) if same else math.inf


def _apart_from_a_short_chain(result: Creep) -> float:
    """Return the error of a long chain without disorder of which only the ends move.

    They move like those of a short chain, which the certified solver can follow.
    """
    parameters = result.chain.parameters() | {"n": _SHORT}
    truth = _truth(Chain(**parameters), result.drive)
    proved = [enclosure(x) for x in truth.state.displacements.tolist()]
    half = len(proved) // 2
    if truth.evidence is not Evidence.PROVED or any(x.middle for x in proved[half - 2 : half + 2]):
        return math.nan  # the two ends may feel each other
    moved = result.state.displacements.tolist()
    pairs = zip(moved[:half] + moved[-half:], proved, strict=True)
    apart = max(abs(Fraction(x) - true.middle) for x, true in pairs)
    return nearest_float(apart) if not any(moved[half:-half]) else math.inf


@cache
def _truth(chain: Chain, drive: Drive) -> Creep:
    return creep(chain, drive, solver="certified", digits=30, record=())


def envelope(
    *,
    quick: bool = False,
    seed: int = 1,
    most_seconds: float | None = None,
    most_compared: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    chosen: Sequence[Extreme] | None = None,
) -> list[Cell]:
    """Return how every solver stands every extreme.

    Parameters
    ----------
    quick : bool
        See `extremes`.
    seed : int
        Of the disorder.
    most_seconds : float, optional
        For each run; what takes longer ends in a limit. Default 1 if quick, else 60.
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
    limit = (1.0 if quick else 60.0) if most_seconds is None else most_seconds
    if not limit > 0:
        raise InputError("most_seconds", most_seconds, "must be positive")
    steps = whole_number(
        (20 if quick else 200) if most_compared is None else most_compared, "most_compared", least=0
    )
    cells: list[Cell] = []
    every = list(extremes(quick=quick) if chosen is None else chosen)
    report = reporter(progress)
    for number, extreme in enumerate(every):
        text = f"{extreme.quantity} = {extreme.value}"
        report("running", number, len(every), "extremes", text=text)
        cells.extend(_cells(extreme, seed, limit, steps))
    return cells


def _cells(
    extreme: Extreme, seed: int, most_seconds: float, most_compared: int
) -> Iterator[Cell]:
    truth: Creep | None = None
    walk: list[Step] = []
    if extreme.truth != "law":
        options = {"digits": 30} if extreme.truth == "certified" else {}
        truth, cell = _ran(extreme, extreme.truth, options, seed, most_seconds, None)
        yield cell
        if extreme.truth == "certified" and truth is not None:
            walk = list(_walk(extreme, seed, truth, most_compared, most_seconds))
    for solver, options in CONTESTANTS.items():
        if extreme.truth == "law" and solver != "exact":
            continue  # the others need hours for what the law knows
        cell = _ran(extreme, solver, options, seed, most_seconds, truth)[1]
        yield _with_steps(cell, _steps(extreme.chain, walk, solver, options, seed, most_seconds))


class Step(NamedTuple):
    """One rearrangement: the rest from which it starts, the way on, and what was proved of it."""

    state: State
    way: int
    proved: Rearrangement


class Steps(NamedTuple):
    """How a solver's single rearrangements compare with what was proved of them."""

    worst: float
    compared: int
    astray: int
    unsaid: int
    """Those astray or beyond the promise that the solver does not call undecided."""


def _walk(
    extreme: Extreme, seed: int, truth: Creep, most: int, most_seconds: float
) -> Iterator[Step]:
    """Yield the first rearrangements along the way of the exact solver."""
    if truth.outcome is Outcome.LIMIT:
        return  # one of them is too long for the certified solver
    chain, drive = extreme.chain, extreme.drive
    state = extreme.start(seed)
    taken, begin = 0, time.perf_counter()
    for q in range(drive.half_cycles + 1):
        target = drive.exact_target(q, seed) if q else None
        while taken < most and time.perf_counter() - begin < most_seconds:
            now = enclosure(state.theta).middle
            # the start may have to be rearranged at its own theta
            way = 0 if target is None else int(target > now) - int(target < now)
            if target is not None and way == 0:
                break
            found = rearrange(chain, state, direction=way, seed=seed, max_events=_LONGEST)
            passed = target is not None and way * (enclosure(found.theta).middle - target) > 0
            if not found.events or passed:
                break
            if found.outcome is not Outcome.AT_REST:
                return
            proved = rearrange(
                chain, state, direction=way, seed=seed, solver="certified", digits=30,
                max_events=2 * _LONGEST, max_seconds=most_seconds,
            )  # fmt: skip
            taken += 1
            yield Step(state, way, proved)
            state = found.state
            if way == 0:
                break


def _steps(
    chain: Chain, walk: Sequence[Step], solver: str, options: dict[str, Any], seed: int,
    most_seconds: float,
) -> Steps:  # fmt: skip
    """Return how a solver does in the rearrangements of a walk."""
    worst, compared, astray, unsaid = math.nan, 0, 0, 0
    force = _largest_force(chain)
    begin = time.perf_counter()
    for state, way, proved in walk:
        if proved.outcome is not Outcome.AT_REST or proved.evidence is not Evidence.PROVED:
            continue
        if time.perf_counter() - begin > most_seconds:
            break
        try:
            found = rearrange(
                chain, state, direction=way, seed=seed, solver=solver, max_events=2 * _LONGEST,
                **options,
            )  # fmt: skip
        except InputError:
            break
        compared += 1
        said = found.evidence is Evidence.UNDECIDED
        if found.itinerary != proved.itinerary:
            astray += 1
            unsaid += not said
            continue
        apart = _apart(found.state, proved.state)
        unsaid += apart > PROMISE * force and not said
        worst = max(apart, 0.0 if math.isnan(worst) else worst)
    return Steps(worst / force, compared, astray, unsaid)


def _apart(one: State, other: State) -> float:
    """Return the largest distance of two states in a tension or a displacement."""
    pairs = zip(
        [*one.tensions.tolist(), *one.displacements.tolist()],
        [*other.tensions.tolist(), *other.displacements.tolist()],
        strict=True,
    )
    return nearest_float(max(abs(enclosure(a).middle - enclosure(b).middle) for a, b in pairs))


def _with_steps(cell: Cell, steps: Steps) -> Cell:
    """Return a cell with what was measured of single rearrangements, and judged by it, too."""
    verdict = cell.verdict
    if verdict in (WITHIN, FLAGGED) and steps.unsaid:
        verdict = BROKEN
    elif verdict == WITHIN and steps.worst > PROMISE:
        verdict = FLAGGED
    return replace(
        cell, worst=steps.worst, compared=steps.compared, astray=steps.astray, verdict=verdict
    )


def _ran(
    extreme: Extreme,
    solver: str,
    options: dict[str, Any],
    seed: int,
    most_seconds: float,
    truth: Creep | None,
) -> tuple[Creep | None, Cell]:
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # they are counted in the result
            result = creep(
                extreme.chain, extreme.drive, seed=seed, solver=solver, start=extreme.start(seed),
                record=(), max_seconds=None if extreme.truth == "law" else most_seconds,
                **options,
            )  # fmt: skip
    except InputError as refusal:
        cell = Cell(extreme.quantity, extreme.value, solver, math.nan, math.nan, math.nan, 0, 0,
                    0, 0, time.perf_counter() - begin, "", "", REFUSED, str(refusal))  # fmt: skip
        return None, cell
    allowed = _allowed(extreme, solver, result)
    error, remark = _error(extreme, result, truth)
    told = ", ".join(f"{name}: {count}" for name, count in result.warnings.items())
    cell = Cell(
        extreme.quantity, extreme.value, solver, error, allowed, math.nan, 0, 0, result.events,
        result.half_cycles, result.seconds, result.outcome.value, result.evidence.value,
        _verdict(solver, result, error, allowed, truth), "; ".join(filter(None, (remark, told))),
    )  # fmt: skip
    return result, cell


def _largest_force(chain: Chain) -> float:
    """Return the largest force at a contact, unit m g."""
    force = nearest_float((chain.mu_s + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha))
    return force + 9 * nearest_float(chain.sigma_mu)  # no deviate of 53 bits is larger


def _allowed(extreme: Extreme, solver: str, result: Creep) -> float:
    """Return what a solver promises of the displacements at the end of a run."""
    if solver == "verlet":
        return math.inf
    if extreme.promise is not None:
        return extreme.promise
    each = 1e-25 if solver in ("mpmath", "certified") else ROUNDING
    # a sum of displacements is good to its last place, however small each one's error
    travelled = float(np.abs(floats(result.state.displacements)).max(initial=0.0)) * 2**-52
    return (1 + result.events) * each * _largest_force(extreme.chain) + travelled


def _error(extreme: Extreme, result: Creep, truth: Creep | None) -> tuple[float, str]:
    if extreme.known is not None:
        return extreme.known(result), ""
    if truth is None or result.solver == truth.solver:
        radius = result.report.get("largest_radius", 0.0)
        return (float(radius) if result.outcome is not Outcome.RUNAWAY else math.nan), ""
    if result.outcome is Outcome.RUNAWAY and truth.outcome is Outcome.RUNAWAY:
        return math.nan, "proved to run away"
    if (result.events, result.half_cycles) != (truth.events, truth.half_cycles):
        return math.nan, f"{result.events} events, certified {truth.events}"
    apart = [
        abs(Fraction(float(ours)) - Fraction(float(theirs)))
        for ours, theirs in zip(
            floats(result.state.displacements), floats(truth.state.displacements), strict=True
        )
    ]
    return nearest_float(max(apart)), ""


def _verdict(solver: str, result: Creep, error: float, allowed: float, truth: Creep | None) -> str:
    if solver == "verlet":
        return STEPPED
    if error <= allowed:
        return WITHIN
    if result.outcome is Outcome.LIMIT or result.evidence is Evidence.UNDECIDED:
        return FLAGGED
    if result.long_rearrangements:
        return FLAGGED
    if truth is not None and truth.outcome is Outcome.LIMIT:
        return FLAGGED
    if result.outcome is Outcome.RUNAWAY and (truth is None or truth.outcome is Outcome.RUNAWAY):
        return WITHIN  # the moment of the proof is the solver's own
    return BROKEN


def defects(cells: Sequence[Cell]) -> list[Cell]:
    """Return the cells in which a promise was neither kept nor flagged."""
    return [cell for cell in cells if cell.verdict == BROKEN]


def to_csv(cells: Sequence[Cell]) -> str:
    """Return the table as CSV, one row for each extreme and solver."""
    names = list(Cell.__dataclass_fields__)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for cell in cells:
        values = [getattr(cell, name) for name in names]
        writer.writerow(f"{v:.6g}" if isinstance(v, float) else v for v in values)
    return text.getvalue()
