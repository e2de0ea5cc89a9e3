"""Tables of runs that take long: a row for each chain; rows that are there already are kept."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any


def rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a table."""
    with file.open(newline="", encoding="utf-8") as kept:
        return list(csv.DictReader(kept))


def add_rows(file: Path, numbers: Iterable[int], measured: Callable[[int], dict[str, Any]]) -> None:
    """Measure the chains that have no row yet, and add a row for each, by the names at the top."""
    known = {row["number"] for row in rows(file)}
    for number in (number for number in numbers if str(number) not in known):
        row = [f"{x:.7g}" if isinstance(x, float) else x for x in measured(number).values()]
        print(*row, flush=True)
        with file.open("a", newline="", encoding="utf-8") as table:
            csv.writer(table, lineterminator="\n").writerow(row)
