"""What the docstrings of the public names promise, and what an import costs."""

from __future__ import annotations

import dataclasses
import doctest
import enum
import importlib
import inspect
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest
from numpydoc.docscrape import NumpyDocString
from numpydoc.validate import validate

import exactcreep
from tests.processes import finished

PACKAGE = Path(exactcreep.__file__).parent
EXAMPLES = [path for path in sorted(PACKAGE.rglob("*.py")) if ">>>" in path.read_text("utf-8")]
PUBLIC = {
    name: getattr(module, name)
    for module in (exactcreep, exactcreep.results)
    for name in sorted(set(module.__all__) - {"__version__", "results"})
}
ROOF = exactcreep.physical(
    length=3, youngs_modulus="16e9", density=11340, section="0.003", kappa="29e-6",
    contacts=10, mu_d="0.45", mu_s="0.55", tan_alpha="0.3",
)  # fmt: skip
NAMES = {
    "Fraction": Fraction,
    "roof": ROOF,
    "pair": exactcreep.Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"),
    "slope": {"l0": 1000, "mu_d": 0.5, "tan_alpha": 0.25},
    **{name: PUBLIC[name] for name in exactcreep.__all__ if name in PUBLIC},
}
"""What examples take as known; the page of the reference says so."""
SECTIONS = {"GL08", "SS03", "PR01", "PR02", "PR03", "PR07", "RT01", "RT03", "EX01"}
"""What numpydoc finds missing: a docstring, its period, parameters and what they mean, what is
returned, an example."""


@pytest.mark.filterwarnings("ignore::exactcreep.quasistatic.checkpoint.CheckpointWarning")
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_of_a_module_print_what_they_say(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    module = importlib.import_module(name)
    failed, tried = doctest.testmod(module, extraglobs=NAMES)
    assert tried > 0
    assert failed == 0


def _names_within(name: str) -> Iterator[str]:
    """Yield the dotted names of a public name and of what a user calls or reads of it."""
    public = PUBLIC[name]
    if inspect.ismodule(public):
        yield from (f"{name}.{each}" for each in public.__all__ if callable(getattr(public, each)))
        return
    yield name
    for member, value in inspect.getmembers_static(public) if isinstance(public, type) else ():
        read = isinstance(value, (classmethod, staticmethod, property)) or callable(value)
        owner = next((owner for owner in public.__mro__ if member in vars(owner)), object)
        ours = owner.__module__.startswith("exactcreep") and not member.startswith("_")
        # what overrides a member that is described does as that says
        own = value.__doc__ or not any(member in vars(base) for base in owner.__mro__[1:])
        if ours and own and (read or hasattr(value, "func")):
            yield f"{name}.{member}"


def _lacks(dotted: str) -> list[str]:
    """Return what numpydoc finds missing; fields of a dataclass may be described as attributes."""
    name, _, member = dotted.partition(".")
    public = PUBLIC[name]
    home = "exactcreep.results" if name in exactcreep.results.__all__ else "exactcreep"
    errors = dict(validate(f"{home}.{dotted}")["errors"])
    if not member and dataclasses.is_dataclass(public):
        docstring = NumpyDocString(inspect.getdoc(public) or "")
        entries = docstring["Parameters"] + docstring["Attributes"]
        described = {word.strip() for entry in entries for word in entry.name.split(",")}
        if {*inspect.signature(public).parameters} <= described:
            errors.pop("PR01", None)
    elif not member and isinstance(public, enum.EnumType):
        errors.pop("PR01", None)  # its parameters are Python's
    if inspect.isclass(public) and member:
        errors.pop("EX01", None)  # the example of a class shows its members
    return sorted(SECTIONS & errors.keys())


@pytest.mark.parametrize("name", PUBLIC)
def test_what_a_user_calls_or_reads_has_the_sections_of_numpydoc(name: str) -> None:
    assert ">>> " in (inspect.getdoc(PUBLIC[name]) or "")
    names = list(_names_within(name))
    assert names
    assert {dotted: found for dotted in names if (found := _lacks(dotted))} == {}


def _completed(kind: type) -> set[str]:
    """Return the names that complete on Tab behind a type or its objects."""
    own = {each.name for each in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else ()
    return {name for name in (*dir(kind), *own) if not name.startswith("_")}


def test_a_run_has_few_attributes() -> None:
    assert len(_completed(exactcreep.Creep)) <= 45


ASKED = "from exactcreep.cli import status; status({}.split())"


@pytest.mark.parametrize(
    ("statement", "needed", "heavy"),
    [
        ("exactcreep", "exactcreep", "numpy numba scipy sympy mpmath xarray matplotlib flint"),
        ("exactcreep.creep", "numpy", "numba scipy.stats sympy xarray matplotlib pandas"),
        ("exactcreep.laws.critical_angle", "mpmath", "numba scipy sympy xarray flint"),
        (ASKED.format("'walk'"), "cyclopts",
         "numpy numba scipy sympy mpmath xarray matplotlib flint pygments markdown_it"),
        (ASKED.format("'threshold --help'"), "numpy",
         "numba scipy.stats scipy.linalg sympy xarray pandas matplotlib"),
        (ASKED.format("'run two-sliders-cycles --set drive.cycles=1'"), "numba",
         "scipy.special xarray pandas h5py h5netcdf sympy matplotlib rich.progress"),
    ],
)  # fmt: skip
def test_what_is_imported_or_asked_for_loads_nothing_heavy_that_it_does_not_need(
    statement: str, needed: str, heavy: str
) -> None:
    script = f"import sys, exactcreep; {statement}; print(*sys.modules)"
    loaded = finished(sys.executable, "-c", script).stdout.splitlines()[-1].split()
    assert needed in loaded
    assert not set(heavy.split()) & set(loaded)
