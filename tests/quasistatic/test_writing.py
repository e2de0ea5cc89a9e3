"""Files are written in one piece or not at all, by one writer at a time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from exactcreep import InputError
from exactcreep.quasistatic.writing import check_output, write_file

OLD, NEW = b"old" * 100, b"new" * 300_000


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("step", ["fsync", "replace"])
@pytest.mark.parametrize(
    ("error", "told", "said"),
    [
        (KeyboardInterrupt, KeyboardInterrupt, "No space"),
        (OSError, InputError, "checkpoint = .* cannot be written: No space left on device$"),
    ],
)
def test_an_interrupted_writer_leaves_the_old_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, error: Any, told: Any, said: str
) -> None:
    write_file(tmp_path / "a", OLD, "out")

    def interrupted(*arguments: object) -> None:
        raise error(28, "No space left on device")

    monkeypatch.setattr(os, step, interrupted)
    with pytest.raises(told, match=said):
        write_file(tmp_path / "a", NEW, "checkpoint")
    assert (tmp_path / "a").read_bytes() == OLD
    assert left(tmp_path) == ["a"]


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
    refused = {"to_pipe": "regular file", "dangling": "link to a file that does not exist",
               "ring": "link to a file", "": "not a directory"}  # fmt: skip
    before = left(tmp_path)
    for name, sentence in refused.items():
        with pytest.raises(InputError, match=sentence):
            check_output(tmp_path / name, "out", force=True)
        with pytest.raises(InputError, match=sentence):
            write_file(tmp_path / name, NEW, "out")
    assert left(tmp_path) == before
    assert (tmp_path / "pipe").is_fifo()


def test_a_part_of_a_killed_writer_is_removed_and_that_of_a_living_one_stays(
    tmp_path: Path,
) -> None:
    fcntl = pytest.importorskip("fcntl")
    part = tmp_path / ".a.part"
    part.write_bytes(OLD)
    write_file(tmp_path / "a", NEW, "out")
    assert left(tmp_path) == ["a"]
    with part.open("xb") as living:
        fcntl.flock(living, fcntl.LOCK_EX)
        write_file(tmp_path / "a", OLD, "out")
        assert left(tmp_path) == [".a.part", "a"]
    assert (tmp_path / "a").read_bytes() == OLD
