"""The pictures that ``exactcreep reproduce`` makes: the paper's figures, and some beyond them."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from exactcreep.figures.pictures import avalanches, beyond, chains, two_sliders
from exactcreep.figures.pictures import lasting as fate_figures
from exactcreep.figures.tables import Table
from exactcreep.model.numbers import InputError
from exactcreep.studies.avalanches import study

Data = Mapping[str, xr.Dataset]
"""The sweeps of a picture by the names of their scenes."""


@dataclass(frozen=True)
class Picture:
    """A picture: the scenes behind it, its tables, and how it is drawn.

    Attributes
    ----------
    name : str
        Of the files, and of the first scene.
    figure : str
        The label of the paper's figure; empty for a picture that the paper does not have.
    tables : callable
        Called with the data; returns the tables.
    draw : callable
        Called with the data and the tables; returns the figure.
    quick : mapping
        For each scene the dotted keys that are set differently for a quick look.
    always : mapping
        Dotted keys that are set in every scene, quick or not.
    reduce : callable or None
        Makes of each sweep what is kept of it.
    compute : callable or None
        Instead of a sweep: called with the settings, and a callable that is told the progress.
    """

    name: str
    figure: str
    tables: Callable[[Data], list[Table]]
    draw: Callable[[Data, list[Table]], Figure]
    quick: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    always: Mapping[str, Any] = field(default_factory=dict)
    reduce: Callable[[xr.Dataset], xr.Dataset] | None = None
    compute: Callable[..., xr.Dataset] | None = None

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes that are run."""
        return tuple(self.quick)


_EIGHT = list(range(1, 9))
_FOUR = [{"size": "1e-3", "seed": k} for k in range(1, 5)]

_ALL = (
    Picture(
        "two-sliders-trace",
        "position2sliders",
        two_sliders.trace_tables,
        two_sliders.draw_trace,
        {"two-sliders-trace": {}},
        {"run.record": ["x_G", "x"]},
    ),
    Picture(
        "two-sliders-angle",
        "velocity2sliders",
        two_sliders.angle_tables,
        two_sliders.draw_angle,
        {"two-sliders-angle": {"drive.steps": 1000}},
    ),
    Picture(
        "two-sliders-amplitude",
        "velocity2sliders_theta",
        two_sliders.amplitude_tables,
        two_sliders.draw_amplitude,
        {"two-sliders-amplitude": {"drive.steps": 800}},
    ),
    Picture(
        "chain-plateaus",
        "velocityNsliders",
        chains.plateau_tables,
        chains.draw_plateaus,
        {"chain-plateaus": {"drive.steps": 50}},
    ),
    Picture(
        "chain-amplitude",
        "velocityNslidersbis",
        chains.amplitude_tables,
        chains.draw_amplitude,
        {
            "chain-amplitude": {"drive.cycles": 30},
            "chain-amplitude-random": {"drive.steps": 40},
        },
    ),
    Picture(
        "chain-size",
        "cloche",
        chains.size_tables,
        chains.draw_size,
        {
            "chain-size": {"drive.cycles": 25},
            "chain-size-random": {
                "drive.steps": 30,
                "vary.chain.n": [2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 18, 22, 26, 30, 38, 46, 56, 64],
            },
        },
    ),
    Picture(
        "chain-jumps",
        "jumps",
        chains.jump_tables,
        chains.draw_jumps,
        {
            "chain-jumps": {
                "drive.cycles": 600,
                "vary.run.start": [
                    "relaxed",
                    {"size": "1e-6", "seed": 1},
                    {"size": "1e-6", "seed": 2},
                    {"size": "1e-6", "seed": 3},
                ],
            }
        },
        {"run.record": ["x_G"]},
    ),
    Picture(
        "two-sliders-staircase",
        "",
        beyond.staircase_tables,
        beyond.draw_staircase,
        {"two-sliders-staircase": {"drive.cycles": 50}},
    ),
    Picture(
        "chain-windows",
        "",
        beyond.window_tables,
        beyond.draw_windows,
        {"chain-windows": {}},
    ),
    Picture(
        "chain-map",
        "",
        beyond.map_tables,
        beyond.draw_map,
        {"chain-map": {"drive.cycles": 10}},
    ),
    Picture(
        "chain-waiting",
        "",
        beyond.waiting_tables,
        beyond.draw_waiting,
        {
            "chain-waiting": {
                "drive.cycles": 500,
                "vary.run.start": [{"size": "1e-6", "seed": k} for k in _EIGHT],
            }
        },
        {"run.record": ["x_G", "slips"]},
        beyond.active_sliders,
    ),
    Picture(
        "gaussian-closed-form",
        "",
        beyond.closed_form_tables,
        beyond.draw_closed_form,
        {"gaussian-closed-form": {"drive.steps": 1000}},
    ),
    Picture(
        "chain-pivots",
        "",
        beyond.pivot_tables,
        beyond.draw_pivots,
        {"chain-pivots": {"drive.cycles": 50, "vary.run.seed": [1, 2]}},
    ),
    Picture(
        "thresholds-by-criterion",
        "",
        fate_figures.threshold_tables,
        fate_figures.draw_thresholds,
        {
            "thresholds-by-criterion": {
                "sizes": [*range(2, 9), 12, 30],
                "step": 0.02,
                "starts": 8,
                "cycles": 400,
                "velocity_cycles": 100,
                "most_velocity": 12,
            }
        },
        {
            "sizes": [*range(2, 13), 16, 20, 30, 60],
            "step": 0.005,
            "starts": 16,
            "cycles": 4000,
            "velocity_cycles": 400,
            "most_velocity": 30,
        },
        compute=fate_figures.thresholds,
    ),
    Picture(
        "fate-map",
        "",
        fate_figures.fate_tables,
        fate_figures.draw_fates,
        {"fate-map": {"count": 81, "cycles": 500}},
        {"sizes": list(range(3, 9)), "low": 0.8, "high": 2.0, "count": 481, "cycles": 4000},
        compute=fate_figures.fates,
    ),
    Picture(
        "lifetimes",
        "",
        fate_figures.lifetime_tables,
        fate_figures.draw_lifetimes,
        {
            "lifetimes": {
                "sizes": [6],
                "ratios": [0.95, 0.96, 0.97],
                "starts": 20,
                "cycles": 5000,
            }
        },
        {
            "sizes": [6, 7, 8],
            "starts": 40,
            "cycles": 40_000,
            "ratios": [0.9, 0.92, 0.94, 0.95, 0.955, 0.96, 0.965, 0.97, 0.975, 0.98],
        },
        compute=fate_figures.lifetimes,
    ),
    Picture(
        "chain-near-threshold",
        "",
        fate_figures.near_tables,
        fate_figures.draw_near,
        {"chain-near-threshold": {"drive.cycles": 250, "vary.run.start": _FOUR[:2]}},
    ),
    Picture(
        "chain-avalanches",
        "",
        avalanches.tables,
        avalanches.draw,
        {"chain-avalanches": {"cycles": [300, 40, 10]}},
        {"sizes": [30, 100, 300], "ratios": [1.02, 2.0], "cycles": [2000, 320, 50]},
        compute=study,
    ),
)

PICTURES: Mapping[str, Picture] = {picture.name: picture for picture in _ALL}
"""The pictures by name, the paper's first, in the paper's order."""


def picture_named(name: str) -> Picture:
    """Return the picture of that name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in PICTURES:
        near = difflib.get_close_matches(name, PICTURES, 1, 0.5)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise InputError("picture", name, "must be all or one of " + ", ".join(PICTURES) + hint)
    return PICTURES[name]
