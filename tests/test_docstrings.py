"""What the docstrings of the public names promise, and what an import costs."""

from __future__ import annotations

import builtins
import dataclasses
import doctest
import importlib
import inspect
import sys
from pathlib import Path

import pytest
from numpydoc.docscrape import NumpyDocString

import exactcreep
from tests.processes import finished

PACKAGE = Path(exactcreep.__file__).parent
EXAMPLES = [path for path in sorted(PACKAGE.rglob("*.py")) if ">>>" in path.read_text("utf-8")]
PUBLIC = sorted(set(exactcreep.__all__) - {"__version__", "disorder", "laws"})


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
def test_a_public_name_shows_an_example_and_describes_what_it_takes_and_raises(name: str) -> None:
    public = getattr(exactcreep, name)
    assert ">>> " in (inspect.getdoc(public) or "")
    if isinstance(public, type) and not dataclasses.is_dataclass(public):
        return  # exceptions and enumerations take none from a user
    said = NumpyDocString(inspect.getdoc(public) or "")
    entries = said["Parameters"] + said["Other Parameters"] + said["Attributes"]
    known = {word.strip(" *") for entry in entries for word in entry.name.split(",")}
    taken = set(inspect.signature(public).parameters)
    if name == "Rearrangement":  # a solver makes it, and the user reads its fields
        taken = {field.name for field in dataclasses.fields(public)}
    assert taken <= known, f"{sorted(taken - known)} of {name}"
    for error in said["Raises"]:
        assert hasattr(exactcreep, error.type) or hasattr(builtins, error.type), error.type


@pytest.mark.parametrize("name", ["disorder", "laws"])
def test_a_public_module_shows_an_example_and_is_imported_by_its_public_name(name: str) -> None:
    assert ">>> " in (inspect.getdoc(getattr(exactcreep, name)) or "")
    script = f"import exactcreep.{name} as there, exactcreep; print(there is exactcreep.{name})"
    done = finished(sys.executable, "-c", script)
    assert done.stdout == "True\n", done.stderr


@pytest.mark.parametrize(
    ("statement", "needed", "heavy"),
    [
        ("exactcreep", "exactcreep", "numpy numba scipy sympy mpmath xarray matplotlib flint"),
        ("exactcreep.creep", "numba", "scipy.stats sympy xarray matplotlib pandas"),
        ("exactcreep.laws.critical_angle", "mpmath", "numba scipy sympy xarray flint"),
    ],
)
def test_an_import_waits_for_nothing_heavy_that_it_does_not_need(
    statement: str, needed: str, heavy: str
) -> None:
    script = f"import sys, exactcreep; {statement}; print(*sys.modules)"
    loaded = finished(sys.executable, "-c", script).stdout.split()
    assert needed in loaded
    assert not set(heavy.split()) & set(loaded)
