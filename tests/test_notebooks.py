"""Every notebook runs from its first cell to its last, and its assertions hold."""

import ast
from pathlib import Path
from typing import Any

import matplotlib as mpl
import nbformat
import pytest

import exactcreep

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
STUDIES = ("05", "07", "10", "11", "12", "13", "14", "15", "16")
"""Notebooks that compute for long; they run with `pytest -m slow`."""


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def code_cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * path.name.startswith(STUDIES))
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs_and_its_assertions_hold(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(path.parent)
    monkeypatch.delenv("EXACTCREEP_FULL", raising=False)
    names: dict[str, Any] = {}
    with mpl.rc_context():
        for cell in code_cells(read(path)):
            exec(compile(cell.source, f"{path.stem}, {cell.id}", "exec"), names)


@pytest.mark.parametrize("path", [path for path in NOTEBOOKS if path.name.startswith(STUDIES)])
def test_what_a_study_takes_from_the_package_is_there(path: Path) -> None:
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
    assert "assert " in cells[-1].source
