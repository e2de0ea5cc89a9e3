"""What every result offers: a summary that JSON can hold, a dataset, a table, equality by value."""

import json
import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep.model.names import did_you_mean
from exactcreep.model.outcome import Evidence, Outcome, cycles_text, direction_of, found_text
from exactcreep.model.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Measured(Result):
    """A result of every kind of value."""

    outcome: Outcome = Outcome.CREEPING
    value: float = math.nan
    curve: Any = field(default_factory=lambda: np.array([1.0, math.nan]))
    parts: Any = (Fraction(1, 3), {"x<y": np.int64(2)})
    reason: str = ""
    seconds: float = 0.0


def test_a_result_tells_what_it_holds_as_json_as_a_dataset_and_as_a_table() -> None:
    told = Measured(parts=[Measured(parts=())]).summary()
    inner = told["parts"][0]
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert (inner["outcome"], inner["value"], inner["curve"]) == ("creeping", None, [1.0, None])
    attributes = Measured().dataset.attrs
    assert attributes["outcome"] == "creeping"
    assert json.loads(attributes["parts"]) == ["1/3", {"x<y": 2}]
    assert "value" not in attributes
    table = Measured()._repr_html_()
    assert "x&lt;y" in table
    assert "reason" not in table
    assert repr(Measured()).startswith("Measured(outcome='creeping', value=nan, curve=[1, nan]")
    with pytest.raises(AttributeError, match="Measured has no picture"):
        Measured().plot()


@pytest.mark.parametrize(
    "other",
    [{"value": 1.0}, {"curve": np.array([1.0, 2.0])}, {"curve": np.ones(3)},
     {"parts": (Fraction(1, 3), {"x<y": 3})}, {"outcome": Outcome.AT_REST}],
)  # fmt: skip
def test_results_are_equal_by_value_whatever_their_time(other: dict[str, Any]) -> None:
    assert Measured() == replace(Measured(), seconds=1.0, parts=[Fraction(1, 3), {"x<y": 2}])
    assert Measured() != replace(Measured(), **other)
    assert Measured() != "creeping"


@pytest.mark.parametrize(
    ("advance", "slope", "way"),
    [
        (0.1, 0.3, "downhill"), (0.1, 0, "+x"), (0.1, -0.3, "uphill"), (-0.1, 0.3, "uphill"),
        (-0.1, 0, "-x"), (-0.1, -0.3, "downhill"), (0, 0.3, "none"), (math.nan, 0.3, "none"),
    ],
)  # fmt: skip
def test_a_direction_is_that_of_the_slope_and_on_the_level_that_of_the_axis(
    advance: float, slope: float, way: str
) -> None:
    assert direction_of(advance, slope) == way


def test_what_was_found_is_said_with_its_direction_and_its_evidence() -> None:
    found = found_text(Outcome.CREEPING, "uphill", f"after {cycles_text(2)}", Evidence.PROVED)
    assert found == "creeping uphill, after 2 cycles (proved)"
    found = found_text(Outcome.AT_REST, "none", cycles_text(1), Evidence.COMPUTED)
    assert found == "at rest, 1 cycle (computed)"


@pytest.mark.parametrize(
    ("name", "suggested"),
    [
        ("verlett", "verlet"), ("VERLET", "verlet"), ("amplitude", "drive.amplitude"),
        ("n", "chain.n"), ("drive_amplitude", "drive.amplitude"), ("viola", ""), ("xyzzy", ""),
    ],
)  # fmt: skip
def test_a_name_is_suggested_that_is_near_or_of_which_it_is_a_part(
    name: str, suggested: str
) -> None:
    said = did_you_mean(name, ["exact", "verlet", "drive.amplitude", "chain.n"])
    assert said == (f" (did you mean {suggested}?)" if suggested else "")
