"""What tests of every room share."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the long studies take the time that they take, and begin with what takes longest."""
    for item in items:
        if item.get_closest_marker("slow") or item.get_closest_marker("benchmark"):
            item.add_marker(pytest.mark.timeout(0))
    items.sort(key=lambda item: item.path.stem != "test_notebooks")


@pytest.fixture
def hears_ctrl_c() -> Iterator[None]:
    """Let this process and those that it starts hear SIGINT as they do in a terminal.

    A shell that starts the tests in the background has it ignored, and children inherit that.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def ignores_ctrl_c() -> Iterator[None]:
    """Let this process and those that it starts ignore SIGINT, as in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)
