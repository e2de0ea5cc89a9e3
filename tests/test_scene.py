"""Scenes: exact numbers, refused names, members, and starts."""

from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from exactcreep import Chain, Cycles, GaussianSteps, InputError, State
from exactcreep.quasistatic.experiment import DRIVES
from exactcreep.scene import Literal, Scene, builtin_scenes, load_scene, parsed_value

TEXT = """
[chain]
n = 3
l0 = 1_000.0
mu_d = 0.5
mu_s = "3/5"
tan_alpha = 0.1

[drive]
kind = "cycles"
amplitude = 1e-3
cycles = 5
"""


@pytest.mark.filterwarnings("ignore:in .*the minimum is above the maximum on 1 of 52503 days")
def test_every_built_in_scene_has_a_title_and_members() -> None:
    assert {"two-sliders-trace", "six-sliders-cycles", "chain-jumps"} <= set(builtin_scenes())
    for name in builtin_scenes():
        scene = load_scene(name)
        assert scene.title
        assert scene.experiment(scene.settings()[0]).drive.target_count > 0


def test_settings_reach_the_experiment_and_another_kind_of_drive_replaces_the_table() -> None:
    scene = load_scene("six-sliders-cycles").with_settings(
        {"chain.n": 8, "drive.amplitude": Literal("0.02"), "run.seed": 7, "run.record": ["slips"]}
    )
    experiment = scene.experiment()
    assert (experiment.chain.n, experiment.drive) == (8, Cycles("0.02", 1000))
    assert (experiment.seed, experiment.record) == (7, ("slips",))
    perturbed = scene.with_settings({"run.start.size": Literal("1e-6"), "run.start.seed": 4})
    start = State.perturbed(experiment.chain, "1e-6", start_seed=4, seed=7)
    assert perturbed.experiment().initial == start
    random = {"drive.sigma_theta": Literal("0.01"), "drive.kind": "gaussian", "drive.steps": 9}
    assert scene.with_settings(random).experiment().drive == GaussianSteps("0.01", 9)


def test_decimals_are_read_as_they_are_written_and_the_first_key_varies_slowest() -> None:
    start = '[run]\nstart = { tensions = [0.1, "1/3"], theta = 0.001 }\n'
    text = TEXT + '[vary]\nchain.l0 = [1, 1_000.0]\n"drive.amplitude" = [0.001, 1e-3]\n' + start
    members = list(Scene.from_text(text).members())
    assert [tuple(m.settings.values()) for m in members] == [
        (1, "0.001"), (1, "1e-3"), ("1_000.0", "0.001"), ("1_000.0", "1e-3"),
    ]  # fmt: skip
    last = members[-1].experiment
    assert last.chain == Chain(3, 1000, "1/2", "3/5", tan_alpha=Fraction(1, 10))
    assert last.drive == Cycles(Fraction(1, 1000), 5)
    assert last.initial.tensions.tolist() == [Fraction(1, 10), Fraction(1, 3)]
    assert last.initial.theta == Fraction(1, 1000)


def test_a_scene_names_the_temperatures_of_places_along_its_chain(tmp_path: Path) -> None:
    (tmp_path / "pipe.csv").write_text("time,in,out\n0,30,10\n1,50,10\n2,10,10\n")
    text = "chain = { n = 4, l0 = 1000, mu_d = 0.5, mu_s = 0.6, tan_alpha = 0 }\n"
    text += 'drive = { kind = "record", file = "pipe.csv", kappa = 1e-5, T0 = 10 }\n'
    scene = Scene.from_text(text, folder=tmp_path)
    for columns, expected in (
        (["in", "out"], [[30, 20, 10], [50, 30, 10], [10, 10, 10]]),
        (["out", "out", "in"], [[10, 10, 30], [10, 10, 50], [10, 10, 10]]),
    ):
        drive: Any = scene.experiment({"drive.temperature_column": columns}).drive
        assert drive.temperatures.tolist() == expected
    for wrong in ([], ["in"] * 4, ["in", "middle"], ["in", 2]):
        assert field_of(scene, {"drive.temperature_column": wrong}) == "drive.temperature_column"


def field_of(scene: Scene, settings: dict[str, Any]) -> str:
    """Return the field by which a scene with these settings is refused."""
    with pytest.raises(InputError) as refused:
        scene.with_settings(settings).experiment()
    return refused.value.name


def test_a_record_is_looked_for_beside_the_scene_and_refused_by_key(tmp_path: Path) -> None:
    (tmp_path / "roof.csv").write_text("time,temperature\n0,20\n1,30\n2,15.5\n")
    drive = '[drive]\nkind = "record"\nfile = "roof.csv"\nkappa = 2.9e-5\nT0 = 20\n'
    path = tmp_path / "roof.toml"
    path.write_text(TEXT.partition("[drive]")[0] + drive)
    scene = load_scene(path)
    assert scene.experiment().drive.exact_target(3) == Fraction("2.9e-5") * Fraction("-4.5")
    assert field_of(scene, {"drive.file": "elsewhere.csv"}) == "drive.file"
    path.write_text(path.read_text().replace("kappa = 2.9e-5\n", ""))
    assert field_of(load_scene(path), {}) == "drive.kappa"


def span(steps: str) -> tuple[str, str]:
    """Return a change of the scene: amplitudes at equal steps."""
    return "cycles = 5", f"cycles = 5\n[vary]\ndrive.amplitude = {{ {steps} }}\n"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("n = 3", "nn = 3"), "chain.nn = 3: is not a key of a scene; did you mean chain.n?"),
        (("n = 3", ""), "chain.n is missing"),
        (('"3/5"', "0.4"), "chain.mu_s = '0.4': must be at least mu_d = 0.5"),
        (('"cycles"', '"cycle"'), "drive.kind = 'cycle': must be one of " + ", ".join(DRIVES)),
        (("cycles = 5", "cycles = 5\n[run]\nstart='?'"), "run.start = '?': must be \"relaxed\""),
        (("cycles = 5", "cycles = 5\n[run]\nstart={tensions=[0]}"), "run.start.tensions = 1: must"),
        (("[chain]", "vary = 3\n[chain]"), "vary = 3: must be a table, [vary]"),
        (("cycles = 5", "cycles = 5\n[vary]\nchain.n=3"), "vary.chain.n = 3: must be a list"),
        (("n = 3", "n = 3\nn = 4"), "must be a TOML file: Cannot overwrite a value"),
        (span("from = 0, to = 1, step = 0.3"), "amplitude.step = '0.3': must divide the way"),
        (span("from = 0, to = 1, step = 1e-7"), "step = '1e-7': must make at most 1000000 members"),
        (span("from = 0, to = 1"), "must have from, to and step"),
        (span('from = 0, to = "1/3", step = 1'), "amplitude.step = 1: must divide the way"),
    ],
)
def test_a_bad_scene_is_refused_by_name(change: tuple[str, str], told: str) -> None:
    assert change[0] in TEXT
    with pytest.raises(InputError) as caught:
        list(Scene.from_text(TEXT.replace(*change, 1)).members())
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [("6", 6), ("0.01", "0.01"), ("1/5", "1/5"), ("exact", "exact"), ('"exact"', "exact"),
     ("[1, 2]", [1, 2]), ("{ size = 1e-6 }", {"size": "1e-6"}), ("", ""), ("1\nx = 2", "1\nx = 2")],
)  # fmt: skip
def test_a_set_value_is_read_as_toml_or_as_it_stands(text: str, value: object) -> None:
    assert parsed_value(text) == value


@pytest.mark.parametrize(
    ("steps", "values"),
    [
        (
            "from = 0.0001, to = 0.00013, step = 0.00001",
            ["0.0001", "0.00011", "0.00012", "0.00013"],
        ),
        ("from = 1, to = 0.5, step = -0.25", [1, "0.75", "0.5"]),
        ("from = 0, to = 1e-2, step = 5e-3", [0, "0.005", "0.01"]),
    ],
)
def test_equal_steps_are_the_decimals_that_would_be_written(
    steps: str, values: list[object]
) -> None:
    scene = Scene.from_text(TEXT.replace(*span(steps)))
    listed = TEXT + f"[vary]\ndrive.amplitude = [{', '.join(map(str, values))}]\n"
    assert scene.vary == {"drive.amplitude": values} == Scene.from_text(listed).vary
    given = parsed_value(f"{{ {steps} }}")
    for number in (str, Decimal, Fraction, Literal):  # of any kind, in Python
        same = {"vary.drive.amplitude": {key: number(value) for key, value in given.items()}}
        assert Scene.from_text(TEXT).with_settings(same).vary == scene.vary
