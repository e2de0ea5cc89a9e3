"""Files that somebody made up to harm: one sentence with the file's name, and nothing else."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import time
import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np
import pytest

from exactcreep import Creep, Cycles, InputError, TemperatureRecord, creep, load_scene, sweep
from exactcreep.quasistatic import checkpoint
from tests.conftest import Command
from tests.paper import paper_chain

SECRET = "root:x:0:0"
MOST_BYTES, MOST_SECONDS = 2**29, 5
Change = Callable[[Any], object]
RUN: dict[str, Any] = {"chain": paper_chain(2), "drive": Cycles("0.01", 3)}
SCENE = load_scene("two-sliders-cycles").with_settings({"drive.cycles": 3, "run.record": ["x_G"]})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a result, a checkpoint, a sweep, and a file that is nobody's business."""
    made = tmp_path_factory.mktemp("good")
    creep(**RUN, checkpoint=made / "run.ckpt").save(made / "run.nc")
    (made / "secret").write_text(f"{SECRET}\n" * 8)
    sweep(SCENE, out=made / "sweep", workers=1)
    return made


# --- results -------------------------------------------------------------------------------------


def sealed(data: bytes) -> bytes:
    return data + b"\nexactcreep sha256 %s\n" % hashlib.sha256(data).hexdigest().encode()


def replaced(name: str, make: Change) -> Change:
    def change(file: Any) -> None:
        del file[name]
        make(file)

    return change


def texts(file: Any) -> None:
    """One long text and many short ones: as an array of equal lengths they take 40 GB."""
    data = ["1" * 10**6, *["1"] * 10**4]
    file.create_dataset("x_G_decimal", data=data, dtype=h5py.string_dtype())


def put(*keys: Any, value: Any) -> Change:
    """Return what puts a value in its place in a list of records."""

    def change(records: Any) -> None:
        for key in keys[:-1]:
            records = records[key]
        records[keys[-1]] = value

    return change


def of_run(*keys: Any, value: Any) -> Change:
    """Return what changes the text from which a run is read."""

    def change(file: Any) -> None:
        run = json.loads(file["run"][()])
        put(*keys, value=value)(run)
        del file["run"]
        file["run"] = json.dumps(run)

    return change


FOREIGN = {"kind": "record", "file": "secret", "kappa": "1", "T0": "0",
           "temperature_column": "root"}  # fmt: skip
SPACE = h5py.h5s.create_simple((300_000_000,))


def unallocated(file: Any) -> None:
    h5py.h5d.create(file.id, b"x_G", h5py.h5t.NATIVE_DOUBLE, SPACE)


RESULTS: dict[str, Change] = {
    "external storage": replaced("x_G", lambda file: file.create_dataset(
        "x_G", (10,), "u1", external=[("secret", 0, 10)])),
    "external link": replaced("x_G", lambda file: file.update(
        x_G=h5py.ExternalLink("other.nc", "x_G"))),
    "soft link": replaced("x_G", lambda file: file.update(x_G=h5py.SoftLink("/theta"))),
    "virtual dataset": replaced("x_G", lambda file: file.create_virtual_dataset(
        "x_G", h5py.VirtualLayout((6,), "f8"))),
    "packed zeros": replaced("x_G", lambda file: file.create_dataset(
        "x_G", (10**7,), "f8", data=np.zeros(10**7), compression="gzip")),
    "a shape without data": replaced("x_G", unallocated),
    "texts": texts,
    "references": replaced("x_G", lambda file: file.create_dataset("x_G", (6,), h5py.ref_dtype)),
    "a record of another file": of_run("experiment", "drive", value=FOREIGN),
    "targets beyond the last": of_run("half_cycles", value=10**12),
    "sliders of another chain": of_run("experiment", "chain", "n", value=3),
    "half a table": lambda file: file.update(rearrangement_theta=np.zeros(3)),
    "nesting": replaced("run", lambda file: file.update(run="[" * 60_000)),
    "no velocity": of_run("velocity_enclosure", value=[1, 2]),
    "a group for an array": replaced("x_G", lambda file: file.create_group("x_G")),
}  # fmt: skip


def said_of(read: Callable[[], object], path: Path) -> str:
    """Return what is said of a file that is refused, in time and without much memory."""
    tracemalloc.start()
    begin = time.process_time()
    try:
        with pytest.raises(InputError) as told:
            read()
        assert time.process_time() - begin < MOST_SECONDS
        assert tracemalloc.get_traced_memory()[1] < MOST_BYTES
    finally:
        tracemalloc.stop()
    said = str(told.value)
    assert path.name in said
    assert "\n" not in said
    assert SECRET not in said
    return said


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_of_somebody_else_is_read_from_its_own_file_alone(
    name: str, folder: Path, tmp_path: Path, command: Command
) -> None:
    for source, copy in (("secret", "secret"), ("run.nc", "other.nc")):
        Path(copy).write_bytes((folder / source).read_bytes())
    data = io.BytesIO((folder / "run.nc").read_bytes()[:-84])
    with h5py.File(data, "r+") as file:
        RESULTS[name](file)
    path = tmp_path / "sent.nc"
    path.write_bytes(sealed(data.getvalue()))
    said_of(lambda: Creep.load(path), path)
    assert "sent.nc" in command("show", "sent.nc").sentence
    assert not Path("sent.png").exists()


def test_a_result_that_was_damaged_anywhere_is_refused(folder: Path, tmp_path: Path) -> None:
    good, path, random = (folder / "run.nc").read_bytes(), tmp_path / "sent.nc", Random(1)
    for _ in range(60):  # a part is lost, doubled or written over, or the rest is
        at = random.randrange(len(good))
        end = at + random.choice([1, 8, 512, 4096])
        part = random.choice([bytes([good[at] ^ 8]), bytes(end - at), b"", 2 * good[at:end]])
        bad = good[:at] + part + random.choice([good[end:], b""])
        path.write_bytes(bad)
        assert bad == good or "checksum" in said_of(lambda: Creep.load(path), path)


# --- checkpoints and cells -----------------------------------------------------------------------


CHECKPOINTS: dict[str, Change] = {
    "division by zero": put(0, "experiment", "chain", "l0", value={"$fraction": ["1", "0"]}),
    "other arguments": put(0, "experiment", "chain", "evil", value=1),
    "a chain of lists": put(0, "experiment", "chain", value=[1, 2]),
    "an array of objects": put(1, "rows", "x_G", value={"$array": ["|O", [1], "AAAAAAAAAAA="]}),
    "an array of too much": put(1, "rows", "x_G", value={"$array": ["<f8", [10**9], ""]}),
    "targets beyond the last": put(1, "run", "done", value=10**12),
    "a record of another file": put(0, "experiment", "drive", value=FOREIGN),
}  # fmt: skip


def lines_of(texts: Iterable[str]) -> bytes:
    data, digest = checkpoint.LINE, ""
    for text in texts:
        digest = hashlib.sha256(f"{digest}{text}".encode()).hexdigest()
        data += f"{digest} {text}\n".encode()
    return data


def records_of(data: bytes) -> list[Any]:
    return [json.loads(line.partition(b" ")[2]) for line in data.splitlines()[1:]]


NESTED = ["[" * 10**6, '{"a":' * 10**6, "[" + "[]," * 10**7 + "[]]"]


@pytest.mark.parametrize("name", [*CHECKPOINTS, *range(len(NESTED))])
def test_a_forged_checkpoint_is_refused(
    name: Any, folder: Path, tmp_path: Path, command: Command
) -> None:
    Path("secret").write_bytes((folder / "secret").read_bytes())
    if name in CHECKPOINTS:
        records = records_of((folder / "run.ckpt").read_bytes())
        CHECKPOINTS[name](records)
        texts = [*map(json.dumps, records)]
    else:
        texts = [NESTED[name]]
    path = tmp_path / "sent.ckpt"
    path.write_bytes(lines_of(texts))
    said_of(lambda: creep(**RUN, checkpoint=path), path)
    assert "sent.ckpt" in command("run", "two-sliders-cycles", "--checkpoint", str(path)).sentence


FORGED: list[Any] = [None, -1, 2**63, 10**400, 1e308, float("nan"), "text", [], [1], {"a": 1},
                     {"$tuple": [1, 2]}, {"$array": ["<i8", [1], "AAAAAAAAAEA="]}]  # fmt: skip


def places(tree: Any, *before: Any) -> Iterator[tuple[Any, ...]]:
    """Yield the keys of every part of a record."""
    pairs = tree.items() if isinstance(tree, dict) else ()
    for key, part in enumerate(tree) if isinstance(tree, list) else pairs:
        yield (*before, key)
        yield from places(part, *before, key)


@pytest.mark.filterwarnings("ignore")
def test_every_number_of_a_checkpoint_is_used_or_refused(folder: Path, tmp_path: Path) -> None:
    data, path, random = (folder / "run.ckpt").read_bytes(), tmp_path / "sent.ckpt", Random(1)
    keys = [key for key in places(records_of(data)) if key[0] == 1]
    for _ in range(250):
        records, key = records_of(data), random.choice(keys)
        put(*key, value=random.choice(FORGED))(records)
        path.write_bytes(lines_of(map(json.dumps, records)))
        begin = time.process_time()
        with suppress(InputError):
            assert creep(**RUN, checkpoint=path).dataset.sizes
        assert time.process_time() - begin < MOST_SECONDS, key


@pytest.mark.filterwarnings("ignore")
def test_every_part_of_a_result_is_used_or_refused(folder: Path, tmp_path: Path) -> None:
    data, path, random = (folder / "run.nc").read_bytes()[:-84], tmp_path / "sent.nc", Random(1)
    with h5py.File(io.BytesIO(data), "r") as held:
        names, run = [*held.attrs, *held], json.loads(held["run"][()])
    values = (-1, np.int64(2**63 - 1), 1e308, "1/0", "{}", np.zeros((2, 2)))
    changes = [(name, values[k % 6]) for k, name in enumerate(names)]
    changes += [(random.choice([*places(run)]), random.choice(FORGED)) for _ in range(150)]
    for name, value in changes:
        forged = io.BytesIO(data)
        with h5py.File(forged, "r+") as file:
            if isinstance(name, tuple):
                of_run(*name, value=value)(file)
            elif name in file:
                del file[name]
                file[name] = value
            else:
                file.attrs[name] = value
        path.write_bytes(sealed(forged.getvalue()))
        with suppress(InputError):
            found = Creep.load(path)
            repr((found, found.summary(), found.dataset, found.finding))


CELLS: dict[str, Change] = {
    "velocity": of_run("velocity", value="fast"),
    "warnings": of_run("warnings", value={"1": 1}),
    "another cell": lambda file: file.attrs.update(cell="another"),
}


@pytest.mark.parametrize("name", ["a grid", "no grid", *CELLS])
def test_a_sweep_of_somebody_else_is_refused(name: str, folder: Path, tmp_path: Path) -> None:
    made = tmp_path / "sweep"
    (made / "cells").mkdir(parents=True)
    for path in (folder / "sweep").rglob("*.*"):
        (made / path.relative_to(folder / "sweep")).write_bytes(path.read_bytes())
    (sent,) = [made / "sweep.nc"] if name in ("a grid", "no grid") else made.rglob("cells/*.nc")
    data = io.BytesIO(sent.read_bytes()[:-84])
    with h5py.File(data, "r+") as file:
        CELLS.get(name, lambda grid: grid.attrs.update(tables="[" * 10**5))(file)
    sent.write_bytes(sealed(b"CDF" * 40 if name == "no grid" else data.getvalue()))
    said_of(lambda: sweep(SCENE, out=made, workers=1), sent if name != "a grid" else made)


# --- texts ---------------------------------------------------------------------------------------

READERS: dict[str, Callable[[Path], object]] = {
    "record": lambda path: TemperatureRecord(path, kappa="1e-5", T0=0),
    "scene": load_scene,
}
TEXTS: dict[str, bytes] = {
    "a packed gigabyte": gzip.compress(bytes(2**30), 9),
    "packed and cut off": gzip.compress(bytes(range(256)) * 900)[:-40],
    "columns": b"," * 2**25 + b"\n",
    "one line": b"time,temperature" * 2**22,
    "zeros": bytes(2**24),
    "nested tables": b"a = " + b"[" * 10**6,
    "no text": bytes(range(256)) * 99,
    "quotes": b'time,temperature\n"' + b"1,2\n" * 10**6,
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("name", TEXTS)
def test_a_text_of_somebody_else_is_refused(name: str, reader: str, tmp_path: Path) -> None:
    path = tmp_path / "sent.csv.gz"
    path.write_bytes(TEXTS[name])
    said_of(lambda: READERS[reader](path), path)


# --- outputs -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "line",
    [
        "run a.toml --checkpoint a.toml",
        "run linked.toml --checkpoint a.toml",
        "show run.png",
        "run a.toml --out result.txt",
        "compare a.toml --out compared.txt",
    ],
)
def test_no_output_replaces_an_input_or_has_a_name_of_another_kind(
    line: str, folder: Path, tmp_path: Path, command: Command
) -> None:
    Path("a.toml").write_text(command("scenes", "two-sliders-cycles").out)
    Path("linked.toml").symlink_to("a.toml")
    Path("run.png").write_bytes((folder / "run.nc").read_bytes())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert command(*line.split(), "--force").sentence
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
