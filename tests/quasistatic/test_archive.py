"""Results of every format so far are read, or refused in a sentence that says what to do.

A checkpoint is read by the version that wrote it. Each file was written by ``run two-sliders-cycles
--set drive.cycles=2 --record x_G --out FILE.nc --checkpoint FILE.ckpt``, by the program that wrote
that format. A new format adds its files.
"""

import json
from fractions import Fraction
from pathlib import Path

import h5py
import pytest

from exactcreep import Creep, Cycles, InputError, creep, load_scene
from exactcreep.quasistatic.checkpoint import VERSION
from exactcreep.quasistatic.creep import run_alone
from exactcreep.quasistatic.dataset import FORMAT, fields_of
from exactcreep.quasistatic.netcdf import Group, Room
from tests.paper import paper_chain

ARCHIVE = Path(__file__).parents[1] / "data" / "archive"
FORMATS = {"result": int(FORMAT.rpartition(" ")[2]), "checkpoint": VERSION}
FILES = sorted(ARCHIVE.iterdir())


def test_the_archive_holds_the_formats_of_this_program() -> None:
    for kind, number in FORMATS.items():
        assert number == max(int(file.stem.partition("-")[2]) for file in ARCHIVE.glob(f"{kind}-*"))


@pytest.mark.filterwarnings("ignore:.*the run has ended")
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_file_of_the_archive_is_read_or_refused_with_advice(file: Path) -> None:
    kind, _, number = file.stem.partition("-")
    scene = load_scene("two-sliders-cycles")
    known = scene.with_settings({"drive.cycles": 2, "run.record": ["x_G"]}).experiment({})

    def gone_on(file: Path) -> Creep:
        return creep(known.chain, known.drive, checkpoint=file)

    read = {"result": Creep.load, "checkpoint": gone_on}[kind]
    if int(number) < FORMATS[kind]:
        with pytest.raises(InputError, match=r"read it with the.* version that wrote it"):
            read(file)
        return
    found = read(file)
    run = run_alone(known)
    assert found.state == run.state
    assert (found.recorded["x_G"] == run.recorded["x_G"]).all()


def test_a_checkpoint_of_another_version_is_refused_with_advice(tmp_path: Path) -> None:
    (kept,) = ARCHIVE.glob("checkpoint-*")
    line, other = f"checkpoint {VERSION}\n", tmp_path / "other.ckpt"
    other.write_bytes(kept.read_bytes().replace(line.encode(), b"checkpoint 13\n", 1))
    with pytest.raises(InputError, match=f"is not a checkpoint of version {VERSION},.* go on"):
        creep(paper_chain(2), Cycles("0.01", 2), checkpoint=other)


def test_results_of_version_0_3_0_say_what_they_said_then() -> None:
    """Of every solver and drive; see the experiments of the members."""
    with h5py.File(ARCHIVE.parent / "results-of-0.3.0.nc") as file:
        groups = [Group(file[f"member_{k}"], Room(2**24)) for k in range(1, len(file) + 1)]
        runs = [Creep(**fields_of(group)) for group in groups]
    said = json.loads((ARCHIVE.parent / "results-of-0.3.0.json").read_text("utf-8"))
    assert len(runs) == len(said) == 9
    for run, then in zip(runs, said, strict=True):
        now, gone = run.summary(), ("long_rearrangements", "trusted_half_cycles", "undecided_from")
        told = {name: value for name, value in then.items() if name not in gone}
        undecided = told.pop("undecided")
        assert {name: now.get(name) for name in told} == told
        assert now["report"]["undecided"] == undecided
        assert now["known_until"] == now["half_cycles"] == then["half_cycles"]
    assert {run.solver for run in runs} == {"exact", "certified", "sliding", "verlet"}
    assert runs[0].recorded["event_time"].size == 896
    assert runs[3].experiment.digits == 25
    assert runs[2].experiment.initial.tensions.tolist() == [Fraction(1, 3), 0]
