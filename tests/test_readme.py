"""Every block of the README does what it says."""

import re
from pathlib import Path

import pytest

from exactcreep.cli import status
from exactcreep.scene import Scene, load_scene

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def test_the_readme_has_exactly_two_set_up_commands_of_one_line_each() -> None:
    set_up = [text for text in blocks("sh") if "pip install" in text]
    assert len(set_up) == 2
    assert all(text.count("\n") == 1 for text in set_up)
    assert "exactcreep run chain-jumps" in set_up[0]
    assert set_up[1].rstrip().rpartition("&&")[2].strip().startswith(".venv/bin/python -m pytest")


@pytest.mark.parametrize("text", blocks("python"))
def test_a_python_block_runs(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(text, "README.md", "exec"), {})
    assert capsys.readouterr().out


@pytest.mark.parametrize("text", blocks("toml"))
def test_a_toml_block_is_a_scene(text: str) -> None:
    assert Scene.from_text(text).members()


COMMANDS = [
    line.removeprefix("exactcreep ").split()
    for text in blocks("sh")
    for line in text.splitlines()
    if line.startswith("exactcreep ")
]


def test_the_commands_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert COMMANDS
    monkeypatch.chdir(tmp_path)
    for words in COMMANDS:
        # shorter than for a reader
        cycles = words[0] == "run" and "cycles" in load_scene(words[1]).tables["drive"]
        short = ["--set", "drive.cycles=4"] if cycles else []
        assert status([*words, *short]) == 0, capsys.readouterr()
    assert {path.name for path in tmp_path.iterdir()} >= {"run.nc", "run.png", "jumps.nc"}


def test_licence_citation_and_ci_script_are_there() -> None:
    assert "MIT License" in (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "061303" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111
