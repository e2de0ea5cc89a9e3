"""Invariants under load: what must hold for every chain, drive and seed."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from exactcreep import Chain, Creep, Outcome, Targets, creep
from exactcreep.quasistatic.creep import PhysicsWarning
from tests.paper import paper_chain

pytestmark = pytest.mark.filterwarnings(f"ignore::{PhysicsWarning.__module__}.PhysicsWarning")
MOST_EVENTS = 1500


def rationals(low: int, high: int, over: int) -> st.SearchStrategy[Fraction]:
    return st.integers(low, high).map(lambda k: Fraction(k, over))


@st.composite
def cases(draw: st.DrawFn) -> tuple[Chain, list[Fraction], int]:
    """Draw a chain below mu_d, where it is taken to, and the key of its disorder."""
    n = draw(st.integers(2, 12))
    l0 = draw(st.sampled_from([Fraction(1, 10**6), Fraction(1), Fraction(1000), Fraction(10**15)]))
    mu_d = draw(rationals(1, 999, 1000))
    excess = draw(st.sampled_from(["1e-3", "0.02", "0.1", "1"]))
    noise = draw(st.sampled_from(["0", "1e-9", "0.01", "0.1"]))
    slope = mu_d * draw(rationals(-9, 9, 10))
    chain = Chain(n, l0, mu_d, mu_d + Fraction(excess), noise, tan_alpha=slope)
    unit = Fraction(chain.times_cosine(mu_d + Fraction(excess)))
    reach = draw(st.lists(rationals(-300, 300, 100), min_size=1, max_size=4))
    return chain, [r * unit / l0 for r in reach], draw(st.integers(0, 2**64 - 1))


LOAD = settings(max_examples=20, deadline=None, derandomize=True, database=None,
                suppress_health_check=[HealthCheck.too_slow])  # fmt: skip


def same_motion(one: Creep, other: Creep) -> bool:
    return (
        np.array_equal(one.state.displacements, other.state.displacements)
        and np.array_equal(one.state.tensions, other.state.tensions)
        and (one.event_count, one.slip_count) == (other.event_count, other.slip_count)
        and one.report["undecided"] == other.report["undecided"]
    )


def pair(amplitude: str, **changed: object) -> tuple[Chain, list[Fraction], int]:
    """Return two sliders that slip one after the other, by a loop of the solver's own."""
    theta = Fraction(amplitude)
    return paper_chain(2, **changed), [theta, -theta] * 3, 2


@LOAD
@example(pair("0.01"), [])
@example(pair("0.001", sigma_mu="0", tan_alpha=0), [])
@example(pair("0.01", mu_s="0.55", sigma_mu="0.1", tan_alpha="0.01"), [])
@example(pair("0.01", mu_s="1.45", sigma_mu="0.5", tan_alpha="-0.48"), [])
@given(cases(), st.lists(rationals(1, 99, 100), max_size=5))
def test_breakpoints_and_output_change_no_bit(
    case: tuple[Chain, list[Fraction], int], cuts: list[Fraction]
) -> None:
    chain, path, seed = case

    def run(theta: list[Fraction], **more: object) -> Creep:
        return creep(chain, Targets(theta), seed=seed, max_events=MOST_EVENTS, **more)

    plain = run(path)
    if plain.outcome is Outcome.LIMIT:
        return
    broken: list[Fraction] = []
    before = Fraction(0)
    for theta in path:
        broken += [before + cut * (theta - before) for cut in sorted(cuts)] + [theta] * 2
        before = theta
    for other in (
        run(broken),
        run(path, record=("x", "tension", "slips", "events")),
        run(path, record=()),
    ):
        assert same_motion(plain, other)
