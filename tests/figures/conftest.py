"""What the tests of pictures share."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from exactcreep.figures import style


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Return the list to which the figures go that would have been written to files."""
    kept: list[Figure] = []
    monkeypatch.setattr(style, "save_picture", lambda figure, path: kept.append(figure))
    return kept
