"""Pictures and tables of the page *The paper's figures*, by the commands of the page (six minutes of two cores)."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from PIL import Image

BOOK = Path(__file__).parents[1]
PAGE, MADE = BOOK / "reference" / "figures.md", BOOK / "pictures" / "paper"

for line in re.findall(r"^\$ exactcreep (run .*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE):
    words = shlex.split(line)
    if not sys.argv[1:] or words[1] in sys.argv[1:]:
        told = subprocess.run(
            [sys.executable, "-m", "exactcreep", *words, "--force"], cwd=MADE, check=True,
            stdout=subprocess.PIPE, encoding="utf-8",
            env=os.environ | {"COLUMNS": "112", "PYTHONPATH": str(BOOK.parent)},
        ).stdout  # fmt: skip
        lines = [row.rstrip() for row in told.splitlines() if not row.startswith("time ")]
        with Image.open(picture := MADE / f"{words[1]}.png") as drawn:
            drawn.convert("RGB").quantize(64).save(picture, optimize=True)
        (MADE / f"{words[1]}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
