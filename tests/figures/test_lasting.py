"""The shipped table of lasting thresholds, and what the pictures of fates are made of."""

from fractions import Fraction

import numpy as np
import pytest
import xarray as xr

from exactcreep import Evidence, fate
from exactcreep.figures.catalogue import PICTURES
from exactcreep.figures.pictures import lasting as fate_figures


def computed(name: str, **changed: object) -> xr.Dataset:
    picture = PICTURES[name]
    settings = {**picture.always, **picture.quick[name], **changed}
    return picture.compute(**settings, say=lambda *told: None)


@pytest.mark.parametrize("n", [2, 3, *(pytest.param(n, marks=pytest.mark.slow) for n in (4, 5))])
def test_a_shipped_threshold_is_proved_on_both_sides_to_all_its_digits(n: int) -> None:
    edge = fate_figures.lasting_edges()[n]
    lower, upper = Fraction(edge["lower"]), Fraction(edge["upper"])
    assert 0 < upper - lower < lower / Fraction(10) ** edge["digits"]
    assert edge["digits"] == (1000 if n < 4 else 100)
    for amplitude, side in ((lower, "below"), (upper, "above")):
        found = fate(fate_figures.chain_of(n), amplitude).summary()
        assert found["evidence"] == Evidence.PROVED.value
        assert {name: found[name] for name in edge[side] if name != "advance"} == {
            name: value for name, value in edge[side].items() if name != "advance"
        }
        assert found["advance"] == pytest.approx(edge[side]["advance"], rel=1e-9)
    assert edge["below"]["outcome"] in ("at_rest", "cycling")
    assert edge["above"]["outcome"] == "creeping"


def test_a_shipped_closed_form_lies_within_its_digits() -> None:
    """In Q(c): c**2 = 16/17 at tan(alpha) = 1/4."""
    forms = {n: edge["closed_form"] for n, edge in fate_figures.lasting_edges().items()}
    assert [n for n, form in forms.items() if form] == [2]
    factor, unit = forms[2].split(" ")
    assert unit == "c/l0"
    edge = fate_figures.lasting_edges()[2]
    square = (Fraction(factor) / 1000) ** 2 * Fraction(16, 17)
    assert Fraction(edge["lower"]) ** 2 <= square <= Fraction(edge["upper"]) ** 2


def test_the_map_of_fates_shows_the_proved_thresholds_of_short_chains() -> None:
    sizes = [3, 5]
    data = computed("fate-map", sizes=sizes, low=1.2, high=1.3, count=41)
    for n in sizes:
        edge = float(fate_figures.lasting_edges()[n]["upper"]) / fate_figures.unit_of(n)
        creeps = data["ratio"].to_numpy()[data["kind"].sel(n=n).to_numpy() > 1]
        assert 0 <= creeps[0] - edge < 0.1 / 40


def test_no_chain_of_the_map_rests_above_the_bound_of_rest() -> None:
    data = computed("fate-map", sizes=[4], low=1.0, high=1.4, count=21)
    bound = fate_figures.bound("at_rest", 4)
    rests = data["kind"].sel(n=4).to_numpy() == 0
    assert rests.any()
    assert not rests[data["ratio"].to_numpy() > bound].any()


def test_creep_of_six_sliders_lives_longer_towards_the_last_locked_cycle() -> None:
    data = computed("lifetimes", ratios=[0.95, 0.97], cycles=3000)
    low, high = (data[name].sel(n=6).to_numpy() for name in ("rate_low", "rate_high"))
    assert high[-1] < low[0]  # the intervals are apart
    (table,) = PICTURES["lifetimes"].tables({"lifetimes": data})
    lives = [row.measured for row in table.rows]
    assert np.all(np.diff(lives) > 0)
