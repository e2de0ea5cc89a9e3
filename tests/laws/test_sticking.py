"""The measured law of sliders that stick and slip against the chains that it was judged on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exactcreep import laws
from tests.laws import sticking_chains
from tests.laws.kept import rows

ROWS = {int(row["number"]): row for row in rows(sticking_chains.FILE)}


def test_the_stated_deviation_is_one_standard_deviation_on_chains_held_out() -> None:
    """In each quarter of the range, by length, by G/D, by slope and by disorder."""
    off, limits, places = [], [], []
    for row in filter(sticking_chains.held_out, ROWS.values()):
        about = sticking_chains.parameters(row)
        if laws.beyond_sticking(about):
            continue
        found = laws.prediction_of(about)
        assert found is not None
        (value,), velocity = found.values, float(row["velocity"])
        stated = math.hypot(found.deviation, float(row["error"]))
        off.append(abs(value - velocity) / stated)
        limits.append(abs(np.mean(found.sliding) - velocity) / stated)
        sticks = about["mu_s"] - about["mu_d"]
        gain = laws.sticking_gain(about) / (sticks * laws.cosine(about["tan_alpha"]))
        slope, rough = about["tan_alpha"] / about["mu_d"], about["sigma_mu"] / sticks
        places.append([about["n"], gain, slope, rough])
    within = np.array([np.less(off, k) for k in (1, 2)])
    assert len(off) > 120
    assert 0.6 <= within[0].mean() <= 0.75
    assert within[1].mean() >= 0.93
    assert np.median(limits) > 4 * np.median(off)
    for place in np.array(places, float).T:
        for quarter in np.array_split(np.argsort(place), 4):
            for share, normal in zip(within[:, quarter].mean(axis=1), (0.683, 0.954), strict=True):
                scatter = math.sqrt(normal * (1 - normal) / len(quarter))
                assert abs(share - normal) < 3 * scatter  # of 32 shares


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:a static coefficient was drawn below mu_d")
def test_chains_run_anew_have_the_velocity_of_the_table() -> None:
    for number in (5, 9, 13, 14, 17):
        row, found = ROWS[number], sticking_chains.run(ROWS[number])
        error = math.hypot(float(row["error"]), found["error"])
        assert abs(found["velocity"] - float(row["velocity"])) <= 5 * error


@pytest.mark.parametrize(
    ("about", "inside", "outside", "bound"),
    [
        ({"amplitude": 0.03}, {"n": 60}, {"n": 61}, "N is not between"),
        ({}, {"tan_alpha": 0.4}, {"tan_alpha": 0.4001}, "|tan_alpha| exceeds"),
        ({}, {"mu_s": 0.833}, {"mu_s": 0.834}, "mu_s - mu_d exceeds"),
        ({}, {"mu_s": 0.501, "sigma_mu": 0}, {"mu_s": 0.5}, "mu_s does not exceed"),
        ({}, {"sigma_mu": 0.099}, {"sigma_mu": 0.101}, "sigma_mu exceeds"),
        ({"sigma_mu": 0}, {"n": 8}, {"n": 7}, "fewer than 8"),
        # N m/2 is 1.47 and D is 0.098 at a slope of 0.2
        ({"sigma_mu": 0}, {"amplitude": 0.00295}, {"amplitude": 0.00293}, "below 2 times Eq. 22"),
        ({}, {"amplitude": 0.00168}, {"amplitude": 0.00166}, "G is below 2 D"),
        ({"n": 4}, {"amplitude": 0.00089}, {"amplitude": 0.00087}, "G is below 3 D"),
        ({"tan_alpha": 0.4}, {"amplitude": 0.00094}, {"amplitude": 0.00092}, "G is below D mu_d"),
    ],
)  # fmt: skip
def test_the_range_of_the_law_includes_its_bounds_and_ends_there(
    about: dict[str, float], inside: dict[str, float], outside: dict[str, float], bound: str
) -> None:
    usual = {"n": 10, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "sigma_mu": 0.01, "tan_alpha": 0.2}
    chain = usual | {"amplitude": 0.01} | about
    assert laws.beyond_sticking(chain | inside) == ""
    assert bound in laws.beyond_sticking(chain | outside)
