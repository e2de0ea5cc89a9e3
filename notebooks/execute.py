"""Run notebooks of this folder anew and keep what they put out: ``python notebooks/execute.py 01 05``.

Without arguments all of them. What progress bars leave is not kept.
"""

import base64
import io
import os
import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

HERE = Path(__file__).parent


def is_progress(output):
    """Tell whether an output is the remainder of a progress bar, erased or of a compilation."""
    data = output.get("data", {})
    return (
        data.get("text/plain") == ""
        or "application/vnd.jupyter.widget-view+json" in data
        or "compiling for this kind of run" in data.get("text/plain", "")
    )


def compact(output):
    """Store a picture with a palette of 256 colours, as a third of the bytes."""
    if picture := output.get("data", {}).get("image/png"):
        smaller = io.BytesIO()
        with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
            image.convert("RGB").quantize(256).save(smaller, format="png", optimize=True)
        output["data"]["image/png"] = base64.b64encode(smaller.getvalue()).decode()
    return output


def execute(path):
    """Run a notebook from its first cell to its last, and write it with what it put out."""
    notebook = nbformat.read(path, as_version=4)
    about = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, timeout=1800, resources=about, record_timing=False).execute()
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = [compact(each) for each in cell.outputs if not is_progress(each)]
    for of_this_machine in ("language_info", "widgets"):
        notebook.metadata.pop(of_this_machine, None)
    nbformat.write(notebook, path)


if __name__ == "__main__":
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])
    begun = tuple(sys.argv[1:]) or ("",)
    for path in sorted(HERE.glob("*.ipynb")):
        if path.name.startswith(begun):
            start = time.perf_counter()
            execute(path)
            print(f"{path.name}: {time.perf_counter() - start:.0f} s", flush=True)
