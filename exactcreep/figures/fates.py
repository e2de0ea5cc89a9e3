"""Pictures of what becomes of a chain: one course until it has settled, and the lives of many."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exactcreep.figures.style import DASHED, INKS, new_figure
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import floats
from exactcreep.model.outcome import Outcome, behaviour
from exactcreep.quasistatic.creep import creep
from exactcreep.studies.fates.result import Fate
from exactcreep.studies.fates.survival import Survival

_MOST_CYCLES = 10_000  # of a picture
_WORDS = {
    Outcome.AT_REST: "at rest",
    Outcome.CYCLING: "locked",
    Outcome.CREEPING: "creeps",
}


def draw_fate(found: Fate, path: Path | str) -> None:
    """Draw x_G and the tensions at the ends of cycles, and where they have settled.

    The course is followed again, with the solver that found its fate.

    Raises
    ------
    InputError
        If the file cannot be written, or its ending is none of a picture.
    """
    settled = found.settled_after
    shown = max(found.cycles, 1)
    if settled is not None and found.period is not None:
        shown = settled + max(2 * found.period, settled // 5, 5)
    shown = min(shown, _MOST_CYCLES)
    drive, record = Cycles(found.amplitude, shown), ("x_G", "tension")
    run = creep(found.chain, drive, start=found.start, solver=found.solver, record=record)
    x_g = floats(run.recorded["x_G"][1::2])
    tensions = floats(run.recorded["tension"][1::2].ravel()).reshape(x_g.size, found.chain.n - 1)
    cycles = np.arange(1, x_g.size + 1)
    with new_figure(path, 6.0, 5.0, _title(found)) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(cycles, x_g, color=INKS[0])
        above.set_ylabel(r"$\tilde{x}_G$  ($g\,\tau_\mathrm{dyn}^2$)")
        for spring, values in enumerate(tensions.T):
            ink = INKS[spring % len(INKS)]
            below.plot(cycles, values, color=ink, linewidth=0.8, label=f"$T_{{{spring + 1}}}$")
        below.set_ylabel("tension  ($m g$)")
        below.set_xlabel("cycle")
        if tensions.shape[1] <= len(INKS):
            below.legend(loc="best", ncols=4)
        if settled is not None and settled <= shown:
            for axes in (above, below):
                axes.axvline(settled, color=INKS[7], linestyle=(0, (4, 2)), linewidth=0.9)
            # the wider side has room for the words
            above.text(
                settled, 0.02, f" {_WORDS[found.outcome]}, period {found.period} ", fontsize=8,
                transform=above.get_xaxis_transform(), va="bottom",
                ha="right" if 2 * settled > shown else "left",
            )  # fmt: skip


def _title(found: Fate) -> str:
    how = "not settled" if found.settled_after is None else f"settled after {found.settled_after}"
    return (
        f"N = {found.chain.n}, A = {float(found.amplitude):.9g}:"
        f" {behaviour(found.outcome, found.direction)}, {how} cycles ({found.evidence.value})"
    )


def draw_survival(found: Survival, path: Path | str) -> None:
    """Draw which part of the starts outlives each number of cycles, beside a constant rate.

    Raises
    ------
    InputError
        If the file cannot be written, or its ending is none of a picture.
    """
    curve, rate = found.curve, found.rate
    end = max(float(curve.cycles.max(initial=1.0)), 1.0)
    title = f"N = {found.chain.n}, A = {float(found.amplitude):.9g}, {found.starts} starts"
    with new_figure(path, 6.0, 4.2, title) as figure:
        axes = figure.subplots()
        steps = np.append(0.0, curve.cycles)
        low, high, moving = (
            np.append(1.0, np.where(np.isnan(values), curve.moving, values))
            for values in (curve.low, curve.high, curve.moving)
        )
        axes.fill_between(steps, low, high, step="post", color=INKS[4], alpha=0.3, linewidth=0,
                          label="Kaplan-Meier, 95 %")  # fmt: skip
        axes.step(steps, moving, where="post", color=INKS[0])
        cut = found.censored
        if cut.size:
            height = moving[np.searchsorted(steps, cut, side="right") - 1]
            axes.plot(cut, height, "|", color=INKS[6], markersize=8, label=f"{cut.size} censored")
        if rate.low > 0:
            times = np.linspace(rate.cut, end, 200)
            label = f"constant rate: one in {1 / rate.rate:.4g} cycles"
            begin = moving[np.searchsorted(steps, rate.cut, side="right") - 1]
            constant = begin * np.exp(-rate.rate * (times - rate.cut))
            axes.plot(times, constant, color=INKS[1], linestyle=DASHED, label=label)
        axes.set(xlim=(0.0, end), xlabel="cycle", ylim=(0.0, 1.05))
        axes.set_ylabel("starts not locked or at rest yet")
        axes.legend()
