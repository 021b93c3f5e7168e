"""Writes tutorial.ipynb, a notebook of tutorial.py: a cell for each of its parts.

    python3 notebook.py
"""
import json
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
LANGUAGE = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
PAGE = """import sys

sys.argv = ["tutorial.py", "page.html"]  # part 2 writes this page"""
SHOW = """from IPython.display import IFrame

IFrame("page.html", width="100%", height=700)"""


def cell(kind, text):
    made = {"cell_type": kind, "metadata": {}, "source": text.strip("\n").splitlines(keepends=True)}
    return {**made, "execution_count": None, "outputs": []} if kind == "code" else made


def notebook(program):
    """The notebook of a program whose parts begin with lines "# ---- 1. Title ---"."""
    doc, program = re.fullmatch(r'"""(.*?)\n.*?"""\n(.*)', program, re.S).groups()
    first, *parts = re.split(r"^# ---- (\d+\. .*?) -+$", program, flags=re.M)
    cells = [cell("markdown", f"# {doc}"), cell("code", PAGE), cell("code", first)]
    for title, part in zip(parts[::2], parts[1::2]):
        comment, code = re.fullmatch(r"\n((?:#[^\n]*\n)*)(.*)", part, re.S).groups()
        text = re.sub(r"^# ?", "", comment, flags=re.M)
        cells += [cell("markdown", f"## {title}\n\n{text}"), cell("code", code)]
    cells += [cell("markdown", "The page that part 2 wrote:"), cell("code", SHOW)]
    for i, each in enumerate(cells):
        each["id"] = f"cell-{i}"
    made = {"cells": cells, "metadata": LANGUAGE, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(made, indent=1) + "\n"


if __name__ == "__main__":
    (HERE / "tutorial.ipynb").write_text(notebook((HERE / "tutorial.py").read_text()))
