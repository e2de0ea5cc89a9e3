"""The pictures that ``exactcreep reproduce`` makes: the paper's figures, and some beyond them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

from exactcreep.figures.drawing import Picture
from exactcreep.figures.pictures import avalanches, beyond, chains, lasting, two_sliders
from exactcreep.model.numbers import InputError

PICTURES: Mapping[str, Picture] = {
    picture.name: picture
    for module in (two_sliders, chains, beyond, lasting, avalanches)
    for picture in vars(module).values()
    if isinstance(picture, Picture)
}
"""The pictures by name, the paper's first, in the paper's order."""


def picture_named(name: str) -> Picture:
    """Return the picture of that name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in PICTURES:
        near = difflib.get_close_matches(name, PICTURES, 1, 0.5)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise InputError("picture", name, "must be all or one of " + ", ".join(PICTURES) + hint)
    return PICTURES[name]
