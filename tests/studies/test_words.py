"""What creep, fate and survival say of one chain is the same, in the same words."""

import random
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    Evidence,
    GaussianSteps,
    InputError,
    Outcome,
    creep,
    fate,
    plan,
    resume,
    threshold,
)
from tests.paper import captions


def drawn(number: int) -> tuple[Chain, Fraction]:
    """Return a random short chain and an amplitude near its law."""
    draw = random.Random(number)
    n = draw.randint(2, 6)
    chain = captions(n, tan_alpha=f"{draw.uniform(0.05, 0.4):.3f}")
    law = n * (0.5 - float(chain.tan_alpha)) * chain.cos_alpha / 2000
    return chain, Fraction(f"{draw.uniform(0.5, 2) * law:.9f}")


@pytest.mark.parametrize("solver", ["exact", "certified", "reference", "mpmath", "verlet"])
def test_a_chain_that_locked_early_is_cycling_since_then_in_every_solver(solver: str) -> None:
    """Its ends go on slipping in every cycle; no solver sees it move after the third."""
    chain, amplitude = captions(4, tan_alpha="0.212"), "0.00061107"
    settled = fate(chain, amplitude)
    assert (settled.outcome, settled.evidence) == (Outcome.CYCLING, Evidence.PROVED)
    assert settled.last_advance == 3
    options = {"dt": "0.001"} if solver == "verlet" else {}
    result = creep(chain, Cycles(amplitude, 9), solver=solver, **options)
    assert (result.outcome, result.since) == (Outcome.CYCLING, settled.settled_after)
    assert result.velocity == 0
    assert result.settled
    if result.outcome_evidence is not Evidence.UNDECIDED:  # its tensions return exactly
        assert result.velocity_error == 0
        assert f"up to cycle {result.since}" in result.reason
    worth = {"exact": Evidence.COMPUTED, "certified": Evidence.PROVED}
    assert result.outcome_evidence is worth.get(solver, result.outcome_evidence)


def test_a_drift_below_two_standard_errors_is_not_called_creep() -> None:
    result = creep(captions(30), Cycles(Fraction("0.00338337"), 1500), record=())
    assert abs(result.velocity) < 2 * result.velocity_error
    assert (result.outcome, result.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
    bound = float(result.reason.rpartition(" ")[2])
    assert bound == pytest.approx(abs(result.velocity) + 2 * result.velocity_error, rel=0.1)
    level = creep(captions(6, "0.01", tan_alpha="0"), GaussianSteps("0.01", 400), seed=3)
    assert (level.outcome, level.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)


def test_a_run_in_parts_knows_since_when_as_one_in_a_piece_does(tmp_path: Path) -> None:
    for chain, amplitude, cycles in ((captions(5), "0.000759", 5000), (captions(4), "0.0009", 90)):
        path = tmp_path / f"{chain.n}.checkpoint"
        whole = creep(chain, Cycles(amplitude, cycles))
        cut = creep(chain, Cycles(amplitude, cycles), max_events=300, checkpoint=path)
        assert (cut.outcome, cut.since) == (Outcome.LIMIT, None)
        for more in (350, 4 * 10**6):
            cut = resume(path, max_events=more)
        assert (cut.outcome, cut.since, cut.reason) == (whole.outcome, whole.since, whole.reason)
        assert cut.velocity == whole.velocity
        kept = tmp_path / f"{chain.n}.nc"
        cut.save(kept)
        assert Creep.load(kept).since == whole.since == whole.summary()["since"]


@pytest.mark.parametrize(
    ("n", "tan_alpha", "amplitude", "settled", "period"),
    [(3, "0.217", "0.000754859", 6, 157), (4, "0.286", "0.000538196", 205, 125)],
)
def test_velocity_of_a_settled_chain_is_that_of_its_cycle(
    n: int, tan_alpha: str, amplitude: str, settled: int, period: int
) -> None:
    chain = captions(n, tan_alpha=tan_alpha)
    known = fate(chain, amplitude, solver="exact")
    assert (known.settled_after, known.period) == (settled, period)
    result = creep(chain, Cycles(amplitude, settled + 2 * period + 1))
    x = result.recorded["x_G"][1::2]
    assert result.outcome is Outcome.CREEPING
    assert result.since <= settled
    assert result.velocity_error == 0
    assert result.velocity == pytest.approx((x[-1] - x[-1 - period]) / (2 * period), rel=1e-12)
    assert result.velocity == pytest.approx(known.velocity, rel=1e-12)


def test_the_tensions_and_not_only_x_g_repeat_since_then() -> None:
    """In its first cycle x_G comes back, but the tensions do not: the ends slip in two ways."""
    chain, drive = captions(3, tan_alpha="0.054"), Cycles("0.001071506", 4)
    result = creep(chain, drive, record=("x_G", "tension"))
    x, tensions = result.recorded["x_G"][1::2], result.recorded["tension"][1::2]
    assert np.allclose(x, 0, atol=1e-12)
    assert result.since == 1 == fate(chain, drive.amplitude, solver="exact").settled_after
    assert np.array_equal(tensions[0], tensions[1])
    load = float(chain.l0 * drive.amplitude)
    assert not np.allclose(tensions[0], load, atol=1e-3)  # as without any slip


def held_against(chain: Chain, amplitude: Fraction) -> Outcome:
    """Hold all that speaks of one chain against what its fate is in float64; return that."""
    settled = fate(chain, amplitude, solver="exact", cycles=1000)
    proved = fate(chain, amplitude, cycles=25)
    assert settled.evidence is not Evidence.PROVED
    assert (proved.evidence is Evidence.PROVED) == (proved.settled_after is not None)
    if Outcome.LIMIT in (settled.outcome, proved.outcome):
        return Outcome.LIMIT
    velocity = pytest.approx(settled.velocity, rel=1e-9, abs=1e-12)
    assert (proved.outcome, proved.velocity) == (settled.outcome, velocity)
    planned = plan(chain, Cycles(amplitude, 100))
    assert planned.solver != "law" or planned.law == (velocity,)

    # the scan of a threshold passes through this amplitude, and calls it what fate does
    points = [amplitude * k / 4 for k in range(2, 7)]
    fates = [fate(chain, a, solver="exact").outcome for a in points]
    idle = [outcome in (Outcome.CYCLING, Outcome.AT_REST) for outcome in fates]
    scan = {"low": points[0], "high": points[-1], "points": 4, "solver": "exact", "digits": 6}
    if idle[0] and not all(idle):
        edges = threshold(chain, windows=True, **scan).windows
        called = [sum(1 if e.begins else -1 for e in edges if e.middle < a) for a in points]
        assert called == [0 if locked else 1 for locked in idle]
    else:
        with pytest.raises(InputError) as refused:
            threshold(chain, windows=True, **scan)
        assert refused.value.field == ("to" if all(idle) else "from")
    return settled.outcome


@pytest.mark.parametrize("count", [pytest.param(9), pytest.param(150, marks=pytest.mark.slow)])
def test_all_that_speaks_of_a_chain_says_the_same(count: int) -> None:
    cases = [drawn(number) for number in range(count)]
    seen = {held_against(*case) for case in cases if case[0].n <= 4}
    assert seen >= {Outcome.AT_REST, Outcome.CYCLING, Outcome.CREEPING}


def runs_of(chain: Chain, amplitude: Fraction, cycles: int) -> tuple[Creep, bool]:
    """Hold a certified run against the fate of its chain; return it, and whether it is proved."""
    run = creep(chain, Cycles(amplitude, cycles), solver="certified", record=())
    known = fate(chain, amplitude, cycles=70)
    assert run.evidence is Evidence.PROVED
    if not run.settled:
        assert run.outcome_evidence is not Evidence.PROVED
    elif run.outcome_evidence is known.evidence is Evidence.PROVED:
        assert (run.outcome, run.direction) == (known.outcome, known.direction)
        assert run.velocity == pytest.approx(known.velocity, rel=1e-12)
    return run, known.evidence is Evidence.PROVED


@pytest.mark.parametrize("count", [pytest.param(10), pytest.param(60, marks=pytest.mark.slow)])
def test_what_a_run_proves_for_ever_is_the_fate_of_its_chain(count: int) -> None:
    """Two of them creep to the end of their runs, and lock or rest some cycles later."""
    cases = [(captions(5), Fraction("0.00079"), 20), (captions(2), Fraction("0.001"), 5)]
    cases += [(captions(4, tan_alpha="0.3"), Fraction("0.000532435"), 57)]
    cases += [(*drawn(number), 2 + 7 * number % 24) for number in range(count)]
    seen = {
        (run.outcome, run.outcome_evidence, run.settled)
        for run, proved in (runs_of(*case) for case in cases)
        if proved
    }
    ends = Outcome.AT_REST, Outcome.CYCLING, Outcome.CREEPING
    assert seen >= {(outcome, Evidence.PROVED, True) for outcome in ends}
    assert (Outcome.CREEPING, Evidence.COMPUTED, False) in seen
