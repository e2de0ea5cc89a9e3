"""The house: rooms, what each may know, and what the package promises by name."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from pkgutil import resolve_name

import pytest

import exactcreep
from exactcreep import moved
from exactcreep.model.drawn import DRAWN
from exactcreep.model.result import Result
from tests.processes import finished

PACKAGE = Path(exactcreep.__file__).parent
ROOMS = (
    ("moved", "watch.preparation"),
    ("compiling",),
    ("model",),
    ("records",),
    ("watch", "disorder"),
    ("laws",),
    ("motion",),
    ("solvers",),
    ("quasistatic",),
    ("walk", "solid", "pipeline"),
    ("scene",),
    ("studies",),
    ("figures",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
"""From the foundations up; rooms of one entry share a floor, and a module may have its own."""
FLOOR = {room: floor for floor, rooms in enumerate(ROOMS) for room in rooms}
FACES = {"commands", "cli", "__init__", "__main__", "results"}
STUBS = {"exactcreep": exactcreep, "exactcreep.results": exactcreep.results}
PUBLIC = {
    *STUBS,
    *(f"{place}.{name}" for place, module in STUBS.items() for name in module.__all__),
}
"""What a face may ask the package for, as everybody may."""
MODULES = {
    path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(PACKAGE.rglob("*.py"))
}
CHANGES = PACKAGE.parent.joinpath("CHANGELOG.md").read_text(encoding="utf-8")


def room_of(module: str) -> str:
    """Return the room of a module, ``model/chain.py`` or ``model.chain.Chain``."""
    parts = module.removesuffix(".py").replace("/", ".").split(".")
    own = ".".join(parts[:2])
    return own if own in FLOOR else parts[0]


def imports(tree: ast.AST) -> Iterator[str]:
    """Yield the module that each import statement names, as from the root of the package."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield f"{node.module}.{alias.name}"


def late_imports(tree: ast.AST) -> Iterator[str]:
    """Yield the module of every call of ``import_module`` that names it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            (named,) = node.args
            if isinstance(named, ast.Constant):
                yield named.value


def test_a_room_imports_only_from_rooms_above_it() -> None:
    against = set()
    for module, tree in MODULES.items():
        room = room_of(module)
        if room in ("__init__", "results"):
            continue
        assert room in FLOOR, f"{room} is a room that the house does not know"
        for name in {*imports(tree), *late_imports(tree)}:
            if room in FACES and name in PUBLIC:
                continue
            package, _, inside = name.partition(".")
            assert package != "derivations", "the package never imports its derivations"
            own = package == "exactcreep" and inside != "__version__"
            if own and FLOOR[room_of(inside)] > FLOOR[room]:
                against.add((module, name))
    assert against == set()


def test_every_type_of_result_has_a_picture_of_its_own() -> None:
    offered = [getattr(exactcreep.results, name) for name in exactcreep.results.__all__]
    results = [kind for kind in (exactcreep.Creep, *offered) if issubclass(kind, Result)]
    assert {*DRAWN} == {kind.__name__ for kind in results}
    assert all(callable(resolve_name(draw)) for draw in DRAWN.values())


@pytest.mark.parametrize("place", STUBS)
def test_every_public_name_is_there_and_promised_to_type_checkers(place: str) -> None:
    module = STUBS[place]
    file = Path(module.__file__ or "").with_suffix(".pyi")
    stub = ast.parse(file.read_text(encoding="utf-8"))
    imported = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    public = set(module.__all__)
    promised = {alias.asname for node in imported for alias in node.names}
    assert promised == public - {"__version__"}
    assert public <= set(dir(module))
    assert all(getattr(module, name) is not None for name in public)
    with pytest.raises(AttributeError, match="velocity"):
        module.velocity  # noqa: B018


@pytest.mark.parametrize("name", [*moved.NAMES, *exactcreep.results.__all__])
def test_a_name_that_stood_at_the_top_says_where_it_went(name: str) -> None:
    said = f"exactcreep.{name} is "
    with pytest.raises(AttributeError, match=said):
        getattr(exactcreep, name)
    with pytest.raises(ImportError, match=said):
        exec(f"from exactcreep import {name}")
    assert f"`{name}`" in CHANGES


@pytest.mark.parametrize("word", [*moved.COMMANDS, *moved.OPTIONS, *moved.SOLVERS])
def test_the_changelog_says_where_a_word_went(word: str) -> None:
    assert re.search(rf"`[^`]*{word}\b[^`]*`", CHANGES)


def test_the_public_names_are_few() -> None:
    assert len(set(exactcreep.__all__) - {"__version__"}) <= 28


# --- what a proof rests on ------------------------------------------------------------------------

BOOK = PACKAGE.parent / "notebooks"
TRUSTED = (BOOK / "explanation/trusted.md").read_text(encoding="utf-8").split("## Assumptions")[0]
MOST_MODULES = 43
"""That are loaded with the proof of a fate."""


def listed(text: str) -> set[str]:
    names = re.findall(r"`([a-z_./]+)`", text)
    return {name.replace(".", "/") + ".py" for name in names} & {*MODULES}


def loaded_with(*names: str) -> set[str]:
    """Return the modules, but no faces of packages, that an import of some loads."""
    script = f"import sys, {', '.join(f'exactcreep.{name}' for name in names)}; print(*sys.modules)"
    known = re.findall(r"exactcreep\.(\S+)", finished(sys.executable, "-c", script).stdout)
    return {name.replace(".", "/") + ".py" for name in known} & {*MODULES} - {"moved.py"}


def test_the_page_names_every_module_that_a_certified_run_loads() -> None:
    deciding, carried = TRUSTED.split("A *fate*")[0].split("### Also loaded")
    assert not listed(deciding) & listed(carried)
    assert listed(deciding) | listed(carried) == loaded_with("solvers.field.certified")


def test_a_proved_fate_adds_the_modules_that_the_page_names() -> None:
    own = {"studies/fates/proof.py", "solvers/field/tangent.py"}
    named = {"studies/fates/fate_result.py"}  # what a fate is called
    loaded = loaded_with("studies.fates.proof", "solvers.field.tangent")
    assert own <= loaded <= listed(TRUSTED) | named | own
    assert len(loaded) <= MOST_MODULES
