"""Measure this machine, print the table, and draw the picture that the README shows.

``python tests/benchmarks/run.py [--quick] [--out DIR]``; with a directory it writes
``benchmark.md``, ``benchmark.png``, ``questions.png`` and ``benchmark.json`` there. It takes ten to
fifteen minutes, and says how many are left; stopped and started again it goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import pickle
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

from exactcreep.quasistatic.files import write_file
from tests.benchmarks import measurements, questions, rearrangements
from tests.benchmarks.measurements import SIZES
from tests.benchmarks.pictures import draw, draw_answers
from tests.benchmarks.report import Results, markdown, plain


@dataclass
class Part:
    """One thing to be measured.

    Attributes
    ----------
    name : str
    into : str
        The field of `Results` that takes it; a list takes all of a list.
    seconds : float
        How long it takes on a quiet machine, without `--quick`, roughly.
    run : callable
    """

    name: str
    into: str
    seconds: float
    run: Callable[[], Any]


def parts(results: Results) -> Iterator[Part]:
    """Yield what there is to be measured; `quick` takes fewer turns, not the longest chain."""
    quick = results.quick
    for n, amplitude in SIZES[:4] if quick else SIZES:
        turns = 9 if n <= 100 and not quick else 3
        yield Part(f"half-cycles, N = {n}", "half_cycles", 10 if n < 100 else 40, partial(
            lambda *size, **how: [measurements.half_cycle_times(*size, **how)],
            n, amplitude, turns=turns, seconds=0.05 if quick else 0.15,
        ))  # fmt: skip
    ladder = rearrangements.LADDER[:-1] if quick else rearrangements.LADDER
    for n, amplitude in SIZES[:3]:
        yield Part(f"single rearrangements, N = {n}", "rearrangements", 30 + 3 * n, partial(
            lambda *size, **how: [rearrangements.rearrangement_costs(*size, **how)],
            n, amplitude, count=rearrangements.SAMPLES[n] // (4 if quick else 1), ladder=ladder,
            least=0.05 if quick else 0.2,
        ))  # fmt: skip
    yield Part("a long chain", "per_event", 10, partial(
        measurements.long_chain_ratio, turns=5 if quick else 15, half_cycles=40
    ))  # fmt: skip
    yield Part("two threads", "speed_ups", 15, partial(
        measurements.thread_speed_ups, turns=5 if quick else 25, seconds=0.05
    ))  # fmt: skip
    yield Part(f"{results.long_run:.0e} half-cycles", "memory", 5, partial(
        measurements.long_run_memory, results.long_run
    ))  # fmt: skip
    yield Part("the first start and the second", "start_up", 15, measurements.start_up_seconds)
    members = 8 if quick else 16
    for n, amplitude in SIZES[:4]:
        seconds = 0.4 if quick else 2.0 if n < 60 else 6.0
        yield Part(f"mean velocity, N = {n}", "velocities", 5 * seconds, partial(
            lambda *size, **how: [measurements.velocity_costs(*size, **how)],
            n, amplitude, members=members, seconds=seconds,
        ))  # fmt: skip
    for n in questions.AMPLITUDES:
        seconds = 0.3 if quick else 2.0 if n < 30 else 6.0
        yield Part(f"questions: mean velocity, N = {n}", "answers", 60, partial(
            questions.mean_velocity, n, members=members, seconds=seconds
        ))  # fmt: skip
    for single in results.rearrangements:
        yield Part(f"questions: one rearrangement, N = {single.n}", "answers", 10, partial(
            questions.itineraries, single, count=5 if quick else 20
        ))  # fmt: skip
    yield Part("questions: thresholds", "answers", 5, questions.thresholds)
    yield Part("questions: fates", "answers", 10, questions.fates)


_QUICK = 0.2
"""How long a quick run takes, in units of a full one."""


def measure(results: Results, *, tell: Callable[[str], None], keep: Callable[[], None]) -> None:
    """Measure what is not done yet; `keep` is called after every part."""
    share = _QUICK if results.quick else 1.0
    # the questions about single rearrangements come up once these are measured
    expected = {part.name: share * part.seconds for part in parts(results)}
    left = sum(seconds for name, seconds in expected.items() if name not in results.done)
    tell(f"about {left / 60:.0f} minutes if nothing else runs")
    spent = planned = 0.0
    for part in parts(results):
        if part.name in results.done:
            continue
        begin = time.perf_counter()
        found = part.run()
        took = time.perf_counter() - begin
        known = getattr(results, part.into)
        if isinstance(known, list):
            known.extend(found)
        else:
            setattr(results, part.into, found)
        results.done.append(part.name)
        keep()
        wanted = expected.get(part.name, share * part.seconds)
        spent, planned, left = spent + took, planned + wanted, max(left - wanted, 0.0)
        tell(f"{part.name}: {took:.0f} s; about {left * spent / planned / 60:.0f} minutes left")


def begun(path: Path | None, *, quick: bool) -> Results:
    """Return what an earlier run with these settings has left at `path`, else nothing yet."""
    if path is not None and path.exists():
        found = pickle.loads(path.read_bytes())
        if isinstance(found, Results) and found.quick == quick:
            return found
    return Results(quick)


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer turns, not the longest chain")
    parser.add_argument(
        "--out", type=Path,
        help="directory for the table, pictures and numbers; what an earlier run has left is kept",
    )  # fmt: skip
    asked = parser.parse_args()
    half_done = None
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
        half_done = asked.out / "benchmark.part"
    results = begun(half_done, quick=asked.quick)

    def keep() -> None:
        if half_done is not None:
            write_file(half_done, pickle.dumps(results), "out")

    measure(results, tell=lambda what: print(what, file=sys.stderr, flush=True), keep=keep)
    text = markdown(results)
    print(text)
    if half_done is not None:
        (asked.out / "benchmark.md").write_text(text, encoding="utf-8")
        numbers = json.dumps(plain(results), indent=1)
        (asked.out / "benchmark.json").write_text(numbers + "\n", encoding="utf-8")
        draw(results, asked.out / "benchmark.png")
        draw_answers(results.answers, asked.out / "questions.png")
        half_done.unlink()


if __name__ == "__main__":
    main()
