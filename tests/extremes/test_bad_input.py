"""Bad input: whatever is handed in, the answer is a value or one clear sentence."""

from __future__ import annotations

import inspect
import itertools
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import exactcreep
from exactcreep import (
    Chain,
    Cycles,
    Experiment,
    GaussianSteps,
    InputError,
    State,
    Targets,
    TemperatureRecord,
    compare,
    creep,
    disorder,
    fate,
    laws,
    physical,
    rearrange,
    sweep,
    threshold,
)
from exactcreep.scene import Scene
from exactcreep.solvers.registry import SOLVERS

GOOD = {"n": 3, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
CHAIN = Chain(**GOOD)
RUN = Cycles("0.0005", 1)
ROOF = {"length": 3, "section": 1, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"}
SCENE = """
[chain]
n = 3
l0 = 1000
mu_d = 0.5
mu_s = 0.6
tan_alpha = 0.25

[drive]
kind = "cycles"
amplitude = 5e-4
cycles = 1
"""

STRANGE: list[Any] = [
    None, True, False, math.nan, math.inf, -math.inf, -0.0, 5e-324, 1.8e308, 10**400, 10**4999,
    "nan", "inf", "1/0", "1e9999999", "1e-5000", "0x10", "1_0", "\u0663", "\u00bd", "1e5000",
    [], {}, (), b"", b"3", 1j, object, np.array([]), np.array([1.0, 2.0]),
    Decimal("NaN"), Decimal("sNaN"), Decimal("-Infinity"), Decimal("1e-99999"),
]  # fmt: skip


class Unshown:
    """A value that has no text and cannot be compared."""

    def __repr__(self) -> str:
        raise RuntimeError("no text")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("no comparison")

    __hash__ = None  # type: ignore[assignment]


NESTED: list[Any] = []
NESTED.append(NESTED)
ODD: dict[str, Any] = {
    "no dimension": np.array(1.5), "two dimensions": np.ones((2, 2)), "empty": np.zeros((0, 3)),
    "objects": np.array([Unshown()], dtype=object), "masked": np.ma.array([1.0, 2.0], mask=[1, 0]),
    "all masked": np.ma.masked, "ragged": [[1], [2, 3]], "half ragged": [1, [2]],
    "letters": np.array(["a", "b"]), "a letter": np.array("a"), "complex": np.array([1j]),
    "fields": np.recarray(2, dtype=[("a", float)]), "no text": Unshown(), "listed": [Unshown()],
    "nested": NESTED, "endless": 10**5000, "endless ratio": Fraction(10**5000, 3),
    "no time": np.timedelta64("NaT"), "seconds": np.timedelta64(1, "s"), "set": {1}, "bytes": b"ab",
    "escape": "\x1b[2J", "half a letter": "\ud800", "slice": slice(1), "class": Fraction,
}  # fmt: skip
FUZZ = settings(max_examples=12, deadline=None, derandomize=True,
                suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip


def require_sentence(call: Callable[[], Any]) -> None:
    """Fail unless a call is accepted, or refused in one clear sentence."""
    try:
        call()
    except InputError as error:
        refused = error
    else:
        return
    assert re.match(re.escape(refused.name) + " = .*: .", told := str(refused))
    assert "\n" not in told
    assert len(told) < 1000


REST = State.relaxed(CHAIN)
EXPERIMENT = Scene.from_text(SCENE).experiment()
CALLS: list[Callable[[Any, Any], Any]] = [
    *(lambda a, b, name=name: Chain(**GOOD | {name: a}) for name in GOOD),
    lambda a, b: Targets([0, a, b]), lambda a, b: State.prepared(CHAIN, [a, b]),
    lambda a, b: State.prepared(CHAIN, [0, 0], theta=a, seed=b),
    lambda a, b: State.perturbed(CHAIN, a, start_seed=b),
    lambda a, b: creep(a, RUN), lambda a, b: creep(CHAIN, a),
    lambda a, b: rearrange(a, REST, direction=1), lambda a, b: rearrange(CHAIN, a, direction=1),
    lambda a, b: rearrange(CHAIN, REST, direction=a),
    lambda a, b: rearrange(CHAIN, REST, direction=1, seed=a),
    lambda a, b: Scene.from_mapping({"chain": a}), lambda a, b: physical(**ROOF, material=a),
    lambda a, b: Experiment(CHAIN, RUN, record=a), lambda a, b: Experiment(CHAIN, RUN, options=a),
    lambda a, b: sweep([EXPERIMENT], executor=1 if a is None else a),
    lambda a, b: threshold(CHAIN, kind=a), lambda a, b: fate(CHAIN, a, solver=b),
    lambda a, b: compare(EXPERIMENT, seeds=a, events=0),  # neither runs
    lambda a, b: compare(EXPERIMENT, seeds=0, events=b),
    lambda a, b: sweep(None if isinstance(a, (bool, int)) else a),
    lambda a, b: TemperatureRecord(a, b, 20), lambda a, b: TemperatureRecord("none.csv", a, b),
    lambda a, b: TemperatureRecord("none.csv", 1, 20, unit=a, delimiter=b),
    lambda a, b: creep(CHAIN, RUN, progress=not callable(a) and a),
    *(lambda a, b, name=name: creep(CHAIN, RUN, **{name: a})
      for name in ("seed", "solver", "start", "record", "burn_in", "max_events", "max_seconds",
                   "accuracy", "question", "every", "nonsense")),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
@pytest.mark.filterwarnings("ignore::exactcreep.results.AccuracyWarning")
@pytest.mark.parametrize("odd", [*ODD.values(), *STRANGE], ids=[*ODD, *range(len(STRANGE))])
def test_a_value_of_any_type_is_used_or_refused_in_a_sentence(odd: Any) -> None:
    for call, pair in itertools.product(CALLS, ((odd, odd), (odd, 1), (1, odd))):
        require_sentence(lambda call=call, pair=pair: call(*pair))


def public() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield every public function, class, and maker of a class; not enumerations."""
    for module in (exactcreep, laws, disorder):
        for name in module.__all__:
            made = getattr(module, name)
            plain = not isinstance(made, type) or not issubclass(made, (Enum, BaseException))
            if not callable(made) or not plain:
                continue
            yield name, made
            for maker, of in vars(made).items():
                if isinstance(of, classmethod) and maker[0] != "_":
                    yield f"{name}.{maker}", getattr(made, maker)


PUBLIC = dict(public())


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_callable_uses_or_refuses_any_value_in_a_sentence(name: str) -> None:
    call, known = PUBLIC[name], {"chain": CHAIN, "drive": RUN, "state": REST}
    needed = [p for p in inspect.signature(call).parameters.values() if p.default is p.empty]
    needed = [p for p in needed if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    for odd, some in itertools.product([*ODD.values(), None, math.nan, 2**63, "x"], (known, {})):
        if some and all(p.name in some for p in needed):
            continue
        given = {p: some.get(p.name, odd) for p in needed}
        places = [value for p, value in given.items() if p.kind != p.KEYWORD_ONLY]
        words = {p.name: value for p, value in given.items() if p.kind == p.KEYWORD_ONLY}
        require_sentence(lambda places=places, words=words: call(*places, **words))


@pytest.mark.parametrize("field", ["tensions", "displacements", "coefficients", "theta"])
def test_a_state_that_is_not_finite_starts_no_run(field: str) -> None:
    given: Any = getattr(REST, field)
    value = math.nan if field == "theta" else np.array([-math.inf, *given[1:]])
    for wrong in (value, np.array(value, dtype=object)[()]):
        bad = replace(REST, **{field: wrong})
        for solver in SOLVERS:
            with pytest.raises(InputError, match=rf"^state\.{field} = "):
                creep(CHAIN, RUN, start=bad, solver=solver)
        with pytest.raises(InputError, match=rf"^state\.{field} = "):
            rearrange(CHAIN, bad, direction=1)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_drive_beyond_the_largest_float_is_refused(solver: str) -> None:
    too_far = Cycles("1e306", 2), GaussianSteps("2e304", 2), Targets(["0.001", "-1e400"])
    for drive in too_far:
        with pytest.raises(InputError, match="largest float"):
            creep(CHAIN, drive, solver=solver)


@FUZZ
@given(st.lists(st.tuples(st.integers(0, len(SCENE)), st.integers(0, 6),
                          st.text(max_size=6) | st.sampled_from(
                              ["[", "]]", '"""', "nan", "inf", "-", "1e999999", "= ", "\n", "{}",
                               "true", "[vary]\n", "chain.n = [1, 2]\n", "\0", "9" * 50])),
                min_size=1, max_size=4))  # fmt: skip
def test_a_scene_spoiled_anywhere_makes_members_or_one_sentence(changes: list[Any]) -> None:
    text = SCENE
    for place, drop, put in changes:
        text = text[:place] + put + text[place + drop :]

    def read() -> None:
        scene = Scene.from_text(text)
        for chosen in scene.settings()[:3]:
            scene.experiment(chosen)

    require_sentence(read)
