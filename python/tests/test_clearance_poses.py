"""`adaptive_bvh clearance` of rigid bodies: poses, and frames between which a body turns far."""

import json
import math
import re

import numpy as np
import pytest
from meshes import sheet
from passes import post, random_pass, rod, sampled_least, turned
from sequence_files import write_ply
from test_clearance import page, run  # noqa: F401

COLUMNS = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"]


def quaternion(rotation):
    """w x y z, of a rotation by less than half a turn."""
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
                     rotation[1, 0] - rotation[0, 1]])
    w = math.sqrt(max(1 + np.trace(rotation), 0)) / 2
    return np.array([w, *(axis / (4 * w))])


def write_poses(path, poses, columns=tuple(COLUMNS), times=None, separator=","):
    lines = [separator.join(columns)]
    for k, (rotation, position) in enumerate(poses):
        row = dict(zip(COLUMNS, [k if times is None else times[k], *position,
                                 *quaternion(rotation)]))
        lines.append(separator.join(f"{row[name]:.17g}" for name in columns))
    path.write_text("\n".join(lines) + "\n")
    return path


def screw(before, after):
    """The pose at a time: by the axis in space, about which all turn and along which all go."""
    rotation = after[0] @ before[0].T
    cosine = (np.trace(rotation) - 1) / 2
    angle = math.acos(cosine)
    axis = np.linalg.svd(rotation - np.eye(3))[2][2]
    if np.linalg.norm(turned(axis, angle) - rotation) > 1e-6:
        axis = -axis
    shift = after[1] - rotation @ before[1]
    along = axis @ shift
    centre = np.linalg.lstsq(np.eye(3) - rotation, shift - along * axis, rcond=None)[0]

    def at(t):
        turn = turned(axis, t * angle)
        return turn @ before[0], turn @ (before[1] - centre) + centre + t * along * axis
    return at


@pytest.mark.parametrize("turn", [0.3, 1.0, 3.0])
def test_bodies_with_poses_go_on_screws(run, tmp_path, turn):  # noqa: F811
    vertices, faces = rod()
    write_ply(tmp_path / "post.ply", *post())
    body = write_ply_at(tmp_path / "rod.ply", vertices, faces)
    rng = np.random.default_rng(5)
    for _ in range(3):
        before, after = random_pass(rng, turn)
        poses = write_poses(tmp_path / "poses.csv", [before, after])
        found = run("--moving", body, "--poses", poses, "--parts", tmp_path / "post.ply",
                    "--clearance", 5, "--tolerance", 0.01)
        at = screw(before, after)
        least = sampled_least(lambda t: vertices @ at(t)[0].T + at(t)[1], faces, post(), 500)
        row = found.row("post", "rod")
        lower, upper = float(row["lower"]), float(row["upper"])
        assert lower <= least + 1e-9 and lower <= upper <= lower + 0.01
        assert least - 0.05 <= upper <= least + 0.01
        assert any("third of a turn" in text for text in found.errors) == (turn > 2.1)


def write_ply_at(path, vertices, faces):
    write_ply(path, vertices, faces)
    return path


def path_of_poses(count=9):
    """Round the post, by a quarter of a turn in all."""
    return [(turned([0, 0, 1], 0.2 * k), turned([0, 0, 1], 0.2 * k) @ [30.0, 0, 2 * k])
            for k in range(count)]


def test_all_conventions_are_the_same_motion(run, tmp_path, page):  # noqa: F811
    write_ply(tmp_path / "post.ply", *post())
    vertices, faces = rod()
    metres = write_ply_at(tmp_path / "metres.ply", vertices / 1000, faces)
    body = write_ply_at(tmp_path / "rod.ply", vertices, faces)
    poses, rows = path_of_poses(), []
    for columns, separator in ((COLUMNS, ","), (["time", "qx", "qy", "qz", "qw", "x", "y", "z"], ";"),
                               (["# t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"], " ")):
        path = write_poses(tmp_path / "poses.csv", poses, [COLUMNS[0]] + [
            name[-1] if name[0] == "t" else name for name in columns[1:]], separator=separator)
        text = path.read_text().split("\n", 1)
        path.write_text(separator.join(columns) + "\n" + text[1])
        rows.append(run("--moving", body, "--poses", path, "--parts", tmp_path / "post.ply",
                        "--report", page).rows)
    assert rows[0] == rows[1] == rows[2] and page.exists()
    # The poses are in the unit of the mesh, here metres: of --unit, with parts in another one.
    path = write_poses(tmp_path / "poses.csv", [(r, p / 1000) for r, p in poses])
    found = run("--moving", metres, "--poses", path, "--parts", tmp_path / "post.ply", "--unit", "m",
                "--parts-unit", "mm", "--tolerance", "0.01mm")
    assert float(found.rows[0]["upper"]) * 1000 == pytest.approx(float(rows[0][0]["upper"]), abs=0.02)


def test_two_bodies_with_poses(run, tmp_path):  # noqa: F811
    """On the same screw: their distance stays. Times are those of the table, also very late ones."""
    write_ply(tmp_path / "post.ply", *post())
    vertices, faces = rod()
    times = 1.7e9 + 0.001 * np.arange(9)
    arguments = []
    for name, shift in (("a", 0.0), ("b", 20.0)):
        body = write_ply_at(tmp_path / f"{name}.ply", vertices + [shift, 0, 0], faces)
        poses = write_poses(tmp_path / f"{name}.csv", path_of_poses(), times=times)
        arguments += ["--moving", body, "--poses", poses]
    found = run(*arguments, "--parts", tmp_path / "post.ply", "--clearance", 11, "--tolerance", 0.001)
    row = found.row("b", "a")
    assert float(row["upper"]) == pytest.approx(10, abs=0.001) and row["kept"] == "no"
    assert float(row["lower"]) <= 10 + 1e-9 and 10 - 1e-9 <= float(row["upper"])
    assert row["frames_checked"] == "1700000000-1700000000.008"
    assert "1700000000.0" in found.out


def test_a_study_of_poses(run, tmp_path):  # noqa: F811
    pytest.importorskip("distributed", reason="distributed is not installed")
    write_ply(tmp_path / "post.ply", *post())
    body = write_ply_at(tmp_path / "rod.ply", *rod())
    poses = write_poses(tmp_path / "poses.csv", path_of_poses())
    single = run("--moving", body, "--poses", poses, "--parts", tmp_path / "post.ply")
    (tmp_path / "study.csv").write_text("name,moving\nA,rod.ply + poses.csv\n")
    found = run("--study", tmp_path / "study.csv", "--parts", tmp_path / "post.ply")
    assert [row["upper"] for row in found.rows] == [row["upper"] for row in single.rows]


HEADER = ",".join(COLUMNS)
FIRST, SECOND = "0,0,0,0,1,0,0,0", "1,1,2,3,0,0,0,1"


@pytest.mark.parametrize("lines, sentence", [
    ([], "no column t"),
    ([FIRST, SECOND], "no column t"),
    ([HEADER.replace("qw", "w"), FIRST, SECOND], "no column qw"),
    ([HEADER + ",x", FIRST + ",1", SECOND + ",1"], "two columns x"),
    ([HEADER], "no pose"),
    ([HEADER, FIRST], "one pose"),
    ([HEADER, SECOND, FIRST], "line 3 of .* the time 0 after 1"),
    ([HEADER, FIRST, FIRST], "line 3 of .* the time 0 after 0"),
    ([HEADER, FIRST, SECOND.replace("2", "nan")], "line 3 of .* no finite number"),
    ([HEADER, FIRST, SECOND.replace("2", "up")], "line 3 of .* no finite number"),
    ([HEADER, FIRST, SECOND[:-2]], "line 3 of .* no finite number"),
    ([HEADER, FIRST, SECOND + "e400"], "line 3 of .* no finite number"),
    ([HEADER, FIRST, SECOND[:-1] + "1.01"], "line 3 of .* a quaternion of length 1.01"),
    ([HEADER, FIRST, SECOND[:-1] + "0"], "line 3 of .* a quaternion of length 0"),
])
def test_tables_that_are_no_poses(run, tmp_path, lines, sentence):  # noqa: F811
    write_ply(tmp_path / "post.ply", *post())
    body = write_ply_at(tmp_path / "rod.ply", *rod())
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    found = run("--moving", body, "--poses", tmp_path / "poses.csv", "--parts", tmp_path / "post.ply")
    assert found.status == 2 and len(found.errors) == 1
    assert re.search(sentence, found.errors[0]), found.errors


def test_poses_without_a_mesh(run, tmp_path, capsys):  # noqa: F811
    for words in (["--poses", "a.csv"], ["--moving", "a.ply", "--poses", "a.txt"]):
        with pytest.raises(SystemExit) as ended:
            run(*words)
        assert ended.value.code == 2 and "write it after the mesh" in capsys.readouterr().err


def test_a_body_that_turns_far_between_frames_is_named(run, tmp_path, page):  # noqa: F811
    """Half a turn about the middle: its vertices meet on the axis."""
    vertices, faces = rod()
    write_ply(tmp_path / "part.ply", *post())
    angles = np.array([0, 1.6, 3.1, 3.3, 6.4])  # radians: by more than a quarter three times
    frames = np.array([vertices @ turned([1, 0.1, 0], angle).T + [40, 0, 0] for angle in angles])
    np.savez(tmp_path / "rod.npz", vertices=frames, faces=faces)
    arguments = ["--moving", tmp_path / "rod.npz", "--parts", tmp_path / "part.ply"]
    found = run(*arguments, "--report", page)
    text = ("rod turns by more than a quarter between frame 0 and frame 1, "
            "between frame 3 and frame 4; its vertices go on straight lines")
    warning, = found.errors
    assert text in warning and "--poses" in warning and text in page.read_text()


def test_what_deforms_and_turns_little_is_not_named(run, tmp_path):  # noqa: F811
    """Also a straight line, which fits itself in any rotation about it, and a mesh that shrinks."""
    write_ply(tmp_path / "part.ply", *sheet(1, 3.0))
    line = np.array([[0, 0, 10.0], [1, 1, 11], [2, 2, 12], [3, 3, 13]])
    faces = np.array([[0, 1, 2], [1, 2, 3]])
    rng = np.random.default_rng(1)
    soft = rng.normal(size=(4, 3)) + [0, 0, 30]
    for frames in ([line, line + 1e-9, line * 2, line @ turned([0, 0, 1], 1.5).T],
                   [soft, 0.01 * soft + 20, np.full((4, 3), 20.0), soft],
                   [soft, soft + 0.3 * rng.normal(size=(4, 3))]):
        np.savez(tmp_path / "soft.npz", vertices=np.array(frames), faces=faces)
        found = run("--moving", tmp_path / "soft.npz", "--parts", tmp_path / "part.ply")
        assert not any("turns by" in text for text in found.errors), found.errors


def test_a_study_lists_turns_among_its_warnings(run, tmp_path):  # noqa: F811
    pytest.importorskip("distributed", reason="distributed is not installed")
    vertices, faces = rod()
    write_ply(tmp_path / "part.ply", *post())
    frames = np.array([vertices + [40, 0, 0], vertices @ turned([1, 0, 0], 3).T + [40, 0, 0]])
    np.savez(tmp_path / "rod.npz", vertices=frames, faces=faces)
    (tmp_path / "study.csv").write_text("name,moving\nA,rod.npz\n")
    run("--study", tmp_path / "study.csv", "--parts", tmp_path / "part.ply")
    result = json.loads((tmp_path / "study" / "A.json").read_text())["result"]
    assert any("turns by more than a quarter" in text for text in result["warnings"])
