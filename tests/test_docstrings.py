"""What the docstrings of the public names promise: every parameter, and examples that run."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from pathlib import Path

import pytest

import exactcreep

PACKAGE = Path(exactcreep.__file__).parent
EXAMPLES = [path for path in sorted(PACKAGE.rglob("*.py")) if ">>>" in path.read_text("utf-8")]
PUBLIC = sorted(set(exactcreep.__all__) - {"__version__", "disorder", "laws"})
LIKE = {"iterate": "rearrange"}
"""Functions whose arguments are those of another."""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_of_a_module_print_what_they_say(path: Path) -> None:
    name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0
    assert failed == 0


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_name_begins_with_a_sentence(name: str) -> None:
    text = inspect.getdoc(getattr(exactcreep, name)) or ""
    assert text.splitlines()[0].endswith((".", ":", ","))


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
    assert taken <= known, f"{sorted(taken - known)} of {name}"
