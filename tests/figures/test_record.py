"""The picture of a record of temperatures shows its readings, of long ones what they come to."""

from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest

from exactcreep.figures.record import draw_record
from exactcreep.model.record_format import guessed
from exactcreep.model.temperature_record import TemperatureRecord
from tests.pictures import assert_shows_data


@pytest.mark.parametrize("days", [5, 300, 5000])
def test_a_record_is_drawn_by_its_readings_or_means_between_extremes(
    days: int, tmp_path: Path
) -> None:
    path = tmp_path / "station.csv"
    readings = 10 + 8 * np.cos(np.arange(days)) - 9 * (np.arange(days) == days // 3)
    rows = (f"{date(2000, 1, 1) + timedelta(k)},{t:.1f}" for k, t in enumerate(readings.tolist()))
    path.write_text("\n".join(["date,temperature", *rows]))
    record = TemperatureRecord.readings(path, **guessed(path).options)
    figure = assert_shows_data(draw_record(record, "station.csv"), framed=True)
    (axes,) = figure.axes
    (line,) = axes.lines
    drawn = np.asarray(line.get_ydata())
    if days <= 300:
        assert np.array_equal(drawn, record.temperatures)
    else:
        (band,) = axes.collections
        assert drawn.mean() == pytest.approx(record.temperatures.mean(), abs=0.05)
        heights = band.get_paths()[0].vertices[:, 1]
        assert heights.min() == record.temperatures.min()
        assert heights.max() == record.temperatures.max()
