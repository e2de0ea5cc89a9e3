"""Where compiled code is kept: read-only installations, containers without a home."""

import shutil
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from exactcreep.compiling import CheckedFile
from exactcreep.watch import interrupts
from tests.processes import PATIENCE, begun, finished

TWICE = """
from exactcreep import compiling
@compiling.njit(cache=True)
def twice(x):
    return 2 * x
"""


def test_compiled_code_with_a_flipped_bit_is_never_loaded(tmp_path: Path) -> None:
    code = bytes(range(256)) * 4
    kept = CheckedFile(str(tmp_path), "one", "stamp")
    kept.save("key", code)
    assert kept.load("key") == code
    [file] = tmp_path.glob("*.nbc")
    whole = file.read_bytes()
    for place in range(0, len(whole), 7):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << place % 8
        file.write_bytes(flipped)
        loaded = None
        with suppress(Exception):  # the pickle itself is damaged: compiled anew, too
            loaded = kept.load("key")
        assert loaded in (None, code)


def test_a_signal_does_not_wait_for_the_compiler() -> None:
    ended = threading.Event()

    def compiles() -> None:
        signal.raise_signal(signal.SIGINT)  # Python hears it in the main thread
        ended.wait(PATIENCE)

    try:
        with pytest.raises(KeyboardInterrupt), interrupts.deferred():
            interrupts.prepare(compiles)
        assert not ended.is_set()
    finally:
        ended.set()
    with pytest.raises(ZeroDivisionError):
        interrupts.prepare(lambda: 1 // 0)


def test_without_a_folder_for_it_compiled_code_is_lost_at_the_end_and_a_warning_says_so() -> None:
    """As in an installation that can only be read, without a home."""
    script = """
import warnings
from numba.core.caching import CacheImpl
CacheImpl._locator_classes = []  # no folder can be written
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    from exactcreep import compiling
    twice = compiling.njit(cache=True)(lambda x: 2 * x)
    print(twice(21), type(twice._cache).__name__, *[each.message for each in said], sep=chr(10))
"""
    answer, cache, sentence = finished(sys.executable, "-c", script).stdout.splitlines()
    assert (answer, cache) == ("42", "NullCache")
    assert "is lost at the end; NUMBA_CACHE_DIR can name a folder" in sentence


def test_a_disk_that_is_full_costs_no_more_than_a_sentence(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    script = """
import resource, sys, warnings
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))  # bytes: as if no more were left
from exactcreep import compiling
sys.path.insert(0, sys.argv[1])
from functions import once, twice
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    print(once(21), twice(21), *[each.message for each in said], sep=chr(10))
"""
    text = TWICE + TWICE.partition("compiling\n")[2].replace("twice", "once")
    (tmp_path / "functions.py").write_text(text, encoding="utf-8")
    kept = tmp_path / "kept"
    done = finished(sys.executable, "-B", "-c", script, str(tmp_path), NUMBA_CACHE_DIR=str(kept))
    once, twice, *said = done.stdout.splitlines()
    assert (once, twice) == ("42", "42")
    (sentence,) = said
    assert sentence.startswith(str(kept))
    assert "is lost at the end; NUMBA_CACHE_DIR can name a folder" in sentence


SCALED = """
from exactcreep import compiling
from factors import FACTOR
@compiling.njit(cache=True)
def scaled(x):
    return FACTOR * x
print(f"{scaled(21.0)} {sum(scaled.stats.cache_hits.values())}\\n", end="", flush=True)  # at once
"""
FORKS = """
import os, sys
_, folder, os.environ["NUMBA_CACHE_DIR"] = sys.argv
from exactcreep import compiling  # once: each process that compiles is a fork
sys.path.insert(0, folder)
for line in sys.stdin:
    for _ in range(int(line)):
        if os.fork() == 0:
            import scaled
            os._exit(0)
    assert all(os.wait()[1] == 0 for _ in range(int(line)))
"""


def test_kept_code_is_found_and_made_anew_if_it_is_damaged_or_a_constant_beside_it_changes(
    tmp_path: Path,
) -> None:
    (tmp_path / "scaled.py").write_text(SCALED, encoding="utf-8")
    kept = tmp_path / "kept"
    words = (sys.executable, "-B", "-c", FORKS, str(tmp_path), str(kept))
    with begun(*words, stdin=subprocess.PIPE) as process:

        def scaled(factor: int, at_once: int = 1) -> list[str]:
            (tmp_path / "factors.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
            print(at_once, file=process.stdin, flush=True)
            return [process.stdout.readline() for _ in range(at_once)]

        assert [*scaled(2), *scaled(3), *scaled(3)] == ["42.0 0\n", "63.0 0\n", "63.0 1\n"]
        for ending in ("nbi", "nbc"):
            for file in kept.rglob(f"*.{ending}"):
                file.write_bytes(file.read_bytes()[:-100])
            assert scaled(3) == ["63.0 0\n"]
        shutil.rmtree(kept)
        assert {line[:4] for line in scaled(3, 3)} == {"63.0"}  # first starts that race
        assert scaled(3) == ["63.0 1\n"]
        assert process.communicate() == ("", "")
