"""How a command takes its arguments and options, and those that several commands share."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

import exactcreep

T = TypeVar("T")

_BY_NAME = inspect.Parameter.KEYWORD_ONLY


def option(metavar: str, text: str, *flags: str) -> Any:
    """Return an option that takes a value, with its placeholder and help."""
    return typer.Option(*flags, metavar=metavar, help=text)


def argument(metavar: str, text: str) -> Any:
    """Return an argument, with its placeholder and help."""
    return typer.Argument(metavar=metavar, help=text)


def flag(name: str, text: str) -> Any:
    """Return an option that takes no value, with its help."""
    return typer.Option(name, help=text)


Amplitude = Annotated[str, option("A", "Of the temperature cycles +A, -A.")]
StartTension = Annotated[str | None, option("R0", "Tension of every spring at the start.")]
SolverName = Annotated[
    str | None,
    option(
        "NAME",
        "exact, reference, mpmath, certified, verlet, sliding, or auto: the cheapest that"
        " suffices. Default: what the scene names, else exact.",
    ),
]
Seed = Annotated[str | None, option("SEED", "Of the disorder and random dilations.")]
Seeds = Annotated[str | None, option("K", "Compare over K seeds, or over those listed: 1,2,3.")]
Member = Annotated[str, option("M", "Which member of a scene that varies something.")]
Workers = Annotated[str | None, option("K", "Threads; default one per processor.")]
SavedRun = Annotated[Path, argument("RUN.nc", "What exactcreep run --out wrote.")]
Json = Annotated[bool, flag("--json", "Print one JSON object.")]
Force = Annotated[bool, flag("--force", "Overwrite files that exist.")]
DataFile = Annotated[Path | None, option("FILE", "Write the data to this NetCDF file.")]
Plot = Annotated[Path | None, option("FILE", "Draw what is found to this PNG or PDF file.")]
MaxSeconds = Annotated[str | None, option("SECONDS", "Give up after so much time.")]


def chain_of(
    n: Annotated[str, option("N", "Number of sliders.")],
    l0: Annotated[str, option("L0", "Natural length of a spring, unit g tau_dyn^2.")] = "1000",
    mu_d: Annotated[str, option("MU", "Dynamical friction coefficient.")] = "0.5",
    mu_s: Annotated[str, option("MU", "Static friction coefficient.")] = "0.6",
    sigma_mu: Annotated[str, option("S", "Standard deviation of the static coefficients.")] = "0",
    tan_alpha: Annotated[str, option("T", "Slope of the incline.")] = "0.25",
) -> Any:
    """Return the chain of a command that is about a chain and no scene."""
    return exactcreep.Chain(n, l0, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)


def scene_of(
    scene: Annotated[str, argument("SCENE", "A built-in scene, or a TOML file.")],
    settings: Annotated[
        list[str] | None,
        option("KEY=VALUE", "Set a key of the scene, e.g. chain.n=6; repeatable.", "--set"),
    ] = None,
) -> Any:
    """Return a scene with the dotted keys and values of ``--set KEY=VALUE`` entries."""
    from exactcreep.scene import parsed_value

    given = {}
    for entry in settings or []:
        key, equals, text = entry.partition("=")
        if not equals:
            raise exactcreep.InputError("set", entry, "must be KEY=VALUE, e.g. chain.n=6")
        given[key.strip()] = parsed_value(text.strip())
    return exactcreep.load_scene(scene).with_settings(given)


def chosen(members: Sequence[T], member: str) -> T:
    """Return the member that the option `Member` names."""
    from exactcreep.model.numbers import whole_number

    return members[whole_number(member, "member", least=1, most=len(members)) - 1]


def run_settings(**given: Any) -> dict[str, Any]:
    """Return those keys of ``[run]`` that are given, as settings of a scene."""
    return {f"run.{name}": value for name, value in given.items() if value is not None}


def those_given(options: Mapping[str, Any]) -> Callable[..., dict[str, Any]]:
    """Return what takes `options`, annotations by name, and returns those that are not None."""

    def given(**values: Any) -> dict[str, Any]:
        return {name: value for name, value in values.items() if value is not None}

    return _taking(given, [_parameter(*each) for each in options.items()])


def _parameter(name: str, annotation: Any) -> inspect.Parameter:
    return inspect.Parameter(name, _BY_NAME, default=None, annotation=annotation)


def _taking(
    function: Callable[..., T], parameters: Iterable[inspect.Parameter]
) -> Callable[..., T]:
    """Return `function`, which says from now on that it takes these parameters by name."""
    by_name = [one.replace(kind=_BY_NAME) for one in parameters]
    function.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    function.__annotations__ = {one.name: one.annotation for one in by_name}
    return function


OfChain = Annotated["exactcreep.Chain", chain_of]
OfScene = Annotated["exactcreep.Scene", scene_of]


def command(*, draws: bool = False) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator: a function as the command line calls it, with all options by name.

    A parameter annotated by a callable, as `OfChain` by `chain_of`, stands for the options that
    this takes, and gets what it returns. A command that `draws` takes the size of its pictures and
    their dots per inch, too.
    """
    return functools.partial(_command, draws=draws)


def _command(function: Callable[..., None], *, draws: bool) -> Callable[..., None]:
    taken: dict[str, inspect.Parameter] = {}
    groups: dict[str, tuple[Callable[..., Any], tuple[str, ...]]] = {}
    for name, one in inspect.signature(function, eval_str=True).parameters.items():
        group = getattr(one.annotation, "__metadata__", (one.annotation,))[0]
        members = inspect.signature(group, eval_str=True).parameters if callable(group) else {}
        if members:
            groups[name] = group, tuple(members)
        taken |= members or {name: one}
    if draws:
        other = "--picture-size" if "size" in taken else "--size"
        sides = option("WxH", "Of pictures, in inches, as in 6x4.", other)
        dots = option("K", "Dots per inch of pictures.")
        for name, about in (("picture_size", sides), ("dpi", dots)):
            taken[name] = _parameter(name, Annotated[str | None, about])

    @functools.wraps(function)
    def called(**given: Any) -> None:
        size = _size_of_pictures(given) if draws else nullcontext()
        for name, (group, members) in groups.items():
            given[name] = group(**{member: given.pop(member) for member in members})
        with size:
            function(**given)

    return _taking(called, taken.values())


_NARROWEST, _WIDEST = 1.0, 50.0  # inches of a picture


def _size_of_pictures(given: dict[str, Any]) -> AbstractContextManager[None]:
    """Take the size of pictures out of what is `given`; return the context in which it holds."""
    size, dpi = given.pop("picture_size"), given.pop("dpi")
    if size is None and dpi is None:
        return nullcontext()
    from exactcreep.figures.style import printed
    from exactcreep.model.numbers import whole_number

    name = "dpi" if size is None else "size"
    if given.get("plot", ...) is None:
        raise exactcreep.InputError(name, size or dpi, "is that of a picture, and needs --plot")
    if str(given.get("out")).lower().endswith(".html"):
        allowed = "is that of a picture: a page fits its window"
        raise exactcreep.InputError(name, size or dpi, allowed)
    dots = None if dpi is None else whole_number(dpi, "dpi", least=10, most=2400)
    return printed(None if size is None else _inches(size), dots)


def _inches(text: str) -> tuple[float, float]:
    try:
        width, height = map(float, text.split("x"))
    except ValueError:
        width = height = math.nan
    if not all(_NARROWEST <= side <= _WIDEST for side in (width, height)):
        allowed = f"must be WIDTHxHEIGHT in inches, each from {_NARROWEST:g} to {_WIDEST:g}"
        raise exactcreep.InputError("size", text, allowed)
    return width, height


def parsed_seeds(text: str | None) -> int | list[int] | None:
    """Return how many seeds, or which, an option names."""
    from exactcreep.model.numbers import whole_number

    if text is None:
        return None
    if "," not in text:
        return whole_number(text, "seeds", least=2)
    return [whole_number(part.strip(), "seeds", least=0) for part in text.split(",")]
