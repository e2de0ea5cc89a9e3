"""How far a computation has come: the same value from all of them, and one display of it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import pytest

import exactcreep as ec
from exactcreep import Cycles, creep
from exactcreep.watch import display, preparation
from exactcreep.watch.display import Display
from exactcreep.watch.progress import Progress, reporter
from tests.paper import captions

CHAIN = captions(2)
DRIVE = Cycles("0.01", 40)
GIVEN = ec.Experiment(CHAIN, DRIVE)
SCENE = ec.load_scene("two-sliders-cycles")
SMALL = SCENE.with_settings({"drive.cycles": 5, "vary.run.seed": [0, 1, 2]})


@pytest.mark.parametrize(
    ("compute", "counted"),
    [
        (lambda hear: creep(CHAIN, DRIVE, progress=hear), "half-cycles"),
        (lambda hear: ec.sweep(SMALL, progress=hear), "cells"),
        (lambda hear: ec.threshold(CHAIN, digits=6, progress=hear), "amplitudes"),
        (lambda hear: ec.compare(GIVEN, [GIVEN], seeds=1, events=20, progress=hear), "runs"),
    ],
)
def test_every_long_computation_hands_on_the_same_kind_of_progress(
    compute: Callable[[Callable[[Progress], None]], Any], counted: str
) -> None:
    heard: list[Progress] = []
    compute(heard.append)
    assert counted in {progress.counted for progress in heard}
    for progress in heard:
        assert 0 <= progress.done <= (progress.total or math.inf)
        assert progress.seconds >= 0


@pytest.mark.parametrize(
    ("done", "total", "about", "left"),
    [
        (10, 40, {}, 9),
        (5, 10, {"work": 0.1}, 27),  # the count does not tell: a tenth of the work is in half
        (0, 40, {}, math.nan),
        (1, 10**6, {}, math.nan),
    ],
)
def test_the_time_left_is_in_proportion_and_counts_the_members_that_follow(
    done: int, total: int, about: dict[str, Any], left: float
) -> None:
    progress = Progress("running", done, total, 33, 3.0, **about)
    assert progress.seconds_left == pytest.approx(left, nan_ok=True)
    assert (progress.half_cycles, progress.events_per_second) == (done, 11.0)


def test_the_time_of_a_study_does_not_count_what_is_compiled_or_loaded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(preparation.time, "perf_counter", lambda: now[0])
    heard: list[Progress] = []
    report = reporter(heard.append)
    report("starts", 0, 100, "starts")
    with preparation.preparing(), preparation.preparing():
        now[0] = 40.0
        report("starts", 0, 100, "starts")
        now[0] = 60.0
    now[0] = 61.0
    report("starts", 1, 100, "starts")
    assert [progress.seconds for progress in heard] == [0.0, 0.0, 1.0]
    assert heard[-1].seconds_left == pytest.approx(99)


def test_what_the_compiler_does_is_preparation() -> None:
    before = preparation.seconds()
    ec.compiling.njit()(lambda number: number + 1)(1)
    assert preparation.seconds() > before


def test_away_from_a_terminal_lines_are_written_after_two_seconds_four_eight_and_so_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = 0.0
    monkeypatch.setattr(display.time, "monotonic", lambda: now)
    with Display() as lines:
        for k in range(1, 9):
            now = 1.0 * k
            lines.show(Progress("running", 10 * k, 80, 7 * k, now))
    told = capsys.readouterr().err.splitlines()
    assert [re.findall(r"[\d.:]+", line)[1:] for line in told] == [
        ["20", "80", "7", "0:00:06"],
        ["40", "80", "7", "0:00:04"],
        ["80", "80", "7", "0:00:00"],
    ]
