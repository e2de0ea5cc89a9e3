"""Drives: which dilations the chain is taken to."""

import numpy as np
import pytest

from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError
from exactcreep.model.targets import Targets
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.creep_result import Creep
from tests.paper import captions


class Growing(Drive):
    """Cycles that grow, from a number of its own."""

    def __init__(self, step: float, count: int) -> None:
        vars(self).update(step=step, count=count)

    @property
    def target_count(self) -> int:
        return self.count

    def targets(self, first: int, count: int, seed: int = 0) -> np.ndarray:
        q = np.arange(first, first + count)
        return self.step * q * (-1.0) ** q


def test_a_drive_of_ones_own_is_kept_as_the_path_of_its_targets(tmp_path):
    chain = captions(2)
    runs = [creep(chain, Growing(step, 20)) for step in (1e-4, 2e-4)]
    assert runs[0].drive == Targets([1e-4 * q * (-1) ** q for q in range(1, 21)])
    assert runs[0].x_G != runs[1].x_G
    runs[0].save(tmp_path / "own.nc")
    assert Creep.load(tmp_path / "own.nc").drive == runs[0].drive
    with pytest.raises(InputError, match=r"drive\.target_count = 2000000: must be a whole number"):
        creep(chain, Growing(1e-4, 2 * 10**6))
