"""The solver "auto": the cheapest rung whose error is known, on both sides of an edge."""

from __future__ import annotations

import math
import random
import warnings
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep.laws import LAWS
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import AccuracyWarning, creep
from exactcreep.solvers.auto import KNOWN_BY, choose
from exactcreep.solvers.exact.layout import TENSION_TOLERANCE
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.sliding import Sliding
from exactcreep.studies.audits.audit import audit
from tests.paper import paper_chain

HAIR = Fraction(1, 10**9)


def chain_of(n=6, **changed):
    return paper_chain(n, **({"tan_alpha": "0.23"} | changed))


def sliding_velocity(chain):
    """Return the mean advance in the last two of four cycles with A = 0.01, in exact numbers."""
    simulation = Sliding(exact=True).simulation(chain, State.relaxed(chain), 0, ("x_G",))
    x_g = simulation.follow(Cycles("0.01", 4), 1, 8).recorded["x_G"]
    return float((x_g[7] - x_g[3]) / 4)


def rung(choice, name):
    (found,) = [candidate for candidate in choice.candidates if candidate.name == name]
    return found


def test_without_an_excess_the_sliding_limit_is_exact_and_a_hair_above_it_is_measured():
    drive = Cycles("0.01", 200)
    equal = choose(chain_of(mu_s="0.5", sigma_mu=0), drive, accuracy="1e-6", record=("x_G",))
    assert (equal.name, rung(equal, "sliding").known_by, rung(equal, "sliding").bias) == (
        "sliding",
        "exact",
        0,
    )
    assert equal.pilot is None
    assert not rung(equal, "exact").applies
    above = choose(chain_of(mu_s="0.52", sigma_mu=0), drive, accuracy="0.01", record=("x_G",))
    assert above.pilot is not None
    assert (above.name, rung(above, "sliding").known_by) == ("sliding", "measured")
    assert 0 < rung(above, "sliding").bias <= 0.01
    # slips of 1e-9: no pilot run sees a half-cycle of them, and nothing is claimed
    hair = choose(
        chain_of(mu_s=Fraction(1, 2) + HAIR, sigma_mu=0), drive, accuracy="0.01", record=("x_G",)
    )
    assert (hair.name, rung(hair, "sliding").known_by) == ("exact", "unknown")
    random_coefficients = choose(
        chain_of(mu_s="0.5", sigma_mu="0.01"), drive, accuracy="1e-6", record=("x_G",)
    )
    assert rung(random_coefficients, "sliding").known_by in ("measured", "unknown")
    assert random_coefficients.name == "exact"


def test_the_law_needs_no_run_where_only_the_velocity_is_asked_for():
    chain = chain_of(mu_s="0.5", sigma_mu=0)
    drive = Cycles("0.01", 200)
    velocity_only = choose(chain, drive, accuracy="0.01")
    assert velocity_only.name == "law"
    assert velocity_only.law == (sliding_velocity(chain),)
    assert choose(chain, drive, accuracy="0.01", record=("x_G",)).name == "sliding"
    path = Path(drive.exact_target(q) for q in range(1, 401))
    assert choose(chain, path, accuracy="0.01").name == "sliding"


def test_two_sliders_from_any_start_are_bounded_by_the_excess_on_both_sides_of_the_edge():
    chain = chain_of(n=2, sigma_mu=0)
    start = State.prepared(chain, [0.05])
    drive = Cycles("0.01", 500)
    bound = rung(choose(chain, drive, accuracy="0.5", start=start), "sliding")
    assert bound.known_by == "promised"
    sliding = sliding_velocity(chain)
    excess = chain.excess
    assert bound.bias == pytest.approx(excess / (sliding - excess), rel=1e-12, abs=0)
    edge = Fraction(bound.bias)
    above, below = (
        choose(chain, drive, accuracy=edge * factor, start=start, record=("x_G",))
        for factor in (1 + HAIR, 1 - HAIR)
    )
    assert (above.name, above.pilot) == ("sliding", None)
    assert below.pilot is not None
    measured = creep(chain, drive, start=start).velocity
    narrower = rung(below, "sliding")
    assert narrower.known_by == "measured"
    assert abs(measured - sliding) <= narrower.bias * measured < bound.bias * measured
    assert abs(measured - sliding) <= excess


def test_two_relaxed_sliders_follow_the_staircase_so_the_law_is_exact():
    chain = chain_of(n=2, sigma_mu=0)
    drive = Cycles("0.004", 500)
    choice = choose(chain, drive, accuracy="1e-9")
    assert (choice.name, rung(choice, "law").known_by) == ("law", "exact")
    assert choice.law[0] == pytest.approx(creep(chain, drive).velocity, rel=1e-11, abs=0)
    staircase = LAWS["velocity_th_2_cycle_corrected"].exact
    assert choice.law[0] == float(staircase(**chain.parameters(), amplitude=drive.amplitude))
    mirrored = choose(chain.mirrored(), drive, accuracy="1e-9")
    assert mirrored.law[0] == -choice.law[0]


def test_two_sliders_differ_from_the_sliding_limit_by_at_most_the_excess_on_every_leg():
    rng = random.Random(3)
    largest = 0.0
    for case in range(40):
        tan_alpha = Fraction(rng.randint(1, 49), 100)
        chain = Chain(2, 100, "0.5", Fraction(rng.randint(51, 90), 100), tan_alpha=tan_alpha)
        drive = GaussianSteps(Fraction(rng.randint(1, 40), 1000), 50)
        start = State.relaxed(chain)
        paths = []
        for solver in (Exact(), Sliding()):
            simulation = solver.simulation(chain, start, case, ())
            stretch = simulation.follow(drive, 1, 50)
            paths.append(np.diff(stretch.recorded["x_G"], prepend=0.0))
        gap = np.abs(paths[0] - paths[1]).max() / chain.excess
        assert gap <= 1 + 1e-9
        largest = max(largest, gap)
    assert largest > 0.5


@pytest.mark.parametrize(("accuracy", "name"), [("0.05", "sliding"), ("1e-5", "exact")])
def test_in_all_other_cases_a_pilot_run_measures_the_error(accuracy, name):
    choice = choose(chain_of(), Cycles("0.01", 300), accuracy=accuracy, record=("x_G",))
    found = rung(choice, "sliding")
    assert choice.name == name
    assert found.known_by == "measured"
    assert (found.bias <= float(accuracy)) is (name == "sliding")
    pilot = choice.pilot
    assert pilot is not None
    assert pilot.events > 0
    assert found.bias == pytest.approx(
        (abs(pilot.difference) + 3 * pilot.difference_error) / abs(pilot.velocity), rel=1e-12, abs=0
    )


def test_the_pilot_run_measures_what_two_whole_runs_measure():
    chain = chain_of()
    pilot = choose(chain, Cycles("0.01", 400), accuracy=1e-9).pilot
    whole = Cycles("0.01", pilot.half_cycles // 2)
    exact = creep(chain, whole, burn_in=pilot.burn_in, record=())
    assert pilot.velocity == pytest.approx(exact.velocity, rel=1e-12, abs=0)
    assert pilot.sliding == pytest.approx(sliding_velocity(chain), rel=1e-12)


def test_below_the_threshold_sliding_is_taken_only_if_the_pilot_rests_too():
    chain = chain_of(n=3, sigma_mu=0)
    rest = choose(chain, Cycles("1e-5", 100), accuracy="0.01", record=("x_G",))
    assert rest.name == "sliding"
    assert rest.pilot is not None
    assert rest.pilot.settled == "rest"
    # the relaxed chain of three creeps not yet where its sliding limit does
    creeping = choose(chain, Cycles("0.0005", 100), accuracy="0.01", record=("x_G",))
    assert creeping.name == "exact"


@pytest.mark.parametrize("name", ["x", "tension", "slips", "events"])
def test_trajectories_need_inertia_unless_there_is_no_excess(name):
    drive = Cycles("0.01", 50)
    choice = choose(chain_of(), drive, accuracy="0.5", record=("x_G", name))
    assert choice.name == "exact"
    assert not rung(choice, "sliding").applies
    assert choice.accuracy_reached  # as the pilot knows
    if name != "events":
        equal = choose(
            chain_of(mu_s="0.5", sigma_mu=0), drive, accuracy="0.5", record=("x_G", name)
        )
        assert equal.name == "sliding"


def test_at_the_edge_of_two_pivots_the_open_factor_is_told():
    edge = Chain(4, 1000, "0.5", "0.5", tan_alpha="0.25")
    choice = choose(edge, Cycles("0.01", 100), accuracy="0.01")
    assert len(choice.law) == 2
    assert rung(choice, "sliding").bias == 0.5
    assert choice.name == "sliding"
    assert "nothing is known to be within 0.01" in choice.reason
    beside = Chain(4, 1000, "0.5", "0.5", tan_alpha=Fraction(1, 4) + HAIR)
    assert choose(beside, Cycles("0.01", 100), accuracy="0.01").name == "law"


@pytest.mark.parametrize(("tan_alpha", "applies"), [("0.499999", True), ("0.5", False)])
def test_from_mu_d_on_only_inertia_decides(tan_alpha, applies):
    choice = choose(chain_of(n=3, tan_alpha=tan_alpha), Cycles("1e-4", 20), accuracy="0.1")
    assert rung(choice, "sliding").applies is applies
    assert (choice.law == ()) is not applies
    if not applies:
        assert choice.name == "exact"


def test_one_target_of_a_random_drive_does_not_tell_its_error():
    equal = chain_of(mu_s="0.5", sigma_mu=0)
    choice = choose(equal, GaussianSteps("0.01", 1), accuracy="0.01", record=("x_G",))
    assert math.isnan(rung(choice, "sliding").statistical)
    assert not choice.accuracy_reached


def test_what_cannot_move_or_be_held_needs_no_run():
    single = choose(chain_of(n=1), Cycles("0.01", 9), accuracy="0.01")
    assert (single.name, single.law, rung(single, "law").known_by) == ("law", (0.0,), "exact")
    steep = choose(
        chain_of(n=3, mu_s="0.5", sigma_mu=0, tan_alpha="0.5"), Cycles("1e-4", 9), accuracy="0.1"
    )
    assert (steep.name, rung(steep, "sliding").known_by) == ("sliding", "exact")
    assert single.pilot is steep.pilot is None


def test_the_law_at_the_edge_of_two_pivots_is_open_also_with_an_excess():
    choice = choose(
        chain_of(n=4, mu_s="0.52", tan_alpha="0.25"), Cycles("0.01", 200), accuracy="0.1"
    )
    assert len(choice.law) == 2
    assert rung(choice, "law").bias == pytest.approx(0.5)
    assert rung(choice, "law").known_by == "promised"
    assert rung(choice, "sliding").known_by == "measured"


def test_auto_gives_the_bits_of_the_solver_it_chooses_and_says_which():
    chain, drive = chain_of(), Cycles("0.01", 100)
    for accuracy, name in (("0.05", "sliding"), ("1e-6", "exact")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            auto = creep(chain, drive, solver="auto", accuracy=accuracy)
        direct = creep(chain, drive, solver=name)
        assert auto.report["chosen"] == name
        assert auto.velocity == direct.velocity
        assert auto.recorded["x_G"].tolist() == direct.recorded["x_G"].tolist()
        assert auto.slip_count == direct.slip_count
        assert auto.evidence in (Evidence.COMPUTED, direct.evidence)


def test_auto_goes_on_from_a_capture_with_the_same_choice():
    chain, drive = chain_of(), Cycles("0.01", 60)
    solver = creep(chain, drive, solver="auto", accuracy="0.05").experiment.algorithm
    state = State.relaxed(chain)
    whole = solver.simulation(chain, state, 0, ("x_G",))
    ends = whole.follow(drive, 1, 120).recorded["x_G"]
    first = solver.simulation(chain, state, 0, ("x_G",))
    first.follow(drive, 1, 50)
    second = solver.simulation(chain, state, 0, ("x_G",))
    second.restore(first.capture())
    rest = second.follow(drive, 51, 70).recorded["x_G"]
    assert rest.tolist() == ends[50:].tolist()
    assert second.report()["chosen"] == whole.report()["chosen"]


def season(calm=200, loud=3000):
    """Return a path that hardly moves at first."""
    draw = np.random.default_rng(0)
    first, then = draw.standard_normal(calm), draw.standard_normal(loud)
    return Path(np.concatenate([1e-5 * first, 0.002 * then]).tolist())


def told_by(chain, drive, accuracy, seed=0, **options):
    """Return the result of auto and what it tells of its accuracy."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        auto = creep(chain, drive, solver="auto", accuracy=accuracy, seed=seed, **options)
    return auto, auto.report


def test_a_silent_beginning_of_a_path_proves_nothing():
    chain = Chain(3, 1000, "0.5", "0.7", "0.01", tan_alpha="0.2")
    auto, told = told_by(chain, season(), "0.01")
    assert told["chosen"] == "exact"
    assert auto.velocity == creep(chain, season(), record=()).velocity
    assert 0.02 < told["relative_error"] < 0.2  # one seed does not say more
    found = rung(choose(chain, season(), accuracy="0.01"), "sliding")
    assert (found.known_by, found.bias > 1) == ("measured", True)
    others = [creep(chain, season(), seed=seed, record=()).velocity for seed in range(1, 9)]
    assert abs(np.mean(others) - auto.velocity) <= told["relative_error"] * auto.velocity


@pytest.mark.parametrize(("n", "size", "rounding"), [(3, 0.002, 1e-11), (6, 0.003, 0.02)])
def test_a_path_without_disorder_has_no_error_but_that_of_rounding(n, size, rounding):
    path = Path((size * np.random.default_rng(1).standard_normal(120)).tolist())
    chain = chain_of(n=n, sigma_mu=0)
    exact = rung(choose(chain, path, accuracy="0.001", record=("x_G",)), "exact")
    near = State.prepared(chain, [1e-15 * (-1) ** i for i in range(n - 1)])
    one, other = (creep(chain, path, start=start, record=()).velocity for start in (None, near))
    assert TENSION_TOLERANCE <= exact.error < rounding
    assert abs(one - other) <= exact.error * one


def test_a_path_with_disorder_is_followed_by_as_many_seeds_as_decide():
    path = Path((0.003 * np.random.default_rng(1).standard_normal(120)).tolist())
    biases = []
    for accuracy, name in (("0.3", "sliding"), ("0.001", "exact")):
        choice = choose(chain_of(), path, accuracy=accuracy, record=("x_G",))
        assert choice.name == name
        biases.append((rung(choice, "sliding").bias, choice.pilot.difference_error))
    assert biases[1][1] < 0.6 * biases[0][1]


def test_a_long_path_is_looked_at_all_over():
    chain = chain_of()
    loud = 0.02 * np.random.default_rng(1).standard_normal(20000)
    choice = choose(chain, Path(loud.tolist()), accuracy="0.05")
    found = rung(choice, "sliding")
    assert (choice.name, found.known_by) == ("sliding", "estimated")
    assert choice.pilot.windows == 18
    assert found.bias < 0.01
    # the same in a single storm after a long calm: fewer than half of the windows move at all
    storm = Path((np.where(np.arange(20000) < 19000, 1e-7, 1) * loud).tolist())
    choice = choose(chain, storm, accuracy="0.05")
    assert choice.pilot.windows == 0 or rung(choice, "sliding").known_by == "unknown"


def test_a_chain_that_comes_to_rest_after_a_thousand_cycles_is_not_said_to_creep():
    chain = Chain(5, 1000, "0.5", "0.501", "0.01", tan_alpha="0.48")
    auto, told = told_by(chain, Cycles("0.000075", 3000), "0.01", seed=7)
    assert (auto.velocity, told["relative_error"], told["known_by"]) == (0, 0, "exact")
    assert told["accuracy_reached"]


def test_where_a_chain_may_still_be_locked_sliding_is_not_known_to_be_right():
    chain = Chain(30, 1000, "0.5", "0.6", tan_alpha="0.25")
    found = rung(choose(chain, Cycles("0.0037", 300), accuracy="0.5"), "sliding")
    assert found.known_by == "unknown"
    assert "locked" in found.reason


def test_a_chain_that_settles_has_a_velocity_without_a_statistical_error():
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    choice = choose(chain, Cycles("0.00048", 500), accuracy="1e-6")
    assert (choice.name, choice.pilot.settled) == ("exact", "period")
    _, told = told_by(chain, Cycles("0.00048", 500), "1e-6")
    assert (told["known_by"], told["relative_error"]) == ("promised", 1e-12)
    assert choose(chain, Cycles("0.00048", 500), accuracy="1e-14").name == "certified"


def test_every_way_of_knowing_is_met_and_defined():
    theorem = choose(chain_of(mu_s="0.5", sigma_mu=0), Cycles("0.01", 9), accuracy="0.01")
    two = chain_of(n=2, sigma_mu=0)
    start = State.prepared(two, [0.05])
    bound = choose(two, Cycles("0.01", 9), accuracy="0.5", start=start)
    course = choose(two, Cycles("0.01", 9), accuracy="1e-6", question="course")
    silent = choose(chain_of(), GaussianSteps("1e-6", 100), accuracy="0.01")
    met = [
        rung(theorem, "sliding"), rung(bound, "sliding"), rung(course, "exact"),
        rung(silent, "sliding"),
        rung(choose(chain_of(), Cycles("0.01", 300), accuracy="0.05"), "sliding"),
    ]  # fmt: skip
    known = [one.known_by for one in met]
    assert known == ["exact", "promised", "estimated", "unknown", "measured"]
    assert set(known) == set(KNOWN_BY)


def test_a_course_is_followed_by_exact_as_far_as_its_twin_agrees_then_certified_or_refused():
    two = chain_of(n=2)
    auto, told = told_by(two, Cycles("0.003", 50), "1e-6", question="course")
    assert (told["chosen"], told["known_by"]) == ("exact", "estimated")
    assert told["relative_error"] <= 1e-6
    digits = creep(two, Cycles("0.003", 50), solver="certified", digits=20, record=("x_G",))
    off = np.abs(digits.recorded["x_G"] - auto.recorded["x_G"]).max()
    assert off <= told["relative_error"] * max(1, np.abs(auto.state.tensions).max())

    six = chain_of()
    short = Cycles("0.002", 4)
    choice = choose(six, short, accuracy="1e-10", question="course")
    assert choice.name == "certified"
    assert choice.solver.digits >= 20
    with pytest.raises(InputError, match="Ask for fewer half-cycles, or for the velocity"):
        choose(six, Cycles("0.01", 1000), accuracy="1e-6", question="course")
    equal = choose(chain_of(mu_s="0.5", sigma_mu=0), short, accuracy="1e-6", question="course")
    assert (equal.name, rung(equal, "sliding").known_by) == ("sliding", "exact")


def test_cycles_that_certified_follows_are_compared_with_the_floats_of_the_start():
    chain = chain_of(sigma_mu=0)
    run, told = told_by(chain, Cycles("0.002", 2), "1e-13", question="course")
    assert (told["chosen"], told["accuracy_reached"]) == ("certified", True)
    assert run.evidence is Evidence.PROVED


def test_a_forged_accuracy_is_found_by_the_audit():
    everything = ("x_G", "x", "tension", "slips", "events")
    result, told = told_by(chain_of(n=2), Cycles("0.003", 80), "0.01", record=everything)
    assert told["known_by"] in ("measured", "unknown")
    assert audit(result).passed
    for name, forged in (("relative_error", 1e-9), ("known_by", "exact"), ("accuracy_reached", 7)):
        claims = audit(replace(result, report=dict(told) | {name: forged})).findings
        assert [claim.sentence.split()[0] for claim in claims] == [name]
