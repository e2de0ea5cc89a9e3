"""What commands print where no terminal is: into pipes and files, in any encoding and set-up."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.processes import PATIENCE, PROGRAM, begun, finished

FEW_EVENTS = ("run", "two-sliders-cycles", "--max-events", "50")


@pytest.mark.parametrize(("line", "status"), [(("run", "--help"), 0), (FEW_EVENTS, 3)], ids=str)
def test_a_reader_that_has_seen_enough_changes_no_status(line: tuple[str], status: int) -> None:
    with begun(*PROGRAM, *line) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.wait(PATIENCE) == status
        assert process.stderr is not None
        assert process.stderr.read() == ""


def test_what_a_set_up_forbids_is_said_in_plain_letters(tmp_path: Path) -> None:
    """ASCII alone, warnings as errors, and pictures that ask for LaTeX."""
    tmp_path.joinpath("matplotlibrc").write_text("text.usetex: True\nfont.family: no-such-font\n")
    forbidding = {
        "PYTHONIOENCODING": "ascii",
        "PYTHONWARNINGS": "error",
        "MATPLOTLIBRC": str(tmp_path / "matplotlibrc"),
        "MPLBACKEND": "nonsense",
    }
    picture = tmp_path / "run.png"
    line = ("run", "six-sliders-cycles", "--set", "drive.cycles=80", "--plot", str(picture))
    told = finished(*PROGRAM, *line, **forbidding)
    assert (told.returncode, told.stderr) == (0, f"written: {picture}\n")
    assert re.search(r"half-cycle +\d+\.\d+ \+- 0\.\d+\n", told.stdout)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert finished(*PROGRAM, "fate", "--help", **forbidding).returncode == 0
