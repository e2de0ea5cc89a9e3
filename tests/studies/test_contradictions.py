"""What creep, fate, survival and threshold say of random chains does not contradict each other."""

import random
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Outcome, creep, fate, survival
from exactcreep.laws.stopping import stopping_time
from exactcreep.studies.fates.survival import start_of

CYCLES = 600
ARRESTED = {Outcome.AT_REST, Outcome.CYCLING}


def drawn(number: int) -> tuple[Chain, Fraction]:
    """Return a random chain of up to eight sliders, and an amplitude from rest to steady creep."""
    draw = random.Random(number)
    n, sigma = draw.randint(2, 8), draw.choice(["0", "0.01"])
    mu_s = draw.choice(["0.6", f"{draw.uniform(0.53, 0.75):.3f}"])
    steep = draw.choice([0.4, 0.02])
    slope = draw.choice(["0", "0.25", f"{draw.uniform(0, steep):.4f}"])
    chain = Chain(n, 1000, "0.5", mu_s, sigma, tan_alpha=slope)
    law = n * (0.5 - float(chain.tan_alpha)) / 2
    rest = min(float(chain.mu_s), n * (float(chain.mu_s) - float(chain.tan_alpha)) / 2)
    scale = draw.choice([law, rest]) * chain.cos_alpha / 1000
    return chain, Fraction(f"{draw.uniform(0.8, 1.6) * scale:.9f}")


def contradictions(number: int) -> tuple[list[str], str]:
    """Return what two answers about one chain contradict each other in, and what it does."""
    chain, amplitude = drawn(number)
    lasted = survival(chain, amplitude, starts=3, cycles=CYCLES, seed=number, workers=1)
    refuted = []

    def refuse(wrong: bool, what: str, answer: object, other: object) -> None:
        if wrong:
            refuted.append(f"{number}: {what}: {answer} and {other}")

    for k, record in enumerate(lasted.records, 1):
        start, seed = start_of(chain, "1e-3", number, k)
        run = creep(chain, Cycles(amplitude, CYCLES), start=start, seed=seed, record=("x_G",))
        x_g = np.append(run.experiment.initial.displacements.mean(), run.recorded["x_G"][1::2])
        arrested, early = lasted.arrested[k - 1], record.settled_after < CYCLES / 20
        periods = x_g[record.settled_after :: max(record.period, 1)]
        # what is locked in the limit still drifts, by less than any slip
        drift = chain.excess / chain.n if record.marginal else 1e-9
        near = drift / CYCLES if record.marginal else 1e-9 * max(1, abs(run.velocity))
        moves, kinds = np.abs(periods - periods[0]).max() > drift, (record.outcome, run.outcome)
        refuse(arrested and moves, "a last advance and later ones", record.last_advance, periods)
        refuse(arrested and run.outcome not in ARRESTED, "survival and creep", *kinds)
        refuse(arrested and early and abs(run.velocity) > near, "arrest", kinds, run.velocity)
        creeps = run.outcome is Outcome.CREEPING
        refuse(record.outcome == "creeping" and not creeps, "survival and creep", *kinds)
        rests = run.outcome is Outcome.AT_REST
        refuse(rests and record.outcome != "at_rest", "survival and creep", *kinds)
        ends = stopping_time(chain, amplitude).cycles < max(10**6, 100 * CYCLES)
        refuse(bool(run.metastable) != (creeps and ends), "metastable", run.metastable, kinds)
        if chain.sigma_mu != 0:
            continue
        own = fate(chain, amplitude, start=start, cycles=CYCLES, solver="exact")
        mine, its = ((answer.last_advance, answer.marginal) for answer in (own, record))
        refuse((own.outcome.value, mine) != (record.outcome, its), "fate, survival", own, record)
        if own.settled_after is not None and own.settled_after + 3 * own.period < CYCLES:
            refuse(own.outcome is not run.outcome, "fate and creep", own, run)
            refuse(own.direction != run.direction, "directions of fate and creep", own, run)
            far = abs(own.velocity - run.velocity) > near
            early = not own.marginal or own.settled_after < CYCLES / 20
            refuse(far and early, "velocities of fate and creep", own.velocity, run.velocity)
    return refuted, "+".join(sorted({record.outcome for record in lasted.records}))


@pytest.mark.filterwarnings("ignore:a static coefficient was drawn below")
@pytest.mark.parametrize("first", [0, pytest.param(40, marks=pytest.mark.slow)])
def test_no_two_answers_about_a_random_chain_contradict_each_other(first: int) -> None:
    seen, found = Counter[str](), []
    for number in range(first, 300 if first else 40):
        against, outcomes = contradictions(number)
        found += against
        seen[outcomes] += 1
    assert found == []
    assert {"at_rest", "creeping", "cycling", "limit"} <= set(seen)
