"""The compiler of the solvers, and where it keeps what it has compiled."""

from __future__ import annotations

import os
import stat
import tempfile
import warnings
from collections.abc import Callable
from typing import Any

import numba
from numba import config


class CacheWarning(UserWarning):
    """What is compiled cannot be kept where it belongs."""


def _probe() -> None:
    """Stand for every function of this installation that is compiled."""


def _kept() -> bool:
    """Return whether the compiler finds a folder in which it can keep what it compiles."""
    try:
        numba.njit(cache=True)(_probe)
    except RuntimeError:  # "no locator available"
        return False
    return True


def _own_folder() -> str | None:
    """Return a temporary folder that belongs to the user alone; None if there cannot be one.

    Compiled code is executed when it is read back, so that nobody else may write there.
    """
    if not hasattr(os, "getuid"):
        return None
    try:
        path = os.path.join(tempfile.gettempdir(), f"exactcreep-{os.getuid()}")
        os.makedirs(path, mode=0o700, exist_ok=True)
        found = os.lstat(path)
    except OSError:
        return None
    own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return path if own and not found.st_mode & 0o077 else None


def _find_room() -> bool:
    """Return whether what is compiled is kept, in a temporary folder if there is no better one."""
    if _kept():
        return True
    folder = _own_folder()
    where = "is lost at the end"
    if folder is not None:
        before, config.CACHE_DIR = config.CACHE_DIR, folder
        if _kept():
            where = f"is kept in {folder}"
        else:
            folder, config.CACHE_DIR = None, before
    warnings.warn(
        "neither the installation nor the home directory can be written: what is compiled"
        f" {where}; NUMBA_CACHE_DIR can name a folder for it",
        CacheWarning,
        stacklevel=2,
    )
    return folder is not None


_KEPT = _find_room()


def njit(*, cache: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Return numba's decorator, which keeps what it compiles only where there is room for it."""
    return numba.njit(cache=cache and _KEPT, **options)  # type: ignore[no-any-return]
