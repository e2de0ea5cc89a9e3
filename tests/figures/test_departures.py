"""The words of a table name what makes a velocity depart from its law, and nothing else."""

from __future__ import annotations

from fractions import Fraction

import pytest

from exactcreep.figures.departures import nearest_edge, pivot_remark, plateau_edges, reduced
from exactcreep.figures.tables import Point
from exactcreep.laws import pivots


def point(tan_alpha: str, sigma_mu: str = "0.01") -> Point:
    """Return a point of five sliders as in the paper's captions."""
    given = {"l0": "1000", "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": sigma_mu, "amplitude": "0.005"}
    exact = {name: Fraction(text) for name, text in (given | {"tan_alpha": tan_alpha}).items()}
    return Point({}, 1.0, parameters=exact | {"n": 5})


def test_the_pivot_changes_at_the_edges_between_plateaus_and_nowhere_else() -> None:
    friction, off = Fraction(1, 2), Fraction(1, 10**6)
    edges = plateau_edges(5, friction)
    assert (edges[0], edges[-1]) == (friction, -friction)
    for edge in edges[1:3]:
        assert len(pivots(5, edge, friction)) == 2
        assert pivots(5, edge - off, friction) != pivots(5, edge + off, friction)
    for before, after in zip(edges[1:3], edges[:2], strict=True):
        assert pivots(5, before + off, friction) == pivots(5, after - off, friction)


@pytest.mark.parametrize(
    ("tan_alpha", "sigma_mu", "word"),
    [
        ("0.47", "0.01", "close to mu_d"),
        ("0.3", "0.01", "at the edge tan(alpha) = 0.3 "),
        ("0.33", "0", "the excess mu_s - mu_d, which"),
        ("0.34", "0.01", "within 3 (mu_s - mu_d)/N of the edge tan(alpha) = 0.3:"),
        ("0.39", "0.01", "the excess mu_s - mu_d and its scatter"),
    ],
)
def test_a_remark_names_the_nearest_cause(tan_alpha: str, sigma_mu: str, word: str) -> None:
    assert pivot_remark(point(tan_alpha, sigma_mu)).startswith(word)


def test_the_distance_to_an_edge_counts_half_windows_of_two_pivots() -> None:
    assert nearest_edge(point("0.32")) == (Fraction(3, 10), 1)


def test_an_amplitude_is_told_in_units_of_the_threshold() -> None:
    assert reduced(point("0")) == 4.0  # that of N mu_d/(2 l0) = 0.00125
