"""Where compiled code is kept: read-only installations, containers without a home."""

import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from exactcreep.watch import interrupts
from tests.processes import PATIENCE, begun, finished


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


TWO = """
from exactcreep import compiling
once, twice = (compiling.njit(cache=True)(lambda x, k=k: k * x) for k in (1, 2))
"""
COUNTED = """
import sys, warnings
sys.path.insert(0, sys.argv[1])
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    from functions import once, twice
    print(once(21), twice(21), *[each.message for each in said], sep=chr(10))
"""


@pytest.mark.parametrize(
    "lost",
    [
        "from numba.core.caching import CacheImpl; CacheImpl._locator_classes = []",
        "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))",
    ],
    ids=["no folder can be written", "the disk is full"],
)
def test_compiled_code_that_cannot_be_kept_costs_no_more_than_a_sentence(
    lost: str, tmp_path: Path
) -> None:
    pytest.importorskip("resource")
    (tmp_path / "functions.py").write_text(TWO, encoding="utf-8")
    words = (sys.executable, "-B", "-c", lost + COUNTED, str(tmp_path))
    done = finished(*words, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    once, twice, sentence = done.stdout.splitlines()
    assert (once, twice) == ("21", "42")
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
                whole = file.read_bytes()
                place = len(whole) * 3 // 4
                flipped = whole[place] ^ 1
                file.write_bytes(whole[:place] + bytes([flipped]) + whole[place + 1 :])
            assert scaled(3) == ["63.0 0\n"]
        shutil.rmtree(kept)
        assert {line[:4] for line in scaled(3, 3)} == {"63.0"}  # first starts that race
        assert scaled(3) == ["63.0 1\n"]
        assert process.communicate() == ("", "")
