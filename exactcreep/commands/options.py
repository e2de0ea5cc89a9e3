"""How commands take their options: signatures and numpydoc docstrings, expanded for typer.

A command is a function, and its docstring is its help: the first sentences, and the description of
each parameter. What stands before the ``*`` of its signature are arguments, what follows options.
A parameter whose annotation names a group, as `Scene`, stands for all options of that group.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

import exactcreep

T = TypeVar("T")

_PACKAGE = Path(exactcreep.__file__).parent
_METAVARS = {"int": "K", "number": "X", "pair": "LO HI", "path": "FILE", "str": "NAME"}
_FLAGS = {
    "low": ("--from",), "high": ("--to",), "settings": ("--set",), "after": ("--after", "--cycles")
}  # fmt: skip
SHARED = {
    "run": ("RUN.nc", "What exactcreep run --out wrote."),
    "solver": ("NAME", "Default: what the scene names, else exact."),
    "seed": ("SEED", "Of the disorder and random dilations."),
    "member": ("int", "Which member of a scene that varies something."),
    "workers": ("int", "Threads; default one per processor."),
    "max_seconds": ("SECONDS", "Come back after so much time."),
    "out": ("path", "Write the data to this NetCDF file."),
    "plot": ("path", "Draw what is found to this PNG, PDF or SVG file."),
    "json": ("bool", "Print one JSON object."),
    "force": ("bool", "Overwrite files that exist."),
}
"""Types and descriptions of parameters that commands share, unless their docstrings have others."""
_ENTRY = re.compile(r"^(\w[\w, ]*?)(?: : (.*))?$\n((?:^ +\S.*\n|^\n(?= ))*)", re.MULTILINE)
GROUPS: dict[str, Callable[..., Any]] = {}
"""What takes a group of options, by the annotation that names it."""


class _Defaults(dict[str, Any]):
    """Names of a module that is not imported: as default values they stand for None."""

    def __missing__(self, name: str) -> None:
        return None


def public(name: str) -> Callable[..., Any]:
    """Return a stand-in for a public function: its signature and docstring, not its module.

    The text of the module is read: importing it would take longer than printing its help.
    """
    stub = (_PACKAGE / "__init__.pyi").read_text("utf-8")
    (module,) = re.findall(rf"^from \.(\S+) import .*\b{name} as {name}\b", stub, re.MULTILINE)
    text = (_PACKAGE / f"{module.replace('.', '/')}.py").read_text("utf-8")
    head = re.compile(rf'^def {name}\(.*?^    """.*?"""$', re.MULTILINE | re.DOTALL)
    (found,) = head.findall(text)
    made = _Defaults()
    exec(f"from __future__ import annotations\n{found}", {}, made)
    stand_in: Callable[..., Any] = made[name]
    return stand_in


def described(function: Callable[..., Any]) -> dict[str, tuple[str, str]]:
    """Return the type and the description of each parameter in a numpydoc docstring."""
    text = (inspect.getdoc(function) or "") + "\n\n"
    known = dict(SHARED)
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.M | re.S)
    for names, kind, about in _ENTRY.findall(section[1] if section else ""):
        words = re.sub(r"``|`", "", " ".join(about.split())).replace("[", r"\[")
        known |= dict.fromkeys(map(str.strip, names.split(",")), (kind, words))
    return known


def help_of(function: Callable[..., Any]) -> str:
    """Return what a docstring says before its sections, each paragraph in one line."""
    text = re.split(r"\n\n\w[\w ]*\n-+\n", inspect.getdoc(function) or "")[0]
    return re.sub(r"(?<=\S)\n(?=\S)", " ", text)


def _as_text(default: Any) -> Any:
    """Return a default as the command line would give it: numbers as text, one by one."""
    if isinstance(default, tuple):
        return tuple(map(_as_text, default))
    is_number = isinstance(default, (int, float)) and not isinstance(default, bool)
    return str(default) if is_number else default


def _taken(one: inspect.Parameter, about: tuple[str, str]) -> inspect.Parameter:
    """Return a parameter as typer takes it: text, a flag, a pair, or several texts."""
    kind, text = about
    asked, default = str(one.annotation), _as_text(one.default)
    flags = _FLAGS.get(one.name, ())
    metavar: str | None
    metavar = next((short for word, short in _METAVARS.items() if kind.startswith(word)), kind)
    annotation: Any = Path if "Path" in asked else str
    annotation = annotation if default is one.empty else annotation | None
    if "bool" in asked:
        annotation, metavar = bool | None if default is None else bool, None
        name = one.name.replace("_", "-")
        flags = (f"--{name}",) if default is False else (f"--{name}/--no-{name}",)
    elif "tuple[" in asked:
        annotation = tuple[str, str] if default else tuple[str, str] | None
    elif "list[" in asked:
        annotation = list[str] | None
    made: Any = typer.Option if one.kind is one.KEYWORD_ONLY else typer.Argument
    made = made(*flags, metavar=metavar, help=text)
    taken: Any = Annotated[annotation, made]
    return one.replace(kind=one.KEYWORD_ONLY, default=default, annotation=taken)


def expanded(function: Callable[..., None]) -> Callable[..., None]:
    """Return a command as typer takes it, all parameters by name, groups as their options."""
    about, taken = described(function), dict[str, inspect.Parameter]()
    groups: dict[str, list[str]] = {}
    signature = inspect.signature(function).parameters
    for name, one in signature.items():
        asked = str(one.annotation).strip("'\"")
        if asked not in GROUPS:
            taken[name] = _taken(one, about.get(name, ("", "")))
            continue
        known, groups[name] = described(GROUPS[asked]), []
        for own, inner in inspect.signature(GROUPS[asked]).parameters.items():
            groups[name].append(own)
            taken[own] = _taken(inner, known.get(own, ("", "")))

    def called(**given: Any) -> None:
        for name, members in groups.items():
            words = {own: given.pop(own) for own in members}
            given[name] = GROUPS[str(signature[name].annotation).strip("'\"")](**words)
        function(**given)

    called.__name__ = function.__name__
    called.__doc__ = help_of(function)
    called.__signature__ = inspect.Signature(list(taken.values()))  # type: ignore[attr-defined]
    called.__annotations__ = {one.name: one.annotation for one in taken.values()}
    return called


# --- groups of options ----------------------------------------------------------------------------


def chain_of(
    *, n: str, l0: str = "1000", mu_d: str = "0.5", mu_s: str = "0.6", sigma_mu: str = "0",
    tan_alpha: str = "0.25",
) -> Any:  # fmt: skip
    """Return the chain of a command that is about a chain and no scene.

    Parameters
    ----------
    n : int
        Number of sliders.
    l0 : number
        Natural length of a spring, unit g tau_dyn^2.
    mu_d : number
        Dynamical friction coefficient.
    mu_s : number
        Static friction coefficient.
    sigma_mu : number
        Standard deviation of the static coefficients.
    tan_alpha : number
        Slope of the incline.
    """
    return exactcreep.Chain(n, l0, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)


def scene_of(scene: str, *, settings: list[str] | None = None) -> Any:
    """Return a scene with the dotted keys and values of ``--set KEY=VALUE`` entries.

    Parameters
    ----------
    scene : SCENE
        A built-in scene, or a TOML file.
    settings : KEY=VALUE
        Set a key of the scene, e.g. chain.n=6; repeatable.
    """
    from exactcreep.scene import parsed_value

    given = {}
    for entry in settings or []:
        key, equals, text = entry.partition("=")
        if not equals:
            raise exactcreep.InputError("set", entry, "must be KEY=VALUE, e.g. chain.n=6")
        given[key.strip()] = parsed_value(text.strip())
    loaded = exactcreep.load_scene(scene).with_settings(given)
    told = f"{loaded.name} with {', '.join(settings or [])}"
    return replace(loaded, title=told) if settings else loaded


def start_of(*, start_tension: str | None = None) -> str | None:
    """Return the tension at the start.

    Parameters
    ----------
    start_tension : number
        Tension of every spring at the start; default the relaxed chain.
    """
    return start_tension


GROUPS |= {"Chain": chain_of, "Scene": scene_of, "State | None": start_of}


# --- what options mean ----------------------------------------------------------------------------


def chosen(members: Sequence[T], member: str) -> T:
    """Return the member that ``--member`` names."""
    return members[(whole(member, "member", most=len(members)) or 1) - 1]


def whole(text: str | None, name: str, least: int = 1, most: int | None = None) -> int | None:
    """Return the whole number that an option gives; None if it is not given."""
    from exactcreep.model.numbers import whole_number

    return None if text is None else whole_number(text, name, least=least, most=most)


def run_settings(**given: Any) -> dict[str, Any]:
    """Return those keys of ``[run]`` that are given, as settings of a scene."""
    return {f"run.{name}": value for name, value in given.items() if value is not None}


def one_of(name: str, known: Sequence[str] | dict[str, Any]) -> str:
    """Return what is allowed, and the name that was meant."""
    import difflib

    near = difflib.get_close_matches(name, known, 1, 0.5)
    return "must be one of " + ", ".join(known) + (f" (did you mean {near[0]}?)" if near else "")
