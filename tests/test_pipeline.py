"""Pipelines in SI units against the continuum, and what their pictures draw."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from exactcreep import InputError, load_scene, pipeline
from exactcreep.figures.walk import friction_bounds
from exactcreep.results import Pipeline
from tests.conftest import Command

STEEL = {"axial_stiffness": "4e9", "submerged_weight": 500, "kappa": "1.17e-5"}
SLOPE = STEEL | {"length": 2000, "friction": "0.5", "tan_alpha": "0.035"}
PULLED = STEEL | {"length": 1500, "friction": "0.4", "end_tension": "6e4"}
ROUGH = SLOPE | {"friction": [(700, "0.7"), (900, "0.3"), (400, "0.5")]}
UPHILL = ROUGH | {"tan_alpha": "-0.02", "end_tension": ("9e4", "2e4")}
PIPES = {"slope": SLOPE, "pulled": PULLED, "rough": ROUGH, "uphill": UPHILL}


def formula(pipe: Pipeline, heating: float) -> float:
    """Return the walk in mm by the formula of walk.md for equal friction."""
    c = 1 / np.hypot(1, float(pipe.tan_alpha))
    s = c * float(pipe.tan_alpha)
    ea, length = float(pipe.axial_stiffness), float(pipe.length)
    weight, ((_, mu),) = float(pipe.submerged_weight), pipe.friction
    pull, f = weight * length * s + float(sum(pipe.end_forces)), float(mu) * weight * c
    constrained = ea * float(pipe.kappa) * heating
    return float(1000 * pull / (ea * f) * (constrained - f * length + abs(pull)))


@pytest.mark.parametrize("name", PIPES)
def test_a_pipe_walks_as_the_continuum_whatever_the_number_of_cells(name: str) -> None:
    for contacts in (12, 40, 100):
        pipe = pipeline(**PIPES[name], contacts=contacts)
        assert contacts / 2 <= pipe.chain.n <= 2 * contacts
        for heating in (60, pipe.critical_heating * 1.3, pipe.critical_heating * 0.9):
            walk = pipe.walk(heating, cycles=4)
            expected = pipe.continuum_walk(heating)
            assert walk.per_cycle[-1] == pytest.approx(expected, rel=1e-9, abs=1e-6)
            assert walk.total == pytest.approx(walk.displacement[-1].mean())
    assert (pipe.continuum_walk(60) < 0) is (name == "uphill")
    assert pipe.walk(60).per_cycle.shape == (1,)
    if len(pipe.friction) == 1:
        assert pipe.continuum_walk(60) == pytest.approx(formula(pipe, 60), rel=1e-12)


@pytest.mark.parametrize("name", PIPES)
def test_forces_reach_the_limits_of_friction_and_meet_the_ends(name: str) -> None:
    pipe = pipeline(**PIPES[name], contacts=200)
    force = pipe.walk(80, cycles=2).axial_force
    places, bounds = friction_bounds(pipe)
    for row, bound, anchor in zip((-2, -1), bounds, pipe.anchors, strict=True):
        there = np.interp(pipe.springs, places, bound)
        assert force[row] == pytest.approx(there, abs=pipe.force_unit)
        outermost = force[row].argmin() if row == -2 else force[row].argmax()
        assert abs(pipe.springs[outermost] - anchor) < 2 * pipe.cell
    upper, lower = map(float, pipe.end_forces)
    assert (force[:, 0] == -upper).all()
    assert (force[:, -1] == lower).all()


def test_the_picture_draws_forces_and_displacements_of_the_walk() -> None:
    walk = pipeline(**ROUGH, contacts=30).walk([60, 40], cycles=2)
    forces, moved = walk.plot().axes
    drawn = [line.get_ydata() for line in forces.lines]
    for row in (-2, -1):
        assert any(np.array_equal(y, walk.axial_force[row] / 1000) for y in drawn)
    assert len(moved.lines) == 8
    for line, row in zip(moved.lines, walk.displacement, strict=True):
        assert np.array_equal(line.get_ydata(), row)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"length": 0}, "length"),
        ({"friction": "0.03"}, "friction"),
        ({"friction": [(700, "0.7")]}, "friction"),
        ({"end_tension": "6e5"}, "friction"),
        ({"static_friction": "0.9"}, "static_friction"),
        ({"profile": [(100, 1), (0, "0.5")]}, "profile"),
        ({"tan_alpha": "1e-7"}, "tan_alpha and end_tension"),
        ({"contacts": 1}, "contacts"),
    ],
)
def test_a_pipe_that_is_none_is_refused_by_field(changed: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as refused:
        pipeline(**SLOPE | changed)
    assert refused.value.name == field


def test_the_scene_prints_millimetres(command: Command) -> None:
    told = command("run", "pipeline-walk", "--json").json
    (member,) = load_scene("pipeline-walk").members()
    assert member.body is not None
    assert told["walk"]["millimetres"][-1] == pytest.approx(member.body.continuum_walk(60))


def test_a_hot_front_walks_a_level_pipe_by_its_friction_alone() -> None:
    """By f L^2/(4 EA) for a sharp front and heat enough; see the page on pipelines."""
    about: dict[str, Any] = STEEL | {"length": 1000, "friction": "0.5", "sigma_mu": "0.002"}
    formula = 1000 * 250 * 1000**2 / (4 * 4e9)

    def walked(contacts: int, heating: int) -> float:
        pipe = pipeline(**about, contacts=contacts, static_friction="1.1")
        front = [[heating * (place < 4 * step) for place in range(161)] for step in range(1, 41)]
        walk = pipe.walk(front, cycles=4, solver="exact")
        return float(walk.per_cycle[1:].mean())

    for contacts in (11, 21):
        assert 0 < formula / walked(contacts, 40) - 1 < 1.8 / contacts
    assert walked(11, 60) == pytest.approx(walked(11, 30), rel=0.05)


def test_the_same_heating_all_along_a_pipe_is_one_number_and_sliding_takes_no_other() -> None:
    pipe = pipeline(**ROUGH, contacts=20)
    one, same = (pipe.walk(heat, cycles=3) for heat in ([60, 40], [[[60, 60]], [[40, 40]]]))
    assert (one.displacement == same.displacement).all()
    for wrong in ([], [[60, 50], [40]], [60, -1]):
        with pytest.raises(InputError, match="heatings"):
            pipe.walk(wrong)
    with pytest.raises(InputError, match="of each cycle; solver"):
        pipe.walk([[60, 50]])
    with pytest.raises(InputError, match="expansion"):
        pipeline(**SLOPE, profile=[(0, 1), (2000, "0.6")]).walk(60)


def test_a_profile_of_heating_has_the_slope_of_the_heating_between_the_anchors() -> None:
    """With `exact`, which needs a peak of friction; a small one."""
    pipe = pipeline(
        **ROUGH, profile=[(0, "1.3"), (2000, "0.7")], static_friction="1.05", contacts=12
    )
    low, high = (pipe.walk(h, cycles=4, solver="exact").per_cycle[-1] for h in (150, 250))
    hot, cold = pipe.anchors
    mean = 1.3 - 0.6 * (hot + cold) / 2 / 2000  # of the profile between them
    slope = 1000 * float(pipe.kappa) * (cold - hot) * mean
    assert (high - low) / 100 == pytest.approx(slope, rel=0.01)
    assert mean > 1.05
