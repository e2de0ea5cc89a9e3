"""Pictures for those who sit at a notebook: what `Creep.plot` and `Rearrangement.plot` are."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.runs import draw_one
from exactcreep.figures.style import INKS
from exactcreep.model.enclosure import floats
from exactcreep.model.numbers import InputError
from exactcreep.model.temperature_record import TemperatureRecord
from exactcreep.quasistatic.result import Creep
from exactcreep.solid import Solid
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.avalanches import MEASURES, avalanches_of, distribution

_POINTS: dict[str, Any] = {"marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7}
_INSTANTS = 400  # of a rearrangement that is drawn


class Plots:
    """The pictures of one run; call it for x_G over time.

    Parameters
    ----------
    result : Creep
    """

    def __init__(self, result: Creep) -> None:
        self._result = result

    def __call__(self, ax: Axes | None = None, *, solid: Solid | None = None) -> Axes:
        """Draw x_G, and every slider of a short chain, over time; return the axes.

        Time is in half-cycles; of a record of temperatures it is in dates, and the temperatures
        stand beside it in degrees.

        Parameters
        ----------
        ax : Axes, optional
        solid : Solid, optional
            Of a record: whose chain it is; displacements are then in millimetres.

        Raises
        ------
        InputError
            If the run did not record x_G, or the solid has another chain.
        """
        result, drive = self._result, self._result.drive
        if "x_G" not in result.recorded:
            raise InputError("plot", "x_G", 'was not recorded: the run needs record = ["x_G"]')
        if solid is not None and solid.chain != result.chain:
            raise InputError("solid", solid, "must be the solid of the run's chain")
        axes = ax if ax is not None else _new_axes()
        if not isinstance(drive, TemperatureRecord):
            draw_one(axes, result)
            return axes
        time, reached = drive.clock(np.arange(1, result.half_cycles + 1)), result.half_cycles
        over = time if drive.dates is None else drive.dates[:reached]
        moved, name = (
            floats(result.recorded["x_G"]),
            r"$\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)",
        )
        if solid is not None:
            moved, name = 1000 * solid.metres(moved), "descent (mm)"
        unit = "\N{DEGREE SIGN}C" if drive.unit == "C" else "K"
        beside = axes.twinx()
        beside.plot(over, drive.temperatures[:reached], color="0.7", linewidth=0.6)
        beside.set_ylabel(f"temperature ({unit})", color="0.5")
        axes.plot(over, moved, color=INKS[6], linewidth=1.6)
        axes.set_zorder(beside.get_zorder() + 1)
        axes.patch.set_visible(False)
        axes.set(xlabel="time" if drive.dates is None else "date", ylabel=name)
        return axes

    def avalanches(self, measure: str = "size", ax: Axes | None = None, **style: Any) -> Axes:
        """Draw how the avalanches after the burn-in are distributed; return the axes.

        Parameters
        ----------
        measure : {"size", "duration", "energy", "extent"}
            Number of slips; from the first event to the last; dissipated; sliders from the first
            to the last that slips.
        ax : Axes, optional
        **style
            Of the line, as matplotlib's `errorbar` takes it.

        Raises
        ------
        InputError
            If the measure is another, or the run did not record its rearrangements, or has none
            after its burn-in.
        """
        if measure not in MEASURES:
            raise InputError("measure", measure, "must be one of " + ", ".join(MEASURES))
        counted = avalanches_of(self._result)
        if not counted.block.size:
            needed = (
                f"none in a whole cycle after the burn-in of {self._result.burn_in} half-cycles"
            )
            raise InputError("avalanches", 0, needed)
        found = distribution(counted, measure)
        axes = ax if ax is not None else _new_axes()
        kept = found.density > 0
        y, error = found.density[kept], np.nan_to_num(found.error[kept])
        axes.errorbar(found.middle[kept], y, error, **{**_POINTS, **style})
        axes.set(xscale="log", yscale="log", xlabel=MEASURES[measure].label)
        axes.set_ylabel(f"density of {measure}")
        # errors as large as the density itself would reach down to zero
        axes.set_ylim(bottom=min(float(y.min()) / 3, axes.get_ylim()[1]))
        return axes


def _new_axes() -> Axes:
    """Return the axes of a new figure of pyplot, which a notebook shows."""
    _, axes = plt.subplots(layout="constrained")
    return axes


def plot_rearrangement(motion: Rearrangement) -> tuple[Axes, Axes]:
    """Draw velocities in space and time, and the energies; return the axes."""
    n, times = motion.chain.n, np.linspace(0.0, float(motion.duration), _INSTANTS)
    velocities = floats(motion.sol(times).velocities)
    figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
    most = float(np.abs(velocities).max()) or 1.0
    image = above.pcolormesh(times, np.arange(1, n + 1), velocities, shading="nearest",
                             cmap="RdBu_r", vmin=-most, vmax=most)  # fmt: skip
    figure.colorbar(image, ax=above, label=r"velocity ($g\,\tau_\mathrm{dyn}$)")
    above.set(ylabel="slider (1 uppermost)", ylim=(n + 0.5, 0.5))
    above.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    dashes = ("-", "-", "--", "-")  # what gravity gives and springs lose may be nearly equal
    for (name, values), dash in zip(motion.energy(times)._asdict().items(), dashes, strict=True):
        below.plot(times, values - values[0], dash, label=name)
    below.set(xlabel=r"time ($\tau_\mathrm{dyn}$)", ylabel=r"energy ($m g^2 \tau_\mathrm{dyn}^2$)")
    below.legend(title="since the start", fontsize=8)
    return above, below
