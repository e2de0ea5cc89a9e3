"""Every notebook runs from its first cell to its last, and its assertions hold."""

import ast
import json
import os
import sys
import time
import warnings
from pathlib import Path
from queue import Empty
from typing import Any

import nbformat
import pytest

import exactcreep

with warnings.catch_warnings():  # what the kernel's clients say about themselves when imported
    warnings.simplefilter("ignore")
    from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
LARGEST_FILE = 400_000
STUDIES = ("05", "07", "10", "11", "12", "13", "14", "15", "16")
"""Notebooks that compute for long; they run with `pytest -m slow`."""


class Client(NotebookClient):
    """A client that looks for replies every second.

    Where a widget makes it write to the channel on which it waits, it is not woken by the reply
    (nbclient issue 312).
    """

    async def async_start_new_kernel_client(self, **options: Any) -> Any:
        """Return the client of a new kernel."""
        made = await super().async_start_new_kernel_client(**options)
        get = made.shell_channel.get_msg

        async def often(timeout: float = 60) -> Any:
            deadline = time.monotonic() + timeout
            while True:
                try:
                    return await get(timeout=1)
                except Empty:
                    if time.monotonic() > deadline:
                        raise

        made.shell_channel.get_msg = often
        return made


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def code_cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture
def kernel_of_this_interpreter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the name of a kernel that runs this Python and imports what the tests import."""
    folder = tmp_path / "kernels" / "these-tests"
    folder.mkdir(parents=True)
    command = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    about = {"argv": command, "display_name": "these tests", "language": "python"}
    (folder / "kernel.json").write_text(json.dumps(about), encoding="utf-8")
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    monkeypatch.delenv("EXACTCREEP_FULL", raising=False)
    monkeypatch.delenv("MPLBACKEND", raising=False)
    return "these-tests"


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * path.name.startswith(STUDIES))
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs_and_its_assertions_hold(
    path: Path, kernel_of_this_interpreter: str
) -> None:
    notebook = read(path)
    client = Client(
        notebook,
        timeout=300,
        kernel_name=kernel_of_this_interpreter,
        resources={"metadata": {"path": str(path.parent)}},
        record_timing=False,
    )
    client.execute()
    assert all(cell.execution_count for cell in code_cells(notebook))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_a_notebook_takes_from_the_package_is_there(path: Path) -> None:
    for cell in code_cells(read(path)):
        for node in ast.walk(ast.parse(cell.source)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("exactcreep"):
                exec(ast.unparse(node), {})
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "ec":
                assert hasattr(exactcreep, node.attr)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_as_it_ran_with_its_pictures(path: Path) -> None:
    notebook = read(path)
    nbformat.validate(notebook)
    cells = code_cells(notebook)
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not [output for output in outputs if output.output_type == "error"]
    assert not [output for output in outputs if output.get("name") == "stderr"]
    widget = "application/vnd.jupyter.widget-view+json"  # an erased progress bar, an empty box
    assert not [output for output in outputs if widget in output.get("data", {})]
    assert "assert " in cells[-1].source
    assert path.stat().st_size < LARGEST_FILE
