"""The guard: it sees one bit, and a build does what it does."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.guard import IGNORED, ROOT, differences, main
from tests.recorder import attempt, bits, fields

OLD = {
    "scenes/a/x_G": ["0x1.0000000000000p+0", "0x1.8000000000000p+1"],
    "scenes/a/seconds": "0x1.0p-3",
    "refused/run/err": "exactcreep: n = 0: must be at least 1",
    "hard/b/undecided": 1,
}


def test_one_bit_of_one_number_is_reported_with_its_place_and_size() -> None:
    new = OLD | {"scenes/a/x_G": ["0x1.0000000000000p+0", "0x1.8000000000001p+1"]}
    found = differences(OLD, new)
    assert list(found) == ["scenes/a/x_G"]
    told = "[1] 3.0 -> 3.0000000000000004; 1 of 2 differ; by at most 4.44e-16"
    assert found["scenes/a/x_G"] == told


def test_a_sentence_a_missing_field_a_new_one_and_another_type_are_reported() -> None:
    new = OLD | {"refused/run/err": "exactcreep: n = 0: must be 1", "hard/b/doubt": "near"}
    new["hard/b/undecided"] = True
    del new["scenes/a/x_G"]
    found = differences(OLD, new)
    assert set(found) == {"scenes/a/x_G", "refused/run/err", "hard/b/undecided", "hard/b/doubt"}
    assert found["scenes/a/x_G"] == "[1.0, 3.0] -> absent"
    assert found["hard/b/undecided"] == "1 -> True"
    assert found["hard/b/doubt"] == "absent -> near"


def test_what_is_meant_to_change_is_left_out_and_so_are_times_but_nothing_else() -> None:
    new = {"scenes/a/seconds": "0x1.0p-2"} | {name: "other" for name in OLD if "sec" not in name}
    assert set(differences(OLD, new)) == set(OLD) - {"scenes/a/seconds"}
    kept = differences(OLD, new, ["scenes/*/x_G", "hard/*"])
    assert list(kept) == ["refused/run/err"]
    assert all(reason for reason in IGNORED.values())


def test_values_that_differ_in_a_bit_a_sign_or_a_type_are_recorded_apart() -> None:
    values = [0.0, -0.0, 5e-324, 0, False, None, "0", float("nan"), float("inf")]
    assert len({repr(bits(value)) for value in values}) == len(values)
    nested = dict(fields("a", {"b": [1, 2.5], "c": [{"d": (1, 2)}], "e": {}}))
    assert nested == {"a/b": [1, "0x1.4000000000000p+1"], "a/c/0/d": [1, 2], "a/e": "{}"}
    assert dict(attempt("a", lambda: 1 // 0)) == {
        "a/raised": "ZeroDivisionError: integer division or modulo by zero"
    }


@pytest.mark.slow
def test_a_build_does_what_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    commit = "HEAD" if Path(ROOT, ".git").exists() else str(ROOT)
    status = main([commit, "--quick"])
    assert status == 0, capsys.readouterr().out
