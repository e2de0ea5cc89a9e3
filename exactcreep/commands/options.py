"""The arguments and options that several commands share, and what ``--set`` means."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Sliders = Annotated[str, typer.Option(metavar="N", help="Number of sliders.")]
Length = Annotated[
    str, typer.Option(metavar="L0", help="Natural length of a spring, unit g tau_dyn^2.")
]
Dynamical = Annotated[str, typer.Option(metavar="MU", help="Dynamical friction coefficient.")]
Static = Annotated[str, typer.Option(metavar="MU", help="Static friction coefficient.")]
Disorder = Annotated[
    str, typer.Option(metavar="S", help="Standard deviation of the static coefficients.")
]
Slope = Annotated[str, typer.Option(metavar="T", help="Slope of the incline.")]
Amplitude = Annotated[str, typer.Option(metavar="A", help="Of the temperature cycles +A, -A.")]
SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="A built-in scene, or a TOML file.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Set a key of the scene, e.g. chain.n=6; repeatable."
    ),
]
SolverName = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="exact, reference, mpmath, certified, verlet, sliding, or auto: the cheapest that"
        " suffices. Default: what the scene names, else exact.",
    ),
]
Seed = Annotated[
    str | None, typer.Option(metavar="SEED", help="Of the disorder and random dilations.")
]
Seeds = Annotated[
    str | None, typer.Option(metavar="K", help="Compare over K seeds, or over those listed: 1,2,3.")
]
Member = Annotated[
    str, typer.Option(metavar="M", help="Which member of a scene that varies something.")
]
Workers = Annotated[
    str | None, typer.Option(metavar="K", help="Threads; default one per processor.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
DataFile = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the data to this NetCDF file.")
]
RunPlot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Draw x_G and theta to this PNG or PDF file.")
]
Every = Annotated[str, typer.Option(metavar="SECONDS", help="How often to write the checkpoint.")]
MaxEvents = Annotated[
    str | None, typer.Option(metavar="K", help="Give up a member after K events.")
]
MaxSeconds = Annotated[
    str | None, typer.Option(metavar="SECONDS", help="Give up after so much time.")
]
MaxBytes = Annotated[
    str | None, typer.Option(metavar="BYTES", help="Give up a member that records more.")
]


def parsed_settings(entries: list[str] | None) -> dict[str, Any]:
    """Return the dotted keys and values of ``--set KEY=VALUE`` entries."""
    from exactcreep.model.numbers import InputError
    from exactcreep.scene import parsed_value

    settings: dict[str, Any] = {}
    for entry in entries or []:
        key, equals, text = entry.partition("=")
        if not equals:
            raise InputError("set", entry, "must be KEY=VALUE, e.g. chain.n=6")
        settings[key.strip()] = parsed_value(text.strip())
    return settings


def parsed_seeds(text: str | None) -> int | list[int] | None:
    """Return how many seeds, or which, an option names."""
    from exactcreep.model.numbers import whole_number

    if text is None:
        return None
    if "," not in text:
        return whole_number(text, "seeds", least=2)
    return [whole_number(part.strip(), "seeds", least=0) for part in text.split(",")]
