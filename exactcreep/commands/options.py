"""The arguments and options that several commands share, and what ``--set`` means."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, get_type_hints

import typer

_CHAIN: dict[str, tuple[str, str, str]] = {
    "n": ("N", "Number of sliders.", "..."),
    "l0": ("L0", "Natural length of a spring, unit g tau_dyn^2.", "1000"),
    "mu_d": ("MU", "Dynamical friction coefficient.", "0.5"),
    "mu_s": ("MU", "Static friction coefficient.", "0.6"),
    "sigma_mu": ("S", "Standard deviation of the static coefficients.", "0"),
    "tan_alpha": ("T", "Slope of the incline.", "0.25"),
}
"""What a command that is about a chain and no scene takes: placeholder, help, default."""
Amplitude = Annotated[str, typer.Option(metavar="A", help="Of the temperature cycles +A, -A.")]
StartTension = Annotated[
    str | None, typer.Option(metavar="R0", help="Tension of every spring at the start.")
]
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
Plot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Draw what is found to this PNG or PDF file.")
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


def _option(name: str, kind: Any, default: str | None, **about: Any) -> inspect.Parameter:
    """Return the parameter of a command that is an option of this type; required if "..."."""
    flags = [about.pop("flag")] if "flag" in about else []
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if default == "..." else default,
        annotation=Annotated[kind, typer.Option(*flags, **about)],
    )


def _taking(
    parameters: list[inspect.Parameter], given: Callable[..., None], command: Callable[..., None]
) -> Callable[..., None]:
    """Return `given` under the name of `command`, with the parameters that typer shall read."""
    functools.update_wrapper(given, command)
    given.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    given.__annotations__ = {one.name: one.annotation for one in parameters}
    return given


def _parameters(command: Callable[..., None]) -> list[inspect.Parameter]:
    """Return the parameters of a command, to be given by name."""
    types = get_type_hints(command, localns={"Chain": object}, include_extras=True)
    return [
        one.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=types[one.name])
        for one in inspect.signature(command).parameters.values()
        if one.kind is not inspect.Parameter.VAR_KEYWORD
    ]


def of_chain(
    command: Callable[..., None], options: Mapping[str, Any] = MappingProxyType({})
) -> Callable[..., None]:
    """Return a command that takes the options of a chain, and hands the chain to `command`.

    It takes `options`, too: annotations by name, None unless given; those that are given are handed
    to `command` as well.
    """

    def with_chain(**given: Any) -> None:
        from exactcreep.model.chain import Chain

        about = {name: given.pop(name) for name in _CHAIN}
        unused = [name for name in options if given[name] is None]
        asked = {name: value for name, value in given.items() if name not in unused}
        command(Chain(**about), **asked)

    chain = [
        _option(name, str, default, metavar=metavar, help=text)
        for name, (metavar, text, default) in _CHAIN.items()
    ]
    more = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
        for name, annotation in options.items()
    ]
    return _taking(chain + more + _parameters(command)[1:], with_chain, command)


_SIZE = re.compile(r"(\d+(?:\.\d*)?|\.\d+)x(\d+(?:\.\d*)?|\.\d+)")
_NARROWEST, _WIDEST = 1.0, 50.0  # inches of a picture


def of_pictures(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that takes the size of its pictures and their dots per inch, too."""

    def with_size(*, picture_size: str | None, dpi: str | None, **given: Any) -> None:
        size = picture_size
        if size is None and dpi is None:
            command(**given)
            return
        from exactcreep.figures.style import printed
        from exactcreep.model.numbers import InputError, whole_number

        name = "dpi" if size is None else "size"
        if given.get("plot", ...) is None:
            raise InputError(name, size or dpi, "is that of a picture, and needs --plot")
        if str(given.get("out")).lower().endswith(".html"):
            raise InputError(name, size or dpi, "is that of a picture: a page fits its window")
        dots = None if dpi is None else whole_number(dpi, "dpi", least=10, most=2400)
        with printed(None if size is None else _inches(size), dots):
            command(**given)

    own = _parameters(command)
    flag = "--picture-size" if any(one.name == "size" for one in own) else "--size"
    sides = "Of pictures, in inches, as in 6x4."
    pictures = [
        _option("picture_size", str | None, None, flag=flag, metavar="WxH", help=sides),
        _option("dpi", str | None, None, metavar="K", help="Dots per inch of pictures."),
    ]
    return _taking(own + pictures, with_size, command)


def _inches(text: str) -> tuple[float, float]:
    from exactcreep.model.numbers import InputError

    sides = _SIZE.fullmatch(text.strip())
    inches = [float(side) for side in sides.groups()] if sides else []
    if not inches or not all(_NARROWEST <= side <= _WIDEST for side in inches):
        allowed = f"must be WIDTHxHEIGHT in inches, each from {_NARROWEST:g} to {_WIDEST:g}"
        raise InputError("size", text, allowed)
    return inches[0], inches[1]


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
