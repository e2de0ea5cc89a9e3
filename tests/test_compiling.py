"""Where compiled code is kept: read-only installations, containers without a home."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import exactcreep
from tests.processes import PATIENCE, environment, finished

NOBODY = 65534
BECOMES = ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
ASKS = """
import sys, warnings
sys.path.insert(0, {installed!r})
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    from exactcreep.twice import compiling, twice
print(compiling.__file__, twice(21), *[each.message for each in said], sep=chr(10))
"""
TWICE = """
from exactcreep import compiling
@compiling.njit(cache=True)
def twice(x):
    return 2 * x
"""


def may_become_nobody() -> bool:
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        return False
    words = (*BECOMES, sys.executable, "-c", "import numba")
    return subprocess.run(words, capture_output=True, check=False, timeout=PATIENCE).returncode == 0


@pytest.fixture
def place() -> Iterator[Path]:
    """Yield a folder with an installation that belongs to root, and a scratch folder for all."""
    if not may_become_nobody():
        pytest.skip("becomes an unprivileged user, which root alone can")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(Path(exactcreep.__file__).parent, folder / "exactcreep", ignore=ignore)
        (folder / "exactcreep" / "twice.py").write_text(TWICE, encoding="utf-8")
        (folder / "scratch").mkdir(mode=0o777)
        (folder / "scratch").chmod(0o1777)
        (folder / "asks.py").write_text(ASKS.format(installed=name), encoding="utf-8")
        yield folder


def asked(place: Path) -> list[str]:
    """Return the lines that the installation says to a user who has no home."""
    own = {"HOME": "/nonexistent", "TMPDIR": str(place / "scratch"), "XDG_CACHE_HOME": ""}
    done = subprocess.run(
        (*BECOMES, sys.executable, "-B", str(place / "asks.py")), check=True, cwd="/",
        env=environment(**own, NUMBA_CACHE_DIR=""), capture_output=True, text=True,
        timeout=PATIENCE,
    )  # fmt: skip
    where, answer, *said = done.stdout.splitlines()
    assert where == str(place / "exactcreep" / "compiling.py")
    assert answer == "42"
    return said


def test_a_read_only_installation_without_a_home_keeps_no_code_and_says_so(place: Path) -> None:
    (said,) = asked(place)
    assert "is lost at the end; NUMBA_CACHE_DIR can name a folder" in said
    assert not any((place / "scratch").iterdir())


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
import sys
from exactcreep import compiling
from factors import FACTOR
@compiling.njit(cache=True)
def scaled(x):
    return FACTOR * x
print(scaled(21.0), sum(scaled.stats.cache_hits.values()))
"""


def test_kept_code_is_found_and_made_anew_if_it_is_damaged_or_a_constant_beside_it_changes(
    tmp_path: Path,
) -> None:
    (tmp_path / "scaled.py").write_text(SCALED, encoding="utf-8")
    script = "import sys; sys.path.insert(0, sys.argv[1]); import scaled"
    words = (sys.executable, "-B", "-c", script, str(tmp_path))
    kept = tmp_path / "kept"

    def scaled(factor: int) -> str:
        (tmp_path / "factors.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
        done = finished(*words, NUMBA_CACHE_DIR=str(kept))
        assert done.stderr == ""
        return done.stdout

    assert [scaled(factor) for factor in (2, 3, 3)] == ["42.0 0\n", "63.0 0\n", "63.0 1\n"]
    for ending in ("nbi", "nbc"):
        for file in kept.rglob(f"*.{ending}"):
            file.write_bytes(file.read_bytes()[:-100])
        assert scaled(3) == "63.0 0\n"
    shutil.rmtree(kept)
    own = environment(NUMBA_CACHE_DIR=str(kept))  # first starts that race
    racing = [subprocess.Popen(words, env=own) for _ in range(3)]
    assert [process.wait(PATIENCE) for process in racing] == [0, 0, 0]
    assert scaled(3) == "63.0 1\n"
