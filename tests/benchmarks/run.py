"""Measure this machine, print the table, and draw the picture that the README shows.

``python tests/benchmarks/run.py [--quick] [--out DIR]``; with a directory it writes
``benchmark.md``, ``benchmark.png``, ``questions.png`` and ``benchmark.json`` there. It takes ten to
fifteen minutes, and says how many are left; stopped and started again it goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import math
import pickle
import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import matplotlib as mpl

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

from exactcreep.figures.style import INKS, STYLE, picture, save_picture
from exactcreep.quasistatic.files import write_file
from tests.benchmarks import measurements, questions
from tests.benchmarks.measurements import (
    C_VERLET,
    SAMPLES,
    SIZES,
    TIME_STEPS,
    HalfCycles,
    Rearrangements,
    Velocity,
)

ERROR = 1e-6
FAMILIES = (
    ("exact", INKS[1], "*"),
    ("Verlet", INKS[0], "o"),
    ("Verlet, located", INKS[4], "s"),
    ("heyoka", INKS[2], "D"),
    ("SciPy", INKS[3], "^"),
)
LABELS = {
    "exact": "exactcreep, exact",
    "Verlet": "exactcreep, Verlet",
    "Verlet, located": "exactcreep, Verlet, events located",
    "heyoka": "heyoka, terminal events",
    "SciPy": "SciPy DOP853, events",
}
_FLOOR = 1e-16
_UNKNOWN = (math.nan, math.nan, math.nan)
_LOST = 0.1  # where settings are drawn with which more than one in ten takes a wrong turn


@dataclass
class Results:
    """Everything that one run measured, and which parts of it are done."""

    quick: bool
    half_cycles: list[HalfCycles] = field(default_factory=list)
    rearrangements: list[Rearrangements] = field(default_factory=list)
    per_event: tuple[float, float, float] = _UNKNOWN
    speed_ups: tuple[float, float, float] = _UNKNOWN
    memory: tuple[float, int, int] = (math.nan, 0, 0)
    velocities: list[Velocity] = field(default_factory=list)
    start_up: tuple[float, float] = _UNKNOWN[:2]
    answers: list[questions.Answer] = field(default_factory=list)
    done: list[str] = field(default_factory=list)

    @property
    def long_run(self) -> int:
        """Half-cycles of the run whose memory is looked at."""
        return 10**5 if self.quick else 10**6


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
    ladder = measurements.LADDER[:-1] if quick else measurements.LADDER
    for n, amplitude in SIZES[:3]:
        yield Part(f"single rearrangements, N = {n}", "rearrangements", 30 + 3 * n, partial(
            lambda *size, **how: [measurements.rearrangement_costs(*size, **how)],
            n, amplitude, count=SAMPLES[n] // (4 if quick else 1), ladder=ladder,
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


def _us(seconds: float) -> str:
    return f"{seconds * 1e6:.3g}" if seconds < 1e-3 else f"{seconds * 1e6:.0f}"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    return [_row(*head), _row(*["---"] * len(head)), *(_row(*row) for row in rows), ""]


def markdown(results: Results) -> str:
    """Return the tables as markdown."""
    lines = [
        f"Measured on {_processor()}, one thread unless said, Python {platform.python_version()},"
        f" NumPy {version('numpy')}, SciPy {version('scipy')}, numba {version('numba')}, heyoka"
        f" {version('heyoka')}. Processor time, contestants in turns, medians; ratios are medians"
        " of the ratios turn by turn. Chains: l0 = 1000, mu_d = 0.5, mu_s = 0.6, sigma_mu = 0.01,"
        " tan_alpha = 0.25.",
        "",
        "**Time per half-cycle** (microseconds), each solver on its own run from the same state;"
        " in brackets: how many times longer than exact, and the time of one Verlet step. The last"
        " column holds exact, as measured here, against a windowed Verlet in C at dt = 0.01 on"
        " another machine.",
        "",
    ]
    rows = []
    for one in results.half_cycles:
        cells = [str(one.n), one.amplitude, _us(one.seconds(0))]
        for place, contestant in enumerate(one.contestants[1:], 1):
            cells.append(
                f"{_us(one.seconds(place))} ({one.ratio(place):.2g} times;"
                f" {contestant.per_step * 1e9:.3g} ns)"
            )
        low, high = C_VERLET[one.n]
        stated = _us(low) if low == high else f"{_us(low)}-{_us(high)}"
        rows.append((*cells, f"{stated} ({one.c_ratio:.2g} times)"))
    steps = tuple(f"our Verlet, dt = {dt}" for dt in TIME_STEPS)
    lines += _table(("N", "A", "exact", *steps, "Verlet in C, dt = 0.01"), rows)

    lines += [
        f"**Time per rearrangement with the right events and positions good to {ERROR:.0e}** in"
        " nine of ten rearrangements, against the certified solver (microseconds; in brackets: how"
        " many times longer than exact). Verlet's time step is interpolated between the measured"
        " ones; SciPy and heyoka are driven from Python, event by event, at the cheapest tolerance"
        " tried that suffices.",
        "",
    ]
    rows = []
    for family, _, _ in FAMILIES:
        cells = [LABELS[family]]
        for single in results.rearrangements:
            seconds, how = single.seconds_at(family, ERROR)
            exact, _ = single.seconds_at("exact", ERROR)
            note = ", extrapolated" if how == "extrapolated" else ""
            cells.append(f"{_us(seconds)} ({seconds / exact:.2g} times{note})")
        rows.append(tuple(cells))
    lines += _table(
        ("", *(f"N = {one.n}, A = {one.amplitude}" for one in results.rearrangements)), rows
    )

    for single in results.rearrangements:
        count = single.methods[0].errors.size
        lines += [
            f"**All settings at N = {single.n}**: {count} successive rearrangements,"
            f" {single.events} events; error: largest position error at the end of a rearrangement,"
            " wrong: other sliders moved, or in another order.",
            "",
        ]
        rows = []
        for method in single.methods:
            rows.append(
                (
                    method.label,
                    _us(method.seconds),
                    f"{method.quantile(0.5):.1e}",
                    f"{method.quantile(0.9):.1e}",
                    f"{100 * method.wrong:.1f} %",
                )
            )
        lines += _table(("method", "time (us)", "median error", "90 % below", "wrong"), rows)

    lines += [
        "**What a mean velocity costs**, from an ensemble of chains, against Verlet at dt = 0.3:"
        " mean advance per half-cycle with its standard error; bias of Verlet, also in combined"
        " standard errors; processor time of Verlet over that of exact, for the same standard error"
        " and for the same half-cycles (equal but for the noise of the standard errors if the"
        " spread is the same). Above 1, exact is the cheaper.",
        "",
    ]
    rows = []
    for cost in results.velocities:
        rows.append(
            (
                str(cost.n),
                cost.amplitude,
                f"{cost.mean[0]:.4f} +- {cost.error[0]:.4f}",
                f"{cost.mean[1]:.4f} +- {cost.error[1]:.4f}",
                f"{100 * (cost.mean[1] / cost.mean[0] - 1):+.2g} % ({cost.bias:+.1f} errors)",
                f"{cost.cost_ratio:.2g} +- {cost.cost_ratio_error:.1g}",
                f"{cost.time_ratio:.2g}",
            )
        )
    lines += _table(
        ("N", "A", "exact", "Verlet, dt = 0.3", "bias", "time ratio, same standard error",
         "time ratio, same half-cycles"), rows,
    )  # fmt: skip

    lines += [
        "**Time to answer a question** (processor time, seconds). Mean velocities at A = "
        + ", ".join(f"{a} (N = {n})" for n, a in questions.AMPLITUDES.items())
        + ", at 95 %; extrapolated: longer than what was run, by the square of the error. The"
        " bias of law, sliding and Verlet is measured against exact; they answer where it is known"
        " to be smaller than what is asked for, Verlet also where none is seen.",
        "",
    ]
    rows = []
    for one in results.answers:
        spent = f"{one.seconds:.2g}" if math.isfinite(one.seconds) else "no answer"
        rows.append((one.question, str(one.n), one.method, spent, one.note))
    lines += _table(("question", "N", "by", "seconds", "what is known of it"), rows)

    short, long, ratio = results.per_event
    exact, spin, share = results.speed_ups
    compiling, ready = results.start_up
    took, peak, little = results.memory
    lines += [
        f"- Time per event at A = 0.005: {short * 1e9:.0f} ns with 100 sliders,"
        f" {long * 1e9:.0f} ns with 100,000: {ratio:.2f} times.",
        f"- Two threads on two ensembles (N = 30): speed-up {exact:.2f} on the wall clock; a loop"
        f" that only counts: {spin:.2f}; median ratio in the same turns {share:.2f}.",
        f"- {results.long_run:,} half-cycles of two sliders: {took:.2f} s, at most"
        f" {peak / 1024:.0f} KiB (1000 half-cycles: {little / 1024:.0f} KiB).",
        f"- A short `exactcreep run`: {compiling:.1f} s of processor time the first time, with"
        f" compilation, {ready:.1f} s afterwards.",
        "",
    ]
    return "\n".join(lines)


def _processor() -> str:
    try:
        known = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    names = [line for line in known.splitlines() if line.startswith("model name")]
    name = names[0].partition(":")[2].strip() if names else platform.machine()
    return f"{name} ({'with' if 'avx512f' in known else 'without'} AVX-512)"


def plain(results: Results) -> dict[str, Any]:
    """Return the numbers as plain data for JSON."""

    def known(value: float) -> float | None:
        return float(value) if math.isfinite(value) else None

    return {
        "half_cycles": [
            {
                "n": one.n,
                "amplitude": one.amplitude,
                "seconds": {c.label: one.seconds(k) for k, c in enumerate(one.contestants)},
                "ratio_to_exact": {c.label: one.ratio(k) for k, c in enumerate(one.contestants)},
                "seconds_per_step": {c.label: known(c.per_step) for c in one.contestants},
                "c_verlet_to_exact": one.c_ratio,
            }
            for one in results.half_cycles
        ],
        "rearrangements": [
            {
                "n": one.n,
                "amplitude": one.amplitude,
                "events": one.events,
                "methods": [
                    {
                        "label": m.label,
                        "seconds": m.seconds,
                        "median_error": known(m.quantile(0.5)),
                        "error_of_nine_in_ten": known(m.quantile(0.9)),
                        "wrong": m.wrong,
                    }
                    for m in one.methods
                ],
            }
            for one in results.rearrangements
        ],
        "seconds_per_event": dict(zip(("n_100", "n_100000", "ratio"), results.per_event,
                                      strict=True)),
        "two_threads": dict(zip(("exact", "spin", "ratio"), results.speed_ups, strict=True)),
        "long_run": dict(zip(("seconds", "peak_bytes", "peak_bytes_of_1000"), results.memory,
                             strict=True)),
        "start_up_seconds": list(results.start_up),
        "velocities": [
            {
                "n": one.n,
                "amplitude": one.amplitude,
                "exact": [one.mean[0], one.error[0]],
                "verlet": [one.mean[1], one.error[1]],
                "time_ratio_at_equal_error": one.cost_ratio,
                "time_ratio": one.time_ratio,
            }
            for one in results.velocities
        ],
        "answers": [asdict(one) | {"seconds": known(one.seconds)} for one in results.answers],
    }  # fmt: skip


def draw(results: Results, path: Path) -> None:
    """Draw error against time of single rearrangements at N = 30, and the times per half-cycle."""
    single = results.rearrangements[-1]
    with mpl.rc_context(STYLE):
        figure = picture(9.0, 4.2)
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1))
        for family, ink, mark in FAMILIES:
            lost = [m for m in single.family(family) if m.quantile(0.9) == math.inf]
            left.plot(
                [m.seconds * 1e6 for m in lost],
                [_LOST] * len(lost),
                color=ink,
                marker=mark,
                markersize=5,
                markerfacecolor="white",
                linestyle="none",
            )
            for method in lost:
                setting = method.setting.rpartition("= ")[2]
                left.annotate(
                    f"{setting}: {100 * method.wrong:.0f} %",
                    (method.seconds * 1e6, _LOST),
                    xytext=(0, 6),
                    textcoords="offset points",
                    fontsize=6,
                    color=ink,
                    rotation=90,
                    ha="center",
                    va="bottom",
                )
            shown = [m for m in single.family(family) if m.quantile(0.9) < math.inf]
            x = [m.seconds * 1e6 for m in shown]
            y = [max(m.quantile(0.9), _FLOOR) for m in shown]
            left.plot(
                x,
                y,
                color=ink,
                marker=mark,
                markersize=11 if mark == "*" else 5,
                linestyle="-" if len(shown) > 1 else "none",
                label=LABELS[family],
            )
            for method, a, b in zip(shown, x, y, strict=True):
                words = method.setting.rpartition("= ")[2]
                if family == "exact":
                    words = f"{a:.2g} µs"
                if family.startswith("Verlet"):
                    words = f"{float(words):g}"
                above = family in ("Verlet", "SciPy", "heyoka")
                left.annotate(
                    words,
                    (a, b),
                    xytext=(6 if above else -6, 2 if above else -7),
                    textcoords="offset points",
                    fontsize=6,
                    color=ink,
                    ha="left" if above else "right",
                )
        left.set_xscale("log")
        left.set_yscale("log")
        left.margins(x=0.14)
        left.set_ylim(_FLOOR / 3, _LOST * 2e4)
        left.set_yticks([10.0**k for k in range(-15, 0, 2)])
        left.axhline(_LOST, color=INKS[7], linewidth=0.6, linestyle=":", zorder=0)
        left.set_xlabel("processor time per rearrangement (µs)")
        left.set_ylabel(
            r"error of nine in ten rearrangements ($g\,\tau_\mathrm{dyn}^2$)", fontsize=9
        )
        left.set_title(
            f"N = {single.n}; numbers: dt or tolerance; open: in so many % wrong events",
            fontsize=8,
        )
        handles, labels = left.get_legend_handles_labels()

        bars = [("exact", INKS[1])] + [
            (f"Verlet, dt = {dt}", ink)
            for dt, ink in zip(reversed(TIME_STEPS), ("#B3CDE3", "#6497B1", INKS[0]), strict=True)
        ]
        width = 0.8 / len(bars)
        for k, (label, ink) in enumerate(bars):
            heights = []
            for one in results.half_cycles:
                place = [c.label for c in one.contestants].index(label)
                heights.append(one.seconds(place) * 1e6)
            x = [i + (k - (len(bars) - 1) / 2) * width for i in range(len(heights))]
            right.bar(x, heights, width, color=ink, label=label, edgecolor="black", linewidth=0.4)
            if label == f"Verlet, dt = {TIME_STEPS[0]}":
                for i, one in enumerate(results.half_cycles):
                    place = [c.label for c in one.contestants].index(label)
                    right.annotate(
                        f"×{one.ratio(place):.2g}",
                        (x[i], heights[i]),
                        xytext=(0, 2),
                        textcoords="offset points",
                        ha="center",
                        fontsize=7,
                        color=ink,
                    )
        right.set_yscale("log")
        right.margins(y=0.12)
        right.tick_params(axis="x", which="both", top=False, bottom=False)
        right.set_xticks(
            range(len(results.half_cycles)),
            [f"N = {one.n}\nA = {one.amplitude}" for one in results.half_cycles],
            fontsize=7,
        )
        right.set_ylabel("processor time per half-cycle (µs)")
        right.set_title("whole half-cycles; ×: Verlet at dt = 0.01 against exact", fontsize=8)
        right.legend(loc="upper left", fontsize=7)
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=7)
        save_picture(figure, path)


def draw_answers(answers: list[questions.Answer], path: Path) -> None:
    """Draw the time of every answer, a row for each question and size."""
    rows = list(dict.fromkeys((one.question, one.n) for one in answers))
    methods = list(dict.fromkeys(one.method for one in answers))
    with mpl.rc_context(STYLE):
        figure = picture(7.0, 0.8 + 0.24 * len(rows))
        axes = figure.subplots()
        for k, method in enumerate(methods):
            shown = [one for one in answers if one.method == method and one.seconds > 0]
            axes.plot(
                [one.seconds for one in shown],
                [rows.index((one.question, one.n)) for one in shown],
                color=INKS[k % len(INKS)],
                marker="os^Dv*<>P"[k % 9],
                markersize=6,
                linestyle="none",
                label=method,
            )
        axes.set_xscale("log")
        axes.set_yticks(range(len(rows)), [f"{what}, N = {n}" for what, n in rows], fontsize=7)
        axes.invert_yaxis()
        axes.grid(axis="y", linewidth=0.3)
        axes.set_xlabel("processor time to the answer (s)")
        figure.legend(loc="outside lower center", ncols=min(len(methods), 5), fontsize=7)
        save_picture(figure, path)


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
