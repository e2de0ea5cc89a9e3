"""Pictures of fates: the trajectory of a chain until it settles, and the survival of many."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import DASHED, DISPLACEMENT, INKS, new_figure, styled
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import floats
from exactcreep.model.numbers import in_full
from exactcreep.quasistatic.creep import creep
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.fates.survival import Survival

_MOST_CYCLES = 10_000  # most cycles in a picture


@styled
def draw_fate(found: Fate) -> Figure:
    """Draw x_G and the tensions at the ends of cycles, and mark where they have settled."""
    settled, shown = found.settled_after, max(found.cycles, 1)
    if settled is not None and found.period is not None:
        shown = settled + max(2 * found.period, settled // 5, 5)
    shown = min(shown, _MOST_CYCLES)
    title = f"N = {found.chain.n}, A = {float(found.amplitude):.9g}: {found.finding}"
    record = ("x_G", "tension")
    run = creep(found.chain, Cycles(found.amplitude, shown), start=found.start,
                solver=found.solver, record=record)  # fmt: skip
    begin = run.experiment.initial
    x_g = np.append(floats(begin.displacements).mean(), floats(run.recorded["x_G"][1::2]))
    tensions = np.vstack([floats(begin.tensions), floats(run.recorded["tension"][1::2])])
    figure = new_figure(6.0, 5.0, title)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(x_g, color=INKS[6])
    above.set_ylabel(DISPLACEMENT)
    for spring, values in enumerate(tensions.T):
        ink, label = INKS[spring % len(INKS)], f"$T_{{{spring + 1}}}$"
        below.plot(values, color=ink, linewidth=0.8, label=label)
    below.set(xlabel="cycle", ylabel=r"tension ($m\,g$)")
    below.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    if tensions.shape[1] <= len(INKS):
        figure.legend(loc="outside lower center", ncols=len(INKS))
    if settled is not None and settled <= shown:
        for axes in (above, below):
            axes.axvline(settled, color=INKS[7], linestyle=(0, (4, 2)), linewidth=0.9)
        above.set_title(f"broken line: settled, period {found.period}", fontsize=8)
    return figure


@styled
def draw_survival(found: Survival) -> Figure:
    """Draw the fraction of starts that survive each number of cycles, beside a constant rate."""
    curve, rate, cut = found.curve, found.rate, found.censored
    end = max(float(curve.cycles.max(initial=1.0)), 1.0)
    bounded = np.isfinite(curve.low).any()
    title = f"N = {found.chain.n}, A = {float(found.amplitude):.9g}: {found.finding}"
    figure = new_figure(6.0, 4.2, title)
    axes = figure.subplots()
    steps = np.append(0.0, curve.cycles)
    low, high, moving = (
        np.append(1.0, np.where(np.isnan(values), curve.moving, values))
        for values in (curve.low, curve.high, curve.moving)
    )
    axes.fill_between(steps, low, high, step="post", color=INKS[4], alpha=0.3, linewidth=0,
                      label="Kaplan-Meier" + ", 95 %" * bool(bounded))  # fmt: skip
    axes.step(steps, moving, where="post", color=INKS[0])
    if cut.size:
        height = moving[np.searchsorted(steps, cut, side="right") - 1]
        axes.plot(cut, height, "|", color=INKS[6], markersize=8, label=f"{cut.size} censored")
    if rate.low > 0:
        times = np.linspace(rate.cut, end, 200)
        begin = moving[np.searchsorted(steps, rate.cut, side="right") - 1]
        constant = begin * np.exp(-rate.rate * (times - rate.cut))
        label = f"constant rate: one in {in_full(1 / rate.rate)} cycles"
        axes.plot(times, constant, color=INKS[1], linestyle=DASHED, label=label)
    axes.set(xlim=(-0.02 * end, 1.02 * end), xlabel="cycle", ylim=(-0.02, 1.05))
    axes.set_ylabel("starts not locked or at rest yet")
    axes.legend()
    return figure
