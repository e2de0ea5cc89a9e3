"""How commands take their options: signatures and numpydoc docstrings, expanded for typer.

A command is a function, and its docstring is its help: the first sentences, and the description of
each parameter. What stands before the ``*`` of its signature are arguments, what follows options.
A parameter whose annotation names a group, as `Scene`, stands for all options of that group.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

import exactcreep

T = TypeVar("T")

_PACKAGE = Path(exactcreep.__file__).parent
_UNSEEN = ("Hearer", "Executor")
"""Annotations of what a command line cannot give."""
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
    "plot": ("path", "Draw what is found to this PNG, PDF or SVG file."),
    "json": ("bool", "Print one JSON object."),
    "force": ("bool", "Overwrite files that exist."),
}
"""Types and descriptions of parameters that commands share, unless their docstrings have others."""
_ENTRY = re.compile(r"^(\w[\w, ]*?)(?: : (.*))?$\n((?:^ +\S.*\n|^\n(?= ))*)", re.MULTILINE)


def public(name: str) -> Callable[..., Any]:
    """Return a stand-in for a public function: its signature and docstring, not its module.

    The text of the module is read: importing it would take longer than printing its help.
    """
    stub = ast.parse((_PACKAGE / "__init__.pyi").read_text("utf-8"))
    (module,) = (
        node.module or ""
        for node in stub.body
        if isinstance(node, ast.ImportFrom) and any(each.asname == name for each in node.names)
    )
    text = (_PACKAGE / f"{module.replace('.', '/')}.py").read_text("utf-8")
    (found,) = (node for node in ast.parse(text).body if getattr(node, "name", "") == name)
    assert isinstance(found, ast.FunctionDef)
    found.body, found.decorator_list = found.body[:1], []
    given: list[list[Any]] = [found.args.defaults, found.args.kw_defaults]
    for defaults in given:
        defaults[:] = [each and ast.Constant(_literal(each)) for each in defaults]
    tree = ast.parse("from __future__ import annotations")
    tree.body.append(found)
    made: dict[str, Any] = {}
    exec(compile(ast.fix_missing_locations(tree), name, "exec"), made)
    stand_in: Callable[..., Any] = made[name]
    return stand_in


def _literal(default: ast.expr) -> Any:
    """Return a default that is written out; None for a name, whose module is not imported."""
    try:
        return ast.literal_eval(default)
    except ValueError:
        return None


def described(function: Callable[..., Any]) -> dict[str, tuple[str, str]]:
    """Return the type and the description of each parameter in a numpydoc docstring."""
    text = (inspect.getdoc(function) or "") + "\n\n"
    known = dict(SHARED)
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.M | re.S)
    for names, kind, about in _ENTRY.findall(section[1] if section else ""):
        words = re.sub(r"``|`", "", " ".join(about.split()))
        for name in names.split(","):
            known[name.strip()] = (kind, words.replace("[", r"\["))
    return known


def help_of(function: Callable[..., Any]) -> str:
    """Return what a docstring says before its sections, each paragraph in one line."""
    text = re.split(r"\n\n\w[\w ]*\n-+\n", inspect.getdoc(function) or "")[0]
    return re.sub(r"(?<=\S)\n(?=\S)", " ", text)


def _parameter(one: inspect.Parameter, about: tuple[str, str]) -> inspect.Parameter:
    """Return a parameter as typer takes it: text, a flag, a pair, or several texts."""
    kind, text = about
    asked, default = str(one.annotation), one.default
    required = default is one.empty
    flags = _FLAGS.get(one.name, ())
    metavar: str | None
    metavar = next((short for word, short in _METAVARS.items() if kind.startswith(word)), kind)
    plain = Path if "Path" in asked else str
    annotation: Any = plain if required else plain | None
    if "bool" in asked:
        annotation, metavar = bool | None if default is None else bool, None
        name = one.name.replace("_", "-")
        flags = (f"--{name}/--no-{name}",) if default is not False else (f"--{name}",)
    elif "tuple[" in asked:
        annotation = tuple[str, str] | None
    elif "list[" in asked:
        annotation = list[str] | None
    if one.kind is one.KEYWORD_ONLY:
        made = typer.Option(*flags, metavar=metavar, help=text)
    else:
        made = typer.Argument(metavar=metavar, help=text)
    if not required and default is not None and not isinstance(default, bool):
        default = str(default)
    return inspect.Parameter(
        one.name, one.KEYWORD_ONLY, default=default, annotation=Annotated[annotation, made]
    )


def expanded(
    function: Callable[..., None], told: Callable[..., Any] | None = None, pictures: bool = False
) -> Callable[..., None]:
    """Return a command as typer takes it, all parameters by name.

    Parameters
    ----------
    function : callable
        Called with what the options come to.
    told : callable, optional
        Whose signature and docstring the options have, without arguments; default `function`.
    pictures : bool
        Whether the size of pictures and their dots per inch are options, too.
    """
    signature = inspect.signature(told or function)
    about, taken = described(told or function), dict[str, inspect.Parameter]()
    groups: dict[str, tuple[Callable[..., Any], tuple[str, ...]]] = {}
    for name, one in signature.parameters.items():
        asked = str(one.annotation).strip("'\"")
        if any(word in asked for word in _UNSEEN):
            continue
        group = GROUPS.get(asked)
        if group is None:
            option = one.replace(kind=one.KEYWORD_ONLY) if told else one
            taken[name] = _parameter(option, about.get(name, ("", "")))
            continue
        inner, known = inspect.signature(group).parameters, described(group)
        groups[name] = group, tuple(inner)
        taken |= {each: _parameter(inner[each], known.get(each, ("", ""))) for each in inner}
    if pictures:
        size = "picture_size" if "size" in taken else "size"
        about, inner = described(printed), inspect.signature(printed).parameters
        for name, each in ((size, "size"), ("dpi", "dpi")):
            taken[name] = _parameter(inner[each].replace(name=name), about[each])

    def called(**given: Any) -> None:
        context: AbstractContextManager[None] = nullcontext()
        if pictures:
            context = printed(given, size=given.pop(size), dpi=given.pop("dpi"))
        for name, (group, members) in groups.items():
            given[name] = group(**{member: given.pop(member) for member in members})
        with context:
            function(**given)

    called.__name__ = function.__name__
    called.__doc__ = help_of(told or function)
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
    return replace(loaded, title=f"with {', '.join(settings)}") if settings else loaded


def printed(
    given: dict[str, Any], *, size: str | None = None, dpi: str | None = None
) -> AbstractContextManager[None]:
    """Return the context in which pictures have the size that was asked for.

    Parameters
    ----------
    size : WxH
        Of pictures, in inches, as in 6x4.
    dpi : int
        Dots per inch of pictures.
    """
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


_NARROWEST, _WIDEST = 1.0, 50.0  # inches of a picture


def _inches(text: str) -> tuple[float, float]:
    try:
        width, height = map(float, text.split("x"))
    except ValueError:
        width = height = float("nan")
    if not all(_NARROWEST <= side <= _WIDEST for side in (width, height)):
        allowed = f"must be WIDTHxHEIGHT in inches, each from {_NARROWEST:g} to {_WIDEST:g}"
        raise exactcreep.InputError("size", text, allowed)
    return width, height


GROUPS: dict[str, Callable[..., Any]] = {"Chain": chain_of, "Scene": scene_of}
"""What takes a group of options, by the annotation that names it."""


# --- what options mean ----------------------------------------------------------------------------


def chosen(members: Sequence[T], member: str) -> T:
    """Return the member that ``--member`` names."""
    from exactcreep.model.numbers import whole_number

    return members[whole_number(member, "member", least=1, most=len(members)) - 1]


def run_settings(**given: Any) -> dict[str, Any]:
    """Return those keys of ``[run]`` that are given, as settings of a scene."""
    return {f"run.{name}": value for name, value in given.items() if value is not None}


def parsed_seeds(text: str | None) -> int | list[int] | None:
    """Return how many seeds, or which, ``--seeds`` names."""
    from exactcreep.model.numbers import whole_number

    if text is None:
        return None
    if "," not in text:
        return whole_number(text, "seeds", least=1)
    return [whole_number(part.strip(), "seeds", least=0) for part in text.split(",")]
