"""The command line: what it prints, what it writes, and with which status it leaves."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from exactcreep import Creep, InputError, resume
from exactcreep.cli import status
from exactcreep.commands.answer import grouped
from exactcreep.quasistatic import checkpoint, files
from exactcreep.quasistatic import creep as loop
from exactcreep.quasistatic.result import load_members
from tests.conftest import Command
from tests.processes import PATIENCE, PROGRAM, begun, environment, finished, wait_until

QUICK = ["run", "six-sliders-cycles", "--set", "drive.cycles=10"]


def test_json_is_one_object_with_the_numbers_of_the_run(command: Command) -> None:
    told = command(*QUICK, "--json", "--seed", "4")
    assert told.code == 0
    names = {"velocity", "velocity_error", "outcome", "evidence", "solver", "half_cycles",
             "rearrangements", "events", "slips", "undecided", "seconds"}  # fmt: skip
    assert names <= set(told.json)
    assert told.json["half_cycles"] == 20
    assert told.json["solver"] == "exact"
    assert told.json["velocity"] == pytest.approx(27.8, rel=0.05)
    assert told.json["events"] >= told.json["slips"] >= told.json["rearrangements"] > 0


def test_a_scene_with_members_prints_what_each_one_sets(command: Command) -> None:
    told = command("run", "chain-jumps", "--set", "drive.cycles=3", "--json")
    members = told.json["members"]
    assert len(members) == 16
    assert members[9]["set"] == {
        "drive.amplitude": 0.00367441471930044455,
        "run.start": {"size": 1e-6, "seed": 1},
    }
    assert members[0]["set"]["run.start"] == "relaxed"
    # every digit that was written is printed, although Python's float holds fewer
    assert '"drive.amplitude": 0.00367441471930044455' in told.out
    assert all(member["half_cycles"] == 6 for member in members)
    assert len({member["x_G"] for member in members}) > 2


def test_a_number_that_is_not_finite_is_null(command: Command) -> None:
    told = command("run", "two-sliders-cycles", "--set", "drive.cycles=1", "--json")
    assert told.json["velocity"] is None
    assert told.json["velocity_error"] is None


def test_numbers_asked_with_digits_are_decimal_strings(command: Command) -> None:
    sure = ("--set", "drive.cycles=4", "--set", "chain.sigma_mu=0")
    told = command("run", "two-sliders-cycles", *sure, "--solver", "mpmath", "--digits", "40",
                   "--json")  # fmt: skip
    assert told.code == 0
    velocity = told.json["velocity"]
    assert isinstance(velocity, str)
    assert len(velocity.replace(".", "")) == 40
    # 2 D k with D = 0.1 cos(alpha), tan(alpha) = 1/4, k slips of each slider in a cycle
    assert velocity.startswith("9.70142500145331")


def test_the_summary_puts_the_paper_s_prediction_beside_the_measured_value(
    command: Command,
) -> None:
    told = command("run", "six-sliders-cycles", "--set", "drive.cycles=80")
    assert told.code == 0
    assert re.search(r"velocity per half-cycle +2[78]\.\d+ ± 0\.\d+", told.out)
    assert re.search(r"paper, Eq\. \(vitesse_seuil\) +27\.8172", told.out)
    assert "creeping" in told.out
    words = " ".join(told.out.split())
    assert "evidence undecided: outcome and velocity are statistics" in words
    assert re.search(r"beyond half-cycle \d+ rounding errors have grown as large as slips", words)


def test_members_that_come_to_the_same_share_a_line(command: Command) -> None:
    sizes = "vary.drive.amplitude=[1e-5,0.001]"
    starts = 'vary.run.start=["relaxed",{size=1e-9,seed=1}]'
    told = command("run", "two-sliders-cycles", "--set", "drive.cycles=5", "--set", sizes,
                   "--set", starts)  # fmt: skip
    assert told.code == 0
    first, second = (line for line in told.out.splitlines() if "(2 members)" in line)
    assert first.split()[:3] == ["1e-05", "relaxed", "…"]
    assert "at_rest" in first
    assert second.split()[0] == "0.001"
    assert "creeping" in second
    assert "4 members" in told.out


def test_groups_are_of_neighbours_that_differ_in_one_thing() -> None:
    settings = [{"a": a, "b": b} for a in (1, 2, 3) for b in (1, 2)]
    names = [[f"{a}", f"{b}"] for a in (1, 2, 3) for b in (1, 2)]
    assert [row for row, _ in grouped(settings, "uvwxyz")] == names
    assert grouped(settings, "uuuuuu") == [(["1 … 3", "1 … 2"], [0, 1, 2, 3, 4, 5])]
    assert grouped(settings, "uuuvuu") == [
        (["1", "1 … 2"], [0, 1]), (["2", "1"], [2]), (["2", "2"], [3]), (["3", "1 … 2"], [4, 5]),
    ]  # fmt: skip
    assert grouped(settings, "uvuvuw")[0] == (["1", "1"], [0])


def test_the_summary_of_members_counts_how_many_creep_cycle_or_rest(command: Command) -> None:
    told = command("run", "two-sliders-cycles", "--set", "vary.drive.amplitude=[0.0003,0.001]",
                   "--set", "drive.cycles=20", "--set", "chain.sigma_mu=0")  # fmt: skip
    assert "2 members: 1 at_rest, 1 creeping" in told.out


def test_the_data_and_the_picture_are_written(command: Command, tmp_path: Path) -> None:
    output = ("--out", "run.nc", "--plot", "run.png", "--record", "x_G,slips")
    told = command(*QUICK, *output, "--json")
    loaded = Creep.load(tmp_path / "run.nc")
    assert loaded.velocity == told.json["velocity"]
    assert set(loaded.recorded) == {"x_G", "slips"}
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    several = ["run", "chain-jumps", "--set", "drive.cycles=3"]
    assert command(*several, "--out", "jumps.nc", "--plot", "jumps.pdf").code == 0
    assert len(load_members(tmp_path / "jumps.nc")) == 16
    assert (tmp_path / "jumps.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("option", ["--out", "--plot", "--checkpoint"])
def test_nothing_is_overwritten_without_force(
    command: Command, tmp_path: Path, option: str
) -> None:
    name = {"--out": "a.nc", "--plot": "a.png", "--checkpoint": "a.ckpt"}[option]
    (tmp_path / name).write_text("precious")
    assert "exists" in command(*QUICK, option, name).sentence
    assert (tmp_path / name).read_text() == "precious"
    assert command(*QUICK, option, name, "--force").code == 0
    assert b"precious" not in (tmp_path / name).read_bytes()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run"], "Missing argument 'SCENE'"),
        (["walk"], "No such command 'walk'"),
        (["run", "six-slider-cycles"], "did you mean six-sliders-cycles?"),
        (["run", "."], "scene = '.': is a directory"),
        ([*QUICK, "--set", "chain.n"], "set = 'chain.n': must be KEY=VALUE"),
        ([*QUICK, "--set", "chain.nn=3"], "did you mean chain.n?"),
        ([*QUICK, "--set", "chain.n=three"], "chain.n = 'three': must be a whole number"),
        ([*QUICK, "--solver", "euler"], "run.solver = 'euler': must be one of exact"),
        ([*QUICK, "--dt", "0.01"], "'dt': solver 'exact' does not take it"),
        ([*QUICK, "--solver", "verlet", "--dt", "0"], "run.dt = '0': must be"),
        ([*QUICK, "--solver", "verlet", "--dt", "5e-324"], "whose square is a float64"),
        ([*QUICK, "--seed", "1.5"], "run.seed = '1.5': must be a whole number"),
        ([*QUICK, "--record", "velocity"], "run.record = 'velocity': must be among x_G"),
        ([*QUICK, "--max-events", "-1"], "max_events = -1: must be a whole number"),
        ([*QUICK, "--max-seconds", "nan"], "max_seconds = 'nan': must be a finite number"),
        ([*QUICK, "--out", "no/such/run.nc"], "must lie in a directory that exists"),
        ([*QUICK, "--out", "."], "out = '.': must be a file, not a directory"),
        ([*QUICK, "--plot", "run.txt"], "plot = 'run.txt': must end in .png"),
        ([*QUICK, "--plot", "run.png", "--record", "none"], "needs x_G among what is recorded"),
        ([*QUICK, "--checkpoint", "a.ckpt", "--every", "-1"], "every = '-1': must not be negative"),
        (["resume", "none.ckpt"], "checkpoint = 'none.ckpt': must be a file"),
        (["sweep", "chain-size", "--workers", "2", "--scheduler", "tcp://a"], "with a scheduler"),
        (["scenes", "--show", "none"], "show = 'none': must be one of"),
    ],
)
def test_bad_input_is_one_sentence_and_status_2(
    command: Command, tmp_path: Path, words: list[str], told: str
) -> None:
    assert told in command(*words).sentence
    assert not list(tmp_path.iterdir())


def test_bad_input_keeps_its_status_where_its_sentence_finds_no_room() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("there is no device that is always full")
    with open("/dev/full", "w") as full:
        assert subprocess.run((*PROGRAM, "run", "nope"), stderr=full, env=environment(),
                              check=False, timeout=PATIENCE).returncode == 2  # fmt: skip


def test_a_directory_that_cannot_be_written_is_refused_before_the_run(
    command: Command, tmp_path: Path
) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    (tmp_path / "closed").mkdir(mode=0o500)
    assert "can be written" in command(*QUICK, "--out", "closed/run.nc").sentence


def test_debug_shows_the_traceback() -> None:
    with pytest.raises(ValueError, match="six-slider"):
        status(["run", "six-slider", "--debug"])
    with pytest.raises(ValueError, match="six-slider"):
        status(["--debug", "run", "six-slider"])


def test_a_limit_leaves_with_status_3_and_the_partial_result(
    command: Command, tmp_path: Path
) -> None:
    told = command("run", "six-sliders-cycles", "--set", "drive.cycles=100000",
                   "--max-events", "20000", "--out", "run.nc", "--json")  # fmt: skip
    assert told.code == 3
    assert told.json["outcome"] == "limit"
    assert told.json["reason"] == "max_events = 20000 was reached"
    assert told.json["half_cycles"] == Creep.load(tmp_path / "run.nc").half_cycles > 0


def test_what_was_computed_is_told_even_if_it_cannot_be_written(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    told = command(*QUICK, "--out", "run.nc", "--json")
    assert told.code == 2
    assert told.json["outcome"] == "creeping"
    assert "No space left on device" in told.err
    assert not list(tmp_path.iterdir())


def test_a_velocity_that_is_not_known_is_printed_with_the_reason(command: Command) -> None:
    scene = ["run", "two-sliders-cycles", "--set"]
    for setting, said in (
        ("drive.cycles=1", "because no whole cycle was completed after the burn-in of 2"),
        ("drive.cycles=5", "standard error not known: 8 half-cycles after the burn-in are too few"),
    ):
        told = " ".join(command(*scene, setting).out.split())
        assert said in told
        assert command(*scene, setting, "--json").json["velocity_reason"] in told
    longer = [*scene, "drive.cycles=100"]
    assert "not known" not in command(*longer).out
    assert "velocity_reason" not in command(*longer, "--json").json


@pytest.mark.slow
def test_the_kernel_is_compiled_once_and_the_first_start_says_so(tmp_path: Path) -> None:
    told, took = [], []
    for _ in range(2):
        begin = time.perf_counter()
        done = finished(*PROGRAM, *QUICK, "--json", NUMBA_CACHE_DIR=str(tmp_path))
        assert done.returncode == 0
        told.append("compiling the kernel, once" in done.stderr)
        took.append((time.perf_counter() - begin, json.loads(done.stdout)["seconds"]))
    assert told == [True, False]
    (first, counted), (second, _) = took
    assert counted < (first - second) / 5  # the compiler's time is not the run's


def test_resume_prints_what_an_uninterrupted_run_prints(command: Command, tmp_path: Path) -> None:
    scene = ["run", "chain-jumps", "--set", "drive.cycles=20"]
    whole = command(*scene, "--json").json
    most = max(member["events"] for member in whole["members"])
    part = command(*scene, "--json", "--max-events", str(most - 1), "--checkpoint", "a.ckpt")
    assert part.code == 3
    again = command("resume", "a.ckpt", "--json", "--out", "a.nc").json
    for objects in (whole, again):
        for member in objects["members"]:
            assert member.pop("seconds") > 0
    assert again == whole
    assert len(load_members(tmp_path / "a.nc")) == 16


def test_resume_refuses_what_is_no_checkpoint(command: Command, tmp_path: Path) -> None:
    (tmp_path / "a.ckpt").write_text("PK")
    assert "is not a checkpoint of exactcreep" in command("resume", "a.ckpt").sentence


def test_a_stale_checkpoint_is_told_by_the_exit_status_beside_the_result(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = ("run", "two-sliders-cycles", "--json", "--checkpoint", "a.ckpt", "--every", "0")
    add, calls = checkpoint.Checkpoint._add, []

    def full_after_the_first(kept: checkpoint.Checkpoint, content: Mapping[str, Any]) -> None:
        calls.append(content)
        if len(calls) > 1:
            raise InputError("checkpoint", "a.ckpt", "cannot be written: No space left on device")
        add(kept, content)

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint.Checkpoint, "_add", full_after_the_first)
        done = command(*run, "--out", "a.nc")
    assert done.code == 4
    assert done.err.count("No space left on device") == 1
    assert done.json["outcome"] == "creeping"
    assert Creep.load(tmp_path / "a.nc").half_cycles == done.json["half_cycles"]
    assert command("resume", "a.ckpt", "--json").json["x_G"] == done.json["x_G"]


def test_of_two_runs_with_one_output_the_second_saves_under_another_name(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    members = loop.run_members

    def meanwhile(*arguments: object, **options: object) -> object:
        (tmp_path / "a.nc").write_bytes(b"of another program")
        return members(*arguments, **options)

    monkeypatch.setattr(loop, "run_members", meanwhile)
    done = command("run", "two-sliders-cycles", "--json", "--out", "a.nc")
    assert done.code == 2
    assert "was made by another program meanwhile; this result is in a-2.nc" in done.err
    assert (tmp_path / "a.nc").read_bytes() == b"of another program"
    assert Creep.load(tmp_path / "a-2.nc").half_cycles == done.json["half_cycles"]


def test_of_three_results_under_one_name_none_is_lost(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    members, free, taken = loop.run_members, files.free_name, []

    def meanwhile(*arguments: object, **options: object) -> object:
        (tmp_path / "a.nc").write_bytes(b"of a second program")
        return members(*arguments, **options)

    def just_taken(path: Path) -> Path:
        name = free(path)
        if not taken:
            (tmp_path / name.name).write_bytes(b"of a third program")
        taken.append(name)
        return name

    monkeypatch.setattr(loop, "run_members", meanwhile)
    monkeypatch.setattr(files, "free_name", just_taken)
    done = command("run", "two-sliders-cycles", "--json", "--out", "a.nc")
    assert done.code == 2
    assert "this result is in a-3.nc" in done.err
    assert (tmp_path / "a-2.nc").read_bytes() == b"of a third program"
    assert Creep.load(tmp_path / "a-3.nc").half_cycles == done.json["half_cycles"]


def size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


ENDLESS = (
    *PROGRAM, "run", "two-sliders-cycles", "--set", "drive.cycles=1e9", "--json",
    "--checkpoint", "a.ckpt", "--every", "0", "--out", "a.nc",
)  # fmt: skip


@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_saves_and_summarises_what_was_computed(tmp_path: Path) -> None:
    with begun(*ENDLESS, cwd=tmp_path) as process:
        # with its third checkpoint, if not before, the loop is running
        wait_until(lambda: size(tmp_path / "a.ckpt") > 30_000, process)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert json.loads(out)["reason"] == "interrupted"
    assert "exactcreep resume a.ckpt goes on" in err
    assert "Traceback" not in err
    loaded = Creep.load(tmp_path / "a.nc")
    assert loaded.half_cycles == json.loads(out)["half_cycles"] > 100
    assert loaded.velocity == pytest.approx(9.757, rel=0.01)


@pytest.mark.usefixtures("ignores_ctrl_c")
def test_a_run_in_the_background_is_deaf_to_ctrl_c_and_saved_by_sigterm(tmp_path: Path) -> None:
    kept = tmp_path / "a.ckpt"
    with begun(*ENDLESS, cwd=tmp_path) as process:
        wait_until(lambda: size(kept) > 10_000, process)
        process.send_signal(signal.SIGINT)
        pressed = size(kept)
        wait_until(lambda: size(kept) > 4 * pressed, process)
        process.terminate()
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM
    assert json.loads(out)["reason"] == "interrupted"
    assert "exactcreep resume a.ckpt goes on" in err
    loaded = Creep.load(tmp_path / "a.nc")
    assert resume(kept, max_events=0).half_cycles == loaded.half_cycles > 100


SWALLOWED = """
import os, signal, sys
from exactcreep import interrupts
from exactcreep.cli import main
from exactcreep.studies import sweep as sweeps

class Finaliser:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):  # the signal is heard here, where Python drops what is raised
            pass

def begin(*arguments):
    sweeps._shared = shared
    Finaliser()
    return shared(*arguments)

shared = sweeps._shared
sweeps._shared = begin
sys.argv[1:] = ["reproduce", "all", "--quick", "--workers", "1"]
main()
"""


@pytest.mark.usefixtures("hears_ctrl_c")
def test_a_ctrl_c_that_a_finaliser_swallows_is_heard_all_the_same(tmp_path: Path) -> None:
    with begun(sys.executable, "-c", SWALLOWED, cwd=tmp_path) as process:
        _, err = process.communicate(timeout=PATIENCE)
    assert "Exception ignored in" in err
    assert process.returncode == 130
    assert len(list(tmp_path.rglob("*.csv"))) == 1


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_program_is_imported_ends_in_a_sentence(number: int) -> None:
    script = """
import os, signal, sys
class Press:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            os.kill(os.getpid(), int(sys.argv[1]))
sys.meta_path.insert(0, Press())
from exactcreep.__main__ import main
main()
"""
    done = finished(sys.executable, "-c", script, str(int(number)))
    sentence = "exactcreep: interrupted\n"
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", sentence)


def test_help_waits_for_no_compiler() -> None:
    told = finished(
        sys.executable, "-c", "import sys; from exactcreep.cli import status; "
        "code = status(['--help']); print(*sys.modules); sys.exit(code)",
    )  # fmt: skip
    assert told.returncode == 0
    heavy = {"numpy", "numba", "scipy", "sympy", "mpmath", "xarray", "matplotlib", "flint"}
    assert not heavy & set(told.stdout.split())
    assert "Exit status" in told.stdout


def test_a_run_without_a_file_loads_only_what_it_computes_with() -> None:
    told = finished(
        sys.executable, "-c", "import sys; from exactcreep.cli import status; "
        "status(['run', 'two-sliders-cycles', '--set', 'drive.cycles=1']); print(*sys.modules)",
    )  # fmt: skip
    loaded = set(told.stdout.split())
    assert "numba" in loaded
    assert not {"xarray", "pandas", "h5py", "h5netcdf", "sympy", "matplotlib"} & loaded


def test_every_command_has_help_with_an_example(command: Command) -> None:
    told = command("--help")
    commands = re.findall(r"^│ ([a-z]+) ", told.out, re.MULTILINE)
    assert {"scenes", "run", "resume"} <= set(commands)
    for name in commands:
        assert "exactcreep " + name in command(name, "--help").out


def test_scenes_lists_every_scene_and_shows_one(command: Command, tmp_path: Path) -> None:
    scenes = command("scenes", "--json").json["scenes"]
    listed = {scene["name"]: scene["members"] for scene in scenes}
    assert listed["chain-jumps"] == 16
    assert all(name in command("scenes").out for name in listed)
    (tmp_path / "mine.toml").write_text(command("scenes", "--show", "six-sliders-cycles").out)
    short = ["--set", "drive.cycles=5", "--json"]
    mine = command("run", "mine.toml", *short).json
    assert mine["x_G"] == command("run", "six-sliders-cycles", *short).json["x_G"]


def test_the_version_is_printed(command: Command) -> None:
    assert re.fullmatch(r"exactcreep \d+\.\d+\.\d+\n", command("--version").out)


def test_the_summary_says_how_many_rearrangements_are_too_long_for_the_promise(
    command: Command,
) -> None:
    scene = ("run", "thirty-sliders-cycles", "--set", "drive.cycles=40")
    count = command(*scene, "--json").json["long_rearrangements"]
    assert count > 1
    told = command(*scene).out
    assert f"{count} rearrangements of more than 200 events, for which 1e-12" in told
    assert "accuracy" not in command(*QUICK).out
