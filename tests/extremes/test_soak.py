"""A short soak; ``python -m tests.extremes.soak`` is the one for a night."""

import pytest

from tests.extremes.soak import soak


@pytest.mark.slow
def test_random_scenes_outlive_random_faults() -> None:
    assert soak(240, seed=1000) == []
