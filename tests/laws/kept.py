"""Tables of runs that take long, a row for each chain."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pandas as pd

Row = dict[str, str]


def rows(file: Path) -> list[Row]:
    """Return the rows of a table."""
    with file.open(newline="", encoding="utf-8") as kept:
        return list(csv.DictReader(kept))


def renew(file: Path, measured: Callable[[Row], dict[str, float]]) -> None:
    """Measure all chains of a table again."""
    table = pd.DataFrame([row | measured(row) for row in rows(file)])
    table.to_csv(file, index=False, float_format="%.7g", lineterminator="\n")
