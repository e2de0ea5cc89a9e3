"""The exact solver against closed forms, invariants and the rules of the model."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, laws, rearrange
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.watch.limits import Limits, Stop
from tests.paper import captions


@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
def test_two_sliders_climb_the_staircase_whatever_the_rational_chain_and_its_start():
    rng, creeping, decided = random.Random(20110603), 0, 0
    while decided < 200:
        mu_d = Fraction(rng.randint(1, 400), rng.randint(200, 400))
        mu_s = mu_d + Fraction(rng.randint(1, 300), rng.randint(100, 1000))
        tangent = mu_d * Fraction(rng.randint(1, 99), 100)
        chain = Chain(2, rng.choice([1, 10, 1000]), mu_d, mu_s, tan_alpha=tangent)
        onset = Fraction(chain.times_cosine(mu_s - tangent))
        amplitude = onset * Fraction(rng.randint(5, 1200), 100) / chain.l0
        stretch = Fraction(chain.excess) * rng.choice([0, Fraction(rng.randint(-40, 40), 41)])
        known = {"mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tangent, "amplitude": amplitude}
        expected = laws.staircase_two_sliders(l0=chain.l0, r0=stretch, **known)
        run = creep(chain, Cycles(amplitude, 6), start=State.prepared(chain, [stretch]))
        if run.report["undecided"]:
            # the amplitude is the float next to an edge of a step: the solver says so
            sides = (chain.l0 * amplitude - onset + side * stretch for side in (-1, 1))
            edges = [side / Fraction(chain.excess) / 2 for side in sides]
            assert min(abs(edge - round(edge)) for edge in edges) < Fraction(1, 10**13)
            continue
        x = run.recorded["x_G"]
        assert (x[-1] - x[3]) / 8 == pytest.approx(float(expected), rel=1e-12, abs=0)
        decided += 1
        creeping += expected > 0
    assert 100 < creeping < 200


@pytest.mark.parametrize(
    ("n", "tan_alpha", "reach", "amplitude"),
    [*((n, 0, 0, Fraction(n, 500)) for n in (2, 3, 6, 30)),
     *((n, "1/4", 0.3, "0.03") for n in (5, 300, 301))],
)  # fmt: skip
def test_the_mirror_image_of_a_chain_moves_as_its_mirror_image_bit_for_bit(
    n: int, tan_alpha: Any, reach: float, amplitude: Any
) -> None:
    """On the level its own: both ends slip at once, which a rule has settled."""
    chain = Chain(n, 1000, "0.5", "0.6", tan_alpha=tan_alpha)
    tensions = np.random.default_rng(n).normal(0, reach, n - 1)
    drive = Cycles(amplitude, 20 if n < 30 else 1)
    one, other = (
        creep(which, drive, start=State.prepared(which, start))
        for which, start in ((chain, tensions), (chain.mirrored(), tensions[::-1].copy()))
    )
    assert np.array_equal(one.state.displacements, -other.state.displacements[::-1])
    assert np.abs(one.state.displacements).max() > 1
    if tan_alpha == 0:
        assert one.report["undecided"] > 0
        assert one.evidence is Evidence.UNDECIDED


def test_a_whole_chain_that_slides_on_unproved_is_given_up():
    gap = Fraction(1, 10**12)
    chain = Chain(10, 1000, "1/1000", Fraction(1, 1000) + gap, "1e-9", tan_alpha="1/1000")
    simulation = ExactSimulation(chain, State.relaxed(chain, 1), 1)
    stretch = simulation.follow(Cycles("0.005", 5), 1, 10)
    assert stretch.stop is Stop.LIMIT
    assert "neither ended" in stretch.reason
    assert simulation.tally.events < 10**6
    given_up = simulation.state()
    simulation.come_to_rest(Limits())  # as a checkpoint does: it must not matter when
    assert simulation.follow(Cycles("0.005", 5), 1, 10).stop is Stop.LIMIT
    assert simulation.state() == given_up


def test_a_chain_of_which_no_force_depends_on_theta_never_rearranges():
    chain = captions(2, expansion=[0])
    for direction in (1, -1):
        nothing = rearrange(chain, State.relaxed(chain), direction=direction)
        assert (nothing.events, nothing.outcome, nothing.theta) == ((), Outcome.AT_REST, 0)


def test_the_velocity_of_a_settled_run_is_right_however_far_the_chain_has_gone():
    """A displacement of 1e9 is rounded by 1e-7, and so is the difference of two."""
    chain, cycles = captions(2), Cycles("0.0011", 20)
    known = {"l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "tan_alpha": 0.25, "amplitude": 0.0011}
    far = replace(State.relaxed(chain), displacements=np.full(2, 1e9))
    velocity = float(laws.staircase_two_sliders(**known))
    assert creep(chain, cycles, start=far).velocity == pytest.approx(velocity, rel=1e-15)
