"""Find the table in a file of text: its encoding, its delimiter, its names and its rows."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from exactcreep.model.numbers import InputError
from exactcreep.model.user_files import content_of, refused, unpacked
from exactcreep.records.words import is_time

MOST_BYTES = 64 * 2**20
"""Largest size of a record, unpacked."""
MOST_ROWS = 1_000_000
"""Most rows of a record: a century of hours."""
_MOST_CELLS, MOST_COLUMNS, _LONGEST_ROW = 20_000_000, 200, 20_000
SAMPLE = 3000  # lines that are looked at to find the table
_MOST_BELOW = 40  # lines below a table that may be left out
_MOST_ABOVE = 6  # rows of names and units
_DELIMITERS = (";", "\t", "|", ",", " ")
_NUMBER = re.compile(r"[+\-−]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_MEASURED = re.compile(_NUMBER.pattern + r"\s*(°\s?[CFK]?|℃|℉|[CFK]|deg\s?[CF])?")
_DATED = re.compile(
    r"(?=(?:.*\d){3})(?=.*(\d[-/.:年T ]\s?\d|\d[-/. ]?[^\W\d_]{3}|[^\W\d_]{3}[-/. ]?\d))"
    r"[\w\s:/.,+\-]+"
)
MISSING = re.compile(r"|-+|\*+|/+|\.+|n/?a|n/?d|nan|nat|null|none|m|x|missing|#n/a|#value!", re.I)
"""Texts that stand for a missing reading."""
_ENCODINGS = {
    "utf-8": "",
    "cp932": "気温|年月日|℃",
    "gb18030": "温度|气温|时间|日期",
    "cp949": "기온|온도|일시",
    "cp1251": "(?i)температур|дата",
    "cp1250": "(?i)měsíc|teplota.*ů|ů.*teplota|powietrza.*[łąęśćńż]|[łąęśćńż].*powietrza",
    "latin-1": "",
}
"""Encodings that are tried, each with words of which the text must hold one."""
RECIPE = 'pandas reads it (how-to "temperatures", other formats)'
"""What is said of tables that need more than an option."""
_ANNOTATION = re.compile(r"#(group|datatype|default)\b")  # InfluxDB
_ZIP = b"PK\x03\x04"


class CellError(InputError):
    """What cannot be read in a table: a scene says where it is, and may not quote it.

    `row`, `column`: numbers of the line and of the column, from 1; 0 if several are meant.
    """

    def __init__(
        self, name: str, value: object, allowed: str, row: int = 0, column: int = 0
    ) -> None:
        super().__init__(name, value, allowed)
        self.row, self.column = row, column


def printable(text: str) -> str:
    """Return a text in one line, without characters that change a terminal."""
    text = " ".join(text.split())
    return "".join(sign if sign.isprintable() else f"\\x{ord(sign):02x}" for sign in text)


def kind(cell: str) -> str:
    """Return whether a cell is a number "n", a date or a time of day "d", missing "", or text."""
    if _MEASURED.fullmatch(cell):
        return "n"
    if MISSING.fullmatch(cell):
        return ""
    return "d" if _DATED.fullmatch(cell) else "t"


def fields(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line; a blank as delimiter stands for any number of blanks."""
    if delimiter == " ":
        if '"' not in line:
            return line.split()
        line = re.sub(r"\s+", " ", line.strip())
    if '"' in line:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    else:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]


@dataclass(frozen=True)
class Table:
    """A table of text within a file.

    `names`: printable and different; numbers from 1 for columns without a name. `about`: names and
    units of each column as written. `notes`: lines above the table. `rows`: numbers of the lines of
    data, from 0. `below`: how many lines below the table are left out.
    """

    shown: str
    encoding: str
    delimiter: str
    named: bool
    names: tuple[str, ...]
    about: tuple[str, ...]
    notes: tuple[str, ...]
    lines: Sequence[str]
    rows: Sequence[int]
    below: int

    @cached_property
    def sample(self) -> list[list[str]]:
        """The cells of the first rows, by column."""
        return self.cells(range(len(self.names)), self.rows[:SAMPLE])

    def cells(self, columns: Sequence[int], rows: Sequence[int] | None = None) -> list[list[str]]:
        """Return the cells of these columns, in every row."""
        width, found = len(self.names), [list[str]() for _ in columns]
        for row in self.rows if rows is None else rows:
            cells = fields(self.lines[row], self.delimiter)
            if len(cells) != width:
                self._check(cells, row)
                cells += [""] * (width - len(cells))
            for column, kept in zip(columns, found, strict=True):
                kept.append(cells[column])
        return found

    def _check(self, cells: list[str], row: int) -> None:
        width = len(self.names)
        if any(kind(cell) in "nd" for cell in cells[width:] if cell) or (
            self.delimiter == " " and len(cells) < width
        ):
            allowed = f"does not read {self.shown}: line {row + 1} has {len(cells)} columns, and"
            allowed += f" others {width}; delete the line, or name another delimiter"
            raise CellError("delimiter", self.delimiter, allowed, row + 1)

    def refused(self, name: str, cell: str, k: int, allowed: str) -> CellError:
        """Return the error about the cell of a column in the k-th row of data."""
        row, column = self.rows[k] + 1, self.names.index(name) + 1 if name in self.names else 0
        return CellError(name, cell, f"{allowed} (line {row} of {self.shown})", row, column)

    def column(self, name: str, field: str) -> int:
        """Return the place of a column by its name or number."""
        wanted = printable(name)
        if wanted in self.names:
            return self.names.index(wanted)
        if re.fullmatch(r"[1-9]\d?\d?", wanted) and int(wanted) <= len(self.names):
            return int(wanted) - 1
        among = ", ".join(self.names[:12])
        told = f"must be one of the columns of {self.shown}: {among} (delimiter ="
        raise CellError(field, name, f"{told} {self.delimiter!r})")


# --- text -----------------------------------------------------------------------------------------


def table_of(path: Path, delimiter: str, encoding: str) -> tuple[Table, bytes]:
    """Return the table in a file, and the content of the file.

    Raises `InputError` if the file is too large, or no table.
    """
    shown, content = str(path), content_of(path, "file", MOST_BYTES)
    data = _member(content, shown) if content.startswith(_ZIP) else content
    text, encoding = _text_of(unpacked(data, "file", shown, MOST_BYTES), encoding, shown)
    if "\0" in text or not text.strip():
        raise InputError("file", shown, "must hold a table as text: save a spreadsheet as CSV")
    text = re.sub(r"\r\n?|\x0c|\x85|\u2028", "\n", text)
    lines = text.split("\n")
    if max(map(len, lines)) > _LONGEST_ROW:
        raise InputError("file", shown, f"must not have a row of {_LONGEST_ROW} characters")
    return _found(lines, shown, delimiter, encoding), content


def _member(content: bytes, shown: str) -> bytes:
    with refused("file", shown, "must be a zip archive of one file"):
        archive = zipfile.ZipFile(io.BytesIO(content))
        members = [each for each in archive.infolist() if not each.is_dir()]
        if len(members) != 1:
            raise ValueError(f"it holds {len(members)}: unpack it, or save a spreadsheet as CSV")
        with archive.open(members[0]) as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise ValueError(f"it must have at most {MOST_BYTES // 2**20} MiB when unpacked")
    return data


def _text_of(data: bytes, encoding: str, shown: str) -> tuple[str, str]:
    """Return the text of bytes, and its encoding."""
    if encoding:
        try:
            return data.decode(encoding).removeprefix("\ufeff"), encoding
        except (LookupError, TypeError, UnicodeError) as error:
            allowed = f"does not read {shown}: {error}; many a file is latin-1"
            raise InputError("encoding", encoding, allowed) from None
    begin = data[:4000]
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")) or begin.count(0) > len(begin) // 3:
        little = begin[1::2].count(0) >= begin[::2].count(0)
        names = ["utf-16" if begin[:1] in b"\xff\xfe" else ("utf-16-be", "utf-16-le")[little]]
    else:
        names = [*_ENCODINGS]
    for name in names:
        try:
            text = data.decode(name).removeprefix("\ufeff")
        except UnicodeError:
            continue
        if re.search(_ENCODINGS.get(name, ""), text[:_LONGEST_ROW]):
            return text, name
    raise InputError("file", shown, "must hold a table as text: save a spreadsheet as CSV")


# --- the table ------------------------------------------------------------------------------------


def _found(lines: list[str], shown: str, delimiter: str, encoding: str) -> Table:
    """Return the table that begins in the first thousands of lines."""
    sample = lines[:SAMPLE]
    best = max((_layout(sample, each) for each in (delimiter or _DELIMITERS)), default=None)
    if best is None or best[0] <= 0:
        allowed = f"is not found in {shown}: no sign separates the columns of most rows in the same"
        allowed += " way, or there is no row of data; name it, e.g. delimiter = ';'"
        raise InputError("delimiter", delimiter or None, allowed)
    _, _, delimiter, width, kinds = best
    if width > MOST_COLUMNS or width * len(lines) > _MOST_CELLS:
        allowed = f"must have at most {MOST_COLUMNS} columns and {_MOST_CELLS} entries"
        raise InputError("file", shown, allowed)
    begin = _begin(sample, delimiter, kinds)
    end = len(lines)
    while not lines[end - 1].strip():
        end -= 1
    last = end
    while end > begin + 1:
        cells = fields(lines[end - 1], delimiter)
        if _fits(cells, kinds) or _begun(cells, kinds, []):
            break
        end -= 1
    if last - end > _MOST_BELOW:
        end = last
    rows = [k for k in range(begin, end) if lines[k].strip(' \t\r,;|"')]
    if len(rows) > MOST_ROWS:
        raise InputError("file", shown, f"must have at most {MOST_ROWS} rows of data")
    first = [fields(lines[row], delimiter) for row in rows[:99]]
    named, names, about, notes = _names(sample[:begin], delimiter, width, first, shown)
    return Table(
        shown, encoding, delimiter, named, names, about, notes, lines, rows,
        sum(1 for k in range(end, last) if lines[k].strip()),
    )  # fmt: skip


def _layout(lines: list[str], delimiter: str) -> tuple[float, int, str, int, list[str]]:
    """Return how well a delimiter makes a table of the lines, its width, and kinds of cells."""
    cells = [fields(line, delimiter) for line in lines if line.strip()]
    tail = cells[max(len(cells) // 3, 1) :]
    widths = Counter(len(row) for row in tail if len(row) > 1)
    if not widths:
        return 0, 0, delimiter, 0, []
    width, _ = max(widths.items(), key=lambda pair: (pair[1], pair[0]))
    rows = [row for row in tail if len(row) == width]
    while width > 1 and not any(row[width - 1] for row in rows):
        width -= 1
    kinds = []
    for column in range(width):
        found = Counter(kind(row[column]) for row in rows if column < len(row))
        found.pop("", None)
        top = found.most_common(1)
        kinds.append(top[0][0] if top and top[0][1] > sum(found.values()) / 2 else "t")
    fit = sum(_fits(row, kinds) for row in tail)
    if not fit or not {"n", "d"} & {*kinds}:
        return 0, 0, delimiter, 0, []
    whole = [each != "t" or not _digits_apart(rows, k) for k, each in enumerate(kinds)]
    share = fit / len(tail) * (sum(whole) / width) ** 2 * (0.8 if delimiter == " " else 1)
    return round(share, 2), -_DELIMITERS.index(delimiter) if delimiter in _DELIMITERS else 0, \
        delimiter, width, kinds  # fmt: skip


def _begin(lines: list[str], delimiter: str, kinds: list[str]) -> int:
    """Return the first line of data; a small table above may end at an empty line."""
    cells = [fields(line, delimiter) for line in lines]
    fits = [k for k, row in enumerate(cells) if _fits(row, kinds)]
    begin, small = fits[0], fits[: _MOST_ABOVE // 2]
    for k in small:
        named = begin + 2 < k and not lines[k - 2].strip() and any(map(is_time, cells[k - 1]))
        begin = k if named and not any(map(is_time, cells[begin - 1])) else begin
    while begin and _begun(cells[begin - 1], kinds, cells[: begin - 1]):
        begin -= 1
    return begin


def _begun(cells: list[str], kinds: list[str], above: list[list[str]]) -> bool:
    """Return whether a row above the first whole row is data, with a cell that is not."""
    dates, numbers = (
        [cell for cell, wanted in zip(cells, kinds, strict=False) if wanted == each]
        for each in "dn"
    )
    dated = any(kind(cell) == "d" and not is_time(cell) for cell in dates)
    named = any(len(row) >= len(kinds) and not any(map(_NUMBER.fullmatch, row)) for row in above)
    return len(cells) >= len(kinds) > 1 and (
        dated or (named and any(map(_NUMBER.fullmatch, numbers)))
    )


def _digits_apart(rows: list[list[str]], column: int) -> bool:
    """Return whether the cells of a column look like several cells."""
    cells = [row[column] for row in rows if column < len(row)]
    return sum(bool(re.search(r"\d[\s;|,]+[\d.+-]", cell)) for cell in cells) > len(cells) / 2


def _fits(cells: list[str], kinds: list[str]) -> bool:
    """Return whether the cells of a line are of these kinds, and its dates are not missing."""
    if len(cells) < 2 or any(cells[len(kinds) :]):
        return False
    found, wrong = 0, 0
    for cell, wanted in zip(cells, kinds, strict=False):
        if wanted == "t":
            continue
        given = kind(cell)
        found += given == wanted
        wrong += given not in (wanted, "") or (wanted == "d" and not given)
    return found > 0 and not wrong


def _names(
    above: list[str], delimiter: str, width: int, first: list[list[str]], shown: str
) -> tuple[bool, tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the names of the columns, their names with units, and the lines above them."""
    block, taken = list[list[str]](), 0
    numbered = [row[0] for row in first] == [*map(str, range(1, len(first) + 1))]
    for line in reversed(above):
        taken += 1
        if _ANNOTATION.match(line.lstrip('"')):
            continue
        if not line.strip():
            if block:
                break
            continue
        bare = re.sub(r"^\s*#+", "", line)
        cells = [cell.lstrip("#").strip() for cell in fields(bare, delimiter)]
        if len(cells) == width - 1 and numbered:  # as R writes the names of rows
            cells = ["", *cells]
        digits = sum(bool(_NUMBER.fullmatch(cell)) for cell in cells)
        if not block and len(cells) < width and delimiter == " " and not digits and taken < 3:
            continue  # units of some columns
        if len(cells) < width or not any(cells) or (digits and (block or kind(cells[0]) != "t")):
            break
        block.insert(0, cells)
        if len(block) == _MOST_ABOVE:
            break
    notes = tuple(line for line in above[: len(above) - taken + 1] if line.strip())
    for cells in block:  # names of empty columns, if any row has as many
        while len(cells) > width and not cells[-1]:
            cells.pop()
    near = [cells for line in above[-2:] if 1 < len(cells := fields(line, delimiter)) < width]
    near = [cells for cells in near[-1:] if not any(map(_NUMBER.fullmatch, cells))]
    named, most = max(map(len, block or near), default=width), max(map(len, first))
    if (near and not block) or named > most:
        told = "names with it need quotes" if block else "mend its first line"
        if delimiter == "," and not block:
            told = f"decimal commas need quotes or another delimiter, or {RECIPE}"
        allowed = f"does not read {shown}: {named} columns are named, and rows have {most}, from"
        raise InputError("delimiter", delimiter, f"{allowed} line {len(above) + 1} on; {told}")
    if not block:
        numbers = tuple(str(k + 1) for k in range(width))
        return False, numbers, ("",) * width, tuple(line for line in above if line.strip())
    width = max(width, named)
    block = [cells + [""] * (width - len(cells)) for cells in block]
    full = [k for k, cells in enumerate(block) if all(cells)]
    full = [k for k, cells in enumerate(block) if all(cells) and any(map(is_time, cells))] or full
    top = full[0] if full else len(block) - 1
    names_row = block[top][:width]
    if top and len({*names_row}) < width:  # names in two rows
        names_row = [f"{a} {b}".strip() for a, b in zip(block[top - 1], names_row, strict=False)]
    written = [" ".join(dict.fromkeys([name, *(row[k] for row in block[top + 1 :])])).strip()
               for k, name in enumerate(names_row)]  # fmt: skip
    seen, names_found = Counter[str](), list[str]()
    for k, name in enumerate(map(printable, names_row)):
        seen[name] += 1
        names_found.append(f"{name}.{seen[name] - 1}" if name and seen[name] > 1 else name
                           or str(k + 1))  # fmt: skip
    return True, tuple(names_found), tuple(written), notes
