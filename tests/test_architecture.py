"""The house: rooms, and what each may know."""

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import exactcreep

PACKAGE = Path(exactcreep.__file__).parent
ROOMS = (
    ("compiling",),
    ("model",),
    ("interrupts", "limits", "progress", "display", "disorder"),
    ("laws",),
    ("motion",),
    ("solvers",),
    ("quasistatic",),
    ("solid",),
    ("scene",),
    ("studies",),
    ("figures",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
"""From the foundations up; rooms of one entry share a floor."""
FLOOR = {room: floor for floor, rooms in enumerate(ROOMS) for room in rooms}
FACES = {"commands", "cli", "__init__", "__main__"}
MODULES = sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    inside = path.relative_to(PACKAGE)
    return inside.parts[0].removesuffix(".py")


def imports(tree: ast.AST) -> Iterator[tuple[str, ast.stmt]]:
    """Yield the module that each import statement names, as from the root of the package."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            for alias in node.names:
                yield f"{node.module}.{alias.name}", node


def for_types_only(tree: ast.Module) -> set[ast.stmt]:
    """Return the imports under ``if TYPE_CHECKING``."""
    found: set[ast.stmt] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            found |= {inner for inner in ast.walk(node) if isinstance(inner, ast.stmt)}
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_room_imports_only_from_rooms_above_it(path: Path) -> None:
    room = room_of(path)
    if room == "__init__":
        return
    assert room in FLOOR, f"{room} is a room that the house does not know"
    for name, node in imports(ast.parse(path.read_text(encoding="utf-8"))):
        parts = name.split(".")
        if parts[0] == "derivations":
            pytest.fail("the package never imports its derivations")
        if parts[0] == "exactcreep" and parts[1] != "__version__":
            assert FLOOR[parts[1]] <= FLOOR[room], f"line {node.lineno}: {room} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_stand_at_the_top_except_in_the_faces(path: Path) -> None:
    if room_of(path) in FACES:
        return
    tree = ast.parse(path.read_text(encoding="utf-8"))
    at_top = set(tree.body) | for_types_only(tree)
    inside = {node.lineno for _, node in imports(tree) if node not in at_top}
    allowed = {
        # an intrinsic runs inside the compiler, and needs its types only there
        node.lineno
        for name, node in imports(tree)
        if name.startswith("llvmlite.")
    }
    if path.name == "style.py":
        return
    assert not inside - allowed


def test_no_module_is_a_drawer_for_odds_and_ends() -> None:
    drawers = {"utils", "util", "common", "helpers", "helper", "misc", "tools", "core", "base"}
    assert not drawers & {path.stem for path in MODULES}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_names_say_what_a_thing_is(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            name = node.name.lstrip("_")
            assert not name.startswith(("get_", "compute_", "do_"))
            assert not name.endswith(("Manager", "Helper"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_every_module_begins_with_a_sentence(path: Path) -> None:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert text is not None
    assert text.splitlines()[0].endswith((".", ":", "?"))


def test_every_public_name_is_there_and_promised_to_type_checkers() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    promised = {
        alias.asname
        for node in for_types_only(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    public = set(exactcreep.__all__)
    assert promised == public - {"__version__"}
    assert public <= set(dir(exactcreep))
    for name in public:
        assert getattr(exactcreep, name) is not None
    wanted = {"Chain", "State", "Cycles", "GaussianSteps", "Path", "creep", "Creep", "rearrange",
              "iterate", "Event", "EventKind", "Evidence", "Outcome", "InputError", "disorder",
              "laws"}  # fmt: skip
    assert wanted <= public
    with pytest.raises(AttributeError, match="velocity"):
        importlib.import_module("exactcreep").velocity  # noqa: B018


def test_precision_is_never_a_global() -> None:
    for path in MODULES:
        if path.relative_to(PACKAGE).as_posix() == "motion/arithmetic.py":
            continue  # python-flint has no other precision: it is set and put back there
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            targets = node.targets if isinstance(node, ast.Assign) else []
            for target in targets:
                shown = ast.unparse(target)
                assert shown not in {"mp.dps", "mp.prec", "ctx.prec", "flint.ctx.prec", "ctx.dps"}
            if isinstance(node, ast.Call):
                assert ast.unparse(node.func) not in {"np.seterr", "numpy.seterr"}
