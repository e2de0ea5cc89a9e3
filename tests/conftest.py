"""What tests of every room share."""

from __future__ import annotations

import itertools
import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from matplotlib.figure import Figure

from exactcreep.cli import status
from exactcreep.figures import style
from exactcreep.watch import limits
from tests.pictures import assert_shows_data
from tests.processes import PATIENCE, environment

hypothesis.settings.register_profile("untimed", deadline=None)  # no verdict depends on the clock
hypothesis.settings.load_profile("untimed")
COMPILED = """
from exactcreep import Cycles, State, creep, fate, rearrange
from exactcreep.solvers.exact.layout import LONGEST_SHORT
from tests.paper import captions
drive = Cycles("0.001", 1)
"""
PARTS = (
    """
for n in (3, 2):
    for record in ((), ("rearrangements",)):
        creep(captions(n, "0.01"), drive, record=record)
creep(captions(LONGEST_SHORT + 1), drive)
""",
    """
for each in ("certified", "verlet", "sliding"):
    creep(captions(3), drive, solver=each)
fate(captions(3), "0.001", solver="exact")
rearrange(captions(3), State.relaxed(captions(3)), direction=1).evidence
""",
)
"""What most tests need compiled, each once, in two processes that take about as long."""
LONGEST = ("test_notebooks", "test_book", "test_killed", "test_solid")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the solvers side by side, once, before the workers of xdist each begin to."""
    if getattr(session.config.option, "numprocesses", None):
        words = [(sys.executable, "-c", COMPILED + part) for part in PARTS]
        for process in [subprocess.Popen(each, env=environment()) for each in words]:
            assert process.wait(3 * PATIENCE) == 0  # all that there is to compile


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the long studies take the time that they take, and begin with what takes longest."""
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.timeout(0))
    items.sort(key=lambda item: item.path.stem not in LONGEST)


@dataclass(frozen=True)
class Told:
    """The status that a command left with, and what it printed."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The object that ``--json`` printed."""
        return json.loads(self.out)

    @property
    def sentence(self) -> str:
        """The one sentence by which a command refuses what it is given."""
        lines = self.err.strip().splitlines()
        assert self.code == 2, self.err
        assert self.out == ""
        assert len(lines) == 1
        assert lines[0].startswith("exactcreep: ")
        assert "defect" not in lines[0]
        return lines[0].removeprefix("exactcreep: ")


Command = Callable[..., Told]


@pytest.fixture
def command(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Command:
    """Return a function that runs the program on words, in the test's own directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")

    def call(*words: str) -> Told:
        capsys.readouterr()
        code = status(words)
        return Told(code, *capsys.readouterr())

    return call


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


OutOfTime = Callable[[int], Iterator[int]]


@pytest.fixture
def out_of_time(monkeypatch: pytest.MonkeyPatch) -> OutOfTime:
    """Return a function after which time is over once limits have looked at their clock so often.

    It returns the counter of these looks.
    """

    def after(most: int) -> Iterator[int]:
        looks = itertools.count()
        monkeypatch.setattr(limits, "clock", lambda: 0.0 if next(looks) < most else 1e9)
        return looks

    return after


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    """Close what a test has drawn."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Return the list of the figures that are written to files."""
    kept: list[Figure] = []
    write: Callable[..., None] = style.save_picture

    def save(figure: Figure, path: object, **how: bool) -> None:
        if str(path) != "unused.png":
            write(figure, path, **how)
        assert_shows_data(figure)
        kept.append(figure)

    monkeypatch.setattr(style, "save_picture", save)
    return kept
