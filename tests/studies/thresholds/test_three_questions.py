"""Questions about a threshold: what each finds, and which other one it names."""

import math
from fractions import Fraction

import numpy as np
import pytest

import exactcreep as ec
from exactcreep.studies.thresholds.intercept import fitted
from exactcreep.studies.thresholds.questions import Lasting
from tests.paper import captions


def test_windows_of_lasting_creep_are_edges_of_the_fate() -> None:
    chain = captions(3)
    found = ec.threshold(chain, low="0.00045", high="0.00049", points=20,
                      edges=True, digits=20)  # fmt: skip
    assert [edge.begins for edge in found.edges] == [True, False, True]
    assert found.edges[0].evidence is ec.Evidence.PROVED
    assert (found.edges[0].lower, found.edges[0].upper) == (found.lower, found.upper)
    for edge in found.edges:
        solver = "certified" if edge.evidence is ec.Evidence.PROVED else "exact"
        sides = [ec.fate(chain, side, solver=solver).outcome for side in (edge.lower, edge.upper)]
        assert [side is ec.Outcome.CREEPING for side in sides] == [not edge.begins, edge.begins]
    assert "(proved), the first of 3 edges of a scan in float64" in found.finding
    told = found.summary()
    assert [one["creep"] for one in told["edges"]] == ["begins", "ends", "begins"]
    assert told["sensitive"] == [*found.sensitive]


@pytest.mark.parametrize(("n", "amplitude"), [(4, Fraction("0.00065")), (6, Fraction("0.00098"))])
def test_where_starts_a_hair_apart_part_the_certified_fate_counts_or_it_is_called_sensitive(
    n: int, amplitude: Fraction
) -> None:
    chain = captions(n)
    question = Lasting(chain, 10_000)
    floats = ec.fate(chain, amplitude, solver="exact").outcome
    assert question.creeps(amplitude) == (n == 6 and floats is not ec.Outcome.CYCLING)
    assert n == 6 or floats is ec.Outcome.CREEPING  # and the certified one is not
    assert question.unsure == {amplitude: question.creeps(amplitude)}
    assert question.sensitive == ([amplitude] if n == 6 else [])


def test_the_error_of_an_intercept_is_its_scatter_over_measurements() -> None:
    random, x = np.random.default_rng(5), np.linspace(0.004, 0.007, 12)
    errors = random.uniform(0.05, 0.5, 12)
    fits = [
        fitted(x, 15_000 * (x - 0.0036) + errors * random.standard_normal(12), errors.copy())
        for _ in range(300)
    ]
    off = np.array([(fit["intercept"] - 0.0036) / fit["error"] for fit in fits])
    steep = np.array([(fit["slope"] - 15_000) / fit["slope_error"] for fit in fits])
    assert abs(off.mean()) < 0.2
    assert 0.9 < min(off.std(), steep.std()) <= max(off.std(), steep.std()) < 1.1
    assert np.mean([fit["chi2"] for fit in fits]) == pytest.approx(10, abs=1)


def test_thirty_sliders_with_disorder_have_the_intercept_and_the_slope_of_the_laws() -> None:
    found = ec.threshold(captions(30, "0.01"), kind="intercept", cycles=100)
    off = abs(found.intercept - found.law_seuil)
    assert off < min(3 * math.hypot(found.error, found.systematic), 0.02 * found.law_seuil)
    assert found.slope == pytest.approx(found.law_slope, rel=0.02)
    assert found.law_slope == 15000
    assert f"moves it by up to {found.systematic:.2g}" in found.finding
    assert found.evidence is ec.Evidence.COMPUTED
    assert found.amplitudes[[0, -1]] == pytest.approx(np.array([1.2, 2]) * found.law_seuil)


def test_stairs_are_no_straight_line_and_leave_the_threshold_undecided() -> None:
    stairs = ec.threshold(captions(2), kind="intercept", cycles=60)
    assert "steps" in stairs.reason
    assert stairs.systematic == math.inf  # the upper half lies on one step
    assert stairs.summary()["systematic"] is None
    bent = ec.threshold(captions(6, "0.01"), kind="intercept", fit=("0.5", "3"), cycles=150)
    assert "chi2" in bent.reason
    assert bent.chi2_probability < 0.01
    assert {stairs.evidence, bent.evidence} == {ec.Evidence.UNDECIDED}


@pytest.mark.parametrize(
    ("tangent", "pulls", "way"),
    [("0.1", ("-0.6", "0"), "uphill"), ("0", ("0.2", "0"), "+x"), ("-0.1", ("0", "0.5"), "uphill")],
)
def test_two_pulled_sliders_creep_where_the_forces_drive_them(
    tangent: str, pulls: tuple[str, str], way: str
) -> None:
    chain = ec.Chain(2, 1000, "0.5", "0.6", tan_alpha=tangent, end_forces=pulls)
    found = ec.threshold(chain, digits=8)
    assert found.evidence is ec.Evidence.PROVED
    assert found.direction == way
    for amplitude, creeps in ((found.lower, False), (found.upper, True)):
        run = ec.creep(chain, ec.Cycles(amplitude, 200))
        assert (run.outcome is ec.Outcome.CREEPING) is creeps
    assert ec.laws.edges(chain)["no_lasting_creep"] <= float(found.lower) * (1 + 1e-12)


def test_an_answer_says_its_kind_and_an_intercept_is_never_given_as_an_edge() -> None:
    rough, eight = captions(6, "0.01"), captions(8)
    kinds = [
        ec.threshold(captions(2), digits=5),
        ec.threshold(eight, after=3, digits=5, points=50),
        ec.threshold(rough, cycles=200, points=8),
        ec.threshold(eight, kind="intercept", cycles=200, points=8),
    ]
    assert [found.kind for found in kinds] == ["edge", "edge in cycle 3", "intercept", "intercept"]
    assert all(isinstance(found, ec.results.Threshold) for found in kinds)
    assert all(found.evidence is not ec.Evidence.PROVED for found in kinds[2:])
    with pytest.raises(ec.InputError, match=r"survival.*after.*kind=\"intercept\""):
        ec.threshold(eight)
