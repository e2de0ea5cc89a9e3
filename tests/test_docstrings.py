"""What the docstrings of the public names promise: every parameter, and examples that run."""

from __future__ import annotations

import builtins
import dataclasses
import doctest
import importlib
import inspect
import re
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

import exactcreep
from tests.processes import finished

PACKAGE = Path(exactcreep.__file__).parent
EXAMPLES = [path for path in sorted(PACKAGE.rglob("*.py")) if ">>>" in path.read_text("utf-8")]
PUBLIC = sorted(set(exactcreep.__all__) - {"__version__", "disorder", "laws"})
LIKE = {"iterate": "rearrange"}
"""Functions whose arguments are those of another."""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_of_a_module_print_what_they_say(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0
    assert failed == 0


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_begins_with_a_sentence(name: str) -> None:
    text = inspect.getdoc(getattr(exactcreep, name)) or ""
    assert text.splitlines()[0].endswith((".", ":", ","))


@pytest.mark.parametrize("name", [*PUBLIC, "disorder", "laws"])
def test_a_public_name_shows_an_example(name: str) -> None:
    assert ">>> " in (inspect.getdoc(getattr(exactcreep, name)) or "")


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_function_describes_every_parameter(name: str) -> None:
    public = getattr(exactcreep, name)
    if isinstance(public, type) and not hasattr(public, "__dataclass_fields__"):
        return  # exceptions and enumerations take none from a user
    described = inspect.getdoc(getattr(exactcreep, LIKE.get(name, name))) or ""
    entries = re.findall(r"^([\w*, ]+?)(?: :.*)?$\n    \S", described, re.MULTILINE)
    bare = re.findall(r"^([\w, ]+) : .*$", described, re.MULTILINE)  # without a line below
    known = {word.strip(" *") for entry in [*entries, *bare] for word in entry.split(",")}
    taken = set(inspect.signature(public).parameters)
    if name == "Rearrangement":  # a solver makes it, and the user reads its fields
        taken = {field.name for field in dataclasses.fields(public)}
    assert taken <= known, f"{sorted(taken - known)} of {name}"


def classes_in(annotation: object) -> set[type]:
    """Return the classes that an annotation is made of."""
    found = {annotation} if isinstance(annotation, type) else set()
    return found.union(*(classes_in(part) for part in get_args(annotation)))


@pytest.mark.parametrize("name", PUBLIC)
def test_what_a_public_function_takes_returns_and_raises_is_public(name: str) -> None:
    public = getattr(exactcreep, name)
    if isinstance(public, type):
        return
    for word, annotation in get_type_hints(public).items():
        for named in classes_in(annotation):
            if named.__module__.startswith("exactcreep."):
                assert getattr(exactcreep, named.__name__, None) is named, f"{word} of {name}"
    text = inspect.getdoc(public) or ""
    raised = re.search(r"^Raises\n-+\n(.*?)(\n\n\w+\n-+\n|\Z)", text, re.MULTILINE | re.DOTALL)
    for error in re.findall(r"^(\w+)$", raised[1] if raised else "", re.MULTILINE):
        assert hasattr(exactcreep, error) or hasattr(builtins, error), f"{name} raises {error}"


@pytest.mark.parametrize("name", ["disorder", "laws"])
def test_a_public_module_is_imported_by_its_public_name(name: str) -> None:
    script = f"import exactcreep.{name} as there, exactcreep; print(there is exactcreep.{name})"
    done = finished(sys.executable, "-c", script)
    assert done.stdout == "True\n", done.stderr


def test_importing_the_package_waits_for_nothing_heavy() -> None:
    done = finished(sys.executable, "-c", "import sys, exactcreep; print(*sys.modules)")
    heavy = {"numpy", "numba", "scipy", "sympy", "mpmath", "xarray", "matplotlib", "flint"}
    assert "exactcreep" in done.stdout.split()
    assert not heavy & set(done.stdout.split())


def test_a_run_waits_for_no_statistics_or_tables_that_it_does_not_make() -> None:
    script = "import sys, exactcreep; exactcreep.creep; print(*sys.modules)"
    done = finished(sys.executable, "-c", script)
    assert "numba" in done.stdout.split()
    assert not {"scipy.stats", "sympy", "xarray", "matplotlib", "pandas"} & set(done.stdout.split())


def test_the_laws_wait_for_no_compiler() -> None:
    script = "import sys; from exactcreep import laws; print(laws.critical_angle, *sys.modules)"
    done = finished(sys.executable, "-c", script)
    assert "mpmath" in done.stdout.split()
    assert not {"numba", "scipy", "sympy", "xarray", "flint"} & set(done.stdout.split())
