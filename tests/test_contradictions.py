"""The parts of the program answer one question: how fast does a chain creep in the long run?

Every part that claims something about it states an interval of velocities, and whether the claim is
proved. Two claims about the same chain, drive and start contradict each other if their intervals
have nothing in common. The chains are drawn by a seed, with answers of every kind among them.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest

import exactcreep as ec
from exactcreep.laws.theorems import edges
from exactcreep.results import Threshold
from tests.paper import captions

F = Fraction
STILL = ec.Outcome.AT_REST, ec.Outcome.CYCLING
SURE = 5.0
"""Standard errors, or deviations of a measured law, beyond which nothing is met by chance."""
SLACK = 1e-9  # of velocities, unit g tau_dyn^2 per half-cycle; theirs are some .1
pytestmark = pytest.mark.filterwarnings("ignore")  # a doubt that is said is no contradiction


class Claim(NamedTuple):
    """An interval of the mean velocity in the long run, and who claims it."""

    who: str
    low: float
    high: float
    proved: bool

    def contradicts(self, other: Claim) -> bool:
        return self.low > other.high + SLACK or other.low > self.high + SLACK


@dataclass(frozen=True)
class Case:
    """A chain, the amplitude of its cycles, and its start; None: relaxed."""

    chain: ec.Chain
    amplitude: Fraction
    start: ec.State | None = None


def drawn(random: Random) -> Case:
    """Return a random case: N from 1 to 9, of every slope, with and without slips and disorder."""
    n, mu_d = random.randint(1, 9), F(random.randint(2, 8), 10)
    mu_s = mu_d + random.choice([F(0), F(1, 10), F(random.randint(1, 300), 1000)])
    sigma = random.choice([F(0), F(0), (mu_s - mu_d) / random.choice([5, 10])])
    steep = [F(0), mu_d / (2 * n), mu_d * random.randint(1, 99) / 100, mu_d * 97 / 100]
    tan = random.choice([1, 1, 1, -1]) * random.choice(steep)
    chain = ec.Chain(n, random.choice([1000, 1, F(1, 1000)]), mu_d, mu_s, sigma, tan_alpha=tan)
    scale = n * (mu_d - abs(tan)) / 2 + random.choice([0, 1]) * (mu_s - mu_d)
    amplitude = F(float(scale) * random.uniform(0.4, 3)).limit_denominator(10**6) / chain.l0
    return Case(chain, amplitude, random.choice([None, None, of_its_own(chain, random)]))


def unlike(random: Random) -> Case:
    """Return a case whose friction, ends or expansions differ, often the same from either end."""
    n, kinds = random.randint(2, 4), random.randint(1, 7)

    def along(count: int, low: int, high: int) -> list[F]:
        values = [F(random.randint(low, high), 20) for _ in range(count)]
        same = random.random() < 0.7
        return [values[min(k, count - 1 - k)] if same else values[k] for k in range(count)]

    friction = [F(random.randint(40, 60), 100) for _ in range(n)]
    excesses = along(n, 1, 3)
    chain = ec.Chain(
        n, 1000,
        mu_d=friction if kinds & 1 else F(1, 2),
        mu_s=np.add(friction, excesses).tolist() if kinds & 1 else F(3, 5),
        tan_alpha=F(random.randint(2, 35), 100),
        end_forces=[F(random.randint(-8, 8), 100) for _ in "12"] if kinds & 2 else (0, 0),
        expansion=along(n - 1, 10, 30) if kinds & 4 else (),
    )  # fmt: skip
    return Case(chain, F(random.randint(40, 250), 10**5) * n / 5)


def of_its_own(chain: ec.Chain, random: Random) -> ec.State | None:
    """Return a start with tensions and coefficients of its own; None for one slider."""
    if chain.n == 1:
        return None
    tensions = [chain.mu_s * random.randint(-9, 9) / 20 for _ in range(chain.n - 1)]
    start = ec.State.prepared(chain, tensions)
    if chain.slides or random.random() < 0.5:
        return start
    own = [float(chain.mu_s) + random.randint(0, 9) / 100 for _ in range(chain.n)]
    return replace(start, coefficients=np.array(own))


def claims_of(case: Case, *, enclosed: bool) -> Iterator[Claim]:
    """Ask every part of the program how fast the chain creeps in the long run."""
    chain, amplitude, start = case.chain, case.amplitude, case.start
    yield from of_theorems(case)
    yield from of_law(case)
    solver = "sliding" if chain.slides else "exact"
    for cycles in (60, 120):
        yield from of_run(ec.creep(chain, ec.Cycles(amplitude, cycles), solver=solver, start=start))
    if chain.slides:
        return
    if clean := chain.sigma_mu == 0:
        yield from of_fate(ec.fate(chain, amplitude, start=start, solver="exact", cycles=1000))
    if enclosed and chain.n <= 5:
        drive = ec.Cycles(amplitude, 10)
        yield from of_run(ec.creep(chain, drive, solver="certified", start=start))
        if clean:
            yield from of_fate(ec.fate(chain, amplitude, start=start, cycles=30))


def of_theorems(case: Case) -> Iterator[Claim]:
    lasting = edges(case.chain).get("no_lasting_creep", 0.0)
    if case.amplitude < lasting * (1 - 1e-9):
        yield Claim("no_lasting_creep_amplitude", 0, 0, True)
    if not case.chain.may_run_away:
        yield Claim("no runaway below mu_d", -1e300, 1e300, True)


def of_law(case: Case) -> Iterator[Claim]:
    law = ec.laws.prediction(case.chain, ec.Cycles(case.amplitude, 10), case.start)
    if law is not None and not math.isnan(law.deviation):
        off = SURE * law.deviation
        low, high = min(law.values) - off, max(law.values) + off
        yield Claim(law.law, low, high, law.deviation == 0)


def of_run(run: ec.Creep) -> Iterator[Claim]:
    who = f"{run.solver}, {run.half_cycles} half-cycles: {run.outcome.value}"
    proved = run.outcome_evidence is ec.Evidence.PROVED
    if run.outcome is ec.Outcome.RUNAWAY:
        yield Claim(who, math.inf, math.inf, proved)
    elif run.outcome_evidence is ec.Evidence.UNDECIDED or run.outcome is ec.Outcome.LIMIT:
        return
    elif proved and run.outcome in STILL:
        yield Claim(who, 0, 0, True)
    elif proved:
        yield Claim(who, run.velocity, run.velocity, True)
    if not math.isnan(run.velocity_error) and not math.isinf(run.velocity):
        off = SURE * run.velocity_error
        yield Claim(f"{who} (mean)", run.velocity - off, run.velocity + off, False)


def of_fate(found: Any) -> Iterator[Claim]:
    who, proved = f"fate by {found.solver}", found.evidence is ec.Evidence.PROVED
    if found.evidence is ec.Evidence.UNDECIDED or found.outcome is ec.Outcome.LIMIT:
        return
    if found.outcome is ec.Outcome.RUNAWAY:
        yield Claim(who, math.inf, math.inf, proved)
    else:
        yield Claim(who, found.velocity, found.velocity, proved)


def assert_none_contradict(case: Case, claims: list[Claim]) -> None:
    pairs = itertools.combinations(claims, 2)
    found = [pair for pair in pairs if pair[0].contradicts(pair[1])]
    assert not found, "\n".join([repr(case), *(f"  {a}\n  {b}" for a, b in found)])


def of_threshold(edge: Threshold, *, creeps: bool) -> Claim:
    if not creeps:
        return Claim("threshold, lower", 0, 0, edge.evidence is ec.Evidence.PROVED)
    down = edge.direction in ("+x", "downhill") and edge.chain.tan_alpha >= 0
    down |= edge.direction == "uphill" and edge.chain.tan_alpha < 0
    away = (SLACK, math.inf) if down else (-math.inf, -SLACK)  # from 0, however slowly
    return Claim("threshold, upper", *away, edge.evidence is ec.Evidence.PROVED)


FAST, REST = range(4), range(4, 10)


@cache
def asked(part: int) -> list[tuple[Case, list[Claim]]]:
    """Return thirty cases with what is claimed of each; every sixth is enclosed, too."""
    random = Random(part)
    cases = [drawn(random) for _ in range(30)]
    return [(case, [*claims_of(case, enclosed=k % 6 == 0)]) for k, case in enumerate(cases)]


@pytest.mark.parametrize("part", [*FAST, *(pytest.param(k, marks=pytest.mark.slow) for k in REST)])
def test_no_two_parts_contradict_each_other_on_a_mean_velocity(part: int) -> None:
    for case, claims in asked(part):
        assert_none_contradict(case, claims)


@pytest.mark.parametrize("part", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_no_two_parts_contradict_each_other_on_an_unlike_chain(part: int) -> None:
    random, proved = Random(part), 0
    for _ in range(8):
        case = unlike(random)
        claims = [*claims_of(case, enclosed=True)]
        assert_none_contradict(case, claims)
        proved += any(claim.who == "fate by certified" and claim.low for claim in claims)
    assert proved >= 3


def test_what_is_drawn_is_claimed_about_in_every_way() -> None:
    """A test that asks nobody finds no contradiction: each part claims something."""
    claims = [claim for part in FAST for _, of_case in asked(part) for claim in of_case]
    for who in ("no_lasting", "sliding", "exact", "certified", "fate by exact", "fate by cert"):
        assert any(claim.who.startswith(who) for claim in claims)
    assert any(claim.proved and claim.low > 0 for claim in claims)
    assert any(claim.proved and claim.low == claim.high == 0 for claim in claims)


def edges_drawn(seed: int, count: int) -> Iterator[tuple[ec.Chain, int | None, Threshold]]:
    """Yield thresholds of random chains without disorder; half of them slide without slips."""
    random = Random(seed)
    for after in itertools.islice(itertools.cycle((None, 1, 2, 3)), count):
        chain = replace(drawn(random).chain, n=random.randint(2, 5), sigma_mu=F(0))
        if random.random() < 0.5:
            chain = replace(chain, mu_s=chain.mu_d)
        with contextlib.suppress(ec.InputError):  # nothing creeps in the scan
            edge = ec.threshold(chain, after=after, digits=6, points=60, max_seconds=5)
            if edge.upper is not None and not edge.reason:
                yield chain, after, edge


@pytest.mark.parametrize("part", range(3))
def test_at_a_threshold_runs_fates_and_laws_say_the_same(part: int) -> None:
    for chain, after, edge in edges_drawn(part, 16):
        for creeps, amplitude in enumerate(map(F, (edge.lower, edge.upper))):
            if after is not None:
                assert (advance_in(chain, amplitude, after) > 1e-6) == creeps, (edge, amplitude)
                continue
            case = Case(chain, amplitude)
            claims = claims_of(case, enclosed=chain.n == 2)
            assert_none_contradict(case, [of_threshold(edge, creeps=bool(creeps)), *claims])


def advance_in(chain: ec.Chain, amplitude: Fraction, cycle: int) -> float:
    """Return how far x_G goes down the incline in a cycle from the relaxed chain."""
    solver = "sliding" if chain.slides else "exact"
    run = ec.creep(chain, ec.Cycles(amplitude, cycle), solver=solver, record=["x_G"])
    begin, *_, end = [0.0, *run.recorded["x_G"]][-3:]
    return float(end - begin) * (-1 if chain.tan_alpha < 0 else 1)


SHALLOW = captions(4, mu_s="0.612", tan_alpha="0.0058")
UPHILL = "0.002701"
"""An amplitude at which the shallow chain creeps against its slope."""


def test_a_drift_below_two_standard_errors_is_not_called_creep() -> None:
    result = ec.creep(captions(30), ec.Cycles(Fraction("0.00338337"), 1500), record=())
    assert abs(result.velocity) < 2 * result.velocity_error
    assert (result.outcome, result.outcome_evidence) == (ec.Outcome.CYCLING, ec.Evidence.UNDECIDED)
    bound = float(result.reason.rpartition(" ")[2])
    assert bound == pytest.approx(abs(result.velocity) + 2 * result.velocity_error, rel=0.1)


def test_a_chain_that_creeps_uphill_and_its_mirror_image_say_so() -> None:
    run, image = (
        ec.creep(chain, ec.Cycles(UPHILL, 200)) for chain in (SHALLOW, SHALLOW.mirrored())
    )
    assert run.direction == image.direction == ec.fate(SHALLOW, UPHILL).direction == "uphill"
    assert image.velocity == -run.velocity > 0
    lives = ec.survival(SHALLOW, UPHILL, starts=12, cycles=300)
    ways = [life.direction for life in lives.lives if life.outcome == "creeping"]
    assert len(ways) == lives.creeping.starts
    assert ways.count("uphill") == lives.directions["uphill"].starts > 0
