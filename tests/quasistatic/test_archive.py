"""Files of every format so far are read, or refused in a sentence that says what to do.

Each was written by ``run two-sliders-cycles --set drive.cycles=2 --record x_G --out FILE.nc
--checkpoint FILE.ckpt``, by the program that wrote that format. A new format adds its files.
"""

from pathlib import Path

import pytest

from exactcreep import Creep, Cycles, InputError, creep, load_scene, resume
from exactcreep.quasistatic.checkpoint import VERSION
from exactcreep.quasistatic.dataset import FORMAT

ARCHIVE = Path(__file__).parents[1] / "data" / "archive"


def numbered(pattern: str) -> dict[int, Path]:
    return {int(path.stem.rpartition("-")[2]): path for path in ARCHIVE.glob(pattern)}


RESULTS, CHECKPOINTS = numbered("result-*.nc"), numbered("checkpoint-*.ckpt")


@pytest.fixture(scope="module")
def known() -> Creep:
    experiment = load_scene("two-sliders-cycles").experiment({})
    drive = Cycles(experiment.drive.exact_target(1, 0), 2)
    return creep(experiment.chain, drive, seed=experiment.seed, record=("x_G",))


def test_the_archive_holds_the_formats_of_this_program() -> None:
    assert int(FORMAT.rpartition(" ")[2]) == max(RESULTS)
    assert max(CHECKPOINTS) == VERSION


@pytest.mark.parametrize("number", RESULTS)
def test_a_result_of_the_archive_is_read_or_refused_with_advice(number: int, known: Creep) -> None:
    if number == max(RESULTS):
        found = Creep.load(RESULTS[number])
        assert found.state == known.state
        assert (found.recorded["x_G"] == known.recorded["x_G"]).all()
        return
    advice = "read it with the version that wrote it"
    with pytest.raises(InputError, match=advice):
        Creep.load(RESULTS[number])


@pytest.mark.parametrize("number", CHECKPOINTS)
def test_a_checkpoint_of_the_archive_goes_on_or_is_refused_with_advice(
    number: int, known: Creep
) -> None:
    if number == VERSION:
        assert resume(CHECKPOINTS[number]).state == known.state
        return
    with pytest.raises(InputError, match=rf"is of version {number};.*let the version that wrote"):
        resume(CHECKPOINTS[number])
