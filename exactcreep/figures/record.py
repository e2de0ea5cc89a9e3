"""Draw a record of temperatures over its time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from exactcreep.figures.style import INKS, new_figure, styled
from exactcreep.model.temperature_record import TemperatureRecord

_MOST_POINTS = 4000  # of a line; more readings are drawn as a band
_STRETCHES = 800


@styled
def draw_record(record: TemperatureRecord, title: str = "") -> Figure:
    """Draw every reading; of long records mean, coldest and warmest of each stretch."""
    times = np.asarray(record.times) if record.dates is None else record.dates
    temperatures = record.temperatures
    figure = new_figure(6.6, 3.0, title)
    axes = figure.add_subplot()
    if temperatures.size <= _MOST_POINTS:
        axes.plot(times, temperatures, color=INKS[0], linewidth=0.8)
    else:
        parts = np.array_split(np.arange(temperatures.size), _STRETCHES)
        lowest = [temperatures[part].min() for part in parts]
        highest = [temperatures[part].max() for part in parts]
        means = [temperatures[part].mean() for part in parts]
        begins = times[[part[0] for part in parts]]
        axes.fill_between(begins, lowest, highest, color=INKS[4], alpha=0.5, linewidth=0)
        axes.plot(begins, means, color=INKS[0], linewidth=0.6)
    axes.set_xlabel("time" if record.dates is None else "date")
    axes.set_ylabel("temperature (K)" if record.unit == "K" else "temperature (°C)")
    return figure
