"""A subject's check with one premise changed: which of its claims are refuted then.

The module is executed again from its source with a line changed, without its entries and without
what is verified over cases, which takes long and proves nothing here. All claims are decided, not
only those before the first that fails. What does not feel the change is decided once for all
mutants: the slow answers of SymPy are kept.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any

import sympy as sp

from derivations import proof
from derivations.proof import Claim, Verification

_SLOW = ("simplify", "solve", "dsolve", "rsolve", "integrate", "limit", "summation", "cancel",
         "together", "factor", "combsimp")  # fmt: skip


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that answers the same question once; lists and mappings are asked anew."""
    kept: dict[Any, Any] = {}

    def answer(*args: Any, **kwargs: Any) -> Any:
        key = (args, tuple(sorted(kwargs.items(), key=lambda item: item[0])))
        try:
            if key in kept:
                return kept[key]
        except TypeError:
            return function(*args, **kwargs)
        kept[key] = function(*args, **kwargs)
        return kept[key]

    return answer


_SYMPY = SimpleNamespace(**{name: getattr(sp, name) for name in dir(sp)})
for _name in _SLOW:
    setattr(_SYMPY, _name, remembered(getattr(sp, _name)))
_vanishes = remembered(proof.vanishes)
_trigonometric: dict[str, Callable[..., Any]] = {}


class Collecting(Verification):
    """A verification that goes on after what is refuted."""

    def identity(self, text: str, expression: Any, how: str = "identity") -> None:
        """Note whether an expression vanishes."""
        self.proved(text, _vanishes(expression), how)

    def proved(self, text: str, truth: bool, how: str) -> None:
        """Note whether a statement is decided to be true."""
        self.claims.append(Claim(text, "proved" if bool(truth) else "refuted", how))

    @property
    def refuted(self) -> set[str]:
        """What does not hold."""
        return {claim.text for claim in self.claims if claim.standing == "refuted"}

    @property
    def all_proved(self) -> set[str]:
        """What is called proved, whether it holds or not."""
        return {claim.text for claim in self.claims}


def _is_call(statement: ast.stmt, method: str) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Call)
        and isinstance(statement.value.func, ast.Attribute)
        and statement.value.func.attr == method
    )


def _proves(statement: ast.stmt) -> bool:
    """Return whether a statement may prove something: it hands the verification on, or calls it."""
    names = [node for node in ast.walk(statement) if isinstance(node, ast.Name)]
    return any(name.id == "v" for name in names)


def _stored(statement: ast.stmt) -> set[str]:
    """Return the names that a statement gives a value, or whose item it does."""
    found = set()
    for node in ast.walk(statement):
        owner = node.value if isinstance(node, ast.Subscript) else node
        if isinstance(getattr(node, "ctx", None), ast.Store) and isinstance(owner, ast.Name):
            found.add(owner.id)
    return found


def _without_cases(function: ast.FunctionDef) -> None:
    """Take out of a check what is verified or argued, and what only serves that."""
    kept: list[ast.stmt] = []
    used: set[str] = set()
    for statement in reversed(function.body):
        if _is_call(statement, "verified") or _is_call(statement, "argued"):
            continue
        named = {statement.name} if isinstance(statement, ast.FunctionDef) else _stored(statement)
        if _proves(statement) or isinstance(statement, ast.Return) or named & used:
            kept.append(statement)
            used |= {node.id for node in ast.walk(statement) if isinstance(node, ast.Name)}
    function.body = kept[::-1]


def _is_check(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.FunctionDef) and (
        statement.name == "check" or any(arg.arg == "v" for arg in statement.args.args)
    )


@cache
def _derived(derive: Callable[[], Any]) -> Callable[[], Any]:
    """Return a subject's derivation that is made once."""
    return cache(derive)


@cache
def _checks(source: str) -> Any:
    """Return the compiled part of a module that its proofs need."""
    tree = ast.parse(source)
    names = {"ENTRIES", "_R", "_TWO", "_CHAIN", "_GAUSS", "_exact_velocity", "_C", "_MARGIN_2"}
    tree.body = [one for one in tree.body if not (_stored(one) & names and not _proves(one))]
    for statement in tree.body:
        if _is_check(statement):
            _without_cases(statement)
    return compile(ast.fix_missing_locations(tree), "<mutant>", "exec")


def checked(module: ModuleType, source: str) -> Collecting:
    """Return what a module's check makes of a changed source of it."""
    space: dict[str, Any] = {"__name__": module.__name__}
    exec(_checks(source), space)
    if space.get("sp") is sp:
        space["sp"] = _SYMPY
    if "trigonometric" in space:
        own = _trigonometric.setdefault(module.__name__, remembered(module.trigonometric))
        space["trigonometric"] = own
    if "vanishes" in space:
        space["vanishes"] = _vanishes
    for name, value in list(space.items()):  # what other subjects derive is not changed
        if isinstance(value, ModuleType) and hasattr(value, "derive"):
            space[name] = SimpleNamespace(**vars(value) | {"derive": _derived(value.derive)})
        elif getattr(value, "__name__", "") == "derive" and value.__module__ != module.__name__:
            space[name] = _derived(value)
    found = Collecting(module.__name__)
    space["check"](found, space["derive"]().results)
    return found
