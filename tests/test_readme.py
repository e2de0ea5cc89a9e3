"""Every block of the README, and of the pages of the book that go on with it, does what it says."""

import inspect
import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from exactcreep.cli import status
from exactcreep.scene import Scene
from tests.test_architecture import ROOMS

ROOT = Path(__file__).parents[1]
PLACES = tuple(
    Path("notebooks", page).with_suffix(".md")
    for page in (
        "howto/scenes", "explanation/claims", "explanation/speed",
        "howto/temperatures", "explanation/scope", "howto/pictures", "howto/sweeps",
        "howto/export", "howto/avalanches", "contributing",
    )
)  # fmt: skip
"""Pages of the book that go on where the README ends, in an order in which their commands run."""
README = (ROOT / "README.md").read_text(encoding="utf-8")
TOLD = "\n\n".join([README, *((ROOT / page).read_text(encoding="utf-8") for page in PLACES)])
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", TOLD, re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def test_the_map_of_the_rooms_says_of_each_what_it_says_of_itself() -> None:
    told = re.findall(r"^\| `exactcreep/(\w+)` \| (.*) \|$", TOLD, re.MULTILINE)
    folders = {path.parent.name for path in (ROOT / "exactcreep").glob("*/__init__.py")}
    floors = [room for rooms in ROOMS for room in rooms if room in folders]
    assert [room for room, _ in told] == floors
    for room, knows in told:
        said = inspect.getdoc(import_module(f"exactcreep.{room}")) or ""
        assert knows == said.partition("\n\n")[0]


@pytest.mark.parametrize("text", [t for t in blocks("python") if not t.startswith(">>>")])
def test_a_python_block_runs(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "README.md", "exec"), {})
    assert capsys.readouterr().out


@pytest.mark.parametrize("text", blocks("toml"))
def test_a_toml_block_is_a_scene(text: str) -> None:
    assert list(Scene.from_text(text).members())


COMMANDS = [
    shlex.split(line.removeprefix("exactcreep "), comments=True)
    for text in blocks("sh")
    for line in text.splitlines()
    if line.startswith("exactcreep ") and "bristol-roof" not in line  # see test_solid
]
SHORTER = {
    "animate": ["--frames", "2", "--set", "drive.cycles=2"],
    "compare": ["--events", "20", "--dts", "0.1", "--seeds", "1"],
    "run": ["--set", "drive.cycles=3"],
}
"""What is asked for less than a reader does, by command."""


def test_the_commands_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert COMMANDS
    monkeypatch.chdir(tmp_path)
    for words in COMMANDS:
        assert status([*words, *SHORTER.get(words[0], [])]) == 0, capsys.readouterr()
    assert {path.name for path in tmp_path.iterdir()} >= {"run.nc", "run.png", "grid"}
