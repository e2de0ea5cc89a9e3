"""Hold this machine's solvers against what a user would take instead, and print the tables.

``python tests/benchmarks/run.py [SEEDS]``: chains of 2, 6 and 30 sliders, by `compare`: exact,
Verlet, SciPy and, with the extra `bench`, heyoka beside the certified solver.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

import xarray as xr

from exactcreep import Cycles, Experiment, Method, compare
from exactcreep.studies.comparison import advice, table
from tests.benchmarks.rivals import RIVALS, registered
from tests.paper import paper_chain

AMPLITUDES = {2: "0.01", 6: "0.01", 30: "0.005"}
"""Of the cycles of the paper's chains, by their sliders."""


def contest(n: int, *, seeds: int, events: int) -> xr.Dataset:
    """Return what every method is worth on one of the paper's chains."""
    methods = [Method("exact"), Method("verlet", dt="0.01"), Method("scipy", rtol=1e-9)]
    methods.append(Method("verlet", dt="0.1", locate=True))
    if "heyoka" in RIVALS:
        methods.append(Method("heyoka", tol=1e-9))
    experiment = Experiment(paper_chain(n), Cycles(AMPLITUDES[n], 100))
    with registered():
        return compare(experiment, methods, seeds=seeds, events=events)


if __name__ == "__main__":
    for size in AMPLITUDES:
        data = contest(size, seeds=int(sys.argv[1]) if len(sys.argv) > 1 else 4, events=300)
        print(f"N = {size}\n{table(data).to_string()}\n{advice(data)}\n")
