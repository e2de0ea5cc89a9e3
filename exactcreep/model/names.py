"""The one place that suggests a name: which known name was meant by one that is not known."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

_BETWEEN = re.compile(r"[.\s_-]")  # the parts of a name
_NEAR = 0.6  # share of the letters that agree


def meant(name: object, known: Iterable[str]) -> str:
    """Return the known name that somebody who wrote `name` most likely meant; "" if none is near.

    A name is near one of whose parts it is, else if more than six tenths of its letters agree.

    >>> meant("amplitude", ["drive.amplitude", "chain.n"]), meant("verlett", ["exact", "verlet"])
    ('drive.amplitude', 'verlet')
    >>> meant("xyzzy", ["exact", "verlet"])
    ''
    """
    word = str(name).lower()
    parts = [each for each in known if word in _BETWEEN.split(each)]
    return next(iter(get_close_matches(word, parts or known, 1, 0.0 if parts else _NEAR)), "")


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return the end of a sentence that asks for the known name that was meant, if any is near."""
    near = meant(name, known)
    return f" (did you mean {near}?)" if near else ""
