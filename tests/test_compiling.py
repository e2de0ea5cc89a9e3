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
from exactcreep import compiling
from factors import FACTOR
@compiling.njit(cache=True)
def scaled(x):
    return FACTOR * x
print(scaled(21.0), sum(scaled.stats.cache_hits.values()))
"""


def test_code_is_compiled_anew_once_a_constant_in_a_module_beside_it_changes(
    tmp_path: Path,
) -> None:
    (tmp_path / "scaled.py").write_text(SCALED, encoding="utf-8")
    script = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import scaled"
    said = []
    for factor in (2, 3, 3):
        (tmp_path / "factors.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
        said.append(finished(sys.executable, "-B", "-c", script, NUMBA_CACHE_DIR=""))
    assert [one.stdout for one in said] == ["42.0 0\n", "63.0 0\n", "63.0 1\n"], said[1].stderr


TWICE_THEN_HITS = """
import sys
sys.path.insert(0, sys.argv[1])
from functions import twice
print(twice(21), sum(twice.stats.cache_hits.values()))
"""


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Return where the compiled code of ``functions.twice`` is to be kept."""
    (tmp_path / "functions.py").write_text(TWICE, encoding="utf-8")
    return tmp_path / "kept"


def test_code_that_was_kept_in_a_damaged_file_is_compiled_anew_and_kept_again(kept: Path) -> None:
    words = (sys.executable, "-B", "-c", TWICE_THEN_HITS, str(kept.parent))
    for ending in ("nbi", "nbc"):
        assert finished(*words, NUMBA_CACHE_DIR=str(kept)).returncode == 0
        (file,) = kept.rglob(f"*.{ending}")
        file.write_bytes(file.read_bytes()[:-100])
        anew = finished(*words, NUMBA_CACHE_DIR=str(kept))
        assert (anew.stdout, anew.stderr) == ("42 0\n", "")
    assert finished(*words, NUMBA_CACHE_DIR=str(kept)).stdout == "42 1\n"


def test_first_starts_that_race_keep_code_that_the_next_start_finds(kept: Path) -> None:
    words = (sys.executable, "-B", "-c", TWICE_THEN_HITS, str(kept.parent))
    own = environment(NUMBA_CACHE_DIR=str(kept))
    racing = [subprocess.Popen(words, env=own, stdout=subprocess.PIPE) for _ in range(3)]
    for process in racing:
        assert process.communicate(timeout=PATIENCE)[0] in (b"42 0\n", b"42 1\n")
        assert process.returncode == 0
    assert finished(*words, NUMBA_CACHE_DIR=str(kept)).stdout == "42 1\n"
