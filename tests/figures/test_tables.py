"""The table of a picture as a CSV that a data frame reads: numbers in columns of numbers."""

from __future__ import annotations

import io

import pandas as pd

from exactcreep.figures.tables import Point, Table, to_csv

TABLES = [
    Table("plateau", "", (
        Point({"n": 6, "tan_alpha": 0.1}, 1.5, 0.25, (2.0,), (1.0, 1.25), "a, remark"),
        Point({"n": 7, "tan_alpha": 0.2}, -1.0),
    )),
    Table("life", "", (Point({"start": "cold"}, 1e-300, 0.0),), unit="cycles"),
]  # fmt: skip


def test_every_quantity_that_varies_has_a_column_and_no_number_is_text() -> None:
    frame = pd.read_csv(io.StringIO(to_csv(TABLES)))
    assert frame["series"].tolist() == ["plateau", "plateau", "life"]
    assert frame["unit"].tolist()[1:] == ["g tau_dyn^2 per half-cycle or target", "cycles"]
    assert frame["tan_alpha"].tolist()[:2] == [0.1, 0.2]
    assert frame["start"].tolist()[2] == "cold"
    text = {"series", "start", "unit", "remark"}
    for name in set(frame) - text:
        assert frame[name].dtype.kind == "f", name
    first = frame.iloc[0]
    assert (first["exact_law_least"], first["exact_law_largest"]) == (1.0, 1.25)
    assert (first["printed_law_least"], first["printed_law_largest"]) == (2.0, 2.0)
    assert (first["deviation_printed"], first["deviation_exact"]) == (-2.0, 1.0)
    assert frame["measured"].tolist()[2] == 1e-300
    assert frame.iloc[1].drop(["series", "n", "tan_alpha", "measured", "unit"]).isna().all()
