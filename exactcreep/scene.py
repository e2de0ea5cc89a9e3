"""Scenes: a chain, a drive and a run in one TOML file; `[vary]` lists what its members vary."""

from __future__ import annotations

import itertools
import math
import os
import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache
from inspect import signature
from pathlib import Path as FilePath
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.names import meant, one_of
from exactcreep.model.numbers import InputError, Shown, exact_number, refusing
from exactcreep.model.state import State
from exactcreep.model.user_files import content_of, leaves, text_of
from exactcreep.pipeline import Pipeline, pipeline
from exactcreep.quasistatic.experiment import DRIVES, Experiment, drive_of_kind
from exactcreep.quasistatic.writing import file_name
from exactcreep.records.table import CellError
from exactcreep.records.temperature_record import TemperatureRecord
from exactcreep.solid import Solid, physical
from exactcreep.solvers.registry import SOLVERS

MOST_MEMBERS = 1_000_000
"""A scene with more members is a mistake: its settings alone would fill the memory."""
_BUILTIN = FilePath(__file__).with_name("scenes")
_LARGEST_FILE = 16 * 2**20  # bytes; enough for long paths of dilations
_DECIMALS = Context(prec=100)
_DEEPEST_KEY = 100  # tables within tables
_MOST_LISTED = 40  # keys in a sentence
_SPAN = {"from", "to", "step"}
_ONE_NUMBER = re.compile(r"must be a (\w+ )?number\b")
_WORD = re.compile(r"[^\s\"'=\[\]{},#]+")


def _keys_of(*made: Callable[..., Any]) -> dict[str, bool]:
    """Return the keys for the parameters of functions, and whether each is required."""
    taken = [each for make in made for each in signature(make).parameters.values()]
    return {each.name: each.default is each.empty for each in taken if each.default is not None}


_IN_KELVIN = {"temperature_amplitude": "amplitude", "sigma_temperature": "sigma_theta"}
"""Keys of ``[drive]`` beside a table of SI units: temperatures (K) for dilations."""
_BODIES: dict[str, Callable[..., Any]] = {"chain": Chain, "physical": physical}
_BODIES["pipeline"] = pipeline  # type: ignore[has-type] # of a decorated function
"""The tables of what creeps, of which a scene has one, and what they are made by."""
_RUN = ("solver", "seed", "burn_in", "accuracy", "record", "start", "twin")
_START = ("tensions", "theta", "size", "seed")


@cache
def _keys() -> dict[str, list[str]]:
    """Return the keys of every table; the keys of ``[drive]`` depend on its kind."""
    options = _keys_of(*(solver() for solver in SOLVERS.values()))
    bodies = {table: [*_keys_of(make)] for table, make in _BODIES.items()}
    bodies["physical"].append("time_unit")
    return bodies | {
        "drive": ["kind", *_IN_KELVIN, *sorted(_keys_of(*DRIVES.values()))],
        "run": [*_RUN, *sorted(options)],
    }


@cache
def _settable() -> list[str]:
    """Return the dotted keys that ``[vary]`` and settings may name."""
    keys = [f"{table}.{key}" for table, names in _keys().items() for key in names]
    return keys + [f"run.start.{key}" for key in _START]


class Literal(str):
    """A decimal number as it was written; its value is exact."""


@dataclass(frozen=True)
class Member:
    """One member of a scene: the varied keys as written, its experiment, and its body in SI units.

    `time_unit`: seconds in one unit of the clock of the drive; nan if unknown, as of a pipeline.
    """

    settings: Mapping[str, Any]
    experiment: Experiment
    body: Solid | Pipeline | None = None
    time_unit: float = math.nan


@dataclass(frozen=True, repr=False)
class Scene(Shown):
    """A TOML scene whose names are checked, but not yet its values.

    Attributes
    ----------
    name, title : str
    tables : mapping
        ``chain``, or instead a solid or a pipe in SI units, ``physical`` or ``pipeline``; ``drive``
        and ``run`` by name, as written.
    vary : mapping of str to list
        Dotted keys and their values; the members are all combinations. In a file also
        ``{ from = 0, to = 0.5, step = 0.1 }``, both ends included.
    folder : Path
        Folder of the files that the scene names.

    Examples
    --------
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
    @refusing
    def from_text(cls, text: str, *, name: str = "scene", folder: FilePath | None = None) -> Scene:
        """Return the scene in a TOML text.

        Parameters
        ----------
        text : str
            TOML.
        name : str, optional
            Name of the scene.
        folder : Path, optional
            Folder of the files that the scene names.

        Returns
        -------
        Scene
            With its names checked.

        Raises
        ------
        InputError
            If the text is not TOML, or a name in it is unknown.
        """
        return cls.from_mapping(_parsed(text, name), name=name, folder=folder)

    @classmethod
    def from_mapping(
        cls, data: Mapping[str, Any], *, name: str = "scene", folder: FilePath | None = None
    ) -> Scene:
        """Return the scene in nested mappings.

        Parameters
        ----------
        data : mapping
            Tables by name.
        name : str, optional
            Name of the scene.
        folder : Path, optional
            Folder of the files that the scene names.

        Returns
        -------
        Scene
            With its names checked.

        Raises
        ------
        InputError
            If a name is unknown.
        """
        if not isinstance(data, Mapping):
            raise InputError("scene", data, "must be a mapping of tables, such as {'chain': {...}}")
        _known(data, ("title", *_keys(), "vary"), "")
        title = data.get("title", "")
        if not isinstance(title, str) or isinstance(title, Literal):
            raise InputError("title", title, "must be a string")
        tables: dict[str, Any] = {"chain": {}, "drive": {}, "run": {}, "vary": {}}
        for table, entries in data.items():
            if isinstance(entries, Mapping):
                tables[table] = dict(entries)
            elif table != "title":
                raise InputError(table, entries, f"must be a table, [{table}]")
        varied = leaves(tables.pop("vary"), whole=_SPAN)
        vary = {key: _values(key, values) for key, values in varied}
        _known(vary, _settable(), "vary.")
        body = _body(tables)
        others = tuple(f"{table}." for table in _BODIES if table != body)
        for key, value in (*leaves(tables), *vary.items()):
            if key.startswith(others):
                raise InputError(key, value, f"must not be given beside [{body}]")
        keys = dict(_keys())
        kinds = [tables["drive"].get("kind"), *vary.get("drive.kind", [])]
        if of_kind := _keys_of(*(drive_of_kind(kind) for kind in kinds if kind is not None)):
            in_kelvin = [key for key, name in _IN_KELVIN.items() if name in of_kind]
            keys["drive"] = ["kind", *of_kind, *in_kelvin * (body != "chain")]
        for table, entries in tables.items():
            _known(entries, keys[table], f"{table}.")
        return cls(name, title, tables, vary, folder or FilePath())

    def _facts(self) -> dict[str, Any]:
        said = {"name": self.name, "title": self.title, **dict(leaves(self.tables))}
        return said | {f"vary.{key}": values for key, values in self.vary.items()}

    def with_settings(self, settings: Mapping[str, Any]) -> Scene:
        """Return the scene with dotted keys set, as in ``{"chain.n": 6}``.

        A varied key gets the single value instead. Another ``drive.kind`` first empties the table
        ``[drive]``. ``vary.KEY`` takes a list.

        Parameters
        ----------
        settings : mapping of str to value
            By dotted keys.

        Returns
        -------
        Scene
            A new scene.

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
            _known({varied: value}, _settable(), "vary." if varied != key else "")
            vary.pop(varied, None)
            if varied != key:
                vary[varied] = value
            else:
                _put(tables, key, value)
        data = {"title": self.title, **tables, "vary": vary}
        return Scene.from_mapping(data, name=self.name, folder=self.folder)

    def settings(self) -> list[dict[str, Any]]:
        """Return the varied keys and values of every member; the first key varies slowest.

        Returns
        -------
        list of dict
            One for each member.

        Raises
        ------
        InputError
            If there are more than a million.
        """
        count = math.prod(map(len, self.vary.values()))
        if count > MOST_MEMBERS:
            raise InputError("vary", count, f"must make at most {MOST_MEMBERS} members")
        places = itertools.product(*self.vary.values())
        return [dict(zip(self.vary, values, strict=True)) for values in places]

    def members(self) -> Iterator[Member]:
        """Return an iterator of the members; each is made on demand.

        Returns
        -------
        iterator of Member
            With `settings` and `experiment`; it raises `InputError` for a value out of range.
        """
        return map(self._member, self.settings())

    def experiment(self, settings: Mapping[str, Any] | None = None) -> Experiment:
        """Return the experiment of the scene with these dotted keys set.

        Parameters
        ----------
        settings : mapping of str to value, optional
            By dotted keys.

        Returns
        -------
        Experiment
            Of the first member, if keys are varied.

        Raises
        ------
        InputError
            If a value is out of range.
        """
        return self._member(settings or {}).experiment

    def _member(self, settings: Mapping[str, Any]) -> Member:
        tables = {table: dict(entries) for table, entries in self.tables.items()}
        for key, value in settings.items():
            _put(tables, key, value)
        run, unit = tables["run"], math.nan
        table = _body(tables)
        seconds = tables[table].pop("time_unit", None)
        with _keys_within(table):
            body = _made(_BODIES[table], tables[table])
        chain = getattr(body, "chain", body)
        body = None if chain is body else body
        with _keys_within("drive"):
            drive = _drive(tables["drive"], self.folder, body, chain.n - 1)
        given = {name: run.pop(name) for name in _RUN if name in run}
        with _keys_within("run.start"):
            start = _start(given.pop("start", "relaxed"), chain, given.get("seed", 0))
        with _keys_within("run"):
            experiment = Experiment(chain, drive, start=start, options=run, **given)
        if isinstance(body, Solid) and (seconds is not None or drive.dates is not None):
            with _keys_within("physical"):
                unit = body.time_unit_of(drive, seconds)
        return Member(settings, experiment, body, unit)


def load_scene(scene: str | os.PathLike[str]) -> Scene:
    """Return the built-in scene with this name, or the scene in this file.

    Parameters
    ----------
    scene : str or path
        A name that ``exactcreep scenes`` lists, or a TOML file.

    Returns
    -------
    Scene
        With its names checked, but not yet its values.

    Raises
    ------
    InputError
        If there is no such scene or file, it is not TOML, or a name in it is unknown.

    Examples
    --------
    >>> load_scene("two-sliders-cycles").experiment().chain.n
    2
    """
    name, builtin = file_name(scene, "scene"), builtin_scenes()
    path = _BUILTIN / f"{name}.toml" if name in builtin else FilePath(name)
    if not path.exists():
        raise InputError("scene", name, one_of(name, builtin, "a file or "))
    if path.suffix == ".nc":
        raise InputError("scene", name, f"is a result: exactcreep show {name} draws it")
    text = text_of(content_of(path, "scene", _LARGEST_FILE), "scene", name)
    return Scene.from_mapping(_parsed(text, name), name=path.stem, folder=path.parent)


def builtin_scenes() -> dict[str, str]:
    return {file.stem: file.read_text("utf-8") for file in sorted(_BUILTIN.glob("*.toml"))}


def key_of(name: str) -> str:
    """Return the first dotted key that ends in this name, e.g. ``chain.n`` for ``n``; or ""."""
    return next((key for key in _settable() if key.rpartition(".")[2] == name), "")


def parsed_value(text: str) -> Any:
    """Return the TOML value of `text`, or `text` itself if it has none (``exact``)."""
    try:
        data = tomllib.loads(f"value = {text}", parse_float=Literal)
    except (ValueError, RecursionError):
        return text
    return data["value"] if list(data) == ["value"] else text


def _parsed(text: str, name: str) -> dict[str, Any]:
    why = "nested too deeply"
    # the parser takes a time that grows with the square of the depth of a dotted key
    if max((word.count(".") for word in _WORD.findall(text)), default=0) <= _DEEPEST_KEY:
        try:
            return tomllib.loads(text, parse_float=Literal)
        except tomllib.TOMLDecodeError as error:
            why = str(error)
        except ValueError:  # an endless integer
            why = "a number is too long"
        except RecursionError:  # endless nesting
            pass
    raise InputError("scene", name, f"must be a TOML file: {why}")


def _known(table: Mapping[str, Any], known: Collection[str], prefix: str) -> None:
    """Raise InputError, with a similar known key, if `table` has an unknown key."""
    for key in table:
        if key in known:
            continue
        hint = "; known are " + ", ".join(known) if len(known) <= _MOST_LISTED else ""
        if near := meant(key, known):
            hint = f"; did you mean {prefix}{near}?"
        named = f"{prefix}{key}"
        if not named.isprintable() or len(named) > 80:
            named = repr(named[:60])
        raise InputError(named, table[key], f"is not a key of a scene{hint}")


def _body(tables: Collection[str]) -> str:
    """Return which of its tables says what creeps."""
    return next(table for table in reversed(_BODIES) if table in tables)


def _values(key: str, values: Any) -> list[Any]:
    """Return the values of a varied key."""
    if isinstance(values, Mapping) and _SPAN & {*values}:
        return _equal_steps(f"vary.{key}", values)
    if not isinstance(values, list) or not values:
        allowed = "must be a list of at least one value, or { from, to, step }"
        raise InputError(f"vary.{key}", values, allowed)
    return values


def _equal_steps(key: str, span: Mapping[str, Any]) -> list[Any]:
    """Return the numbers of ``{ from, to, step }``, as written: a float is what Python prints."""
    if {*span} != _SPAN:
        raise InputError(key, dict(span), "must have from, to and step, and nothing else")
    first, last, step = (
        exact_number(repr(float(value)) if isinstance(value, float) else value, f"{key}.{name}")
        for name, value in ((name, span[name]) for name in ("from", "to", "step"))
    )
    written = f"from {span['from']} to {span['to']}"
    if step == 0 or (last - first) / step < 0:
        raise InputError(f"{key}.step", span["step"], f"must lead {written}")
    steps = (last - first) / step
    if steps.denominator != 1:
        allowed = f"must divide the way {written} into equal steps, not {float(steps):.6g}"
        raise InputError(f"{key}.step", span["step"], allowed)
    if steps >= MOST_MEMBERS:
        raise InputError(f"{key}.step", span["step"], f"must make at most {MOST_MEMBERS} members")
    return [_as_written(first + k * step) for k in range(int(steps) + 1)]


def _as_written(value: Fraction) -> Any:
    """Return a number as in TOML: an integer, or its decimals; a rational if they have no end."""
    if value.denominator == 1:
        return int(value)
    decimal = _DECIMALS.divide(Decimal(value.numerator), Decimal(value.denominator))
    return Literal(f"{decimal.normalize(_DECIMALS):f}") if Fraction(decimal) == value else value


def _put(tables: dict[str, dict[str, Any]], key: str, value: Any) -> None:
    table, name, *rest = key.split(".")
    if not rest:
        tables.setdefault(table, {})[name] = value
        return
    inner = tables[table].get(name)
    tables[table][name] = {**(inner if isinstance(inner, Mapping) else {}), rest[0]: value}


@contextmanager
def _keys_within(table: str) -> Iterator[None]:
    """Make an error within the block name its key together with the table."""
    try:
        yield
    except InputError as error:
        name = error.name
        if name == table.rpartition(".")[2]:
            name = table
        elif not name.startswith((f"{table}.", "chain.", "drive.")):
            name = f"{table}.{name}"
        value, allowed = error.value, error.allowed
        several = isinstance(value, list) or (isinstance(value, str) and "," in value)
        if several and _ONE_NUMBER.match(allowed):
            allowed += f"; several values are for vary.{name}"
        raise InputError(name, value, allowed) from None


def _made(
    make: Callable[..., Any], given: Mapping[str, Any], folder: FilePath | None = None
) -> Any:
    required = [name for name, needed in _keys_of(make).items() if needed]
    for name in required:
        if name not in given:
            raise InputError(name, None, f"is missing; {', '.join(required)} are required")
    try:
        return make(**given)
    except CellError as error:
        file = FilePath(given.get("file", ""))
        if folder is None or file.resolve().is_relative_to(folder.resolve()):
            raise
        where = f"line {error.row}, column {error.column or '1 and others'}"
        allowed = f"cannot be used for {where}, which exactcreep record FILE quotes, and a scene"
        allowed += " only from its own folder"
        raise InputError("file", str(file), allowed) from None


def _drive(
    table: Mapping[str, Any], folder: FilePath, solid: Solid | Pipeline | None, springs: int
) -> Drive:
    given = dict(table)
    make = drive_of_kind(given.pop("kind", None))
    keys = _keys_of(make)
    if solid is not None:
        for kelvin, name in _IN_KELVIN.items():
            if kelvin in given and name in given:
                raise InputError(kelvin, given[kelvin], f"must not be given together with {name}")
            if kelvin in given:
                given[name] = exact_number(given.pop(kelvin), kelvin) * solid.kappa
        if "kappa" in keys:
            kappa = given.setdefault("kappa", solid.kappa)
            if exact_number(kappa, "kappa") != solid.kappa:
                allowed = "must be the kappa of the solid or the pipe, or be left out"
                raise InputError("kappa", kappa, allowed)
    _known(given, keys, "drive.")
    if isinstance(given.get("file"), str):
        # a relative path starts at the folder of the scene, not at the current folder
        given["file"] = folder / given["file"]
    columns = given.get("temperature_column")
    if not isinstance(columns, list):
        return _made(make, given, folder)  # type: ignore[no-any-return]
    if not 0 < len(columns) <= springs:
        allowed = f"must name from 1 to {springs} columns: at most one for each spring"
        raise InputError("temperature_column", columns, allowed)
    places = [_made(make, given | {"temperature_column": name}, folder) for name in columns]
    return TemperatureRecord.along(places, springs)


def _start(given: Any, chain: Chain, seed: Any) -> State | None:
    if given == "relaxed":
        return None
    if not isinstance(given, Mapping):
        allowed = 'must be "relaxed", { tensions = [...] } or { size = 1e-6, seed = 1 }'
        raise InputError("start", given, allowed)
    _known(given, _START, "run.start.")
    if "size" in given:
        for name in ("tensions", "theta"):
            if name in given:
                raise InputError(name, given[name], "cannot be given together with size")
        return State.perturbed(chain, given["size"], start_seed=given.get("seed", 0), seed=seed)
    if "seed" in given:
        raise InputError("seed", given["seed"], "belongs to a start of a given size")
    return State.prepared(chain, given.get("tensions"), theta=given.get("theta", 0), seed=seed)
