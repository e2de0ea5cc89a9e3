"""Chains whose sliders or springs differ: what understands them answers, all else refuses them."""

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any

import pytest

import exactcreep
from exactcreep import (
    Chain,
    Cycles,
    Experiment,
    InputError,
    Path,
    Scene,
    Solid,
    State,
    creep,
    disorder,
    fate,
    intercept,
    laws,
    physical,
    plan,
    rearrange,
    survival,
    sweep,
    threshold,
)
from exactcreep.solvers.registry import SOLVERS

ALIKE: dict[str, Any] = {
    "n": 3, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": 0, "tan_alpha": "0.25"
}  # fmt: skip
UNLIKE: dict[str, dict[str, Any]] = {
    "friction": {"mu_d": ["0.5", "0.4", "0.5"]},
    "static friction": {"mu_s": ["0.6", "0.6", "0.7"]},
    "end_forces": {"end_forces": ("0.1", 0)},
    "expansion": {"expansion": [1, "0.5"]},
}
CYCLES = Cycles("0.002", 2)
VECTORS = Path([["0.002", 0], ["0.002", "0.001"], [0, 0]])


def _solid(chain: Chain) -> Solid:
    lead = {"length": 8, "section": 1, "mu_d": "0.5", "mu_s": "0.6", "material": "lead"}
    return dataclasses.replace(physical(tan_alpha="0.25", **lead), chain=chain)


def _scene(chain: Chain) -> Scene:
    cycles = {"kind": "cycles", "amplitude": "0.002", "cycles": 2}
    tables = {"chain": chain.parameters(), "drive": cycles, "run": {}}
    return Scene.from_mapping(tables)


def _drawn(chain: Chain) -> Chain:
    return Chain(**chain.parameters() | {"sigma_mu": "0.05"})


CALLS: dict[str, Callable[[Chain], Any]] = {
    **{f"creep {name}": lambda chain, name=name: creep(chain, CYCLES, solver=name)
       for name in SOLVERS},
    **{f"rearrange {name}": lambda chain, name=name: rearrange(
        chain, State.relaxed(chain), direction=1, solver=name)
       for name in SOLVERS if name != "sliding"},  # which has none
    "fate": lambda chain: fate(chain, "0.002", cycles=20),
    "survival": lambda chain: survival(chain, "0.002", starts=2, cycles=10),
    "intercept": lambda chain: intercept(_drawn(chain), cycles=400, points=8),
    "threshold": lambda chain: threshold(chain, after=2, digits=4, points=50),
    "plan": lambda chain: plan(chain, CYCLES),
    "sweep": lambda chain: sweep(_scene(chain)).compute(),
    "compare": lambda chain: exactcreep.compare(Experiment(chain, CYCLES), events=5),
    "Solid": _solid,
    "prediction": lambda chain: laws.prediction(chain, CYCLES),
    "prediction_of": lambda chain: laws.prediction_of(chain.parameters() | {"amplitude": 0.002}),
    "edges": laws.edges,
    "law_values": lambda chain: laws.law_values(laws.threshold_amplitude, chain.parameters()),
}  # fmt: skip
EVERYTHING = {"friction", "end_forces", "expansion"}
TAKEN: dict[str, set[str]] = {
    **{f"{call} {solver}": EVERYTHING for call in ("creep", "rearrange")
       for solver in ("exact", "reference", "mpmath", "certified", "verlet")},
    "compare": {"friction", "end_forces"},
    "fate": {"friction", "end_forces"},
    "survival": EVERYTHING,
    "threshold": {"friction", "end_forces"},
    "intercept": {"friction", "end_forces"},
    "edges": {"friction", "end_forces"},
    "creep sliding": {"friction", "end_forces"},
    "sweep": EVERYTHING,
    "prediction": EVERYTHING,
    "prediction_of": EVERYTHING,
}  # fmt: skip
"""What a function takes; another test holds its answer to an oracle."""


@pytest.mark.filterwarnings("ignore:a static coefficient was drawn")
@pytest.mark.parametrize("kind", UNLIKE)
@pytest.mark.parametrize("call", CALLS)
def test_an_unlike_chain_is_understood_or_refused(call: str, kind: str) -> None:
    chain = Chain(**ALIKE | UNLIKE[kind])
    if chain.unlike <= TAKEN.get(call, set()):
        CALLS[call](chain)
        return
    with pytest.raises(InputError) as refused:
        CALLS[call](chain)
    assert refused.value.field.rpartition(".")[2] in UNLIKE[kind]


OF_VECTORS: dict[str, Callable[[Chain], Any]] = {
    **{f"creep {name}": lambda chain, name=name: creep(chain, VECTORS, solver=name)
       for name in SOLVERS},
    "plan": lambda chain: plan(chain, VECTORS),
    "sweep": lambda chain: sweep([Experiment(chain, VECTORS)]),
    "compare": lambda chain: exactcreep.compare(Experiment(chain, VECTORS), events=5),
    "prediction": lambda chain: laws.prediction(chain, VECTORS),
    "creep from": lambda chain: creep(chain, CYCLES, start=_state(chain)),
    "fate from": lambda chain: fate(chain, "0.002", start=_state(chain)),
    "plan from": lambda chain: plan(chain, CYCLES, start=_state(chain)),
    **{f"rearrange {name}": lambda chain, name=name: rearrange(
        chain, _state(chain), direction=1, solver=name)
       for name in SOLVERS if name != "sliding"},
}  # fmt: skip
"""What takes a drive or a state, given those of springs with a dilation of their own."""
TAKES_VECTORS = {
    "sweep", "prediction", *(f"creep {name}" for name in SOLVERS if name != "sliding")
}  # fmt: skip


def _state(chain: Chain) -> State:
    return creep(chain, Path(VECTORS.theta[:1])).state


@pytest.mark.filterwarnings("ignore:a static coefficient was drawn")
@pytest.mark.parametrize("call", OF_VECTORS)
def test_a_dilation_of_each_spring_is_understood_or_refused(call: str) -> None:
    chain = Chain(**ALIKE | {"mu_s": "0.5" if "sliding" in call else "0.6"})
    if call in TAKES_VECTORS:
        OF_VECTORS[call](chain)
        return
    with pytest.raises(InputError) as refused:
        OF_VECTORS[call](chain)
    assert refused.value.field in {"drive.theta", "start.theta", "state.theta"}


def test_every_public_function_of_a_chain_is_asked() -> None:
    for name, public in vars(exactcreep).items():
        if inspect.isfunction(public) and "chain" in inspect.signature(public).parameters:
            assert name in {call.split()[0] for call in CALLS}


@pytest.mark.parametrize("kind", UNLIKE)
def test_a_uniform_chain_written_as_lists_is_the_same_chain(kind: str) -> None:
    listed = {"mu_d": ["0.5"] * 3, "mu_s": ["0.6"] * 3, "end_forces": (0, 0), "expansion": [1, 1]}
    same = Chain(**ALIKE | {name: listed[name] for name in UNLIKE[kind]})
    assert same == Chain(**ALIKE)
    assert same.parameters() == Chain(**ALIKE).parameters()
    assert not same.unlike


@pytest.mark.parametrize("kind", UNLIKE)
def test_an_unlike_chain_is_made_again_from_its_parameters_and_mirrored(kind: str) -> None:
    chain = Chain(**ALIKE | UNLIKE[kind])
    assert Chain(**chain.parameters()) == chain
    assert hash(Chain(**chain.parameters())) == hash(chain)
    assert chain.mirrored().mirrored() == chain != chain.mirrored()
    assert _scene(chain).experiment().chain == chain
    forces = State.relaxed(chain).forces(chain)
    assert (-State.relaxed(chain.mirrored()).forces(chain.mirrored())[::-1] == forces).all()


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"mu_d": ["0.5"]}, "mu_d"), ({"mu_s": []}, "mu_s"), ({"mu_d": ["0.5", -1, 0]}, "mu_d[1]"),
        ({"mu_s": ["0.6", "0.4", 1]}, "mu_s[1]"), ({"mu_d": ["0.5", "x", 0]}, "mu_d[1]"),
        ({"end_forces": [1]}, "end_forces"), ({"end_forces": "12"}, "end_forces"),
        ({"expansion": [1, 1, 1]}, "expansion"), ({"expansion": [1, None]}, "expansion[1]"),
        ({"l0": [1, 2, 3]}, "l0"), ({"mu_d": {"0.5", "0.4", "0.3"}}, "mu_d"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_list_names_its_entry(given: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as refused:
        Chain(**ALIKE | given)
    assert refused.value.field == field


def test_coefficients_are_drawn_about_the_mean_of_their_slider() -> None:
    means = ["0.6", "0.7", "0.65"]
    unlike = Chain(**ALIKE | {"mu_s": means, "sigma_mu": "0.01"})
    alike = Chain(**ALIKE | {"sigma_mu": "0.01"})
    for n, mean in enumerate(means, 1):
        drawn, other = (disorder.static_coefficient(chain, 4, n, 5) for chain in (unlike, alike))
        assert drawn - other == pytest.approx(float(mean) - 0.6, abs=1e-15)
        assert State.relaxed(unlike, seed=4).coefficients[n - 1] == pytest.approx(
            disorder.static_coefficient(unlike, 4, n, 0), abs=1e-15)  # fmt: skip
