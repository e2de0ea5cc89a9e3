"""Names of columns as services and loggers write them are known for what they are."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from exactcreep.records.words import (
    PARTS,
    is_less,
    is_other,
    is_temperature,
    is_time,
    part_of,
    statistic_of,
)

NAMES = tomllib.loads(Path(__file__).with_name("names.toml").read_text("utf-8"))
KNOWN = {
    "temperature": lambda name: is_temperature(name) and not is_less(name),
    "other": is_other,
    "less": is_less,
    "time": lambda name: is_time(name) or any(part_of(name, code) for code in PARTS),
}


@pytest.mark.parametrize("kind", KNOWN)
def test_names_are_known_as_a_temperature_a_time_or_another_quantity(kind: str) -> None:
    assert [name for name in NAMES[kind] if not KNOWN[kind](name)] == []


def test_the_minimum_and_the_maximum_of_a_day_have_the_same_stem() -> None:
    for low, high in NAMES["pairs"]:
        kind, stem = statistic_of(low)
        assert (kind, statistic_of(high)) == ("min", ("max", stem))
