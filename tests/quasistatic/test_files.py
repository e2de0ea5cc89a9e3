"""Files are written in one piece or not at all: killed, interrupted, or on a full disk."""

from __future__ import annotations

import errno
import io
import itertools
import os
import random
import signal
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic import files
from exactcreep.quasistatic.files import Occupied, check_output, remove_parts, write_file
from exactcreep.quasistatic.netcdf import netcdf
from tests.processes import PATIENCE, finished

OLD, NEW = b"old" * 100, b"new" * 300_000


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_made_with_the_permissions_that_the_mask_leaves(tmp_path: Path) -> None:
    for mask, mode in ((0o022, 0o644), (0o077, 0o600), (0o002, 0o664)):
        before = os.umask(mask)
        try:
            write_file(tmp_path / "a", OLD, "out")
            write_file(tmp_path / "a", memoryview(NEW), "out")
        finally:
            os.umask(before)
        assert (tmp_path / "a").stat().st_mode & 0o777 == mode
        assert (tmp_path / "a").read_bytes() == NEW
        assert left(tmp_path) == ["a"]


@pytest.mark.parametrize("step", ["open", "fsync", "replace"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, OSError, MemoryError])
def test_an_interrupted_writer_leaves_the_old_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, error: type[BaseException]
) -> None:
    write_file(tmp_path / "a", OLD, "out")

    def interrupted(*arguments: object, **words: object) -> None:
        raise error(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(files.os, step, interrupted)
        with pytest.raises(InputError if error is OSError else error) as told:
            write_file(tmp_path / "a", NEW, "checkpoint")
    if error is OSError:
        assert str(told.value).startswith("checkpoint = ")
        assert str(told.value).endswith("cannot be written: No space left on device")
    assert (tmp_path / "a").read_bytes() == OLD
    assert left(tmp_path) == ["a"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_writer_killed_at_random_leaves_the_old_file_or_the_new_one(tmp_path: Path) -> None:
    moments, target, length = random.Random(5), tmp_path / "a", 400_000
    write_file(target, bytes(length), "out")
    for _ in range(25):
        before = target.read_bytes()
        child = os.fork()
        if child == 0:
            for k in itertools.count(before[0] + 1):
                write_file(target, bytes([k % 256]) * length, "out")
        end = time.monotonic() + PATIENCE
        while target.read_bytes() == before and time.monotonic() < end:
            time.sleep(0.001)
        time.sleep(moments.uniform(0, 0.005))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        found = target.read_bytes()
        assert found in (bytes([k]) * length for k in range(256))


def test_only_regular_files_are_replaced_and_links_are_followed(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(OLD)
    (tmp_path / "link").symlink_to("a")
    write_file(tmp_path / "link", NEW, "out")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "a").read_bytes() == NEW
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "to_pipe").symlink_to("pipe")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "ring").symlink_to("ring")
    refused = {"pipe": "regular file", "to_pipe": "regular file",
               "dangling": "link to a file that does not exist", "ring": "link to a file",
               "": "not a directory"}  # fmt: skip
    before = left(tmp_path)
    for name, sentence in refused.items():
        for refusing in (lambda path: check_output(path, "out", force=True),
                         lambda path: write_file(path, NEW, "out")):  # fmt: skip
            with pytest.raises(InputError, match=sentence):
                refusing(tmp_path / name)
    assert left(tmp_path) == before
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("links", [True, False])
def test_of_two_writers_of_one_file_the_second_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    def refuse(*names: object) -> None:
        raise OSError(95, "Operation not supported")

    if not links:
        monkeypatch.setattr(files.os, "link", refuse)
    for name in "ab":
        assert check_output(tmp_path / name, "out", force=False)
        write_file(tmp_path / name, NEW, "out", force=False)
        with pytest.raises(Occupied, match="exists and is not overwritten without force"):
            write_file(tmp_path / name, OLD, "out", force=False)
        assert (tmp_path / name).read_bytes() == NEW
    assert left(tmp_path) == ["a", "b"]


@pytest.mark.skipif(files.fcntl is None, reason="needs locks")
def test_parts_of_killed_writers_are_removed_and_those_of_living_ones_stay(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(OLD)
    (tmp_path / "to_a").symlink_to("a")
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        files.os.replace = lambda *names: (os.write(write, b"."), signal.pause())
        write_file(tmp_path / "a", NEW, "out")
    assert os.read(read, 1) == b"."
    (part,) = [name for name in left(tmp_path) if name.endswith(".part")]
    check_output(tmp_path / "to_a", "out", force=True)
    assert part in left(tmp_path)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    (tmp_path / "other.part").write_bytes(OLD)
    check_output(tmp_path / "b", "out", force=True)  # of another file
    assert part in left(tmp_path)
    check_output(tmp_path / "to_a", "out", force=True)
    assert left(tmp_path) == ["a", "other.part", "to_a"]
    (tmp_path / part).write_bytes(OLD)
    remove_parts(tmp_path)
    assert left(tmp_path) == ["a", "other.part", "to_a"]


FULL_DISKS = """
import os, resource, signal, sys
from contextlib import contextmanager
from pathlib import Path
import numpy as np
import xarray as xr
from exactcreep import Chain, Cycles, creep
from exactcreep.cli import status
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic import checkpoint
from exactcreep.quasistatic.files import write_file
from exactcreep.figures import style as figures
from exactcreep.figures.paper import Picture
from exactcreep.figures.run import draw_run

@contextmanager
def full_disk(name):  # no file in it can be longer than 20 kB
    os.chdir(name)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        yield
    except InputError as error:
        print("told:", error, file=sys.stderr)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        os.chdir("..")

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
result = creep(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"), Cycles("0.01", 5000))
run = ["run", "two-sliders-cycles", "--set", "drive.cycles=5000", "--json"]
sweep = ["sweep", "two-sliders-cycles", "--set", "drive.cycles=2000", "--set", "run.record=x_G"]
sweep += ["--set", "vary.run.seed=[0,1]", "--workers", "1", "--resume", "--out"]
assert status(run) == 0
with full_disk("result"):
    result.save("it", force=True)
with full_disk("run"):
    assert status([*run, "--out", "it", "--force"]) == 2
with full_disk("picture"):
    figures.save_picture(draw_run([result]), "it.png")
with full_disk("sweep"):
    assert status([*sweep, "."]) == 2
with full_disk("checkpoint"):
    write_file("it", checkpoint.to_bytes({"values": np.zeros(9000)}), "checkpoint")
with full_disk("reproduce"):
    blank = Picture("it", "", (0.1, 0.1), [], {}, lambda figure, data, tables: None)
    data = {name: xr.Dataset({"v": ("t", np.arange(9000))}) for name in "ab"}
    blank.write(data, Path("."))
print("goes on")
"""
WRITERS = {"result": "it", "run": "it", "picture": "it.png", "sweep": "sweep.nc",
           "checkpoint": "it", "reproduce": "it.nc"}  # fmt: skip


@pytest.mark.skipif(os.name != "posix", reason="needs limits on the size of files")
def test_on_a_full_disk_every_writer_says_so_and_keeps_what_was_there(tmp_path: Path) -> None:
    for writer, name in WRITERS.items():
        (tmp_path / writer).mkdir()
        (tmp_path / writer / name).write_bytes(OLD)
    script = f"import os; os.chdir({str(tmp_path)!r})\n{FULL_DISKS}"
    done = finished(sys.executable, "-c", script)
    assert (done.returncode, done.stdout.split("\n")[-2]) == (0, "goes on"), done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("cannot be written: File too large") == len(WRITERS)
    for writer, name in WRITERS.items():
        assert (tmp_path / writer / name).read_bytes() == OLD
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".part"]


def test_groups_of_one_netcdf_file_are_the_datasets_that_were_given(tmp_path: Path) -> None:
    one = xr.Dataset({"v": ("t", [1.0, 2.0])}, {"t": [3, 4]}, {"title": "one"})
    other = xr.Dataset({"w": (("t", "s"), [["a", "bcd"]]), "none": ("e", [0.0][:0])})
    write_file(tmp_path / "a.nc", netcdf({None: xr.Dataset(attrs={"n": 2}), "x": one, "y": other}),
               "out")  # fmt: skip
    for group, dataset in (("x", one), ("y", other)):
        found = xr.load_dataset(tmp_path / "a.nc", group=group, engine="h5netcdf")
        assert found.identical(dataset)
    assert xr.load_dataset(tmp_path / "a.nc", engine="h5netcdf").attrs == {"n": 2}


@pytest.mark.parametrize("room", [0, 3000, 20_000, 10**9])
def test_a_library_that_fills_the_disk_lives_on_and_leaves_what_was_there(
    room: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Disk(io.FileIO):
        def write(self, data: Any) -> int:
            left = room - self.tell()
            if left <= 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data[:left])

        def truncate(self, size: int | None = None) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

    class Full(files._Part, Disk):
        """A file on a disk with so little room."""

    write_file(tmp_path / "a.nc", OLD, "out")
    monkeypatch.setattr(files, "_Part", Full)
    data = xr.Dataset({"v": ("t", np.ones(9000))})
    with pytest.raises(InputError, match="No space left"):
        write_file(tmp_path / "a.nc", netcdf({None: data}), "out")
    assert (tmp_path / "a.nc").read_bytes() == OLD
    assert left(tmp_path) == ["a.nc"]
