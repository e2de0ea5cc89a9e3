"""Files as services and loggers write them are read rightly, or refused with the option that helps.

No layout may be read wrongly in silence. `layouts` writes the files, each with its right reading.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from exactcreep import InputError, TemperatureRecord
from tests.records.layouts import CODED, LAYOUTS, File, drawn


def assert_right(file: File, path: Path, **options: Any) -> TemperatureRecord:
    readings = TemperatureRecord.readings(path, **options)
    found = readings.celsius.copy()
    found[readings.faults().get("far", [])] = np.nan
    assert {*readings.faults()} <= {"missing", "far"}
    assert (len(readings.times), readings.missing) == (file.readings, file.missing)
    for time, expected in zip(readings.times[[0, -1]], (file.first, file.last), strict=True):
        assert abs(time - np.datetime64(expected)) < np.timedelta64(1, "ms")
    ends = np.nanmin(found), np.nanmax(found)
    assert ends == pytest.approx((file.low, file.high), abs=file.near)
    return readings


def assert_read_or_helped(file: File, folder: Path) -> None:
    path = folder / f"station{file.ending}"
    path.write_bytes(file.content)
    if not file.needs:
        options = assert_right(file, path).options
        assert_right(file, path, **options)  # what it prints for a scene reads it, too
        return
    with pytest.raises(InputError) as refused:
        TemperatureRecord.readings(path)
    said = str(refused.value)
    assert file.needs in said
    assert "line " in said
    assert said.isprintable()
    if file.given:
        assert_right(file, path, **file.given)


@pytest.mark.parametrize("name", FILES := LAYOUTS | CODED)
def test_a_layout_is_read_rightly_or_by_the_option_that_is_named(name: str, tmp_path: Path) -> None:
    assert_read_or_helped(FILES[name](), tmp_path)


@given(file=st.randoms(use_true_random=False).map(drawn))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_drawn_layout_is_read_wrongly_in_silence(file: File, tmp_path: Path) -> None:
    path = tmp_path / "station.csv"
    path.write_bytes(file.content)
    try:
        assert_right(file, path)
    except InputError as error:
        said = str(error)
    else:
        return
    assert re.search("_column|date_format|unit|delimiter", said)
