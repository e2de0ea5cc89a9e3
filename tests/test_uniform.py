"""Chains whose sliders or springs differ: what understands them answers, all else refuses them."""

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any

import pytest

import exactcreep
import exactcreep as ec
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
CYCLES = ec.Cycles("0.002", 2)
VECTORS = ec.Targets([["0.002", 0], ["0.002", "0.001"], [0, 0]])


def _solid(chain: ec.Chain) -> ec.results.Solid:
    lead = {"length": 8, "section": 1, "mu_d": "0.5", "mu_s": "0.6", "material": "lead"}
    return dataclasses.replace(ec.physical(tan_alpha="0.25", **lead), chain=chain)


def _without_slips(chain: ec.Chain) -> ec.Chain:
    return ec.Chain(**chain.parameters() | {"mu_s": chain.parameters()["mu_d"]})


def _drawn(chain: ec.Chain) -> ec.Chain:
    return ec.Chain(**chain.parameters() | {"sigma_mu": "0.05"})


Call = Callable[[ec.Chain, Any, ec.State | None], Any]
OF_DRIVES: dict[str, Call] = {
    **{f"creep {name}": lambda chain, drive, start, name=name: ec.creep(
        chain, drive, start=start, solver=name) for name in SOLVERS},
    "sweep": lambda chain, drive, start: ec.sweep([ec.Experiment(chain, drive)]),
    "compare": lambda chain, drive, start: ec.compare(ec.Experiment(chain, drive), events=5),
    "prediction": lambda chain, drive, start: ec.laws.prediction(chain, drive),
}  # fmt: skip
OF_STATES: dict[str, Call] = {
    **{f"rearrange {name}": lambda chain, drive, start, name=name: ec.rearrange(
        chain, start or ec.State.relaxed(chain), direction=1, solver=name)
       for name in SOLVERS if name != "sliding"},  # which has none
    "fate": lambda chain, drive, start: ec.fate(chain, "0.002", start=start, cycles=20),
}  # fmt: skip
CALLS: dict[str, Call] = OF_DRIVES | OF_STATES | {
    "survival": lambda chain, *_: ec.survival(chain, "0.002", starts=2, cycles=10),
    "threshold intercept": lambda chain, *_: ec.threshold(_drawn(chain), cycles=400, points=8),
    "threshold": lambda chain, *_: ec.threshold(chain, after=2, digits=4, points=50),
    "threshold sliding": lambda chain, *_: ec.threshold(_without_slips(chain), digits=4),
    "Solid": lambda chain, *_: _solid(chain),
    "prediction_of": lambda chain, *_: ec.laws.prediction_of(
        chain.parameters() | {"amplitude": 0.002}),
    "edges": lambda chain, *_: ec.laws.edges(chain),
    "law_values": lambda chain, *_: ec.laws.law_values(
        ec.laws.threshold_amplitude, chain.parameters()),
}  # fmt: skip
VECTOR, START = "a dilation of each spring", "a start after such dilations"
FIELDS = {VECTOR: {"drive.theta"}, START: {"start.theta", "state.theta"}}
EVERYTHING = {"friction", "end_forces", "expansion"}
TAKEN: dict[str, set[str]] = {
    **{call: {*EVERYTHING, VECTOR} for call in ("sweep", "prediction")},
    **{f"{call} {solver}": {*EVERYTHING, VECTOR} for call in ("creep", "rearrange")
       for solver in ("exact", "certified", "verlet")},
    **dict.fromkeys(("survival", "fate", "threshold", "edges", "prediction_of"), EVERYTHING),
    **{call: {"friction", "end_forces"}
       for call in ("compare", "threshold intercept", "creep sliding", "threshold sliding")},
}  # fmt: skip
"""What a function takes; another test holds its answer to an oracle."""
CASES = [
    *((call, kind) for call in CALLS for kind in UNLIKE),
    *((call, VECTOR) for call in OF_DRIVES),
    *((call, START) for call in (*OF_STATES, "creep exact")),
]


@pytest.mark.filterwarnings("ignore:a static coefficient was drawn")
@pytest.mark.parametrize(("call", "kind"), CASES)
def test_what_differs_from_slider_to_slider_is_understood_or_refused(call: str, kind: str) -> None:
    slides = kind in FIELDS and "sliding" in call
    differs = {"mu_s": "0.5" if slides else "0.6"} | UNLIKE.get(kind, {})
    chain, drive, start = ec.Chain(**ALIKE | differs), CYCLES, None
    if kind == VECTOR:
        drive = VECTORS
    if kind == START:
        start = ec.creep(chain, ec.Targets(VECTORS.theta[:1])).state
    if (chain.unlike or {kind}) <= TAKEN.get(call, set()):
        CALLS[call](chain, drive, start)
        return
    with pytest.raises(ec.InputError) as refused:
        CALLS[call](chain, drive, start)
    field = refused.value.name
    assert field in FIELDS[kind] if kind in FIELDS else field.rpartition(".")[2] in UNLIKE[kind]


def test_every_public_function_of_a_chain_is_asked() -> None:
    for name, public in vars(exactcreep).items():
        if inspect.isfunction(public) and "chain" in inspect.signature(public).parameters:
            assert name in {call.split()[0] for call in CALLS}


@pytest.mark.parametrize("kind", UNLIKE)
def test_a_uniform_chain_written_as_lists_is_the_same_chain(kind: str) -> None:
    listed = {"mu_d": ["0.5"] * 3, "mu_s": ["0.6"] * 3, "end_forces": (0, 0), "expansion": [1, 1]}
    same = ec.Chain(**ALIKE | {name: listed[name] for name in UNLIKE[kind]})
    assert same == ec.Chain(**ALIKE)
    assert same.parameters() == ec.Chain(**ALIKE).parameters()
    assert not same.unlike


@pytest.mark.parametrize("kind", UNLIKE)
def test_an_unlike_chain_is_made_again_from_its_parameters_and_mirrored(kind: str) -> None:
    chain = ec.Chain(**ALIKE | UNLIKE[kind])
    drive = {"kind": "cycles", "amplitude": "0.002", "cycles": 1}
    scene = ec.Scene.from_mapping({"chain": chain.parameters(), "drive": drive})
    for again in (ec.Chain(**chain.parameters()), scene.experiment().chain):
        assert (again, hash(again)) == (chain, hash(chain))
    mirrored = chain.mirrored()
    assert mirrored.mirrored() == chain != mirrored
    forces = [ec.State.relaxed(one).forces(one) for one in (chain, mirrored)]
    assert (-forces[1][::-1] == forces[0]).all()


def test_coefficients_are_drawn_about_the_mean_of_their_slider() -> None:
    means = ["0.6", "0.7", "0.65"]
    unlike = ec.Chain(**ALIKE | {"mu_s": means, "sigma_mu": "0.01"})
    alike = ec.Chain(**ALIKE | {"sigma_mu": "0.01"})
    start = ec.State.relaxed(unlike, seed=4).coefficients
    for n, mean in enumerate(means, 1):
        for k in (0, 5):
            drawn, other = (ec.disorder.static_coefficient(one, 4, n, k) for one in (unlike, alike))
            assert drawn - other == pytest.approx(float(mean) - 0.6, abs=1e-15)
            assert k or start[n - 1] == drawn
