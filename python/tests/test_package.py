"""The package beside its module: types, signatures, docstrings, example."""

import ast
import inspect
import os
import pathlib
import re
import runpy
import subprocess
import sys

import numpy as np
import pytest
from recorded_page import Page

import adaptive_bvh as ab

HERE = pathlib.Path(__file__).parent
PACKAGE = pathlib.Path(ab.__file__).parent
STUB = ast.parse((PACKAGE / "__init__.pyi").read_text())


def test_stubtest():
    pytest.importorskip("mypy.stubtest", reason="mypy is not installed")
    run = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "adaptive_bvh", "--ignore-unused-allowlist",
         "--allowlist", str(HERE / "stubtest_allowlist.txt")],
        env={**os.environ, "MYPYPATH": str(PACKAGE.parent), "PYTHONPATH": str(PACKAGE.parent)},
        capture_output=True, text=True, cwd=PACKAGE.parent)
    assert run.returncode == 0, run.stdout + run.stderr


def functions_in_stub():
    """Name, and the parameters with their defaults, of all functions and methods."""
    for node in STUB.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef) and node.name[0] != "_":
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    properties = [ast.unparse(d) for d in member.decorator_list]
                    if not any("property" in p or "setter" in p for p in properties):
                        yield node.name + "." + member.name, member


def parameters(node):
    a = node.args
    positional = [p.arg for p in a.args if p.arg != "self"]
    defaults = dict(zip(reversed(positional), reversed([ast.unparse(d) for d in a.defaults])))
    defaults.update({p.arg: ast.unparse(d) for p, d in zip(a.kwonlyargs, a.kw_defaults) if d})
    return positional, [p.arg for p in a.kwonlyargs], defaults


def signatures_in_docstring(text, name):
    """As pybind11 writes them: of one function, or numbered ones of several."""
    for line in text.splitlines():
        match = re.match(r"(?:\d+\. )?" + re.escape(name) + r"\((.*)\) -> ", line)
        if match:
            yield match.group(1)


def test_stub_has_the_parameters_and_defaults_of_the_module():
    checked = 0
    documented = {}
    for path, node in functions_in_stub():
        target = ab
        for part in path.split("."):
            target = getattr(target, part)
        name = path.split(".")[-1]
        if name in ("__eq__", "__hash__", "__len__"):
            continue
        positional, keywords, defaults = parameters(node)
        found = []
        if inspect.isfunction(target):  # of Python
            signatures = [str(inspect.signature(target))[1:-1]]
        else:
            signatures = signatures_in_docstring(target.__doc__, name)
        for signature in signatures:
            fake = ast.parse(f"def f({re.sub(r'adaptive_bvh[.]', '', signature)}): ...").body[0]
            found.append(parameters(fake))
        documented[path] = found
        for _, _, theirs in found:
            for key, value in theirs.items():
                if value == "inf":  # of vertex_distances: a number that has no literal
                    theirs[key] = "..."
        # The second way to call DeformableMesh is the first with one argument less.
        same = [f for f in found if (f[0], f[1]) == (positional, keywords)]
        assert same, (path, positional, keywords, found)
        for key, value in defaults.items():
            assert same[0][2].get(key) == value, (path, key)
        checked += 1
    assert checked > 50


ARRAYS = {"numpy.float64": "_Floats", "numpy.int32": "_Ints", "numpy.int64": "_Longs",
          "bool": "_Bools"}


def type_in_stub(text):
    """A type as pybind11 generates it, as the stub writes it."""
    text = re.sub(r"adaptive_bvh\.", "", text)
    text = re.sub(r"\b(tuple|list|dict)\[", lambda match: match.group(0).capitalize(), text)
    return re.sub(r"numpy\.ndarray\[([\w.]+)\]", lambda match: ARRAYS[match.group(1)], text)


def agree(generated, written):
    """Whether the stub's type is the generated one, or says more."""
    vague = {"object": "", "tuple": "Tuple", "list": "List", "str": "(str|Literal|_Kind)",
             "numpy.ndarray": "(npt.NDArray|_)"}
    generated = type_in_stub(generated)
    return generated == written or bool(re.match(vague.get(generated, "$"), written))


def results_in_stub():
    """Name and type of what functions return and of properties."""
    for name, node in functions_in_stub():
        yield name, ast.unparse(node.returns)
    for node in STUB.body:
        if isinstance(node, ast.ClassDef) and node.name[0] != "_":
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and member.decorator_list:
                    if ast.unparse(member.decorator_list[0]) == "property":
                        yield node.name + "." + member.name, ast.unparse(member.returns)


def test_stub_has_the_results_of_the_module():
    checked = 0
    for path, written in results_in_stub():
        target = ab
        for part in path.split("."):
            target = getattr(target, part)
        text = target.fget.__doc__ if isinstance(target, property) else target.__doc__
        generated = re.findall(r"\) -> (.+)$", text.split("\n\n")[0], re.M)
        generated += re.findall(r"^\d+\. .*\) -> (.+)$", text, re.M)
        if generated:
            assert any(agree(g, written) for g in generated), (path, generated, written)
            checked += 1
    assert checked > 200


def test_everything_public_has_a_docstring():
    for name in ab.__all__:
        thing = getattr(ab, name)
        assert thing.__doc__, name
        if inspect.isclass(thing) and name != "MeshLoadError":
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    assert value.__doc__, name + "." + member
        assert thing.__module__ in ("adaptive_bvh", "adaptive_bvh._core"), name
    assert "(N, 3)" in ab.__doc__ and ab.__version__.count(".") == 2


def test_public_names_are_those_of_the_module():
    core = {n for n in dir(ab._core) if not n.startswith("_")}
    assert core | {"Recording"} == set(ab.__all__)
    assert ast.literal_eval(STUB.body[-1].value) == ab.__all__


def run_tutorial(capsys, monkeypatch, *arguments):
    tutorial = HERE.parent / "examples" / "tutorial.py"
    monkeypatch.setattr(sys, "argv", ["tutorial.py", *arguments])
    runpy.run_path(str(tutorial), run_name="__main__")
    return capsys.readouterr().out.splitlines()


def test_tutorial(capsys, monkeypatch):
    lines = run_tutorial(capsys, monkeypatch)
    assert lines[0] == "1. distance 0.2500 m, between z = 0.0000 and 0.2500"
    bears = next(line for line in lines if "bears" in line)
    assert float(re.search(r"bears ([0-9.]+) of", bears).group(1)) == pytest.approx(1, abs=0.02)
    assert "3. touching: net and post 3" in lines
    rays = re.match(r"4. (\d+) of 10000 rays hit, deepest at z = (.*) m, (\d+)% lit", lines[-2])
    # The net is a square of side 1, which the camera sees within a square of side 1.2 as before.
    assert 6500 < int(rays.group(1)) < 7225 and -0.2 < float(rays.group(2)) < -0.1
    assert 20 < int(rays.group(3)) < 95
    assert lines[-1] == "5. the copy answers the same: True"


@pytest.fixture
def page(tmp_path):
    """Where a program writes a page, if the component recording is there."""
    try:
        ab.Recording()
    except RuntimeError as missing:
        pytest.skip(str(missing))
    return tmp_path / "page.html"


def test_tutorial_writes_a_page(capsys, monkeypatch, page):
    run_tutorial(capsys, monkeypatch, str(page))
    text = page.read_text()
    assert "force on the net, N" in text and text.rstrip().endswith("</html>")


def test_contact_signs(capsys, monkeypatch, page):
    monkeypatch.setattr(sys, "argv", ["contact_signs.py", str(page)])
    program = runpy.run_path(str(HERE.parent / "examples" / "contact_signs.py"))
    lines = capsys.readouterr().out.splitlines()
    upward = [float(re.search(r", ([0-9.]+) N upward", line).group(1)) for line in lines]
    assert 0 < upward[0] < upward[1] < upward[2]
    contacts = program["contacts"]
    assert (contacts.distances[contacts.positions[:, 2] < 0] < 0).all()
    np.testing.assert_allclose(contacts.normals, [[0, 0, -1]] * len(contacts), atol=1e-12)
    frame = Page(page.read_text()).frame(2)
    assert [arrows["label"] for arrows in frame["arrows"]] == ["force on the ring, N", "normal"]
    assert frame["bodies"][0]["vertexDistances"]["low"] == pytest.approx(-0.03)


def test_example(capsys):
    example = HERE.parent / "examples" / "deform.py"
    runpy.run_path(str(example), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 10
    assert lines[0] == "step 1: distance 0.8900, 0 contacts"
    assert lines[-1] == "step 10: distance 0.0000, 60 contacts"
