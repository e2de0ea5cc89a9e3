"""The house: rooms, what each may know, and what the package promises by name."""

import ast
import importlib
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import exactcreep

OWN = ("exactcreep", "derivations")
PACKAGE = Path(exactcreep.__file__).parent
ROOMS = (
    ("watch.preparation",),
    ("compiling",),
    ("model",),
    ("watch", "disorder"),
    ("laws",),
    ("motion",),
    ("solvers",),
    ("quasistatic",),
    ("solid", "pipeline"),
    ("scene",),
    ("studies",),
    ("figures",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
"""From the foundations up; rooms of one entry share a floor, and a module may have its own."""
FLOOR = {room: floor for floor, rooms in enumerate(ROOMS) for room in rooms}
FACES = {"commands", "cli", "__init__", "__main__"}
PUBLIC = {"exactcreep", *(f"exactcreep.{name}" for name in exactcreep.__all__)}
"""What a face may ask the package for, as everybody may."""
MODULES = {
    path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(PACKAGE.rglob("*.py"))
}
LAZY = {
    path.parent.relative_to(PACKAGE.parent).as_posix().replace("/", "."): {
        alias.asname: f"{node.module}"
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    for path in sorted(PACKAGE.glob("*/**/__init__.pyi"))
}
"""What packages of rooms import when it is first used: by package, name and module within it."""
UPWARDS = {("model/result.py", "exactcreep.figures.pictures")}
"""Imports against the stream: results, which draw themselves, wait for matplotlib only then."""


def room_of(module: str) -> str:
    """Return the room of a module, ``model/chain.py`` or ``model.chain.Chain``."""
    parts = module.removesuffix(".py").replace("/", ".").split(".")
    own = ".".join(parts[:2])
    return own if own in FLOOR else parts[0]


def imports(tree: ast.AST) -> Iterator[tuple[str, ast.stmt]]:
    """Yield the module that each import statement names, as from the root of the package."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield f"{node.module}.{alias.name}", node


def late_imports(tree: ast.AST) -> Iterator[str]:
    """Yield the module of every call of ``import_module`` that names it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            (named,) = node.args
            if isinstance(named, ast.Constant):
                yield named.value


def lazy_imports(tree: ast.AST) -> Iterator[str]:
    """Yield the modules of the attributes that are asked of packages in `LAZY`."""
    packages = {name.rpartition(".")[2]: name for name, _ in imports(tree) if name in LAZY}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            package = packages.get(node.value.id, "")
            if module := LAZY.get(package, {}).get(node.attr):
                yield f"{package}.{module}"


def for_types_only(tree: ast.Module) -> set[ast.stmt]:
    """Return the imports under ``if TYPE_CHECKING``."""
    found: set[ast.stmt] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            found |= {inner for inner in ast.walk(node) if isinstance(inner, ast.stmt)}
    return found


def test_a_room_imports_only_from_rooms_above_it() -> None:
    against = set()
    for module, tree in MODULES.items():
        room = room_of(module)
        if room == "__init__":
            continue
        assert room in FLOOR, f"{room} is a room that the house does not know"
        named = {name for name, _ in imports(tree)}
        for name in {*named, *late_imports(tree), *lazy_imports(tree)}:
            if room in FACES and name in PUBLIC:
                continue
            package, _, inside = name.partition(".")
            assert package != "derivations", "the package never imports its derivations"
            own = package == "exactcreep" and inside != "__version__"
            if own and FLOOR[room_of(inside)] > FLOOR[room]:
                against.add((module, name))
    assert against == UPWARDS


def test_no_module_waits_for_itself() -> None:
    """Within a room too, imports go one way, those that wait until they are needed too."""
    names = {module.removesuffix(".py").replace("/", "."): module for module in MODULES}
    needs: dict[str, set[str]] = {}
    for name, module in names.items():
        tree = MODULES[module]
        typed = for_types_only(tree)
        asked = {asked for asked, node in imports(tree) if node not in typed}
        asked |= {late for late in late_imports(tree) if (module, late) not in UPWARDS}
        asked |= {*lazy_imports(tree)}
        inside = {asked.removeprefix("exactcreep.") for asked in asked if "." in asked}
        needs[name] = ({*inside, *(one.rpartition(".")[0] for one in inside)} & {*names}) - {name}
    tuple(TopologicalSorter(needs).static_order())  # raises CycleError


def test_every_public_name_is_there_and_promised_to_type_checkers() -> None:
    stub = ast.parse(PACKAGE.joinpath("__init__.pyi").read_text(encoding="utf-8"))
    imported = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    public = set(exactcreep.__all__)
    promised = {alias.asname for node in imported for alias in node.names}
    assert promised == public - {"__version__"}
    assert public <= set(dir(exactcreep))
    assert all(getattr(exactcreep, name) is not None for name in public)
    with pytest.raises(AttributeError, match="velocity"):
        importlib.import_module("exactcreep").velocity  # noqa: B018


def test_no_two_modules_share_a_name() -> None:
    """But a figures/X or commands/X that draws or calls X, and the solver.py of two solvers."""
    faces = ("figures/", "commands/")
    named = Counter(
        Path(module).name
        for module in MODULES
        if not module.startswith(faces) and not module.endswith("__init__.py")
    )
    assert named.pop("solver.py") == 2
    assert {name for name, times in named.items() if times > 1} == set()


def private_names(tree: ast.Module) -> Iterator[str]:
    """Yield the private names of the package that a test imports, or takes from a module."""
    ours: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(OWN):
            ours |= {alias.asname or alias.name for alias in node.names}
            yield from (alias.name for alias in node.names if alias.name.startswith("_"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            private = node.attr.startswith("_") and not node.attr.startswith("__")
            if private and node.value.id in ours:
                yield f"{node.value.id}.{node.attr}"


def test_no_test_takes_a_private_name() -> None:
    for path in PACKAGE.parent.joinpath("tests").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assert [*private_names(tree)] == [], path
