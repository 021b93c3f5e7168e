"""python/examples/tutorial.ipynb: it is the tutorial, and it runs."""

import pathlib
import runpy

import pytest

import adaptive_bvh as ab

EXAMPLES = pathlib.Path(__file__).resolve().parent.parent / "examples"


def test_the_notebook_is_that_of_the_tutorial():
    made = runpy.run_path(str(EXAMPLES / "notebook.py"))["notebook"]
    tutorial = (EXAMPLES / "tutorial.py").read_text()
    assert made(tutorial) == (EXAMPLES / "tutorial.ipynb").read_text(), "run notebook.py"


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    try:
        ab.Recording()
    except RuntimeError as missing:
        pytest.skip(str(missing))
    notebook = nbformat.read(EXAMPLES / "tutorial.ipynb", as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": tmp_path}})
    client.execute()
    printed = "".join(
        output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", [])
    )
    assert "1. distance 0.2500 m" in printed and "5. the copy answers the same: True" in printed
    assert (tmp_path / "page.html").read_text().rstrip().endswith("</html>")
