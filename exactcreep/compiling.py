"""The compiler of the solvers, and its cache."""

from __future__ import annotations

import hashlib
import inspect
import pickle
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import parse_assembly
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from exactcreep.watch import preparation


class CacheWarning(UserWarning):
    """Compiled code cannot be stored in its folder."""


def _find_place() -> bool:
    """Return whether the compiler finds a folder for its cache."""
    try:
        numba.njit(cache=True)(_say)  # a test with any function of this installation
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
    sources = {path: path.read_bytes() for path in Path(__file__).parent.rglob("*.py")}
    return {path: source for path, source in sources.items() if b"compiling import" in source}


@lru_cache
def _digest(folder: Path) -> str:
    """Return a digest of the modules in a folder, and the compiled modules that they may call."""
    sources = _compiled_modules() | {path: path.read_bytes() for path in folder.glob("*.py")}
    return hashlib.sha256(b"\0".join(sources[path] for path in sorted(sources))).hexdigest()


class CheckedFile(IndexDataCacheFile):  # type: ignore[misc]
    """Keeps compiled code with a checksum, since damaged code would abort the process."""

    def save(self, key: Any, data: Any) -> None:
        packed = self._dump(data)
        super().save(key, (hashlib.sha256(packed).digest(), packed))

    def load(self, key: Any) -> Any:
        """Return stored code; None if there is none, or its checksum differs."""
        digest, packed = super().load(key) or (b"", b"")
        return pickle.loads(packed) if hashlib.sha256(packed).digest() == digest else None


class _Cache(FunctionCache):  # type: ignore[misc]
    """Stores compiled code until a compiled module, or one in its folder, changes."""

    _full = False

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        folder = Path(inspect.getfile(function)).parent
        if folder.is_dir():
            self._cache_file = CheckedFile(
                cache_path=self._cache_path,
                filename_base=self._impl.filename_base,
                source_stamp=_digest(folder),
            )

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return stored code; None if its file is damaged, or refers to missing classes."""
        try:
            with preparation.preparing():
                return super().load_overload(signature, target_context)
        except Exception:  # unpickling can raise any exception
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Store a compiled function; an error, such as a full disk, only warns."""
        try:
            super().save_overload(signature, data)
        except Exception as error:  # OSError, or any exception while unpickling a damaged index
            if not _Cache._full:
                _Cache._full = True
                reason = getattr(error, "strerror", None) or error
                _say(f"{self.cache_path} cannot be written ({reason})")


def njit(*, cache: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Return numba's decorator, with a cache if a folder for it exists."""

    def compiled(function: Any) -> Any:
        dispatcher = numba.njit(**options)(function)
        if cache and _KEPT:
            dispatcher._cache = _Cache(function)
        return dispatcher

    return compiled


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that is only linked into its callers, without machine code of its own."""

    def _finalize_final_module(self) -> None:
        """Give the engine only the variables in which numba stores an environment."""
        names = (variable.name for variable in self._final_module.global_variables)
        lines = [f'@"{name}" = common global i64 0' for name in names if "NumbaEnv" in name]
        self._codegen._add_module(parse_assembly("\n".join(lines)))
        self._finalized = True

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()


class _Within(Compiler):  # type: ignore[misc]
    """The compiler of functions that only compiled code calls."""

    def __init__(self, typing: Any, target: Any, library: Any, *how: Any) -> None:
        super().__init__(typing, target, _Part(target.codegen(), "part"), *how)


_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
_WITHIN = _OPTIONS | {
    "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _Within
}  # fmt: skip
compiled = njit(cache=True, **_OPTIONS)
"""Compile without reference counting: the caller owns all arrays, and nothing is allocated."""
merged = njit(**_WITHIN, forceinline=True)
"""Compile into the caller. Each caller stores its own copy."""
inlined = njit(cache=True, **_WITHIN, forceinline=True)
"""Compile into the caller, and store the function itself too, which halves the time to compile
another variant of the caller. Only for functions of a module, not for nested functions.
"""
apart = njit(cache=True, **_WITHIN)
"""Compile as a function of its own, so that rare work does not burden its callers."""


_hearers: list[Callable[[], None]] = []
"""Whom the compiler tells once that it is at work."""


class _Watch(event.Listener):  # type: ignore[misc]
    """Counts the compiler's time as preparation (its lock admits one thread), and tells of it."""

    def on_start(self, event: Any) -> None:
        preparation.begin()
        while _hearers:
            _hearers.pop()()  # it may itself need the compiler

    def on_end(self, event: Any) -> None:
        preparation.end()


event.register("numba:compile", _Watch())


@contextmanager
def told(say: Callable[[], None] | None) -> Iterator[None]:
    """Call `say` when the compiler first works within the block."""
    _hearers.extend([say] if say else [])
    try:
        yield
    finally:
        _hearers[:] = [each for each in _hearers if each is not say]
