"""Files that were damaged or made up are refused in one sentence, and in time."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from exactcreep import Creep, Cycles, creep
from exactcreep.quasistatic import netcdf as files
from exactcreep.quasistatic.writing import write_file
from tests.paper import paper_chain
from tests.quasistatic.runs import told


@pytest.fixture(scope="module")
def certified() -> Creep:
    drive = Cycles("0.0015", 4)
    return creep(paper_chain(3, "0"), drive, solver="certified", record=("x_G", "events"))


def mutations(data: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield damaged copies: bits flipped, bytes lost, runs of zeros, parts doubled, cut off."""
    rng = random.Random(seed)
    for _ in range(count):
        at, length = rng.randrange(len(data)), rng.choice([1, 2, 8, 64, 512, 4096])
        end = min(len(data), at + length)
        yield rng.choice([
            data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :],
            data[:at] + bytes(end - at) + data[end:],
            data[:at] + b"\xff" * (end - at) + data[end:],
            data[:at] + data[end:],
            data[:at] + data[at:end] + data[at:],
            data[:at],
            data[:at] + rng.randbytes(end - at) + data[end:],
        ])  # fmt: skip


def test_a_file_damaged_anywhere_is_refused(certified: Creep, tmp_path: Path) -> None:
    certified.save(tmp_path / "run.nc")
    good = (tmp_path / "run.nc").read_bytes()
    for bad in mutations(good, 60, 1):
        (tmp_path / "bad.nc").write_bytes(bad)
        said = told(lambda: Creep.load(tmp_path / "bad.nc"))
        assert (
            re.search("checksum does not match|does not end with a checksum", said) or bad == good
        )
    assert Creep.load(tmp_path / "run.nc").x_G == certified.x_G


CLAIMS = {
    "n": (10**6, "it holds 3 of n = 1000000"),
    "half_cycles": (10**12, "it holds 8 of half_cycles = 1000000000000"),
    "l0": ("1e999999999", "not a ratio of integers: 1e999999999"),
    "velocity_exact": ("9" * 10**6, "not a ratio of integers: 999"),
    "cycles": (10**15, "at most 1000000000000"),
    "warnings": ("[" * 10**6, "nested too deeply"),
}


@pytest.mark.parametrize("name", CLAIMS)
def test_a_claim_that_would_cost_unbounded_time_is_refused(
    certified: Creep, tmp_path: Path, name: str
) -> None:
    value, sentence = CLAIMS[name]
    data = certified.dataset.copy()
    data.attrs[name] = value
    write_file(tmp_path / "bad.nc", files.netcdf({None: data}), "out")
    assert sentence in told(lambda: Creep.load(tmp_path / "bad.nc"))
