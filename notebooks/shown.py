"""What the examples of a page print and draw, made by running them when the book is built.

Below a block of code ``<<printed>>`` stands for what it printed, and ``<<drawn FILE: alternative text>>``
for a picture that it wrote. The blocks of a page run in their order, in one empty directory: Python
in one namespace, lines of a shell that begin with ``exactcreep`` as commands.
"""

import contextlib
import io
import os
import re
import shlex
import shutil
import tempfile
from pathlib import Path
from unittest.mock import patch

import matplotlib as mpl
import matplotlib.pyplot as plt

from exactcreep.cli import status
from exactcreep.figures.style import STYLE

BOOK = Path(__file__).parent
MADE = BOOK / "pictures" / "made"
TERMINAL = patch.dict(os.environ, {"COLUMNS": "96", "NO_COLOR": "1"})
"""The terminal that commands believe to print on."""
_PART = re.compile(
    r"^```(?P<language>python|sh|toml)\n(?P<code>.*?)^```$"
    r"|^<<(?P<printed>printed)>>$"
    r"|^<<drawn (?P<file>[\w.-]+): (?P<seen>[^>]*)>>$",
    re.MULTILINE | re.DOTALL,
)


def shown(text, page):
    """Return the text of a page with what its examples print and draw."""
    if "\n<<printed>>\n" not in text and "\n<<drawn " not in text:
        return text
    with tempfile.TemporaryDirectory() as folder, mpl.rc_context(STYLE), TERMINAL:
        session = _Session(Path(folder), page)
        with_pictures = _PART.sub(session.replaced, text)
        plt.close("all")
    return with_pictures


class _Session:
    """The examples of one page, each run where the ones before it left off."""

    def __init__(self, folder, page):
        self.folder, self.names, self.printed = folder, {}, ""
        self.page = page.replace("/", "-")

    def replaced(self, part):
        """Run a block and keep it as it is, or put what the last one made in place of a line."""
        if part["printed"]:
            assert self.printed.strip(), f"{self.page}: nothing was printed"
            lines = "\n".join(map(str.rstrip, self.printed.rstrip().splitlines()))
            return f"```text\n{lines}\n```"
        if part["file"]:
            return self._picture(part["file"], " ".join(part["seen"].split()))
        run = {"python": self._python, "sh": self._shell, "toml": self._scene}[part["language"]]
        self.printed = run(part["code"])
        return part[0]

    def _picture(self, file, seen):
        kept = MADE / f"{self.page}-{file}"
        shutil.copyfile(self.folder / file, kept)
        return f"![{seen}](/{kept.relative_to(BOOK).as_posix()})"

    def _python(self, code):
        if code.startswith(">>>"):  # what an example of this kind prints stands in it
            lines = [line[4:] for line in code.splitlines() if line.startswith((">>> ", "... "))]
            code = "\n".join(lines)
        heard = io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(heard):
            exec(compile(code, f"<{self.page}>", "exec"), self.names)
        return heard.getvalue()

    def _shell(self, code):
        heard, failed = io.StringIO(), io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(heard):
            for line in code.splitlines():
                if line.startswith("exactcreep "):
                    with contextlib.redirect_stderr(failed):
                        done = status(shlex.split(line, comments=True)[1:])
                    limited = 3 if "--max-events" in line else 0
                    assert done == limited, f"{self.page}: {line}: {failed.getvalue()}"
        return heard.getvalue()

    def _scene(self, code):
        (self.folder / "my-scene.toml").write_text(code, encoding="utf-8")
        return ""
