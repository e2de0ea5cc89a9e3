"""How well a run is known: up to which target its tensions and events are those of `certified`."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, Evidence, State, creep, rearrange
from exactcreep.commands.run import known_text
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observed_run import ObservedRun
from exactcreep.watch.limits import NO_LIMITS
from tests.paper import captions, paper_chain

pytestmark = pytest.mark.filterwarnings("ignore:.*a coefficient of friction is mostly")
RECORD = ("tension", "slips")


def test_a_run_says_up_to_where_it_is_known_and_what_holds_beyond() -> None:
    run = creep(paper_chain(6), Cycles("0.01", 150), seed=1)
    assert (run.evidence, run.outcome_evidence) == (Evidence.UNDECIDED, Evidence.UNDECIDED)
    assert 0 < run.known_until < 150
    assert known_text(run) == (
        f"known to 1e-9 up to half-cycle {run.known_until}; the mean velocity holds for the whole"
        " run"
    )
    assert run.finding == "creeping downhill, half-cycles 31 to 300"
    locked = creep(captions(5), Cycles("0.000759", 150))
    assert locked.known_until < 300
    assert known_text(locked).endswith("the outcome is where float64 ended")


def test_a_comparison_settled_by_a_rule_ends_what_is_known_though_the_copies_agree() -> None:
    level = captions(2, tan_alpha="0")  # both ends reach their thresholds at once
    run = creep(level, Cycles("0.003", 10), twin=True)
    assert run.report["undecided"] > 0
    assert (run.known_until, run.evidence) == (0, Evidence.UNDECIDED)


def test_a_start_within_some_roundings_of_where_a_slider_starts_is_undecided() -> None:
    """At one rounding a rule settles it; at six a copy that is further off slips differently."""
    chain = captions(2)
    room = chain.times_cosine(chain.mu_s) - chain.sin_alpha
    for roundings, told in ((1, (1, 0)), (6, (0, 0)), (40, (0, 2))):
        start = State.prepared(chain, [room - roundings * 2.0**-50])
        run = creep(chain, Cycles("1e-5", 1), start=start, burn_in=0)
        assert (run.report["undecided"], run.known_until) == told


def off(run: Creep) -> float:
    """Return the largest error of a tension where a run is known, of the largest force so far.

    It is infinite if a slider has slipped otherwise.
    """
    until, chain = run.known_until, run.chain
    cycles = Cycles(run.drive.amplitude, (max(until, 1) + 1) // 2)
    told = {"seed": run.seed, "start": run.experiment.start, "record": RECORD, "burn_in": 0}
    truth = creep(chain, cycles, solver="certified", **told)
    assert truth.evidence is Evidence.PROVED
    tension, slips = (truth.recorded[name][:until] for name in ("tension", "slips"))
    if (slips != run.recorded["slips"][:until]).any():
        return np.inf
    held = np.array(chain.each("mu_d", chain.times_cosine)) * (slips > 0)
    forces = np.hstack([held, abs(tension).astype(float)]).max(axis=1, initial=1.0)
    forces = np.maximum.accumulate(np.maximum(forces, max(map(abs, chain.end_forces))))
    return float(
        (abs(run.recorded["tension"][:until] - tension).max(axis=1) / forces).max(initial=0)
    )


def disordered(n: int, amplitude: str, cycles: int, seed: int) -> Creep:
    chain = paper_chain(n)
    start = State.perturbed(chain, "1e-3", start_seed=seed, seed=seed)
    told = {"seed": seed, "start": start, "record": RECORD, "burn_in": 0}
    return creep(chain, Cycles(amplitude, cycles), twin=True, **told)


def test_the_tensions_are_right_up_to_where_a_run_is_known() -> None:
    """Of random chains: nearly equal, rough at one slider, pulled, level, with long avalanches."""
    random, reached = np.random.default_rng(60), 0
    for k in range(10):
        n = int(random.integers(2, 7)) if k else 12
        mu_d = [Fraction(int(m), 1000) for m in random.integers(400, 600, n)]
        if k % 3 == 1:
            mu_d[n // 2] *= 10**6
        chain = Chain(
            n, 1000, mu_d, [mu * Fraction(6, 5) for mu in mu_d], "0.01" if k % 2 else 0,
            tan_alpha="0.2" if k % 4 else 0, end_forces=(0, "0.05") if k % 5 == 2 else (0, 0),
        )  # fmt: skip
        run = creep(chain, Cycles(f"{n * 2.5e-4:.9f}", 4), seed=k, record=RECORD, burn_in=0)
        assert (run.evidence is Evidence.COMPUTED) == (run.known_until == run.half_cycles)
        assert off(run) <= 1e-9
        reached += run.known_until
    assert reached > 40


def test_a_run_that_agreed_with_a_distant_copy_once_is_right_where_it_is_known() -> None:
    """The copy was off at its start alone once: it agreed to the end."""
    level = creep(paper_chain(4, tan_alpha="0"), Cycles("0.006", 2), seed=3, record=RECORD)
    for run in (disordered(4, "0.000970143", 30, 7739), level):
        assert 0 < run.known_until < run.half_cycles
        assert off(run) <= 1e-9


@pytest.mark.parametrize("at", [0, 3])
def test_a_coefficient_that_is_never_reached_changes_neither_the_bits_nor_what_is_known(
    at: int,
) -> None:
    runs = []
    for nail in (10**3, 10**6, 10**9, 10**12, 10**15):
        mu_d, mu_s = ["0.5"] * 7, ["0.6"] * 7
        mu_d[at], mu_s[at] = nail - 1, nail
        chain = Chain(7, 1000, mu_d, mu_s, "0.01", tan_alpha="0.25")
        runs.append(creep(chain, Cycles("0.0007", 10), record=(*RECORD, "x", "events"), seed=1))
        first, run = runs[0], runs[-1]
        assert all((run.recorded[k] == first.recorded[k]).all() for k in ("x", "event_time"))
        assert (run.known_until, run.evidence) == (20, Evidence.COMPUTED)
        alone = rearrange(chain, State.relaxed(chain), direction=1)
        assert alone.evidence is Evidence.COMPUTED
        assert alone.error < 1e-14
    assert first.slip_count > 40
    assert off(first) < 1e-13


@pytest.mark.parametrize("size", [Fraction(1, 10**6), 10**3, 10**9])
def test_promises_are_relative_to_the_largest_force(size: Fraction) -> None:
    """With mu = 1e9 tensions are off by some 1e-7 of a weight, and known to 1e-16 of the force."""
    mu_d, mu_s = size * Fraction(1, 2), size * Fraction(3, 5)
    chain = Chain(3, max(size, 1000), mu_d, mu_s, tan_alpha=min(size, 1) / Fraction(4))
    run = creep(chain, Cycles(min(size / 500, Fraction(9, 10)), 5), record=RECORD, burn_in=0)
    assert (run.evidence, run.slip_count > 50) == (Evidence.COMPUTED, True)
    assert off(run) < 1e-13
    alone = rearrange(chain, State.relaxed(chain), direction=1)
    assert alone.evidence is Evidence.COMPUTED
    assert alone.error < 1e-14 * size


def test_a_run_beyond_the_events_of_its_copies_is_known_as_far_as_a_twin_shows() -> None:
    for n, sigma_mu in ((2, "0.01"), (3, "0.01"), (3, "0")):
        chain, drive = captions(n, sigma_mu), Cycles("0.0015", 500)
        run, twin = creep(chain, drive), creep(chain, drive, twin=True)
        assert run.event_count > 2**14
        assert run.known_until == twin.known_until == 1000
    chaotic = creep(paper_chain(30), Cycles("0.004", 20))
    assert chaotic.event_count > 2**14
    assert chaotic.known_until < 10


@pytest.mark.parametrize("n", [3, 6])
def test_copies_of_a_chain_that_mirrors_itself_mirror_themselves(n: int) -> None:
    """Else a rounding decides which end slips first, and they part at once."""
    run = ObservedRun(Experiment(captions(n, tan_alpha="0"), Cycles("0.003", 8)))
    run.go_on(NO_LIMITS, lambda: None, pause=0.1)
    assert run.copy.agreed == 16


@pytest.mark.slow
def test_no_run_with_disorder_is_known_further_than_it_is_right() -> None:
    random, reached = np.random.default_rng(37), []
    for k in range(300):
        n = 3 + k % 10
        amplitude = random.uniform(0.9, 1.6) * n * 0.25 / (1 + 1 / 16) ** 0.5 / 2000
        run = disordered(n, f"{amplitude:.9f}", 60, int(random.integers(10**6)))
        assert off(run) <= 1e-9
        reached.append(run.known_until)
    assert np.median(reached) > 10
