"""The compiler of the solvers, and where it keeps what it has compiled."""

from __future__ import annotations

import hashlib
import inspect
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile

from exactcreep.watch import preparation


class CacheWarning(UserWarning):
    """Compiled code cannot be kept in its folder."""


def _find_place() -> bool:
    """Return whether the compiler finds a folder in which it can keep what it compiles."""
    try:
        numba.njit(cache=True)(_say)  # stands for every function of this installation
    except RuntimeError:  # "no locator available"
        _say("neither the installation nor the home directory can be written")
        return False
    return True


def _say(why: str) -> None:
    lost = "compiled code is lost at the end; NUMBA_CACHE_DIR can name a folder for it"
    warnings.warn(f"{why}: {lost}", CacheWarning, stacklevel=3)


_KEPT = _find_place()


@lru_cache
def _compiled_modules() -> dict[Path, bytes]:
    """Return the sources of the modules of this package that have something compiled."""
    sources = {path: path.read_bytes() for path in Path(__file__).parent.rglob("*.py")}
    return {path: source for path, source in sources.items() if b"compiling import" in source}


@lru_cache
def _digest(folder: Path) -> str:
    """Return a digest of the modules in a folder, and of those that its own may call compiled."""
    sources = _compiled_modules() | {path: path.read_bytes() for path in folder.glob("*.py")}
    return hashlib.sha256(b"\0".join(sources[path] for path in sorted(sources))).hexdigest()


class _Cache(FunctionCache):  # type: ignore[misc]
    """Keeps compiled code, or says once that it cannot.

    Compiled code holds constants and functions of other modules, which numba does not compare. It
    is kept until a module of its folder, or another compiled module of the package, changes.
    """

    _full = False

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        folder = Path(inspect.getfile(function)).parent
        if folder.is_dir():
            self._cache_file = IndexDataCacheFile(
                cache_path=self._cache_path,
                filename_base=self._impl.filename_base,
                source_stamp=_digest(folder),
            )

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return what was kept; None if its file is damaged, or names classes that are gone."""
        try:
            with preparation.preparing():
                return super().load_overload(signature, target_context)
        except Exception:  # what unpickling can raise is not written down
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep a compiled function; a full disk, or an index beyond repair, costs no more."""
        try:
            super().save_overload(signature, data)
        except Exception as error:  # OSError, or what unpickling a damaged index raises
            if not _Cache._full:
                _Cache._full = True
                reason = getattr(error, "strerror", None) or error
                _say(f"{self.cache_path} cannot be written ({reason})")


def njit(*, cache: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Return numba's decorator, which keeps what it compiles only where there is room for it."""

    def compiled(function: Any) -> Any:
        dispatcher = numba.njit(**options)(function)
        if cache and _KEPT:
            dispatcher._cache = _Cache(function)
        return dispatcher

    return compiled


_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
_WITHIN = _OPTIONS | {
    "forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True
}  # fmt: skip
compiled = njit(cache=True, **_OPTIONS)
"""Compile without reference counting: the arrays belong to the caller, nothing is allocated."""
merged = njit(**_WITHIN)
"""Compile into the caller, and call from there alone. Each caller keeps what it has merged."""
inlined = njit(cache=True, **_WITHIN)
"""The same, kept on disk by itself, too: another variant of a caller is compiled in half the time.

For functions of a module; those that are made in another function cannot be kept.
"""


class _Listener(event.Listener):  # type: ignore[misc]
    """Says once that the compiler is at work."""

    def __init__(self, say: Callable[[], None] | None) -> None:
        self.say = say

    def on_start(self, event: Any) -> None:
        say, self.say = self.say, None  # saying so may need the compiler, too
        if say is not None:
            say()

    def on_end(self, event: Any) -> None:
        pass


class _Stopwatch(event.Listener):  # type: ignore[misc]
    """Counts the time of the compiler as preparation; a lock of its own lets in one thread."""

    def on_start(self, event: Any) -> None:
        preparation.begin()

    def on_end(self, event: Any) -> None:
        preparation.end()


event.register("numba:compile", _Stopwatch())


@contextmanager
def told(say: Callable[[], None] | None) -> Iterator[None]:
    """Call `say` as soon as the compiler is at work within the block, if it ever is."""
    with event.install_listener("numba:compile", _Listener(say)):
        yield
