"""Pictures as large, and as fine, as they are asked for."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from tests.conftest import Command

RUN = ("run", "two-sliders-cycles", "--set", "drive.cycles=5")


def pixels_of(path: Path) -> tuple[int, int]:
    with Image.open(path) as image:
        return image.size


def test_a_picture_has_the_size_and_the_dots_that_were_asked_for(
    command: Command, tmp_path: Path
) -> None:
    plot = tmp_path / "run.png"
    for words, pixels in (
        (("--size", "5x2.5", "--dpi", "40"), (200, 100)),
        (("--size", "3x3"), (450, 450)),
        (("--dpi", "50"), (320, 260)),
    ):
        assert command(*RUN, "--plot", str(plot), "--force", *words).code == 0
        assert pixels_of(plot) == pixels
    moving = tmp_path / "moving.gif"
    scene = ("animate", "two-sliders-cycles", "--frames", "2", "--out", str(moving))
    assert command(*scene, "--size", "4x4", "--dpi", "50").code == 0
    assert pixels_of(moving) == (200, 200)


@pytest.mark.parametrize(
    "words",
    [("--size", "5"), ("--size", "0x3"), ("--size", "3x99"), ("--dpi", "3"), ("--dpi", "fine")],
)
def test_a_size_that_is_none_is_refused_before_anything_runs(
    command: Command, tmp_path: Path, words: tuple[str, str]
) -> None:
    plot = tmp_path / "run.png"
    told = command(*RUN, "--plot", str(plot), *words)
    assert told.code == 2
    assert words[0].strip("-") in told.sentence
    assert not plot.exists()


def test_the_size_of_no_picture_is_refused(command: Command) -> None:
    told = command(*RUN, "--size", "5x5")
    assert told.code == 2
    assert "--plot" in told.sentence
    told = command("animate", "two-sliders-cycles", "--out", "page.html", "--dpi", "50")
    assert told.code == 2
    assert "page" in told.sentence
