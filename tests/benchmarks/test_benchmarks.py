"""Timings against what a user would pick instead: ``pytest -m benchmark tests/benchmarks``."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("heyoka", reason='needs the extra "bench"')

from tests.benchmarks import questions
from tests.benchmarks.measurements import (
    SIZES,
    half_cycle_times,
    long_chain_ratio,
    long_run_memory,
    start_up_seconds,
    thread_speed_ups,
    velocity_costs,
)
from tests.benchmarks.rearrangements import SAMPLES, Rearrangements, rearrangement_costs

pytestmark = pytest.mark.benchmark

AT_LEAST = {2: 15.0, 6: 2.0, 30: 2.0, 60: 2.0, 300: 1.5}
"""Times faster than our own Verlet at dt = 0.01: what must not be lost, not what was reached."""


@pytest.mark.parametrize(("n", "amplitude"), SIZES)
def test_a_half_cycle_is_faster_than_by_verlet_at_a_hundredth(n, amplitude):
    measured = half_cycle_times(n, amplitude, turns=5 if n < 100 else 2, seconds=0.1)
    for place, one in enumerate(measured.contestants):
        print(
            f"N = {n}, {one.label}: {measured.seconds(place) * 1e6:.3g} us per half-cycle,"
            f" {measured.ratio(place):.3g} times exact, {one.per_step * 1e9:.3g} ns per step"
        )
    assert measured.ratio(1) >= AT_LEAST[n]


@pytest.fixture(scope="module", params=SIZES[:3], ids=lambda size: f"N={size[0]}")
def singles(request: pytest.FixtureRequest) -> Rearrangements:
    n, amplitude = request.param
    measured = rearrangement_costs(n, amplitude, count=SAMPLES[n] // 2, least=0.05)
    for method in measured.methods:
        print(
            f"N = {n}, {method.label}: {method.seconds * 1e6:.3g} us, nine of ten within"
            f" {method.quantile(0.9):.1e}, wrong {100 * method.wrong:.1f} %"
        )
    return measured


def test_exact_is_right_in_every_rearrangement_and_to_1e_12(singles):
    exact = singles.family("exact")[0]
    assert exact.wrong == 0.0
    assert exact.quantile(1.0) < 1e-12


def test_the_rivals_agree_at_their_finest(singles):
    # they are written independently: where they see the same events, they come to the same place
    for family, within in (("SciPy", 1e-10), ("heyoka", 1e-12)):
        finest = singles.family(family)
        best = min(finest, key=lambda method: method.quantile(0.9))
        assert best.quantile(0.9) < within


def test_verlet_converges_to_first_order_and_to_second_with_events_located(singles):
    if singles.n == 2:
        pytest.skip("two sliders slip one by one: no start in the middle of a motion")
    for family, coarse, fine, order in (
        ("Verlet", "0.001", "0.00001", 1),
        ("Verlet, located", "0.01", "0.001", 2),
    ):
        known = {method.setting: method.quantile(0.9) for method in singles.family(family)}
        ratio = known[f"dt = {coarse}"] / known[f"dt = {fine}"]
        fitted = math.log(ratio) / math.log(float(coarse) / float(fine))
        assert fitted == pytest.approx(order, abs=0.25)


def test_at_equal_accuracy_exact_is_faster_than_everything_else(singles):
    exact, _ = singles.seconds_at("exact", 1e-6)
    for family, least in (("Verlet", 20.0), ("Verlet, located", 5.0), ("heyoka", 25.0),
                          ("SciPy", 700.0)):  # fmt: skip
        seconds, how = singles.seconds_at(family, 1e-6)
        print(f"N = {singles.n}, {family}: {seconds / exact:.3g} times exact ({how})")
        assert seconds >= least * exact


def test_an_event_costs_the_same_in_a_chain_a_thousand_times_longer():
    short, long, ratio = long_chain_ratio(turns=9, half_cycles=40)
    print(f"{short * 1e9:.0f} ns and {long * 1e9:.0f} ns per event")
    assert ratio <= 1.5


def test_two_threads_are_worth_as_much_as_they_are_to_a_loop_that_only_counts():
    exact, spin, ratio = thread_speed_ups(turns=15, seconds=0.1)
    print(f"speed-up {exact:.2f}, of a spinning loop {spin:.2f}")
    assert ratio >= 0.9


def test_a_million_half_cycles_take_no_more_memory_than_ten_thousand():
    took, peak, _ = long_run_memory(10**6)
    _, shorter, _ = long_run_memory(10**4)
    print(f"{took:.2f} s, {peak} bytes; 10^4: {shorter} bytes")
    assert peak < 2**20
    assert peak < shorter + 8 * 10**6 / 8  # far below one float per half-cycle


def test_the_kernel_is_compiled_within_40_s_once():
    first, second = start_up_seconds()
    print(f"{first:.1f} s of processor time with compilation, {second:.1f} s afterwards")
    assert first < 40
    assert second < first / 3


@pytest.mark.parametrize(("n", "amplitude"), SIZES[:4])
def test_a_mean_velocity_costs_no_more_than_twice_verlet_at_three_tenths(n, amplitude):
    measured = velocity_costs(n, amplitude, members=8, seconds=0.8)
    print(
        f"N = {n}: {measured.mean}, errors {measured.error}, bias {measured.bias:+.1f} errors,"
        f" Verlet / exact: {measured.time_ratio:.2g} per half-cycle, {measured.cost_ratio:.2g} at"
        " equal error"
    )
    assert measured.time_ratio >= 0.4
    assert math.isfinite(measured.cost_ratio)


@pytest.mark.parametrize("n", questions.AMPLITUDES)
def test_a_mean_velocity_to_three_per_cent_has_an_answer_by_exact(n):
    answers = list(questions.mean_velocity(n, members=8, seconds=0.3))
    for one in answers:
        print(f"{one.question}, N = {one.n}, {one.method}: {one.seconds:.2g} s, {one.note}")
    answered = {one.method for one in answers if one.seconds > 0 and "3 %" in one.question}
    assert "exact" in answered


def test_thresholds_and_fates_are_proved():
    answers = [*questions.thresholds(), *questions.fates()]
    for one in answers:
        print(f"{one.question}, N = {one.n}, {one.method}: {one.seconds:.2g} s, {one.note}")
    assert all("proved" in one.note for one in answers if one.method == "certified")
