"""Files of this format are read, and others are refused in a sentence that says what to do.

A file is read by the version that wrote it. Each file was written by ``run two-sliders-cycles
--set drive.cycles=2 --record x_G --out FILE.nc --checkpoint FILE.ckpt``, by the program that wrote
that format. A new format adds its files.
"""

from pathlib import Path

import pytest

from exactcreep import Creep, Cycles, InputError, creep, load_scene
from exactcreep.quasistatic.checkpoint import VERSION
from exactcreep.quasistatic.creep import run_alone
from exactcreep.quasistatic.dataset import FORMAT
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
