"""Kinds of values that options take: their names in a help, and how they are read.

Numbers stay text until a function of the package reads them exactly. A value may begin with a
hyphen: -5/12.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter

import exactcreep

if TYPE_CHECKING:
    from exactcreep import Scene

T = TypeVar("T")


def taken(metavar: str, **further: Any) -> Parameter:
    """Return the parameter of an option whose value is called `metavar` in the help."""
    return Parameter(metavar=metavar, allow_leading_hyphen=True, **further)


Number = Annotated[str, taken("X")]
Whole = Annotated[str, taken("K")]
Name = Annotated[str, taken("NAME")]
Seconds = Annotated[str, taken("SECONDS")]
File = Annotated[Path, taken("FILE")]
Flag = Annotated[bool, Parameter(negative="", show_default=False)]
SceneName = Annotated[str, Parameter(help="A built-in scene, or a TOML file.")]
Run = Annotated[Path, Parameter(help="What exactcreep run --out wrote.")]
Settings = Annotated[
    list[str] | None,
    taken("KEY=VALUE", name="--set", help="Set a key of the scene, e.g. chain.n=6; repeatable."),
]
Solver = Annotated[str | None, taken("NAME", help="Default: what the scene names, else exact.")]
Seed = Annotated[str | None, taken("SEED", help="Of the disorder and random dilations.")]
Workers = Annotated[str | None, taken("K", help="Threads; default one per processor.")]
Force = Annotated[Flag, Parameter(help="Overwrite files that exist.")]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ChainOptions:
    """The chain of a command that does not read a scene.

    Parameters
    ----------
    n
        Number of sliders.
    l0
        Natural length of a spring, unit g tau_dyn^2.
    mu_d
        Dynamical friction coefficient.
    mu_s
        Static friction coefficient.
    sigma_mu
        Standard deviation of the static coefficients.
    tan_alpha
        Slope of the incline.
    """

    n: Whole
    l0: Number = "1000"
    mu_d: Number = "0.5"
    mu_s: Number = "0.6"
    sigma_mu: Number = "0"
    tan_alpha: Number = "0.25"


def scene_of(scene: str, settings: Sequence[str] | None, **run: Any) -> Scene:
    """Return a scene with ``--set KEY=VALUE`` entries, and keys of ``[run]`` that are not None."""
    from exactcreep.scene import parsed_value

    given = {}
    for entry in settings or ():
        key, equals, text = entry.partition("=")
        if not equals:
            raise exactcreep.InputError("set", entry, "must be KEY=VALUE, e.g. chain.n=6")
        given[key.strip()] = parsed_value(text.strip())
    loaded = exactcreep.load_scene(scene).with_settings(given)
    if settings:
        fixed = [entry.strip() for entry in settings if not entry.strip().startswith("vary.")]
        title = f"{loaded.name} with {', '.join(fixed)}" if fixed else loaded.title
        loaded = replace(loaded, title=title)
    options = {f"run.{name}": value for name, value in run.items() if value is not None}
    return loaded.with_settings(options)


def whole(text: str | None, name: str, least: int = 1, most: int | None = None) -> int | None:
    """Return the whole number of an option; None if it is not given."""
    from exactcreep.model.numbers import whole_number

    return None if text is None else whole_number(text, name, least=least, most=most)


# --- docstrings -----------------------------------------------------------------------------------

_SECTION = re.compile(r"\n\n(\w[\w ]*)\n-+\n")


def help_of(function: Callable[..., Any]) -> str:
    """Return a docstring without its sections, one line per paragraph, and its examples."""
    said, *parts = _SECTION.split(inspect.getdoc(function) or "")
    lines = dict(zip(parts[::2], parts[1::2], strict=True)).get("Examples", "").splitlines()
    examples = "\n".join(f"    {line}" for line in lines if line)
    text = re.sub(r"(?<=\S)\n(?=\S)", " ", said)
    return f"{text}\n\nExamples of use:\n\n{examples}" if examples else text
