"""What a run of the benchmark measured, as tables in markdown and as numbers for JSON."""

from __future__ import annotations

import math
import platform
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tests.benchmarks import questions
from tests.benchmarks.measurements import C_VERLET, TIME_STEPS, HalfCycles, Velocity
from tests.benchmarks.rearrangements import Rearrangements

ERROR = 1e-6
LABELS = {
    "exact": "exactcreep, exact",
    "Verlet": "exactcreep, Verlet",
    "Verlet, located": "exactcreep, Verlet, events located",
    "heyoka": "heyoka, terminal events",
    "SciPy": "SciPy DOP853, events",
}
"""The families of methods, as they are called in pictures and tables."""
_UNKNOWN = (math.nan, math.nan, math.nan)


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


def _us(seconds: float) -> str:
    return f"{seconds * 1e6:.3g}" if seconds < 1e-3 else f"{seconds * 1e6:.0f}"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def markdown(results: Results) -> str:
    """Return the tables as markdown."""
    return "\n".join(
        (
            f"Measured on {_processor()}, one thread unless said, Python"
            f" {platform.python_version()}, NumPy {version('numpy')}, SciPy {version('scipy')},"
            f" numba {version('numba')}, heyoka {version('heyoka')}. Processor time, contestants in"
            " turns, medians; ratios are medians of the ratios turn by turn. Chains: l0 = 1000,"
            " mu_d = 0.5, mu_s = 0.6, sigma_mu = 0.01, tan_alpha = 0.25.\n",
            _half_cycles(results.half_cycles),
            _at_equal_error(results.rearrangements),
            *map(_all_settings, results.rearrangements),
            _velocities(results.velocities),
            _answers(results.answers),
            _rest(results),
        )
    )


def _half_cycles(half_cycles: list[HalfCycles]) -> str:
    rows = []
    for one in half_cycles:
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
    return (
        "**Time per half-cycle** (microseconds), each solver on its own run from the same state;"
        " in brackets: how many times longer than exact, and the time of one Verlet step. The last"
        " column holds exact, as measured here, against a windowed Verlet in C at dt = 0.01 on"
        " another machine.\n\n"
        + _table(("N", "A", "exact", *steps, "Verlet in C, dt = 0.01"), rows)
    )


def _at_equal_error(rearrangements: list[Rearrangements]) -> str:
    rows = []
    for family, label in LABELS.items():
        cells = [label]
        for single in rearrangements:
            seconds, how = single.seconds_at(family, ERROR)
            exact, _ = single.seconds_at("exact", ERROR)
            note = ", extrapolated" if how == "extrapolated" else ""
            cells.append(f"{_us(seconds)} ({seconds / exact:.2g} times{note})")
        rows.append(tuple(cells))
    return (
        f"**Time per rearrangement with the right events and positions good to {ERROR:.0e}** in"
        " nine of ten rearrangements, against the certified solver (microseconds; in brackets: how"
        " many times longer than exact). Verlet's time step is interpolated between the measured"
        " ones; SciPy and heyoka are driven from Python, event by event, at the cheapest tolerance"
        " tried that suffices.\n\n"
        + _table(("", *(f"N = {one.n}, A = {one.amplitude}" for one in rearrangements)), rows)
    )


def _all_settings(single: Rearrangements) -> str:
    rows = [
        (
            method.label,
            _us(method.seconds),
            f"{method.quantile(0.5):.1e}",
            f"{method.quantile(0.9):.1e}",
            f"{100 * method.wrong:.1f} %",
        )
        for method in single.methods
    ]
    return (
        f"**All settings at N = {single.n}**: {single.methods[0].errors.size} successive"
        f" rearrangements, {single.events} events; error: largest position error at the end of a"
        " rearrangement, wrong: other sliders moved, or in another order.\n\n"
        + _table(("method", "time (us)", "median error", "90 % below", "wrong"), rows)
    )


def _velocities(velocities: list[Velocity]) -> str:
    rows = [
        (
            str(cost.n),
            cost.amplitude,
            f"{cost.mean[0]:.4f} +- {cost.error[0]:.4f}",
            f"{cost.mean[1]:.4f} +- {cost.error[1]:.4f}",
            f"{100 * (cost.mean[1] / cost.mean[0] - 1):+.2g} % ({cost.bias:+.1f} errors)",
            f"{cost.cost_ratio:.2g} +- {cost.cost_ratio_error:.1g}",
            f"{cost.time_ratio:.2g}",
        )
        for cost in velocities
    ]
    return (
        "**What a mean velocity costs**, from an ensemble of chains, against Verlet at dt = 0.3:"
        " mean advance per half-cycle with its standard error; bias of Verlet, also in combined"
        " standard errors; processor time of Verlet over that of exact, for the same standard error"
        " and for the same half-cycles (equal but for the noise of the standard errors if the"
        " spread is the same). Above 1, exact is the cheaper.\n\n"
        + _table(("N", "A", "exact", "Verlet, dt = 0.3", "bias", "time ratio, same standard error",
                  "time ratio, same half-cycles"), rows)
    )  # fmt: skip


def _answers(answers: list[questions.Answer]) -> str:
    rows = []
    for one in answers:
        spent = f"{one.seconds:.2g}" if math.isfinite(one.seconds) else "no answer"
        rows.append((one.question, str(one.n), one.method, spent, one.note))
    return (
        "**Time to answer a question** (processor time, seconds). Mean velocities at A = "
        + ", ".join(f"{a} (N = {n})" for n, a in questions.AMPLITUDES.items())
        + ", at 95 %; extrapolated: longer than what was run, by the square of the error. The"
        " bias of law, sliding and Verlet is measured against exact; they answer where it is known"
        " to be smaller than what is asked for, Verlet also where none is seen.\n\n"
        + _table(("question", "N", "by", "seconds", "what is known of it"), rows)
    )


def _rest(results: Results) -> str:
    short, long, ratio = results.per_event
    exact, spin, share = results.speed_ups
    compiling, ready = results.start_up
    took, peak, little = results.memory
    return (
        f"- Time per event at A = 0.005: {short * 1e9:.0f} ns with 100 sliders,"
        f" {long * 1e9:.0f} ns with 100,000: {ratio:.2f} times.\n"
        f"- Two threads on two ensembles (N = 30): speed-up {exact:.2f} on the wall clock; a loop"
        f" that only counts: {spin:.2f}; median ratio in the same turns {share:.2f}.\n"
        f"- {results.long_run:,} half-cycles of two sliders: {took:.2f} s, at most"
        f" {peak / 1024:.0f} KiB (1000 half-cycles: {little / 1024:.0f} KiB).\n"
        f"- A short `exactcreep run`: {compiling:.1f} s of processor time the first time, with"
        f" compilation, {ready:.1f} s afterwards.\n"
    )


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
