"""A mistake that everybody makes is answered with its mend."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import pytest

import exactcreep
from exactcreep import Chain, Cycles, InputError, creep, laws, load_scene, threshold
from exactcreep.model.outcome import Outcome
from tests.paper import paper_chain

PAIR, DRIVE = paper_chain(2), Cycles("0.005", 5)
MADE = {"n": 2, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6"}


@pytest.mark.parametrize(
    ("mistaken", "mend"),
    [
        (lambda: Chain(**MADE, alpha=14), "is the slope, the tangent of the angle: 0.249"),
        (lambda: Chain(**MADE, angle="steep", tan_alpha=0), "of the angle: 0.268 for 15 degrees"),
        (lambda: load_scene("two-sliders-cycles").with_settings({"chain.alpha": 14}), "0.249"),
        (lambda: creep(PAIR, DRIVE, solver="Verlet"), r"did you mean verlet\?"),
        (lambda: load_scene("six-slider-cycles"), r"did you mean six-sliders-cycles\?"),
        (lambda: threshold(n=3), r"n = 3: belongs to a chain: threshold\(Chain\(n=3, \.\.\.\)"),
        (lambda: creep(DRIVE, n=3), r"creep\(Chain\(n=3"),
        (lambda: Chain(**MADE | {"mu_s": [0.6] * 9}, tan_alpha=0), "numbers, of each slider"),
        (lambda: creep(PAIR, DRIVE, seed=None), "no run is random; default 0"),
    ],
    ids=lambda case: case if isinstance(case, str) else "",
)  # fmt: skip
def test_what_is_refused_says_what_was_meant(mistaken: Callable[[], object], mend: str) -> None:
    with pytest.raises(InputError, match=mend):
        mistaken()


def test_a_law_names_the_numbers_that_it_takes() -> None:
    with pytest.raises(
        TypeError, match=r"creep_velocity\(\*, n, l0, mu_d, .* takes numbers by name"
    ):
        laws.creep_velocity(6, 1000)  # type: ignore[misc]


def test_what_a_chain_does_not_have_leads_to_the_page_on_it() -> None:
    with pytest.raises(AttributeError, match=r"'distribution'; the page explanation/scope of the"):
        PAIR.distribution  # type: ignore[attr-defined] # noqa: B018
    assert exactcreep.Chain is Chain
    assert pickle.loads(pickle.dumps(PAIR)) == copy.deepcopy(PAIR) == PAIR


def test_a_run_that_was_ended_at_once_averages_over_nothing() -> None:
    run = creep(PAIR, DRIVE, max_events=0)
    assert run.outcome is Outcome.LIMIT
    assert run.velocity_of == "this run, which has no half-cycles after its burn-in"
