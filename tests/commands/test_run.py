"""``exactcreep run`` and ``resume``: what they print, write and keep, and how they leave."""

from __future__ import annotations

import json
import re
import signal
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from exactcreep import Creep, Outcome, resume
from exactcreep.quasistatic.creep_result import load_members
from tests.conftest import Command
from tests.processes import PATIENCE, PROGRAM, begun, wait_until
from tests.test_book import README

SIX, TWO = ("run", "six-sliders-cycles"), ("run", "two-sliders-cycles")
JUMPS = ("run", "chain-jumps")


def cycles(count: int, *more: str) -> tuple[str, ...]:
    return ("--set", f"drive.cycles={count}", *more)


QUICK = (*SIX, *cycles(10))


def words(text: str) -> str:
    return " ".join(text.split())


# --- what is printed -----------------------------------------------------------------------------


def test_a_scene_with_members_prints_what_each_one_sets(command: Command) -> None:
    told = command(*JUMPS, *cycles(3, "--json"))
    members = told.json["members"]
    # every digit that was written is printed, although Python's float holds fewer
    assert '"drive.amplitude": 0.00367441471930044455' in told.out
    start = {"run.start": {"size": 1e-6, "seed": 1}}
    assert members[9]["set"] == {"drive.amplitude": 0.00367441471930044455} | start
    assert [members[0]["set"]["run.start"], len(members)] == ["relaxed", 16]
    assert all(member["half_cycles"] == 6 for member in members)
    assert len({member["x_G"] for member in members}) > 2


def test_numbers_asked_with_digits_are_decimal_strings(command: Command) -> None:
    sure = cycles(4, "--set", "chain.sigma_mu=0", "--solver", "certified", "--digits", "40")
    velocity = command(*TWO, *sure, "--json").json["velocity"]
    assert isinstance(velocity, str)
    assert len(velocity.replace(".", "")) == 40
    # 2 D k with D = 0.1 cos(alpha), tan(alpha) = 1/4, k slips of each slider in a cycle
    assert velocity.startswith("9.70142500145331")


def test_the_readme_shows_what_is_printed_where_no_terminal_folds_it(
    command: Command, drawn: list[Figure], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS")
    text = README.read_text("utf-8")
    line = re.search(r"exactcreep (run .*)$", text, re.MULTILINE)
    shown = re.search(r"^```text\n(six-sliders-cycles: .*?)^```$", text, re.MULTILINE | re.DOTALL)
    untimed = re.compile(r"[\d.]+ s$", re.MULTILINE)
    assert line is not None
    assert shown is not None
    assert untimed.sub("", command(*line[1].split()).out) == untimed.sub("", shown[1])
    assert f": {drawn[0].get_suptitle()}\n" in shown[1]


def test_below_its_threshold_the_equation_of_the_paper_says_nothing(command: Command) -> None:
    for slope in ("1/4", "-1/4", "0"):
        given = "--set", "drive.amplitude=1e-5", "--set", f"chain.tan_alpha={slope}"
        below = command(*SIX, *cycles(5), *given).out
        assert ("paper, Eq. 23 none: below its threshold" in words(below)) == (slope != "0")


# --- what is written -----------------------------------------------------------------------------


def test_the_data_that_are_written_are_those_of_the_run(command: Command) -> None:
    told = command(*SIX, *cycles(10**5), "--max-events", "20000", "--out", "run.nc", "--json")
    loaded = Creep.load("run.nc")
    assert told.code == 3
    assert told.json.items() >= loaded.summary().items()
    assert loaded.reason == "max_events = 20000 was reached"
    assert (loaded.outcome, loaded.solver) == (Outcome.LIMIT, "exact")
    assert min(loaded.velocity, loaded.half_cycles) > 0
    assert not loaded.experiment.twin  # nobody asked for it


# --- checkpoints ---------------------------------------------------------------------------------


def test_resume_prints_what_an_uninterrupted_run_prints(command: Command) -> None:
    whole = command(*JUMPS, *cycles(20, "--json")).json
    most = str(max(member["events"] for member in whole["members"]) - 1)
    part = command(*JUMPS, *cycles(20), "--max-events", most, "--checkpoint", "a.ckpt")
    assert part.code == 3
    again = command("resume", "a.ckpt", "--json", "--out", "a.nc").json
    for member in (*whole["members"], *again["members"]):
        assert member.pop("seconds") > 0
    assert again == whole
    assert len(load_members("a.nc")) == 16


def test_what_is_no_checkpoint_is_refused_and_none_is_overwritten(command: Command) -> None:
    Path("a.ckpt").write_text("PK")
    assert "is not a checkpoint of exactcreep" in command("resume", "a.ckpt").sentence
    assert "exists" in command(*QUICK, "--checkpoint", "a.ckpt").sentence
    assert Path("a.ckpt").read_text() == "PK"
    assert command(*QUICK, "--checkpoint", "a.ckpt", "--force").code == 0
    assert command("resume", "a.ckpt").code == 0


# --- signals and the compiler --------------------------------------------------------------------


@pytest.mark.usefixtures("ignores_ctrl_c")
def test_a_signal_saves_and_summarises_what_was_computed(tmp_path: Path) -> None:
    """In the background of a shell, where Ctrl-C is ignored, SIGTERM does."""
    kept = tmp_path / "a.ckpt"

    def size() -> int:
        return kept.stat().st_size if kept.exists() else 0

    endless = ("--json", "--checkpoint", "a.ckpt", "--every", "0", "--out", "a.nc")
    with begun(*PROGRAM, *TWO, "--set", "drive.cycles=1e9", *endless, cwd=tmp_path) as process:
        # with its third checkpoint, if not before, the loop is running
        wait_until(lambda: size() > 30_000, process)
        process.send_signal(signal.SIGINT)
        pressed = size()
        wait_until(lambda: size() > 2 * pressed, process)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM
    assert json.loads(out)["reason"] == "interrupted"
    assert "exactcreep resume a.ckpt goes on" in err
    loaded = Creep.load(tmp_path / "a.nc")
    assert loaded.half_cycles == json.loads(out)["half_cycles"] > 100
    assert loaded.velocity == pytest.approx(9.757, rel=0.01)
    assert resume(kept, max_events=0).half_cycles == loaded.half_cycles
