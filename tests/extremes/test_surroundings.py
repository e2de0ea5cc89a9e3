"""Strange surroundings change no result: clocks, disks, numpy's settings, pools, folders."""

from __future__ import annotations

import io
import json
import string
import sys
from decimal import Context, Decimal
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Drive, GaussianSteps, creep
from tests.conftest import Command
from tests.paper import paper_chain

THREE = paper_chain(3)
QUIETEST = Chain(2, "1e300", "0.5", "0.6", tan_alpha="0.25")


@pytest.mark.parametrize(
    ("chain", "drive", "words"),
    [
        (THREE, Cycles("0.0015", 4), {"record": ("x", "events", "rearrangements", "slip_table")}),
        (THREE, GaussianSteps("0.003", 50), {"twin": True}),
        (THREE, Cycles("5e-324", 2), {}),
        (QUIETEST, Cycles("1e-300", 2), {}),
        (THREE, Cycles("0.0015", 4), {"solver": "sliding"}),
        (THREE, Cycles("0.0015", 4), {"solver": "verlet", "dt": "0.05"}),
        (THREE, Cycles("0.0005", 1), {"solver": "certified"}),
    ],
    ids=["tables", "copies", "denormal", "long springs", "sliding", "verlet", "certified"],
)  # fmt: skip
def test_numpy_that_raises_what_it_passes_over_changes_nothing(
    chain: Chain, drive: Drive, words: dict[str, Any]
) -> None:
    calm = creep(chain, drive, **words)
    with np.errstate(all="raise"):
        assert creep(chain, drive, **words) == calm


FATE = ("fate", "--n", "2", "--amplitude", "0.001")
ANSWERS = (("--help",), ("run", "--help"), ("scenes",), FATE)


@pytest.mark.parametrize("columns", ["0", "1", "6", "10", "-3", "x", "999999999"])
def test_a_terminal_of_any_width_shows_answers(
    columns: str, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    for words in ANSWERS:
        told = command(*words)
        assert told.code == 0, told.err
        assert told.out


@pytest.mark.parametrize("name", ["stdout", "stderr"])
@pytest.mark.parametrize("closed", [False, True], ids=["none", "closed"])
def test_a_process_without_a_stream_computes_all_the_same(
    name: str, closed: bool, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = io.StringIO()
    stream.close()
    monkeypatch.setattr(sys, name, stream if closed else None)
    pair = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    assert creep(pair, Cycles("0.001", 5), progress=True).half_cycles == 10
    assert [command(*words).code for words in (*ANSWERS, ("scenes", "nothing"))] == [0, 0, 0, 0, 2]


HOSTILE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e"


def test_text_of_a_scene_reaches_the_terminal_without_control_characters(
    command: Command, tmp_path: Path
) -> None:
    text = command("scenes", "two-sliders-cycles").out.splitlines()
    title = f"title = {json.dumps(HOSTILE)}"
    scene, result = tmp_path / f"a{HOSTILE}b.toml", str(tmp_path / f"c{HOSTILE}d.nc")
    scene.write_text("\n".join([title, *(line for line in text if not line.startswith("title"))]))
    picture = str(tmp_path / "e.svg")
    for words in (("run", str(scene), "--out", result, "--plot", picture), ("show", result),
                  ("run", str(scene), "--out", result), ("scenes", str(scene)),
                  ("show", f"none{HOSTILE}.nc"), (f"run{HOSTILE}",), ("run", f"--{HOSTILE}"),
                  ("fate", "--n", HOSTILE), ("show", result, "--json")):  # fmt: skip
        told = command(*words)
        assert told.out + told.err
        assert "defect" not in told.err
        assert not set(HOSTILE) - set(string.printable) & set(told.out + told.err), words
    ElementTree.parse(picture)  # control characters would not be XML


def test_python_s_limit_for_digits_of_integers_ends_no_answer(command: Command) -> None:
    usual = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(640)
    try:
        told = command("threshold", "--n", "2", "--digits", "700", "--json")
    finally:
        sys.set_int_max_str_digits(usual)
    assert told.code == 0, told.err
    lower, upper = (Decimal(told.json[name]) for name in ("lower", "upper"))
    edge = Context(prec=800).divide(Decimal("0.0014"), Context(prec=800).sqrt(Decimal(17)))
    assert lower <= edge <= upper
    assert len(lower.as_tuple().digits) >= 700
