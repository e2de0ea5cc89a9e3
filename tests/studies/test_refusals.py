"""What a question refuses, it refuses in one sentence that names the field."""

from __future__ import annotations

import pytest

from exactcreep import cli

ASKED = {
    "threshold": "--n 3 --solver exact --digits 9 --points 50",
    "intercept": "--n 6 --sigma-mu 0.01",
    "survival": "--n 6 --amplitude 0.001",
    "fate": "--n 6 --amplitude 0.001",
    "plan": "six-sliders-cycles",
}
"""What each is asked with, before what it refuses."""


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("threshold --n 0", "n = "),
        ("threshold --tan-alpha 0.6", "tan_alpha"),
        ("threshold --bracket 0.0001 0.0002", "bracket"),
        ("threshold --from 0.001 --to 0.002", "from"),
        ("threshold --mu-s 0.5 --tan-alpha 0.1", "tan_alpha = "),
        ("threshold --solver verlet", "solver"),
        ("threshold --tan-alpha 0", "tan_alpha"),
        ("threshold --sigma-mu 0.01 --cycles 20", "sigma_mu"),
        ("intercept --n 1", "n = 1: must be at least 2: one slider has no spring"),
        ("intercept --tan-alpha 0.55", "tan_alpha"),
        ("intercept --fit 2 1.2", "fit"),
        (f"intercept --seed {2**32}", "seed"),
        ("survival --size -1", "size"),
        ("survival --workers 0", "workers"),
        ("fate --sigma-mu 0.01", "sigma_mu"),
        ("fate --mu-s 0.5", "mu_s"),
        ("fate --amplitude -0.001", "amplitude"),
        ("plan --digits many", "digits"),
    ],
)
def test_what_is_refused_is_named(
    line: str, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *words = line.split()
    assert cli.status([command, *ASKED[command].split(), *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    *progress, sentence = said.err.splitlines()  # of a search that takes a second
    assert sentence.startswith(f"exactcreep: {named}")
    assert not any(line.startswith("exactcreep") for line in progress)
