"""What every result offers: a summary that JSON can hold, a dataset, a table, equality by value."""

import json
import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep.model.outcome import Outcome
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
