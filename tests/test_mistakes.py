"""A mistake that everybody makes is answered with its mend."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from exactcreep import (
    Chain,
    Cycles,
    InputError,
    PhysicsWarning,
    creep,
    load_scene,
    physical,
    threshold,
)
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers import Verlet
from tests.paper import paper_chain

PAIR, DRIVE = paper_chain(2), Cycles("0.005", 5)
ROOF = {"length": 8, "section": "0.003", "mu_d": "0.6", "mu_s": "0.7", "tan_alpha": "0.3",
        "material": "lead"}  # fmt: skip
MADE = {"n": 2, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6"}


@pytest.mark.parametrize(
    ("mistaken", "mend"),
    [
        (lambda: Chain(**MADE, alpha=14), "is the slope, the tangent of the angle: 0.249"),
        (lambda: load_scene("two-sliders-cycles").with_settings({"chain.alpha": 14}), "0.249"),
        (lambda: creep(PAIR, DRIVE, solver="Verlet"), r"did you mean verlet\?"),
        (lambda: threshold(n=3), r"n = 3: belongs to a chain: threshold\(Chain\(n=3, \.\.\.\)"),
        (lambda: creep(DRIVE, n=3), r"creep\(Chain\(n=3"),
        (lambda: Chain(**MADE | {"mu_s": [0.6] * 9}, tan_alpha=0), "numbers, of each slider"),
        (lambda: physical(**ROOF | {"tan_alpha": 1}).creep(DRIVE, time_unit=9), "must exceed tan"),
        (lambda: creep(PAIR, DRIVE, seed=None), "no run is random; default 0"),
    ],
    ids=lambda case: case if isinstance(case, str) else "",
)  # fmt: skip
def test_what_is_refused_says_what_was_meant(mistaken: Callable[[], object], mend: str) -> None:
    with pytest.raises(InputError, match=mend):
        mistaken()


@pytest.mark.parametrize(
    ("implausible", "said"),
    [
        (lambda: Chain(**MADE, tan_alpha=-20), "tan_alpha = -20: a slope of 87 degrees"),
        (lambda: Chain(**MADE | {"mu_s": 50}, tan_alpha=0), "mu_s = 50: .* between 0.1 and 1"),
        (lambda: Chain(**MADE, sigma_mu=5, tan_alpha=0), "sigma_mu = 5: .* less than 0.1"),
        (lambda: physical(**ROOF | {"kappa": 30}), "kappa = 30: .* per kelvin"),
        (lambda: Experiment(PAIR, Cycles(2, 1)), "theta.* reaches 1"),
        (lambda: Experiment(paper_chain(600_000), DRIVE), "sliders = 600000: .* of memory"),
        (lambda: Experiment(PAIR, Cycles("0.005", 10**12)), "events = .*e.14: .* more than a day"),
        (lambda: Verlet(dt=1e-12), "steps = 1e.12: "),
    ],
)  # fmt: skip
def test_what_is_implausible_is_remarked_in_one_place(
    implausible: Callable[[], object], said: str
) -> None:
    with pytest.warns(PhysicsWarning, match=said):
        implausible()
