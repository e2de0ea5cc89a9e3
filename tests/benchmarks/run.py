"""Compare this machine's solvers with SciPy's integrator, for the page on speed.

``python tests/benchmarks/run.py [SEEDS]`` takes a minute or two for 4 seeds. Chains of 2, 6 and
30 sliders, by `compare`: exact, Verlet and SciPy beside the certified solver. It prints the tables
and writes ``benchmark.csv`` and ``benchmark.png`` to ``notebooks/pictures``.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import Cycles, Experiment, compare
from exactcreep.figures.style import INKS, LENGTH, new_figure, save_picture, styled
from exactcreep.studies.comparison import sentence, table
from tests.benchmarks.rivals import registered
from tests.paper import paper_chain

AMPLITUDES = {2: "0.01", 6: "0.01", 30: "0.005"}
"""Of the cycles of the paper's chains, by their sliders."""
PICTURES = Path(__file__).parents[2] / "notebooks" / "pictures"


def contest(n: int, *, seeds: int, events: int) -> xr.Dataset:
    """Return the comparison of every method on one of the paper's chains."""
    methods = [("exact", {}), ("verlet", {"dt": "0.1"}), ("verlet", {"dt": "0.01"})]
    methods += [("verlet", {"dt": "0.1", "locate": True}), ("scipy", {"rtol": 1e-9})]
    experiment = Experiment(paper_chain(n), Cycles(AMPLITUDES[n], 100))
    with registered():
        others = [replace(experiment, solver=name, options=own) for name, own in methods]
        return compare(experiment, others, seeds=seeds, events=events)


@styled
def drawn(rows: pd.DataFrame) -> Figure:
    """Draw the error of each method against its time; hollow: some seed had a wrong event."""
    figure = new_figure(9.0, 3.4)
    for axes, (n, own) in zip(figure.subplots(1, 3, sharey=True), rows.groupby("n"), strict=True):
        for ink, mark, row in zip(INKS, "*osD^v", own.itertuples(), strict=False):
            face = "none" if row.parted else ink
            about = {"ms": 8, "color": ink, "mfc": face, "label": row.method}
            axes.loglog(1e3 * row.seconds, row.error, mark, **about)
        axes.set(xlabel="time per half-cycle (ms)", title=f"N = {n}")
        axes.margins(0.15)
    figure.axes[0].set_ylabel(f"largest error of a position {LENGTH}")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure


if __name__ == "__main__":
    tables = {}
    for size in AMPLITUDES:
        data = contest(size, seeds=int(sys.argv[1]) if len(sys.argv) > 1 else 4, events=300)
        tables[size] = table(data).assign(seeds=data.sizes["seed"], events=int(data.events.sum()))
        print(f"N = {size}\n{tables[size].to_string()}\n{sentence(data)}\n")
    measured = pd.concat(tables, names=["n"]).reset_index()
    measured.to_csv(PICTURES / "benchmark.csv", index=False, float_format="%.4g")
    save_picture(drawn(measured), PICTURES / "benchmark.png")
