"""What a proof rests on is on one page, and grows only there where a reader sees it."""

from __future__ import annotations

import re
from pathlib import Path

from tests.test_architecture import MODULES, for_types_only, imports

BOOK = Path(__file__).parents[1] / "notebooks" / "explanation"
PAGE = (BOOK / "trusted.md").read_text(encoding="utf-8")
MOST_LINES = 6300
"""Of the modules that decide. If it has to grow, say on the page what for."""
MOST_MODULES = 43
"""That are loaded with the proof of a fate; floats alone ask `motion.amplified` and `estimated`.

`model.rules` was a part of `contacts` and of five solvers, `exact_state` one of `at_rest`;
`model.uniform` is the gate before laws of equal sliders.
"""


def module_of(name: str) -> str | None:
    """Return the path of the module that an import names, None if it is not the package's."""
    parts = name.split(".")[1:]
    for size in (len(parts), len(parts) - 1):
        path = "/".join(parts[:size]) + ".py"
        if path in MODULES and name.startswith("exactcreep."):
            return path
    return None


def needed(*first: str) -> set[str]:
    """Return the modules that these import, directly or not, and themselves."""
    found, left = set(), list(first)
    while left:
        module = left.pop()
        if module in found:
            continue
        found.add(module)
        typed = for_types_only(MODULES[module])
        names = (name for name, node in imports(MODULES[module]) if node not in typed)
        left += [path for name in names if (path := module_of(name)) is not None]
    return found


def listed(text: str) -> set[str]:
    names = re.findall(r"`([a-z_.]+)`", text)
    return {name.replace(".", "/") + ".py" for name in names} & {*MODULES}


def test_the_page_names_every_module_that_a_certified_run_loads() -> None:
    part = PAGE.split("## Assumptions")[0].split("A *fate*")[0]
    deciding, carried = part.split("### Also loaded")
    assert not listed(deciding) & listed(carried)
    assert listed(deciding) | listed(carried) == needed("solvers/field/certified.py")


def test_what_decides_stays_small_enough_to_be_read() -> None:
    table = PAGE.split("### Also loaded")[0]
    rows = {name.replace(".", "/") + ".py" for name in re.findall(r"^\| `([a-z_.]+)`", table, re.M)}
    root = Path(__file__).parents[1] / "exactcreep"
    lines = sum(len((root / row).read_text(encoding="utf-8").splitlines()) for row in rows)
    assert 0 < lines <= MOST_LINES


def test_a_proved_fate_adds_the_modules_that_the_page_names() -> None:
    own = {"studies/fates/proof.py", "solvers/field/tangent.py"}
    known = listed(PAGE.split("## Assumptions")[0])
    results = {"studies/fates/fate_result.py"}  # what a fate is called
    assert needed(*own) <= known | results | own
    assert len(needed(*own)) <= MOST_MODULES


def test_the_program_is_read_in_five_files_of_two_thousand_lines() -> None:
    page = (BOOK.parent / "contributing.md").read_text(encoding="utf-8")
    files = re.findall(r"^\d\. \*\*`([a-z_/]+)`\*\*", page, re.M)
    assert len(files) == 5
    root = Path(__file__).parents[1] / "exactcreep"
    sizes = [len((root / f"{name}.py").read_text(encoding="utf-8").splitlines()) for name in files]
    assert sum(sizes) <= 2000
