"""Time a half-cycle of `exact` and of velocity Verlet in C, for the page on speed.

``python tests/benchmarks/half_cycles.py [SECONDS]`` needs a C compiler (``cc``) and some six
minutes of a quiet machine; SECONDS (0.25) is how long each contestant runs at least, in each of
three turns. It writes ``half-cycles.md`` and ``half-cycles.json`` to ``notebooks/pictures``; the
page draws the second. Processor time of one thread, contestants in turns, the least of the turns.
Each contestant follows a run of its own.
"""

from __future__ import annotations

import json
import math
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

from exactcreep.laws.paper import threshold_amplitude
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.solvers.registry import solver_named
from exactcreep.watch.limits import Limits
from tests.paper import paper_chain

TURNS = 3
LENGTHS = (2, 3, 4, 6, 8, 10, 30, 60, 300)
LONG = (100, 300, 1000, 3000)
STEPS = ("0.01", "0.1", "0.3")
EIGHT = "Verlet in C, dt = 0.3, eight members in lanes"
PICTURES = Path(__file__).parents[2] / "notebooks" / "pictures"


def amplitudes(n: int) -> dict[str, str]:
    """Return the two amplitudes of cycles of a chain, by what they are called."""
    law = threshold_amplitude(n=n, l0=1000, mu_d=0.5, tan_alpha=0.25)
    return {"0.01": "0.01", "1.37 Eq. 22": f"{1.37 * float(law):.8f}"}


class Exact:
    """The compiled solver on its way along cycles."""

    def __init__(self, n: int, amplitude: str, sigma: str) -> None:
        chain = paper_chain(n, sigma)
        self.simulation: Any = solver_named("exact", {}).simulation(
            chain, State.relaxed(chain, 1), 1, ()
        )
        self.drive, self.done = Cycles(amplitude, 10**9), 0

    def run(self, seconds: float, least: int = 2) -> float:
        """Go on for so long, and return the microseconds of a half-cycle."""
        begin, count, stretch = time.thread_time(), 0, least
        while count < least or time.thread_time() - begin < seconds:
            self.simulation.follow(self.drive, self.done + 1, stretch)
            self.done, count = self.done + stretch, count + stretch
            stretch = min(2 * stretch, 2000)
        return 1e6 * (time.thread_time() - begin) / count

    def per_event(self, events: int) -> float:
        """Go on for about so many events, and return the nanoseconds of one."""
        begin, before = time.thread_time(), self.simulation.events
        stretch = self.simulation.follow(self.drive, self.done + 1, 10**6, Limits(events))
        self.done += stretch.completed
        return 1e9 * (time.thread_time() - begin) / (self.simulation.events - before)


class Compiled:
    """The program of `verlet.c` with one, or eight members in the lanes of a vector."""

    def __init__(self, folder: str, members: int) -> None:
        self.program = f"{folder}/verlet{members}"
        source = str(Path(__file__).with_name("verlet.c"))
        flags = ("-O3", "-march=native", f"-DLANES={members}", "-o", self.program)
        subprocess.run(["cc", *flags, source, "-lm"], check=True)

    def __call__(self, n: int, amplitude: str, step: str, sigma: str, seconds: float) -> float:
        """Return the microseconds of a half-cycle of one member."""
        given = [str(n), str(1000 * float(amplitude)), step, sigma]
        spent, count = 0.0, 2
        while True:
            done = subprocess.run(
                [self.program, *given, str(count), "4", "1"], capture_output=True, check=True
            )
            spent = float(done.stdout.split()[0])
            if (
                math.isnan(spent)
                or spent * count * 1e-6 >= seconds
                or spent * count > 2e6
                or count >= 10**6
            ):
                return spent
            count = min(max(2 * count, int(seconds * 1.2e6 / max(spent, 1e-3))), 10**6)


def half_cycles(folder: str, seconds: float) -> list[dict[str, Any]]:
    """Return one row for each chain, amplitude and disorder: seconds of a half-cycle by method."""
    alone, eight, rows = Compiled(folder, 1), Compiled(folder, 8), []
    for n in LENGTHS:
        for name, amplitude in amplitudes(n).items():
            for sigma in ("0.01", "0"):
                exact = Exact(n, amplitude, sigma)
                exact.run(0.0, 10 if n < 60 else 4)
                if exact.simulation.events == 0:
                    continue  # nothing ever moves
                best: dict[str, float] = {}
                for _ in range(1 if n == 300 else TURNS):
                    times = {"exact": exact.run(seconds)}
                    for step in STEPS:
                        took = alone(n, amplitude, step, sigma, seconds)
                        times[f"Verlet in C, dt = {step}"] = took
                    times[EIGHT] = eight(n, amplitude, "0.3", sigma, seconds)
                    best = {k: min(t, best.get(k, t)) for k, t in times.items()}
                rows.append(
                    {"n": n, "amplitude": name, "sigma_mu": sigma}
                    | {"seconds": {k: 1e-6 * t for k, t in best.items()}}
                )
                print(n, name, sigma, {k: float(f"{t:.4g}") for k, t in best.items()}, flush=True)
    return rows


def long_chains() -> list[tuple[int, float]]:
    """Return, by sliders, the nanoseconds of an event."""
    rows = []
    for n in LONG:
        exact = Exact(n, amplitudes(n)["1.37 Eq. 22"], "0.01")
        exact.per_event(20_000)
        rows.append((n, min(exact.per_event(100_000) for _ in range(TURNS))))
        print(n, rows[-1], flush=True)
    return rows


def page(rows: list[dict[str, Any]], events: list[tuple[int, float]]) -> str:
    """Return the tables in Markdown."""
    methods = list(rows[0]["seconds"])
    lines = [
        f"Microseconds of a half-cycle, measured on {platform.processor() or platform.machine()}, "
        f"one thread, the least of {TURNS} turns (one at 300 sliders); chains of the captions. "
        "Without disorder the members in the lanes are all the same.",
        "",
        "| " + " | ".join(["N", "A", "sigma_mu", *methods]) + " |",
        "|" + " --- |" * (3 + len(methods)),
    ]
    for row in rows:
        times = [f"{1e6 * row['seconds'][method]:.3g}" for method in methods]
        about = [str(row["n"]), row["amplitude"], row["sigma_mu"]]
        lines.append("| " + " | ".join([*about, *times]) + " |")
    lines += ["", "Nanoseconds of an event at 1.37 Eq. 22, sigma_mu = 0.01:", ""]
    lines += ["| N | exact |", "| --- | --- |"]
    lines += [f"| {n} | {took:.0f} |" for n, took in events]
    return "\n".join(lines) + "\n"


def main(seconds: float) -> None:
    """Measure, write and print everything."""
    with tempfile.TemporaryDirectory() as folder:
        rows = half_cycles(folder, seconds)
    text = page(rows, long_chains())
    (PICTURES / "half-cycles.md").write_text(text, encoding="utf-8")
    drawn = [row for row in rows if row["amplitude"] == "0.01" and row["sigma_mu"] == "0.01"]
    (PICTURES / "half-cycles.json").write_text(json.dumps(drawn, indent=1) + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.25)
