"""The streams and the width of all printed text, and text that cannot command a terminal."""

from __future__ import annotations

import io
import os
import shutil
import sys
import unicodedata
from importlib import import_module
from typing import Any, TextIO

_NARROWEST, _WIDEST = 40, 1000  # columns


class _Nowhere(io.TextIOBase):
    """Discards everything."""

    def write(self, text: str) -> int:
        return len(text)


_NOWHERE: TextIO = _Nowhere()  # type: ignore[assignment]


def stream(name: str = "stdout") -> TextIO:
    """Return ``stdout`` or ``stderr``; if a process has none, a stream that discards all text."""
    found: TextIO | None = getattr(sys, name, None)
    return _NOWHERE if found is None or getattr(found, "closed", False) else found


def is_terminal(name: str) -> bool:
    """Return whether ``stdout`` or ``stderr`` is a terminal."""
    return bool(getattr(stream(name), "isatty", bool)())


def width() -> int:
    """Return the number of columns of a line: ``COLUMNS``, or the terminal's; at least 40."""
    return min(max(shutil.get_terminal_size().columns, _NARROWEST), _WIDEST)


def folds() -> bool:
    """Return whether long lines are folded: on a terminal, or if ``COLUMNS`` gives a width."""
    return is_terminal("stdout") or os.environ.get("COLUMNS", "").strip("0").isdigit()


def console(name: str = "stdout", columns: int | None = None) -> Any:
    """Return rich's console for a stream, with this width or `width`."""
    made = import_module("rich.console").Console  # loaded only when needed
    return made(file=stream(name), width=columns or width(), highlight=False)


def printable(text: str) -> str:
    r"""Return text in which every control character but a line feed is an escape, e.g. ``\x1b``.

    Text from a file could otherwise move the cursor or set the title of the terminal.
    """
    if text.isprintable():
        return text
    return "".join(
        sign.encode("unicode_escape").decode()
        if sign != "\n" and unicodedata.category(sign) in _UNSEEN
        else sign
        for sign in text
    )


_UNSEEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Unicode's categories of control characters, surrogates, and separators of lines."""
