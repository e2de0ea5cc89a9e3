"""What the model refuses: the sentence names the field, and the value, and says what is allowed."""

import gzip
import math
import pickle
from decimal import Decimal
from pathlib import Path as File

import numpy as np
import pytest

import exactcreep as ec
from exactcreep import Chain, Cycles, GaussianSteps, InputError, State, Targets, disorder
from exactcreep.model.numbers import exact_number, refusing, whole_number
from exactcreep.model.user_files import content_of, text_of, unpacked
from exactcreep.solvers import Verlet

PAPER = {"n": 3, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
CHAIN = Chain(**PAPER)
REST = {"tensions": [0, 0], "displacements": [0, 0, 0], "coefficients": [0.6, 0.6, 0.6],
        "draws": [1, 1, 1], "theta": 0.0}  # fmt: skip
NAN, INF = math.nan, math.inf


def refusal(make, *given, **named) -> InputError:
    """Return the refusal of a call, which is one sentence of a bearable length."""
    with pytest.raises(InputError) as caught:
        make(*given, **named)
    sentence = str(caught.value)
    assert sentence.startswith(f"{caught.value.name} = ")
    assert "must" in sentence or "beyond" in sentence
    assert "\n" not in sentence
    assert len(sentence) < 250
    return caught.value


@pytest.mark.parametrize(
    "value",
    [
        NAN, -INF, True, np.bool_(False), None, [], b"1", "", "0x10", "1/0", "nan", "1e6000",
        "1" * 10_001, Decimal("sNaN"), 1j,
    ],
)  # fmt: skip
def test_what_is_no_finite_number(value):
    assert refusal(exact_number, value, "mu_s").name == "mu_s"


@pytest.mark.parametrize("value", [0, 11, 1.5, "x", True, INF])
def test_a_whole_number_out_of_its_range(value):
    refused = refusal(whole_number, value, "n", least=1, most=10)
    assert refused.allowed == "must be a whole number, at least 1 and at most 10"


CHAINS = [
    ("n", 0), ("n", 1_000_001), ("l0", 0), ("l0", "1e400"), ("mu_d", "-0.1"), ("mu_s", "0.4"),
    ("sigma_mu", -1), ("sigma_mu", 1e308), ("tan_alpha", NAN), ("mu_d", ["0.5"]),
    ("end_forces", "12"), ("expansion", [1, 1, 1]), ("l0", [1, 2, 3]),
]  # fmt: skip
STATES = [
    ("tensions", ["0.1", "0.2"]), ("tensions", [0.0]), ("displacements", np.zeros((3, 1))),
    ("coefficients", {0.6}), ("draws", [1.5, 1, 1]), ("draws", [0, 1, 1]),
    ("draws", [2**63 - 1, 1, 1]), ("draws", [True, True, True]), ("theta", "0.1"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("make", "given", "field"),
    [
        *((Chain, PAPER | {field: value}, field) for field, value in CHAINS),
        *((State, REST | {field: value}, f"state.{field}") for field, value in STATES),
        (Chain, PAPER | {"mu_d": ["0.5", -1, 0]}, "mu_d[1]"),
        (Chain, PAPER | {"mu_s": ["0.6", "0.4", 1]}, "mu_s[1]"),
        (Cycles, (-1, 3), "amplitude"),
        (Cycles, ("0.1", 0), "cycles"),
        (GaussianSteps, (-0.1, 3), "sigma_theta"),
        (GaussianSteps, (0.1, 10**13), "steps"),
        (Targets, ([],), "theta"),
        (Targets, ([0.1, "warm"],), "theta[1]"),
        (disorder.dilations, (GaussianSteps("0.1", 100), 0, 2**62 + 1, 1), "first"),
        (disorder.static_coefficient, (CHAIN, 2**64, 1, 0), "seed"),
        (disorder.static_coefficient, (CHAIN, 0, 0, 0), "n"),
        (disorder.static_coefficient, (CHAIN, 0, 1, -1), "k"),
        (State.prepared, (CHAIN, [1, 2, 3]), "tensions"),
        (State.prepared, (CHAIN, [0, "x"]), "tensions[1]"),
        (State.prepared, (CHAIN, ["1e400", 0]), "tensions[0]"),
    ],
)
def test_what_cannot_be_is_refused_by_its_field(make, given, field):
    refused = refusal(make, **given) if isinstance(given, dict) else refusal(make, *given)
    assert refused.name == field


def test_a_refusal_survives_pickling():
    error = pickle.loads(pickle.dumps(InputError("n", 0, "must be at least 1")))
    assert (error.name, error.value, str(error)) == ("n", 0, "n = 0: must be at least 1")


def test_a_file_is_read_and_unpacked_up_to_a_size_to_the_byte(tmp_path: File) -> None:
    whole, path = bytes(range(256)) * 4096, tmp_path / "a"
    more, most = whole + b"x", len(whole)
    assert unpacked(gzip.compress(whole), "file", "a", most) == whole
    assert unpacked(more, "file", "a", most) == more  # not packed
    path.write_bytes(whole)
    assert content_of(path, "file", most) == whole
    path.write_bytes(more)
    for read in (
        lambda: content_of(path, "file", most),
        lambda: unpacked(gzip.compress(more), "file", "a", most),
    ):
        with pytest.raises(InputError, match="must have at most 1 MiB"):
            read()
    with pytest.raises(InputError, match="line 2 holds another byte"):
        text_of("Tag\nMärz".encode("latin-1"), "file", "a")


LEVEL = {name: value for name, value in PAPER.items() if name not in ("tan_alpha", "sigma_mu")}
ROOF = {"length": 8, "section": "0.003", "mu_d": "0.6", "mu_s": "0.7", "material": "lead"}
DRIVE = Cycles("0.005", 5)


@pytest.mark.parametrize(
    ("mistaken", "mend"),
    [
        (lambda: Chain(**LEVEL, alpha=14), "is the slope, the tangent of the angle: 0.249"),
        (lambda: ec.threshold(n=3), r"n = 3: belongs to a chain: threshold\(Chain\(n=3, \.\.\.\)"),
        (lambda: ec.creep(DRIVE, n=3), r"creep\(Chain\(n=3"),
        (lambda: Chain(**PAPER | {"mu_s": [0.6] * 9}), "numbers, of each slider"),
        (lambda: ec.physical(**ROOF, tan_alpha=1).creep(DRIVE, time_unit=9), "has to exceed"),
        (lambda: ec.creep(CHAIN, DRIVE, seed=None), "no run is random; default 0"),
    ],
)
def test_a_mistake_that_everybody_makes_is_answered_with_its_mend(mistaken, mend):
    with pytest.raises(InputError, match=mend):
        mistaken()


@pytest.mark.parametrize(
    ("implausible", "said"),
    [
        (lambda: Chain(**LEVEL, tan_alpha=-4), "tan_alpha = -4: a slope of 76 degrees"),
        (lambda: Chain(**PAPER | {"mu_s": 11}), "mu_s = 11: .* between 0.1 and 1"),
        (lambda: Chain(**PAPER | {"sigma_mu": "0.6"}), "sigma_mu = 0.6: .* less than 0.1"),
        (lambda: ec.physical(**ROOF, tan_alpha="0.3", kappa="0.0011"), "= 0.0011: .* per kelvin"),
        (lambda: ec.Experiment(CHAIN, Cycles(2, 1)), "theta.* reaches 1"),
        (lambda: ec.Experiment(Chain(**PAPER | {"n": 600_000}), DRIVE), "= 600000: .* of memory"),
        (lambda: Verlet(dt=8e-7), "steps = 1.25e.0?6: "),
    ],
)
def test_what_is_implausible_is_remarked_in_one_place(implausible, said):
    with pytest.warns(ec.results.PhysicsWarning, match=said):
        implausible()


def test_a_defect_of_a_law_is_no_mistake_of_its_user() -> None:
    @refusing
    def law(n, mu_d):
        return {3: mu_d}[n]

    with pytest.raises(KeyError):
        law(n=2, mu_d=0.5)
    with pytest.raises(InputError, match="n = "):
        law(n=[], mu_d=0.5)
