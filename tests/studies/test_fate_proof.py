"""Fates that are proved for ever."""

from fractions import Fraction

import flint
import numpy as np
import pytest

from exactcreep import Chain, Evidence, Outcome, fate, threshold
from exactcreep.studies import fate_proof
from exactcreep.studies.fate import Fate
from tests.oracle.rearrangement import integrate


def chain_of(n: int, **changed: str) -> Chain:
    given = {"l0": "1000", "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"} | changed
    return Chain(n, **given)  # type: ignore[arg-type]


def told(found: Fate) -> tuple[object, ...]:
    return found.outcome, found.evidence, found.period, found.settled_after


@pytest.mark.parametrize(
    ("n", "amplitude", "outcome", "period", "settled"),
    [
        (2, "0.0003", Outcome.AT_REST, 1, 0),
        (2, "0.0004", Outcome.CREEPING, 1, 1),
        (3, "0.0007", Outcome.CREEPING, 3, 9),
        (3, "0.00085", Outcome.CREEPING, 15, 11),
        (4, "0.0007", Outcome.CREEPING, 1, 3),
        (4, "0.0009", Outcome.CREEPING, 5, 39),
        (5, "0.000759", Outcome.CYCLING, 1, 25),
    ],
)
def test_a_fate_is_proved_for_ever(
    n: int, amplitude: str, outcome: Outcome, period: int, settled: int
) -> None:
    found = fate(chain_of(n), amplitude)
    assert told(found) == (outcome, Evidence.PROVED, period, settled)


@pytest.mark.parametrize(("n", "amplitude"), [(2, "0.0004"), (3, "0.00066")])
def test_float64_agrees_with_a_proved_advance(n: int, amplitude: str) -> None:
    proved, computed = (fate(chain_of(n), amplitude, solver=s) for s in ("certified", "exact"))
    assert proved.evidence is Evidence.PROVED
    assert proved.period == computed.period
    middle, radius = proved.advance_enclosure
    noise = Fraction(2) ** -44 * proved.period
    assert abs(Fraction(computed.advance) - middle) <= radius + noise


def test_a_chain_of_one_rests() -> None:
    assert told(fate(chain_of(1), "0.01")) == (Outcome.AT_REST, Evidence.PROVED, 1, 0)


def test_what_has_not_settled_is_not_proved() -> None:
    found = fate(chain_of(6), "0.00099", cycles=5)
    assert (found.outcome, found.evidence) == (Outcome.LIMIT, Evidence.UNDECIDED)
    assert found.reason == "not settled within 5 cycles"


def test_a_set_that_is_too_small_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fate_proof, "_ROOM", 0.5)
    found = fate(chain_of(4), "0.0007", cycles=70)
    assert found.evidence is Evidence.UNDECIDED
    assert "may leave the set" in found.reason


def test_a_period_without_the_symmetry_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fate_proof, "mirrored", lambda one, n: ())
    assert fate(chain_of(3), "0.0007", cycles=30).evidence is Evidence.UNDECIDED


def test_the_lone_slips_between_avalanches_are_added_up() -> None:
    def slip(n: int, sign: int) -> object:
        return (("start", (n,), (sign,)), ("stop", (n,), (sign,)))

    def both(one: int, other: int) -> object:
        pair = ("start", (one,), (1,)), ("start", (other,), (1,))
        return (*pair, ("stop", (other,), (1,)), ("stop", (one,), (1,)))

    down, up = both(4, 3), both(1, 2)
    word = fate_proof._Word.of([(slip(4, 1), down), (up, slip(1, 1))], 4)
    assert word is None  # one lone slip comes before its avalanche, one after
    word = fate_proof._Word.of([(slip(4, 1), down), (up, slip(4, -1))], 4)
    assert word is not None
    assert (word.half, word.late) == (2, (0, -1))
    assert fate_proof._Word.of([(down,), (down,)], 4) is None


def test_a_bound_of_the_largest_singular_value_holds() -> None:
    matrix = np.random.default_rng(3).normal(size=(4, 4))
    bound = float(fate_proof._two_norm(flint.arb_mat(matrix.tolist())))
    assert np.linalg.norm(matrix, 2) <= bound <= np.linalg.norm(matrix, 2) * 1.001


def test_the_lasting_edge_of_three_sliders_is_that_of_the_horizon() -> None:
    lasting, horizon = (
        threshold(chain_of(3), criterion=criterion, digits=20, points=200)
        for criterion in ("lasting", "horizon")
    )
    assert (lasting.lower, lasting.upper) == (horizon.lower, horizon.upper)
    assert lasting.evidence is Evidence.PROVED
    below, above = lasting.fates
    assert (below.outcome, above.outcome) == (Outcome.AT_REST, Outcome.CREEPING)


@pytest.mark.slow
def test_five_sliders_creep_for_ever_from_later_than_they_pass_a_horizon() -> None:
    found = threshold(
        chain_of(5), criterion="lasting", digits=20, bracket=("0.0007597", "0.00075971")
    )
    assert found.evidence is Evidence.PROVED
    below, above = found.fates
    assert (below.outcome, above.outcome) == (Outcome.CYCLING, Outcome.CREEPING)
    assert found.summary()["fate_at_upper"]["outcome"] == "creeping"


def test_four_sliders_lock_above_the_horizon_threshold() -> None:
    # float64 has them creep for ever there
    found = fate(chain_of(4), "0.00065")
    assert told(found) == (Outcome.CYCLING, Evidence.PROVED, 1, 75)
    assert fate(chain_of(4), "0.00065", solver="exact").outcome is Outcome.CREEPING


def integrated(found: Fate, cycles: int) -> list[tuple[object, ...]]:
    """Return the itineraries of every half-cycle by an integration of the equations of motion."""
    chain, amplitude = found.chain, float(found.amplitude) * float(found.chain.l0)
    tensions, load = np.zeros(chain.n - 1), 0.0
    draws = np.ones(chain.n, dtype=np.int64)
    out = []
    for half_cycle in range(1, 2 * cycles + 1):
        way = 1 if half_cycle % 2 else -1
        seen: list[object] = []
        while True:
            trajectory = integrate(chain, tensions, draws, way, 0)
            room = way * (way * amplitude - load - trajectory.ramp)
            assert abs(room) > 1e-9  # or rounding decides
            if room < 0:
                break
            seen.append(tuple(trajectory.itinerary))
            tensions, load = trajectory.tensions, load + trajectory.ramp
        tensions = tensions - (way * amplitude - load)
        load = way * amplitude
        out.append(tuple(seen))
    return out


def settled_fates(seed: int, count: int) -> list[Fate]:
    """Return fates of random chains that settle within ten cycles, and do not only rest."""
    rng = np.random.default_rng(seed)
    out: list[Fate] = []
    while len(out) < count:
        mu_d = rng.uniform(0.3, 0.6)
        changed = {
            "mu_d": f"{mu_d:.3f}",
            "mu_s": f"{mu_d + rng.uniform(0.05, 0.2):.3f}",
            "tan_alpha": f"{mu_d * rng.uniform(0.3, 0.9):.3f}",
        }
        chain = chain_of(int(rng.integers(2, 5)), **changed)
        law = chain.n * float(chain.mu_d - chain.tan_alpha) * chain.cos_alpha / 2000
        found = fate(chain, f"{law * rng.uniform(1, 2.5):.6f}", cycles=12)
        if found.itinerary and found.settled_after is not None and found.settled_after <= 10:
            out.append(found)
    return out


@pytest.mark.parametrize(
    "count", [pytest.param(4), pytest.param(40, marks=pytest.mark.slow)]
)
def test_an_integration_goes_through_the_proved_period(count: int) -> None:
    for found in settled_fates(5, count):
        assert found.evidence is Evidence.PROVED
        settled, period = found.settled_after, found.period
        assert settled is not None
        assert period is not None
        halves: list[list[object]] = [[] for _ in range(2 * period)]
        for half_cycle, itinerary in found.itinerary or ():
            halves[half_cycle - 1].append(itinerary)
        wanted = [tuple(half) for half in halves]
        assert integrated(found, settled + 2 * period)[2 * settled :] == 2 * wanted
