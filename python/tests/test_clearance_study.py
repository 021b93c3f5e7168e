"""Studies of `adaptive_bvh clearance`: many motions on Dask."""

import csv
import json
import os
import signal
import subprocess
import time

import numpy as np
import pytest
from meshes import sheet
from sequence_files import write_ply
from test_clearance import COMMAND, ENVIRONMENT, hose_frames

from adaptive_bvh._clearance._frames import SequenceError
from adaptive_bvh._clearance._study import _failed, read_study

HEIGHTS = {"low": 0.0, "middle": 0.7, "high": 1.4, "next": 2.0}


@pytest.fixture
def study(tmp_path):
    """Four motions of one hose, each at another height above a sheet."""
    frames, faces = hose_frames()
    vertices, triangles = sheet(1, 9.0)
    write_ply(tmp_path / "floor.ply", vertices + [2, 0, -1.2], triangles)
    lines = ["name,moving,height"]
    for name, height in HEIGHTS.items():
        np.savez(tmp_path / f"{name}.npz", vertices=frames + [0, 0, height], faces=faces)
        lines.append(f"{name},{name}.npz,{height}")
    (tmp_path / "study.csv").write_text("\n".join(lines) + "\n")
    return tmp_path


def command(study, *more):
    return [*COMMAND, "--study", "study.csv", "--parts", "floor.ply", "--clearance", "0.5mm",
            "--csv", "pairs.csv", "--report", "study.html", *more]


def run(study, *more, **options):
    return subprocess.run(command(study, *more), cwd=study, env=ENVIRONMENT, capture_output=True,
                          text=True, timeout=300, **options)


def rows(study):
    with (study / "pairs.csv").open() as file:
        return list(csv.DictReader(file))


def test_what_a_study_names(tmp_path):
    path = tmp_path / "study.csv"
    path.write_text("name;moving;length\nA;hose_*.ply | c.pc2 + c.obj;3,5\n", encoding="utf-8-sig")
    motion, = read_study(str(path))
    assert motion.name == "A" and motion.about == {"length": "3,5"}
    assert [[os.path.basename(file) for file in body] for body in motion.moving] == [
        ["hose_*.ply"], ["c.pc2", "c.obj"]]
    for text in ("", "name,files\nA,b\n", "name,moving\nA,b\nA,c\n", "name,moving\n,b\n",
                 "name,moving\nA\n", "name,moving\n"):
        path.write_text(text)
        with pytest.raises(SequenceError, match="study.csv"):
            read_study(str(path))


def test_a_long_table_is_read_in_linear_time(tmp_path):
    path = tmp_path / "study.csv"
    path.write_text("name,moving\n" + "".join(f"m{k},a.npz\n" for k in range(50_000)))
    begin = time.process_time()
    assert len(read_study(str(path))) == 50_000
    assert time.process_time() - begin < 10  # with all pairs of lines, minutes


def test_what_a_motion_that_failed_says():
    class KilledWorker(Exception):
        pass
    killed = _failed(KilledWorker("run_motion"))
    assert killed["status"] == 4 and "may need more memory" in killed["headline"]
    assert _failed(KeyError("x"))["status"] == 4
    for failed in (killed, _failed(KeyError("x"))):
        assert "send this line" in failed["headline"]
    assert _failed(SequenceError("no file")) == {
        "status": 2, "headline": "no file", "rows": [], "problems": ["no file"]}


def test_a_study_without_distributed_says_so(study):
    try:
        import distributed  # noqa: F401
        pytest.skip("distributed is installed")
    except ImportError:
        found = run(study)
        assert found.returncode == 2 and "pip install distributed" in found.stderr


@pytest.fixture
def dask():
    return pytest.importorskip("distributed")


def test_a_study_finds_what_single_runs_find(study, dask):
    found = run(study)
    assert found.returncode == 1, found.stderr
    lines = found.stdout.splitlines()
    assert [line.split(":")[0] for line in lines] == list(HEIGHTS)
    for row in rows(study):
        single = subprocess.run(
            [*COMMAND, "--moving", f"{row['motion']}.npz", "--parts", "floor.ply", "--clearance",
             "0.5mm", "--csv", "single.csv"], cwd=study, env=ENVIRONMENT)
        with (study / "single.csv").open() as file:
            expected, = csv.DictReader(file)
        assert {key: row[key] for key in expected} == expected
        assert row["height"] == str(HEIGHTS[row["motion"]])
        assert single.returncode == (0 if row["kept"] == "yes" else 1)
    page = (study / "study.html").read_text()
    assert page.index(">low<") < page.index(">next<") and "<svg" in page and "</html>" in page


def test_a_study_goes_on_where_it_was(study, dask):
    first = run(study)
    files = {path.name: path.stat().st_mtime_ns for path in (study / "study").glob("*.json")}
    assert set(files) == {f"{name}.json" for name in HEIGHTS}
    (study / "study" / "high.json").unlink()
    (study / "study" / "low.json").write_text("{")  # a file that was damaged
    again = run(study)
    assert "2 of 4 motions were done before" in again.stderr and again.stdout == first.stdout
    assert (study / "study" / "next.json").stat().st_mtime_ns == files["next.json"]
    other = run(study, "--tolerance", "0.2mm")  # another question
    assert "done before" not in other.stderr
    result = json.loads((study / "study" / "next.json").read_text())
    assert result["result"]["status"] == 0


def test_a_motion_that_cannot_be_read(study, dask):
    (study / "middle.npz").write_bytes(b"")
    found = run(study)
    assert found.returncode == 1 and "error: middle: " in found.stderr
    assert {row["motion"] for row in rows(study)} == set(HEIGHTS) - {"middle"}


def test_a_study_says_all_that_single_runs_say(study, dask):
    vertices, triangles = sheet(1, 9.0)
    write_ply(study / "floor.ply", 1e-3 * (vertices + [2, 0, -1.2]), triangles)  # in metres
    found = run(study, "--report", "missing/study.html")
    assert found.returncode == 1, found.stderr  # they touch: the page that is missing does not hide it
    assert found.stderr.count("differ in size by a factor of") == len(HEIGHTS)
    assert "error: missing/study.html cannot be written" in found.stderr
    assert {row["motion"] for row in rows(study)} == set(HEIGHTS)


@pytest.mark.parametrize("words, sentence", [
    (["--parts", "floor.ply", "--moving", "low.npz"], "--moving stands in the table"),
    ([], "no part is given"),
    (["--parts", "floor.ply", "--results", "study.csv"], "study.csv cannot be a folder of results"),
    (["--parts", "floor.ply", "--scheduler", "nowhere"], "no scheduler answers at nowhere"),
])
def test_what_a_study_cannot_do_is_said(study, dask, words, sentence):
    found = subprocess.run([*COMMAND, "--study", "study.csv", *words], cwd=study, env=ENVIRONMENT,
                           capture_output=True, text=True, timeout=100)
    assert found.returncode == 2 and found.stderr.startswith(f"error: {sentence}"), found.stderr
    assert len(found.stderr.splitlines()) == 1


def test_parts_that_cannot_be_read_are_no_lack_of_memory(study, dask):
    (study / "floor.ply").write_bytes(b"ply")
    found = run(study)
    assert found.returncode == 2 and "memory" not in found.stderr
    assert found.stderr.count("this part is left out, export it again") == len(HEIGHTS)


def wait_for(found, seconds=200):
    begin = time.monotonic()
    while not found() and time.monotonic() - begin < seconds:
        time.sleep(0.1)
    assert found()


def test_ctrl_c_keeps_what_is_done(study, dask):
    """As a terminal sends it: to the processes of Dask, too."""
    (study / "sitecustomize.py").write_text(
        "import sys, time\n"
        "from adaptive_bvh._clearance import _arrays, _opening\n"
        "def slowly(path, *rest):\n"
        "    time.sleep(600 if path.endswith('next.npz') else 0)\n"
        "    return _arrays.read_npz(path, *rest)\n"
        "_opening.read_npz = slowly\n")
    environment = {**ENVIRONMENT, "PYTHONPATH": f"{study}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}
    process = subprocess.Popen(
        command(study), cwd=study, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    wait_for(lambda: len(list((study / "study").glob("*.json"))) == 3)
    os.killpg(process.pid, signal.SIGINT)
    out, errors = process.communicate(timeout=100)
    assert process.returncode == 3, errors
    assert errors.splitlines() == [errors.splitlines()[0],
                                   "Ctrl-C: run the same command again to go on"], errors
    assert [line.split(":")[0] for line in out.splitlines()] == list(HEIGHTS)[:3]
    assert "1 are not done yet" in (study / "study.html").read_text()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="finds processes in /proc")
def test_a_worker_that_dies_loses_nothing(study, dask):
    """Kills a process of Dask that is at work on a motion: the motion runs again."""
    sitecustomize = study / "sitecustomize.py"  # in the processes of Dask, too
    sitecustomize.write_text(
        "import pathlib, os, sys, time\n"
        "folder = pathlib.Path(__file__).parent\n"
        "from adaptive_bvh._clearance import _arrays\n"
        "read = _arrays.read_npz\n"
        "def slowly(path, *rest):\n"
        "    mark = folder / (pathlib.Path(path).stem + '.pid')\n"
        "    if path.endswith('high.npz') and not mark.exists():\n"
        "        mark.write_text(str(os.getpid()))\n"
        "        time.sleep(600)\n"
        "    return read(path, *rest)\n"
        "from adaptive_bvh._clearance import _opening\n"
        "_opening.read_npz = slowly\n")
    environment = {**ENVIRONMENT, "PYTHONPATH": f"{study}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}
    process = subprocess.Popen(command(study), cwd=study, env=environment, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    mark, begin = study / "high.pid", time.monotonic()
    while not (mark.exists() and mark.read_text()) and time.monotonic() - begin < 200:
        time.sleep(0.1)
    worker = int(mark.read_text())
    assert worker != process.pid
    os.kill(worker, signal.SIGKILL)
    out, errors = process.communicate(timeout=200)
    assert process.returncode == 1, errors
    assert {row["motion"] for row in rows(study)} == set(HEIGHTS)
    assert [line.split(":")[0] for line in out.splitlines()] == list(HEIGHTS)
