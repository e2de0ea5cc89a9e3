"""Drives: which dilations the chain is taken to."""

from fractions import Fraction

import numpy as np
import pytest

from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.numbers import InputError


def test_cycles_alternate_and_begin_with_a_dilation():
    drive = Cycles("0.01", 3)
    assert drive.half_cycles == 6
    assert drive.targets(1, 6).tolist() == [0.01, -0.01] * 3
    assert drive.targets(2, 3).tolist() == [-0.01, 0.01, -0.01]
    assert [drive.exact_target(q) for q in (1, 2)] == [Fraction(1, 100), Fraction(-1, 100)]
    assert drive.cyclic
    assert not drive.random


def test_a_path_is_what_it_was_given():
    drive = Path(["0.1", 0.25, "-1/3"])
    assert drive.half_cycles == 3
    assert drive.targets(1, 3).tolist() == [0.1, 0.25, -1 / 3]
    assert drive.exact_target(3) == Fraction(-1, 3)
    targets = drive.targets(1, 3)
    targets[0] = 7.0
    assert drive.targets(1, 1).tolist() == [0.1]


def test_random_steps_depend_on_the_seed_and_the_number_only():
    drive = GaussianSteps("0.1", 1000)
    assert drive.half_cycles == 1000
    assert drive.random
    whole = drive.targets(1, 1000, seed=3)
    assert whole[499:].tolist() == drive.targets(500, 501, seed=3).tolist()
    assert (whole != drive.targets(1, 1000, seed=4)).all()
    assert abs(whole.mean()) < 0.1 * 4 / np.sqrt(1000)
    assert drive.exact_target(5, seed=3) == Fraction(whole[4])


@pytest.mark.parametrize("drive", [Cycles("0.01", 3), GaussianSteps("0.1", 7), Path(["0.1", 2])])
def test_a_drive_can_be_made_again_from_its_parameters(drive):
    parameters = drive.parameters()
    assert parameters.pop("kind") == drive.kind
    assert type(drive)(**parameters) == drive


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Cycles(-1, 3), "amplitude"),
        (lambda: Cycles("0.1", 0), "cycles"),
        (lambda: Cycles("0.1", 1.5), "cycles"),
        (lambda: Cycles(float("nan"), 3), "amplitude"),
        (lambda: GaussianSteps(-0.1, 3), "sigma_theta"),
        (lambda: GaussianSteps(0.1, 10**13), "steps"),
        (lambda: Path([]), "theta"),
        (lambda: Path("0.1"), "theta"),
        (lambda: Path([0.1, "warm"]), "theta[1]"),
        (lambda: Path(3), "theta"),
    ],
)
def test_impossible_drives_are_refused_by_name(make, field):
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.field == field
