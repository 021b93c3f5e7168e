"""The tool `adaptive_bvh clearance`: what it finds, against dense samples in NumPy."""

import csv
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from brute_force import points_to_triangles, triangle_distances
from meshes import ball, sheet, wave
from passes import post, random_pass, rod, sampled_least
from recorded_page import Page
from sequence_files import write_ply

import adaptive_bvh as ab
from adaptive_bvh._clearance import main

COMMAND = [sys.executable, "-B", "-m", "adaptive_bvh", "clearance"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(pathlib.Path(ab.__file__).parent.parent)}


class Run:
    """A run of the command in this process: its status, what it says, the rows of its CSV file."""

    def __init__(self, capsys, folder, *arguments):
        table = folder / "clearance.csv"
        self.status = main(["clearance", *map(str, arguments), "--csv", str(table)])
        said = capsys.readouterr()
        self.out, self.errors = said.out, said.err.splitlines()
        self.rows = list(csv.DictReader(table.open())) if table.exists() else []

    def row(self, part, moving=None):
        found = [row for row in self.rows
                 if row["part"] == part and moving in (None, row["moving"])]
        assert len(found) == 1, (part, moving, self.rows)
        return found[0]


@pytest.fixture
def run(capsys, tmp_path):
    return lambda *arguments: Run(capsys, tmp_path, *arguments)


def hose_frames(count=6):
    """A ball that flies in an arc, and deforms: frames × vertices × 3, faces."""
    vertices, faces = ball(1)
    frames = [wave(vertices, 0.8 * k) + [0.9 * k, 0.2 * k, 0.2 * (k - 3) ** 2]
              for k in range(count)]
    return np.array(frames), faces


def write_frames(folder, name, frames, faces, first=0):
    for k, vertices in enumerate(frames):
        write_ply(folder / f"{name}_{first + k:03d}.ply", vertices, faces)
    return folder / f"{name}_*.ply"


def write_parts(folder):
    """Three sheets; returns the vertices and faces of each."""
    parts = {}
    vertices, faces = sheet(1, 3.0)
    for i, z in enumerate((-1.6, -2.5, -9.0)):
        moved = vertices @ np.array([[1, 0, 0.1 * i], [0, 1, 0], [0, 0, 1]]) + [3.5, 0.7, z]
        parts[f"part{i}"] = moved, faces
        write_ply(folder / f"part{i}.ply", moved, faces)
    return parts


@pytest.fixture
def bay(tmp_path):
    frames, faces = hose_frames()
    parts = write_parts(tmp_path)
    return write_frames(tmp_path, "hose", frames, faces), frames, faces, parts


_known = {}


def sampled(frames, faces, part, samples=12):
    """Times in frames, and the distance at each."""
    key = (frames.tobytes(), part[0].tobytes(), samples)
    if key not in _known:
        _known[key] = _sampled(frames, faces, part, samples)
    return _known[key]


def _sampled(frames, faces, part, samples):
    times = np.arange((len(frames) - 1) * samples + 1) / samples
    distances = []
    for t in times:
        k = min(int(t), len(frames) - 2)
        vertices = frames[k] + (t - k) * (frames[k + 1] - frames[k])
        distances.append(triangle_distances(vertices, faces, *part).min())
    return times, np.array(distances)


def intervals_of(text):
    return [tuple(float(x) for x in (part.split("-") * 2)[:2]) for part in text.split("; ") if part]


def expect_row(row, frames, faces, part, limit, tolerance, first=0):
    """A row against samples: bounds, place and intervals."""
    times, distances = sampled(frames, faces, part)
    lower, upper = float(row["lower"]), float(row["upper"])
    assert lower <= distances.min() + 1e-12 and upper <= distances.min() + tolerance
    assert 0 <= upper - lower <= tolerance + 1e-12
    at = float(row["frame"]) - first
    k = min(int(at), len(frames) - 2)
    vertices = frames[k] + (at - k) * (frames[k + 1] - frames[k])
    points = [np.array([float(row[f"{axis}_{body}"]) for axis in "xyz"])
              for body in ("moving", "part")]
    assert np.linalg.norm(points[0] - points[1]) == pytest.approx(upper, abs=1e-5)
    for point, (positions, triangles), number in zip(
            points, ((vertices, faces), part), ("triangle_moving", "triangle_part")):
        corners = positions[triangles[int(row[number])]]
        assert points_to_triangles(point, *corners) < 1e-3  # the frame has six digits
    below = [(a - first, b - first) for a, b in intervals_of(row["below_limit"])]
    for t, distance in zip(times, distances):
        inside = any(a - 1e-9 <= t <= b + 1e-9 for a, b in below)
        if distance < limit:
            assert inside, (t, distance, below)
        elif distance > limit + tolerance + 0.05:  # intervals end at hundredths of a frame
            assert not inside, (t, distance, below)
    kept = "yes" if lower >= limit and lower > 0 else "no" if upper < limit or upper == 0 else None
    assert row["kept"] == kept


@pytest.mark.parametrize("limit, threads", [(0.0, 1), (0.4, 2), (1.5, 1), (3.0, 2), (40.0, 1)])
def test_every_pair_agrees_with_samples(run, tmp_path, bay, limit, threads):
    hose, frames, faces, parts = bay
    found = run("--moving", hose, "--parts", tmp_path / "part*.ply", "--clearance", limit,
                "--threads", threads, "--tolerance", 0.01)
    for name, part in parts.items():
        expect_row(found.row(name), frames, faces, part, limit, 0.01)
    uppers = [float(row["upper"]) for row in found.rows]
    assert uppers == sorted(uppers)
    assert found.status == (1 if "no" in [row["kept"] for row in found.rows] else 0)


def test_a_limit_above_all_distances_needs_no_search_for_times(run, tmp_path, bay, monkeypatch):
    """Such as 5 m in place of 5 mm."""
    from adaptive_bvh._clearance import _motion
    hose, *_ = bay
    monkeypatch.setattr(_motion, "intervals_below", None)
    found = run("--moving", hose, "--parts", tmp_path / "part*.ply", "--clearance", "5m")
    assert found.status == 1 and [row["below_limit"] for row in found.rows] == ["0-5"] * 3
    frames, faces = hose_frames()
    other = write_frames(tmp_path, "other", frames + [0, 3, 3], faces)
    found = run("--moving", hose, "--moving", other, "--parts", tmp_path / "part2.ply",
                "--clearance", "5m")
    assert found.row("other", "hose")["below_limit"] == "0-5"


@pytest.mark.parametrize("limit", [0.0, 3.0, 12.0])
def test_what_is_nearest_in_the_middle_of_an_interval(run, tmp_path, limit):
    """A long rod that turns while it passes a post: at both frames it is far away."""
    vertices, faces = rod()
    write_ply(tmp_path / "post.ply", *post())
    rng = np.random.default_rng(6)
    for _ in range(4):
        before, after = [vertices @ rotation.T + at for rotation, at in random_pass(rng)]
        np.savez(tmp_path / "rod.npz", vertices=np.array([before, after]), faces=faces)
        found = run("--moving", tmp_path / "rod.npz", "--parts", tmp_path / "post.ply",
                    "--clearance", limit, "--tolerance", 0.01)
        row = found.row("post")
        lower, upper = float(row["lower"]), float(row["upper"])
        least = sampled_least(lambda t: before + t * (after - before), faces, post(), 500)
        assert lower <= least + 1e-9 and lower <= upper <= lower + 0.01
        assert least - 0.05 <= upper <= least + 0.01


def test_impacts_between_frames_are_found(run, tmp_path):
    """A thin sheet that a small ball crosses between two frames."""
    vertices, faces = ball(0, 0.2)
    frames = np.array([vertices + [0.1, 0.2, 3.0 - 2 * k] for k in range(4)])
    part = sheet(1, 2.0)
    write_ply(tmp_path / "part.ply", *part)
    hose = write_frames(tmp_path, "ball", frames, faces)
    found = run("--moving", hose, "--parts", tmp_path / "part.ply")
    row = found.row("part")
    assert found.status == 1 and float(row["upper"]) == 0 and "NOT KEPT" in found.out
    assert float(row["frame"]) == pytest.approx(1.4, abs=1e-5)  # its lowest corner is there
    (begin, end), = intervals_of(row["below_limit"])
    assert begin == pytest.approx(1.4, abs=0.02) and end == pytest.approx(1.6, abs=0.02)


def test_status_and_verdict(run, tmp_path, bay):
    hose, frames, faces, parts = bay
    least = sampled(frames, faces, parts["part0"])[1].min()
    arguments = ["--moving", hose, "--parts", tmp_path / "part0.ply"]
    kept = run(*arguments, "--clearance", f"{0.98 * least}mm")
    assert kept.status == 0 and kept.out.startswith("KEPT") and kept.row("part0")["kept"] == "yes"
    violated = run(*arguments, "--clearance", f"{1.02 * least / 10}cm")
    assert violated.status == 1 and violated.out.startswith("NOT KEPT")
    assert violated.row("part0")["below_limit"] != ""
    ignored = run(*arguments, tmp_path / "part2.ply", "--clearance", f"{1.02 * least}",
                  "--ignore", "hose:part0")
    assert ignored.status == 0 and [row["part"] for row in ignored.rows] == ["part2"]
    with pytest.raises(SystemExit) as wrong:
        main(["clearance", "--nonsense"])
    assert wrong.value.code == 2


def test_units(run, tmp_path, bay):
    """Lengths with units, files in different units."""
    hose, frames, faces, parts = bay
    vertices, triangles = parts["part0"]
    write_ply(tmp_path / "inches.ply", vertices / 25.4, triangles)
    reference = run("--moving", hose, "--parts", tmp_path / "part0.ply", "--clearance", "0.5mm")
    expected = float(reference.row("part0")["upper"])
    found = run("--moving", hose, "--parts", tmp_path / "inches.ply", "--parts-unit", "in",
                "--clearance", "0.05cm")
    assert float(found.row("inches")["upper"]) == pytest.approx(expected, abs=1e-9)
    found = run("--moving", hose, "--parts", tmp_path / "part0.ply", "--unit", "m",
                "--clearance", "500mm")
    assert found.row("part0")["unit"] == "m" and float(found.row("part0")["limit"]) == 0.5
    assert float(found.row("part0")["upper"]) == pytest.approx(expected, abs=1e-9)
    for wrong in ("five", "5 parsec", "-1", "1e999", ""):
        assert run("--moving", hose, "--parts", tmp_path / "part0.ply", "--clearance=" + wrong
                   ).status == 2


def test_several_moving_bodies(run, tmp_path, bay):
    hose, frames, faces, parts = bay
    shifted = frames[2:5] + [0, 0, 0.5]
    pipe = write_frames(tmp_path, "pipe", shifted, faces, first=100)
    found = run("--moving", hose, "--moving", pipe, "--parts", tmp_path / "part*.ply",
                "--clearance", 0.3)
    assert len(found.rows) == 7
    for name, part in parts.items():
        expect_row(found.row(name, "pipe"), shifted, faces, part, 0.3, 0.2, first=100)
    assert found.row("pipe")["moving"] == "hose" and found.row("pipe")["frames_checked"] == "0-2"
    assert len(found.errors) == 1 and "6 frames and pipe has 3" in found.errors[0]
    both = run("--moving", *sorted(tmp_path.glob("hose_*")), *sorted(tmp_path.glob("pipe_*")),
               "--parts", tmp_path / "part*.ply", "--clearance", 0.3)
    assert both.rows == found.rows  # names tell the sequences apart


@pytest.mark.parametrize("limit, shift", [(0.0, 1.1), (0.4, 2.5), (0.4, 9.0)])
def test_moving_bodies_against_each_other(run, tmp_path, bay, page, limit, shift):
    """Two balls in different motions, against samples; frames without which nothing is known."""
    hose, frames, faces, parts = bay
    others = frames[::-1] * [1, -1, 1] + [0.3, shift, 0.1]
    pipe = write_frames(tmp_path, "pipe", others, faces)
    arguments = ["--moving", hose, "--moving", pipe, "--parts", tmp_path / "part2.ply",
                 "--clearance", limit, "--tolerance", 0.01]
    found = run(*arguments, "--report", page)
    row, samples = found.row("pipe"), 12
    times = np.arange((len(frames) - 1) * samples + 1) / samples
    distances = np.array([triangle_distances(at(frames, t), faces, at(others, t), faces).min()
                          for t in times])
    assert row["moving"] == "hose" and found.errors == []
    assert float(row["lower"]) <= distances.min() + 1e-12
    assert distances.min() <= float(row["upper"]) + 0.15  # between samples it may be nearer
    assert float(row["upper"]) <= distances.min() + 0.01
    below = intervals_of(row["below_limit"])
    for t, distance in zip(times, distances):
        if distance < limit or distance == 0:
            assert any(a - 1e-9 <= t <= b + 1e-9 for a, b in below), (t, distance)
    assert [body["name"] for body in Page(page.read_text()).run["bodies"]] == [
        "hose", "pipe", "part2"]
    ignored = run(*arguments, "--ignore", "pipe:hose")
    assert [row["part"] for row in ignored.rows] == ["part2"] * 2
    (tmp_path / "pipe_002.ply").unlink()
    broken = run(*arguments)
    assert broken.row("pipe")["frames_checked"] == "0-1; 3-5"


def at(frames, time):
    before = min(int(time), len(frames) - 2)
    return frames[before] + (time - before) * (frames[before + 1] - frames[before])


def test_a_body_that_stands_still(run, tmp_path, bay):
    _, frames, faces, parts = bay
    write_ply(tmp_path / "still.ply", frames[3], faces)
    found = run("--moving", tmp_path / "still.ply", "--parts", tmp_path / "part0.ply")
    expected = triangle_distances(frames[3], faces, *parts["part0"]).min()
    assert float(found.row("part0")["upper"]) == pytest.approx(expected, abs=1e-12)
    assert found.status == 0


def test_threads_do_not_change_the_answer(run, tmp_path, bay):
    hose, *_ = bay
    arguments = ["--moving", hose, "--parts", tmp_path / "part*.ply", "--clearance", 0.4]
    assert run(*arguments, "--threads", 1).rows == run(*arguments, "--threads", 3).rows


@pytest.fixture
def page(tmp_path):
    try:
        ab.Recording()
    except RuntimeError as missing:
        pytest.skip(str(missing))
    return tmp_path / "report.html"


def test_the_page_plays_the_motion(run, tmp_path, bay, page):
    hose, frames, faces, parts = bay
    found = run("--moving", hose, "--parts", tmp_path / "part*.ply", "--clearance", 1.5,
                "--report", page)
    text = page.read_text()
    recorded = Page(text)
    assert [body["name"] for body in recorded.run["bodies"]] == ["hose", *parts]
    assert len(recorded.run["frames"]) >= len(frames)
    moments = re.findall(r'<tr data-frame="(\d+)"', text)
    assert len(moments) == 3
    first = recorded.frame(int(moments[0]))
    assert first["distance"] == pytest.approx(float(found.rows[0]["upper"]), abs=1e-9)
    assert found.rows[0]["part"] in first["note"]
    block = first["bodies"][0]["vertexDistances"]
    least = np.min([sampled_vertex_clearance(vertices, parts) for vertices in frames], axis=0)
    assert block["low"] <= least.min() + 1e-9 and block["high"] <= 4 * 1.5 + 1e-9
    assert "NOT KEPT" in text and text.count('id="answer"') == 1


def sampled_vertex_clearance(vertices, parts):
    return np.min([points_to_triangles(vertices[:, None], *(
        part[0][part[1]][:, k][None] for k in range(3))).min(axis=1) for part in parts.values()],
        axis=0)


def test_names_from_files_do_not_become_html(run, tmp_path, bay, page):
    hose, frames, faces, parts = bay
    name = "<img src=x onerror=alert(1)>"
    write_ply(tmp_path / f"{name}.ply", *parts["part0"])
    run("--moving", hose, "--parts", tmp_path / f"{name}.ply", "--report", page)
    assert "<img" not in page.read_text()


def test_what_cannot_be_written_is_said(run, tmp_path, bay):
    hose, *_ = bay
    found = run("--moving", hose, "--parts", tmp_path / "part2.ply", "--report",
                tmp_path / "missing" / "page.html")
    assert found.status == 2 and "cannot be written" in found.errors[-1]
    assert found.out.startswith("KEPT")


def test_the_command_as_a_user_calls_it(tmp_path, bay):
    hose, *_ = bay
    result = subprocess.run([*COMMAND, "--moving", str(hose), "--parts", "part2.ply",
                             "--clearance", "5mm"], cwd=tmp_path, env=ENVIRONMENT,
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("KEPT: nothing comes below 5.000 mm.")
    assert result.stderr == ""  # no terminal, no progress
    help_text = subprocess.run([*COMMAND, "--help"], env=ENVIRONMENT, capture_output=True,
                               text=True)
    assert help_text.returncode == 0 and "--clearance LENGTH" in help_text.stdout


def test_ctrl_c_while_the_page_is_written_loses_the_page_alone(run, tmp_path, bay, monkeypatch):
    hose, *_ = bay
    from adaptive_bvh._clearance import _report

    def interrupted(*_, **__):
        raise KeyboardInterrupt
    monkeypatch.setattr(_report, "write_report", interrupted)
    found = run("--moving", hose, "--parts", tmp_path / "part2.ply", "--report", tmp_path / "a.html")
    assert found.status == 3 and "a.html is not written" in found.errors[-1]
    assert found.out.startswith("KEPT") and len(found.rows) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT")
def test_ctrl_c_leaves_a_report_of_what_was_done(tmp_path, page):
    """Frames that are read slowly, until Ctrl-C."""
    frames, faces = hose_frames(40)
    write_parts(tmp_path)
    write_frames(tmp_path, "hose", frames, faces)
    slow = tmp_path / "slow.py"
    slow.write_text(
        "import sys, time\n"
        "from adaptive_bvh._clearance import _files, main\n"
        "read = _files.NumberedFiles.read\n"
        "def slowly(self, frame):\n"
        "    if frame > 20:\n"
        "        print('slow', file=sys.stderr, flush=True)\n"
        "        time.sleep(0.2)\n"
        "    return read(self, frame)\n"
        "_files.NumberedFiles.read = slowly\n"
        "sys.exit(main())\n")
    process = subprocess.Popen(
        [sys.executable, "-B", str(slow), "clearance", "--moving", "hose_*.ply", "--parts",
         "part2.ply", "--csv", "out.csv", "--report", str(page)],
        cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))  # ignored in a background job
    said = ""
    while said.count("slow") < 6:  # the first frames of pieces, then frames of a piece
        said += process.stderr.readline()
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    out, errors = process.communicate(timeout=60)
    assert process.returncode == 3, errors
    assert "Ctrl-C" in errors and "Traceback" not in errors and time.monotonic() - begin < 30
    assert out.startswith("NOT COMPLETE") and "only these frames were checked: 0-" in out
    row, = csv.DictReader((tmp_path / "out.csv").open())
    assert row["part"] == "part2" and row["frames_checked"].startswith("0-")
    assert "only these frames were checked" in page.read_text()
