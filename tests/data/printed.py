"""Store the numbers that commands print in ``printed.json``: ``python -m tests.data.printed``."""

import contextlib
import io
import json
import os
import tempfile
from pathlib import Path

from exactcreep.cli import status
from tests.commands.test_commands import EVERY, make_files, numbers

TIMED = {"compare"}
"""Commands with times between the other numbers."""


def printed(*words: str) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        status(words)
    return numbers(out.getvalue())


if __name__ == "__main__":
    os.environ["COLUMNS"] = "80"
    kept = Path(__file__).with_suffix(".json")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        make_files(printed)
        found = {name: printed(name, *EVERY[name][0]) for name in EVERY.keys() - TIMED}
    kept.write_text(json.dumps({name: found[name] for name in sorted(found)}, indent=1) + "\n")
