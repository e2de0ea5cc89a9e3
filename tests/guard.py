"""The guard: in what does this working tree differ from another build, bit by bit?

``python tests/guard.py [COMMIT] [--quick] [--except PATTERN]...`` runs COMMIT (default HEAD) in a
temporary worktree and the present working tree, each in a process of its own, both afresh: scenes
under every solver, the hard cases, checkpoints, every command, and bad input. Then it lists every
field in which they differ, with both values. A change that means to alter fields names them:

    python tests/guard.py HEAD --except '*/residual' --except 'public/*'

Patterns are those of `fnmatch`; ``*`` also spans slashes. Exit status: 0 nothing else differs,
1 something does, 2 a build could not be recorded.

Both builds are compiled anew, which takes most of the time of ``--quick``. COMMIT may be a
directory that holds a build, and ``--cached`` takes the compiled code that lies beside each build:
quick to repeat, but wrong after an edit of a module whose functions are compiled into another's.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
RECORDER = Path(__file__).with_name("recorder.py")
IGNORED = {
    "*/seconds": "a measured time",
    "*.seconds": "a measured time",
    "*/seconds_*": "a measured speed",
    "commands/plan */json/*/seconds": "a predicted time, from a measured speed",
    "*--max-bytes */json/[!or]*": "memory is looked at between stretches, which follow the clock",
    "*--max-bytes */json/rearrangements": "memory is looked at between stretches",
    "resumed/*-sliding/early/*": "its events are counted between stretches, which follow the clock",
    "*.version": "the version of the build",
    "commands/--version/out": "the version of the build",
}
"""Fields that two runs of the same build need not share, and why; all others are compared."""
ABSENT = "absent"


def differences(
    old: Mapping[str, Any], new: Mapping[str, Any], allowed: Sequence[str] = ()
) -> dict[str, str]:
    """Return, for each field that differs, the value in each build, in words.

    Parameters
    ----------
    old, new : mapping of str to value
        What `tests/recorder.py` wrote.
    allowed : sequence of str
        Patterns of further fields that may differ.
    """
    patterns = [*IGNORED, *allowed]
    return {
        name: told(old.get(name, ABSENT), new.get(name, ABSENT))
        for name in [*old, *(name for name in new if name not in old)]
        if (name not in old or name not in new or not same(old[name], new[name]))
        and not any(fnmatchcase(name, pattern) for pattern in patterns)
    }


def same(old: Any, new: Any) -> bool:
    """Return whether two recorded values are equal, types included: True is not 1."""
    return json.dumps(old) == json.dumps(new)


def told(old: Any, new: Any) -> str:
    """Return how two values differ; of two lists the first entry that does, and by how much."""
    if not isinstance(old, list) or not isinstance(new, list):
        return f"{shown(old)} -> {shown(new)}"
    pairs = list(zip(old, new, strict=False))
    unlike = [index for index, pair in enumerate(pairs) if not same(*pair)]
    words = [f"{len(old)} -> {len(new)} entries"] if len(old) != len(new) else []
    if unlike:
        before, after = pairs[unlike[0]]
        words.append(f"[{unlike[0]}] {shown(before)} -> {shown(after)}")
        words.append(f"{len(unlike)} of {len(pairs)} differ")
    numbers = [(as_number(before), as_number(after)) for before, after in pairs]
    gaps = [abs(after - before) for before, after in numbers
            if before is not None and after is not None]  # fmt: skip
    if unlike and gaps:
        words.append(f"by at most {max(gaps, key=lambda gap: (gap != gap, gap)):.3g}")
    return "; ".join(words)


def as_number(value: Any) -> float | None:
    """Return the number that a recorded value is; None if it is none."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    with suppress(TypeError, ValueError):
        return float.fromhex(value) if "0x" in value else float(value)
    return None


def shown(value: Any) -> str:
    """Return a recorded value for the eye; digits enough to tell two floats apart."""
    if isinstance(value, list):
        return f"[{', '.join(map(shown, value[:6]))}{', ...' * (len(value) > 6)}]"
    number = as_number(value) if isinstance(value, str) and "0x" in value else None
    text = str(value) if number is None else repr(number)
    return text if len(text) <= 300 else f"{text[:300]}..."


def recorded(builds: Mapping[str, Path], options: Sequence[str], *, cached: bool) -> list[Any]:
    """Return what each build does, side by side in processes and directories of their own.

    Raises
    ------
    SystemExit
        If one of them cannot be recorded.
    """
    with tempfile.TemporaryDirectory(prefix="guard-") as folder:
        running = {}
        try:
            for name, build in builds.items():
                if not (build / "exactcreep" / "__init__.py").is_file():  # lest another be found
                    raise SystemExit(f"guard: {build} holds no exactcreep")
                here = Path(folder, name, "here")
                here.mkdir(parents=True)
                own = {"PYTHONPATH": str(build), "COLUMNS": "240", "MPLBACKEND": "Agg",
                       "PYTHONHASHSEED": "0", "NO_COLOR": "1", "TERM": "dumb"}  # fmt: skip
                if not cached:
                    own["NUMBA_CACHE_DIR"] = str(Path(folder, name, "compiled"))
                words = [sys.executable, "-P", str(RECORDER), "../recorded.json", *options]
                running[name] = subprocess.Popen(words, cwd=here, env=os.environ | own)
            for name, process in running.items():
                if process.wait() != 0:
                    sys.stderr.write(f"guard: the build {name} could not be recorded\n")
                    raise SystemExit(2)
            return [json.loads(Path(folder, name, "recorded.json").read_text("utf-8"))
                    for name in builds]  # fmt: skip
        finally:
            for process in running.values():
                process.kill()
                process.wait()


@contextmanager
def build_of(commit: str) -> Iterator[Path]:
    """Yield a directory with the build of a commit, and remove it; a directory stays as it is."""
    if Path(commit).is_dir():
        yield Path(commit).resolve()
        return
    with tempfile.TemporaryDirectory(prefix="guard-") as folder:
        tree = Path(folder, "build")
        try:
            git("worktree", "add", "--quiet", "--detach", str(tree), commit)
            yield tree
        finally:
            git("worktree", "remove", "--force", str(tree))


def git(*words: str) -> None:
    """Run git in this repository; leave with status 2 if it fails."""
    if subprocess.run(["git", "-C", str(ROOT), *words], check=False).returncode:
        raise SystemExit(2)


def report(found: Mapping[str, str], compared: int, most: int) -> None:
    """Print the fields that differ, at most `most` of them, and how many there are of each kind."""
    for name, words in list(found.items())[: most or None]:
        print(f"{name}\n    {words}")
    if 0 < most < len(found):
        print(f"... and {len(found) - most} more; --show 0 lists them all")
    kinds = Counter((name.split("/")[0], name.rpartition("/")[2]) for name in found)
    for (group, last), count in kinds.most_common(40 if len(found) > most else 0):
        print(f"{count:6}  {group}/*/{last}")
    print(f"{len(found)} of {compared} fields differ")


def main(words: Sequence[str] | None = None) -> int:
    """Compare two builds, print in what they differ, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", nargs="?", default="HEAD", metavar="COMMIT")
    parser.add_argument("--quick", action="store_true", help="fewer and shorter runs")
    parser.add_argument("--except", action="append", default=[], metavar="PATTERN", dest="allowed",
                        help="fields that are meant to change; repeatable")  # fmt: skip
    parser.add_argument("--only", action="append", default=[], metavar="GROUP",
                        help="record this group alone; repeatable")  # fmt: skip
    parser.add_argument("--show", type=int, default=60, metavar="K", help="list K fields; 0: all")
    parser.add_argument("--cached", action="store_true", help="take code compiled before")
    asked = parser.parse_args(words)
    options = ["--quick"] * asked.quick + [f"--only={group}" for group in asked.only]
    with build_of(asked.commit) as build:
        old, new = recorded({"old": build, "new": ROOT}, options, cached=asked.cached)
    found = differences(old, new, asked.allowed)
    report(found, len({*old, *new}), asked.show)
    return 1 if found else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the worktree is removed
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
