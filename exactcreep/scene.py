"""Scenes: a chain, a drive and a run as one TOML file, whose members vary what `[vary]` lists.

Numbers are read as exact decimals; a name that is not known is refused, with the nearest
known one.
"""

from __future__ import annotations

import difflib
import itertools
import math
import os
import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from inspect import signature
from pathlib import Path as FilePath
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.reading import content_of, text_of
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import DRIVES, Experiment, drive_of_kind
from exactcreep.quasistatic.files import file_name
from exactcreep.solid import Solid, physical
from exactcreep.solvers.registry import SOLVERS

MOST_MEMBERS = 1_000_000
"""A scene that varies more is a mistake: its settings alone would fill the memory."""
_BUILTIN = FilePath(__file__).with_name("scenes")
_LARGEST_FILE = 16 * 2**20  # bytes; long paths of dilations belong there, records do not
_DEEPEST = 8  # tables within tables
_DEEPEST_KEY = 100
_MOST_LISTED = 40  # keys in a sentence
_ANGLES = {"angle", "alpha", "pitch", "slope", "degrees"}
_WORD = re.compile(r"[^\s\"'=\[\]{},#]+")


def _keys_of(make: Callable[..., Any]) -> dict[str, bool]:
    """Return the keys of a table from which something is made, and whether each is required.

    Arguments that are None by default are not for users: files keep a drive by them.
    """
    taken = signature(make).parameters.values()
    return {each.name: each.default is each.empty for each in taken if each.default is not None}


_TABLES = ("chain", "drive", "run", "physical")
_IN_KELVIN = {"temperature_amplitude": "amplitude", "sigma_temperature": "sigma_theta"}
"""Keys of ``[drive]`` beside ``[physical]``: temperatures (K) for dilations."""
_RUN_KEYS = ("solver", "seed", "burn_in", "accuracy", "record", "start")
_START_KEYS = ("tensions", "theta", "size", "seed")
_SOLVERS = [solver for solver in SOLVERS.values() if is_dataclass(solver)]
_OPTIONS = {key for solver in _SOLVERS for key in signature(solver).parameters}
_OF_DRIVES = {key for kind in DRIVES.values() for key in _keys_of(kind)}
_KEYS = {
    "chain": _keys_of(Chain),
    "physical": _keys_of(physical) | {"time_unit": False},
    "run": dict.fromkeys((*_RUN_KEYS, *sorted(_OPTIONS)), False),
    "run.start": dict.fromkeys(_START_KEYS, False),
    "drive": dict.fromkeys(("kind", *_IN_KELVIN, *sorted(_OF_DRIVES)), False),
}
"""The keys of every table and whether each is required; those of ``[drive]`` depend on its kind."""
_SETTABLE = [f"{table}.{key}" for table, keys in _KEYS.items() for key in keys]


class Literal(str):
    """A decimal number as it was written; its value is exact."""


@dataclass(frozen=True)
class Member:
    """One member of a scene: what it sets, and the experiment it makes.

    Attributes
    ----------
    settings : mapping of str to value
        The varied keys and this member's values, as written.
    experiment : Experiment
    solid : Solid or None
        What the chain stands for, if the scene speaks SI.
    time_unit : float or None
        Seconds of one unit of its drive's clock, if that is known.
    """

    settings: Mapping[str, Any]
    experiment: Experiment
    solid: Solid | None = None
    time_unit: float | None = None


@dataclass(frozen=True)
class Scene:
    """What a TOML scene says, checked for its names but not yet for its values.

    Attributes
    ----------
    name : str
    title : str
        One line for humans.
    tables : mapping
        ``chain`` or ``physical`` (a solid in SI units instead), ``drive`` and ``run`` by name, as
        written.
    vary : mapping of str to list
        Dotted keys and the values that the members take, all combinations of them.
    folder : Path
        Where files named by the scene are looked for.

    Examples
    --------
    >>> from exactcreep import load_scene
    >>> scene = load_scene("two-sliders-cycles")
    >>> varied = scene.with_settings({"vary.chain.tan_alpha": ["0.1", "0.2"]})
    >>> [member.experiment.chain.tan_alpha for member in varied.members()]
    [Fraction(1, 10), Fraction(1, 5)]
    """

    name: str
    title: str
    tables: Mapping[str, Mapping[str, Any]]
    vary: Mapping[str, list[Any]]
    folder: FilePath

    @classmethod
    def from_text(cls, text: str, *, name: str = "scene", folder: FilePath | None = None) -> Scene:
        """Return the scene that TOML text describes, or raise `InputError`."""
        return cls.from_mapping(_parsed(text, name), name=name, folder=folder)

    @classmethod
    def from_mapping(
        cls, data: Mapping[str, Any], *, name: str = "scene", folder: FilePath | None = None
    ) -> Scene:
        """Return the scene that nested mappings (as from TOML) describe.

        Raises
        ------
        InputError
            If a name is unknown or a table is not one.
        """
        _known(data, ("title", *_TABLES, "vary"), "")
        title = data.get("title", "")
        if not isinstance(title, str) or isinstance(title, Literal):
            raise InputError("title", title, "must be a string")
        tables = {}
        for table in (*_TABLES, "vary"):
            entries = data.get(table, {})
            if not isinstance(entries, Mapping):
                raise InputError(table, entries, f"must be a table, [{table}]")
            if table in data or table != "physical":
                tables[table] = dict(entries)
        vary = dict(_flattened(tables.pop("vary")))
        for table in tables:
            if table != "drive":
                _known(tables[table], _KEYS[table], f"{table}.")
        _known(vary, _SETTABLE, "vary.")
        for key, values in vary.items():
            if not isinstance(values, list) or not values:
                raise InputError(f"vary.{key}", values, "must be a list of at least one value")
        both = {f"chain.{key}": value for key, value in tables["chain"].items()} | vary
        for key, value in both.items():
            if "physical" in tables and key.startswith("chain."):
                allowed = "must not be given beside [physical], which makes the chain"
                raise InputError(key, value, allowed)
        kinds = [tables["drive"].get("kind"), *vary.get("drive.kind", [])]
        keys = [key for kind in kinds if kind is not None for key in _keys_of(drive_of_kind(kind))]
        if "physical" in tables:
            keys += [kelvin for kelvin, name in _IN_KELVIN.items() if name in keys]
        if keys:
            _known(tables["drive"], ("kind", *keys), "drive.")
        return cls(name, title, tables, vary, folder or FilePath())

    def with_settings(self, settings: Mapping[str, Any]) -> Scene:
        """Return the scene with dotted keys set, ``{"chain.n": 6}``.

        A key that was varied takes the one value instead. Setting ``drive.kind`` to another
        kind empties the table ``[drive]`` first; ``vary.KEY`` takes a list, and varies KEY.

        Raises
        ------
        InputError
            If a key is unknown.
        """
        tables = {table: dict(entries) for table, entries in self.tables.items()}
        vary = dict(self.vary)
        kind = settings.get("drive.kind")
        if kind is not None and kind != tables["drive"].get("kind"):
            tables["drive"] = {}
            vary = {key: values for key, values in vary.items() if not key.startswith("drive.")}
        for key, value in settings.items():
            varied = key.removeprefix("vary.")
            _known({varied: value}, _SETTABLE, "vary." if varied != key else "")
            vary.pop(varied, None)
            if varied != key:
                vary[varied] = value
            else:
                _put(tables, key, value)
        data = {"title": self.title, **tables, "vary": vary}
        return Scene.from_mapping(data, name=self.name, folder=self.folder)

    def settings(self) -> list[dict[str, Any]]:
        """Return, for every member, the varied keys and their values; the first varies slowest."""
        count = math.prod(len(values) for values in self.vary.values())
        if count > MOST_MEMBERS:
            raise InputError("vary", count, f"must make at most {MOST_MEMBERS} members")
        return [
            dict(zip(self.vary, values, strict=True))
            for values in itertools.product(*self.vary.values())
        ]

    def members(self) -> list[Member]:
        """Return the members of the scene; a scene that varies nothing has one.

        Raises
        ------
        InputError
            If a value is out of its range; the message names the key.
        """
        return [self._member(settings) for settings in self.settings()]

    def _member(self, settings: Mapping[str, Any] | None) -> Member:
        """Return the member of the scene with these dotted keys set."""
        tables = {table: dict(entries) for table, entries in self.tables.items()}
        for key, value in (settings or {}).items():
            _put(tables, key, value)
        about, solid = tables.get("physical"), None
        if about is not None:
            seconds = about.pop("time_unit", None)
            solid = _named("physical", lambda: _made(physical, _KEYS["physical"], about))
            chain = solid.chain
        else:
            chain = _named("chain", lambda: _made(Chain, _KEYS["chain"], tables["chain"]))
        drive = _named("drive", lambda: _drive(tables["drive"], self.folder, solid))
        run = tables["run"]
        given = {name: run.pop(name) for name in _RUN_KEYS if name in run}
        seed = given.get("seed", 0)
        start = _named("run.start", lambda: _start(given.pop("start", "relaxed"), chain, seed))
        experiment = _named(
            "run", lambda: Experiment.of(chain, drive, start=start, options=run, **given)
        )
        unit = None
        if solid is not None and (seconds is not None or drive.dates is not None):
            unit = _named("physical", lambda: solid.time_unit_of(drive, seconds))
        return Member(settings or {}, experiment, solid, unit)

    def experiment(self, settings: Mapping[str, Any] | None = None) -> Experiment:
        """Return the experiment of the scene with these dotted keys set."""
        return self._member(settings).experiment


def load_scene(scene: str | os.PathLike[str]) -> Scene:
    """Return the built-in scene of that name, or the scene in that file.

    Parameters
    ----------
    scene : str or path
        A name that ``exactcreep scenes`` lists, or a TOML file.

    Raises
    ------
    InputError
        If there is neither, the file cannot be read, it is no TOML, or a name in it is unknown.

    Examples
    --------
    >>> load_scene("two-sliders-cycles").experiment().chain.n
    2
    """
    name = file_name(scene, "scene")
    builtin = builtin_scenes()
    path = _BUILTIN / f"{name}.toml" if name in builtin else FilePath(name)
    if not path.exists():
        near = difflib.get_close_matches(name, builtin, 1, 0.3)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise InputError("scene", name, f"must be a file or one of {', '.join(builtin)}{hint}")
    text = text_of(content_of(path, "scene", _LARGEST_FILE), "scene", name)
    return Scene.from_mapping(_parsed(text, name), name=path.stem, folder=path.parent)


def builtin_scenes() -> dict[str, str]:
    """Return the text of every built-in scene by its name."""
    return {file.stem: file.read_text("utf-8") for file in sorted(_BUILTIN.glob("*.toml"))}


def parsed_value(text: str) -> Any:
    """Return the value that `text` has in TOML, or `text` itself if it is none (``exact``)."""
    try:
        data = tomllib.loads(f"value = {text}", parse_float=Literal)
    except (ValueError, RecursionError):
        return text
    return data["value"] if list(data) == ["value"] else text


def _parsed(text: str, name: str) -> dict[str, Any]:
    words = (word for word in _WORD.findall(text) if word.count(".") > _DEEPEST_KEY)
    if any(sum(map(bool, word.split("."))) > _DEEPEST_KEY for word in words):
        # the parser takes a time that grows with the square of the depth of a dotted key
        raise InputError("scene", name, "must be a TOML file: nested too deeply")
    try:
        return tomllib.loads(text, parse_float=Literal)
    except tomllib.TOMLDecodeError as error:
        raise InputError("scene", name, f"must be a TOML file: {error}") from None
    except (ValueError, RecursionError) as error:  # an endless integer, endless nesting
        kind = "nested too deeply" if isinstance(error, RecursionError) else "a number is too long"
        raise InputError("scene", name, f"must be a TOML file: {kind}") from None


def _printable(key: str) -> str:
    """Return a key that a user made up as it may stand in a sentence."""
    return key if key.isprintable() and len(key) <= 80 else repr(key[:60])


def _known(table: Mapping[str, Any], known: Collection[str], prefix: str) -> None:
    """Raise InputError if `table` has a key that is not `known`, naming the nearest one."""
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, 1, 0.3)
            hint = f"; did you mean {prefix}{near[0]}?" if near else ""
            if str(key).rpartition(".")[2] in _ANGLES:
                hint = "; tan_alpha is the slope, the tangent of the angle: 0.268 for 15 degrees"
            if not near and len(known) <= _MOST_LISTED:
                hint = "; known are " + ", ".join(known)
            allowed = f"is not a key of a scene{hint}"
            raise InputError(_printable(f"{prefix}{key}"), table[key], allowed)


def _flattened(table: Mapping[str, Any], prefix: str = "", depth: int = 0) -> Iterator[Any]:
    """Yield dotted keys and values of nested tables."""
    for key, value in table.items():
        if isinstance(value, Mapping) and value and depth < _DEEPEST:
            yield from _flattened(value, f"{prefix}{key}.", depth + 1)
        else:
            yield f"{prefix}{key}", value


def _put(tables: dict[str, dict[str, Any]], key: str, value: Any) -> None:
    table, name, *rest = key.split(".")
    if not rest:
        tables.setdefault(table, {})[name] = value
        return
    inner = tables[table].get(name)
    tables[table][name] = {**(inner if isinstance(inner, Mapping) else {}), rest[0]: value}


def _named(table: str, build: Callable[[], Any]) -> Any:
    """Return what `build` makes; an error in it names the key with its table."""
    try:
        return build()
    except InputError as error:
        field = error.field
        if field == table.rpartition(".")[2]:
            field = table
        elif not field.startswith(f"{table}."):
            field = f"{table}.{field}"
        raise InputError(field, error.value, error.allowed) from None


def _made(make: Callable[..., Any], keys: Mapping[str, bool], given: Mapping[str, Any]) -> Any:
    """Return what a table makes, or raise `InputError` if a key is missing."""
    required = [name for name, needed in keys.items() if needed]
    for name in required:
        if name not in given:
            raise InputError(name, None, "is missing; " + ", ".join(required) + " are required")
    return make(**given)


def _drive(table: Mapping[str, Any], folder: FilePath, solid: Solid | None) -> Drive:
    given = dict(table)
    make = drive_of_kind(given.pop("kind", None))
    for kelvin, name in _IN_KELVIN.items():
        if solid is None or kelvin not in given:
            continue
        if name in given:
            raise InputError(kelvin, given[kelvin], f"must not be given together with {name}")
        given[name] = exact_number(given.pop(kelvin), kelvin) * solid.kappa
    keys = _keys_of(make)
    _known(given, keys, "drive.")
    if solid is not None and "kappa" in keys:
        kappa = given.setdefault("kappa", solid.kappa)
        if exact_number(kappa, "kappa") != solid.kappa:
            raise InputError("kappa", kappa, "must be physical.kappa, or be left out")
    if isinstance(given.get("file"), str):
        # a path in a scene is meant from where the scene is, not from where the program was started
        given["file"] = folder / given["file"]
    made: Drive = _made(make, keys, given)
    return made


def _start(given: Any, chain: Chain, seed: Any) -> State | None:
    """Return the start that a scene asks for; None: the relaxed chain."""
    if given == "relaxed":
        return None
    if not isinstance(given, Mapping):
        allowed = 'must be "relaxed", { tensions = [...] } or { size = 1e-6, seed = 1 }'
        raise InputError("start", given, allowed)
    _known(given, _START_KEYS, "run.start.")
    if "size" in given:
        for name in ("tensions", "theta"):
            if name in given:
                raise InputError(name, given[name], "cannot be given together with size")
        return State.perturbed(chain, given["size"], start_seed=given.get("seed", 0), seed=seed)
    if "seed" in given:
        raise InputError("seed", given["seed"], "belongs to a start of a given size")
    return State.prepared(chain, given.get("tensions"), theta=given.get("theta", 0), seed=seed)
