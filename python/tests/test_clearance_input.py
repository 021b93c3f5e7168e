"""Sequences that `adaptive_bvh clearance` reads, and input that is wrong: one sentence each."""

import re

import numpy as np
import pytest
from meshes import ball, sheet
from sequence_files import Gltf, write_obj, write_pc2, write_ply, write_stl
from test_clearance import hose_frames, run, write_frames  # noqa: F401

import adaptive_bvh as ab
from adaptive_bvh._clearance import main
from adaptive_bvh._clearance._arrays import read_npz
from adaptive_bvh._clearance._files import Reading
from adaptive_bvh._clearance._frames import FrameError, SequenceError
from adaptive_bvh._clearance._opening import open_moving

MM = Reading("mm", "mm")


@pytest.fixture
def part(tmp_path):
    """A sheet that the hose does not reach."""
    vertices, faces = sheet(1, 3.0)
    write_ply(tmp_path / "part.ply", vertices + [2, 0, -4], faces)
    return tmp_path / "part.ply"


def opened(*names, reading=MM, rate=30.0):
    sequence, = open_moving([str(name) for name in names], reading, rate)
    return sequence


def expect_frames(sequence, frames, faces, tolerance=0.0):
    """The triangles of each frame, corner by corner, as vertices may be joined."""
    assert len(sequence) == len(frames)
    shape = sequence.read(0).shape
    for k, expected in enumerate(frames):
        frame = sequence.read(k)
        assert frame.shape is shape
        topology = shape.topologies[0]
        vertices = topology.vertices(frame.positions)
        np.testing.assert_allclose(vertices[topology.triangles], expected[faces], rtol=0,
                                   atol=tolerance)


# ---- what is read --------------------------------------------------------------------------------


@pytest.mark.parametrize("comment", ["", "comment frame {}\n"])
def test_binary_ply(tmp_path, comment):
    frames, faces = hose_frames(3)
    for k, vertices in enumerate(frames):
        write_ply(tmp_path / f"hose_{k + 8}.ply", vertices, faces, comment.format(k))
    sequence = opened(tmp_path / "hose_*.ply")
    assert sequence.name == "hose" and sequence.numbers == [8, 9, 10]  # not in alphabetical order
    expect_frames(sequence, frames, faces)
    scaled = opened(tmp_path / "hose_*.ply", reading=Reading("mm", "in"))
    expect_frames(scaled, 25.4 * frames, faces, 1e-12)


def test_stl_is_joined_by_the_first_frame(tmp_path):
    frames, faces = hose_frames(3)
    for k, vertices in enumerate(frames):
        write_stl(tmp_path / f"{k}.stl", vertices, faces)
    sequence = opened(tmp_path / "*.stl")
    expect_frames(sequence, frames, faces, 1e-6)
    joined, apart = sequence.read(0).shape.topologies
    assert len(joined.vertices(sequence.read(1).positions)) == len(frames[0])
    torn = frames[1][faces].reshape(-1, 3)
    torn[0] += 0.5  # one corner of one triangle leaves its neighbours
    write_stl(tmp_path / "1.stl", torn, np.arange(len(torn)).reshape(-1, 3))
    frame = opened(tmp_path / "*.stl").read(1)
    joined, apart = frame.shape.topologies
    assert joined.vertices(frame.positions) is None
    assert len(apart.vertices(frame.positions)) == 3 * len(faces)


def test_torn_frames_count(run, tmp_path, part):  # noqa: F811
    frames, faces = hose_frames(4)
    soups = frames[:, faces].reshape(4, -1, 3)
    soups[2, 0] = [2, 0, -3]  # this corner alone comes near
    for k, vertices in enumerate(soups):
        write_stl(tmp_path / f"h{k}.stl", vertices, np.arange(len(vertices)).reshape(-1, 3))
    found = run("--moving", tmp_path / "h*.stl", "--parts", part)
    assert found.status == 0 and float(found.row("part")["upper"]) == pytest.approx(1, abs=1e-3)


def test_polygons_may_be_cut_along_other_diagonals(tmp_path):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], float)
    bent = square.copy()
    bent[1] = [0.3, 0.6, 0]  # a notch: the polygon is cut along its other diagonal
    faces = [[0, 1, 2, 3], [1, 4, 5, 2]]
    for k, vertices in enumerate((square, bent, square)):
        write_obj(tmp_path / f"{k}.obj", vertices, faces)
    first, second = (ab.load_mesh(tmp_path / f"{k}.obj", weld=False).faces for k in (0, 1))
    sequence = opened(tmp_path / "*.obj")
    assert not np.array_equal(first, second)
    assert sequence.read(0).shape is sequence.read(1).shape is sequence.read(2).shape


def test_npz(run, tmp_path, part):  # noqa: F811
    frames, faces = hose_frames(4)
    np.savez(tmp_path / "hose.npz", vertices=frames, faces=faces)
    expect_frames(opened(tmp_path / "hose.npz"), frames, faces)
    np.savez_compressed(tmp_path / "other.npz", anything=frames.astype("f4"))
    write_obj(tmp_path / "mesh.obj", frames[0], faces.tolist())
    expect_frames(opened(tmp_path / "other.npz", tmp_path / "mesh.obj"), frames, faces, 1e-6)
    found = run("--moving", tmp_path / "other.npz", tmp_path / "mesh.obj", "--parts", part)
    assert found.status == 0 and found.row("part")["moving"] == "other"


def test_pc2(tmp_path):
    frames, faces = hose_frames(4)
    write_obj(tmp_path / "mesh.obj", frames[0], faces.tolist())
    write_pc2(tmp_path / "hose.pc2", frames, start=10, rate=0.5)
    sequence = opened(tmp_path / "hose.pc2", tmp_path / "mesh.obj")
    assert sequence.numbers == [10, 10.5, 11, 11.5]
    expect_frames(sequence, frames, faces, 1e-6)
    write_pc2(tmp_path / "short.pc2", frames, announced=9)
    sequence = opened(tmp_path / "short.pc2", tmp_path / "mesh.obj")
    assert len(sequence) == 4 and "announces 9 frames and ends after 4" in sequence.problems[0]


# ---- animations of glTF --------------------------------------------------------------------------


def test_gltf_nodes_and_morph_targets(tmp_path):
    vertices, faces = ball(1)
    document = Gltf()
    target = 0.3 * vertices[:, ::-1]
    mesh = document.mesh(vertices, faces, [target])
    document.json["nodes"] = [{"children": [1], "translation": [1, 0, 0]}, {"mesh": mesh}]
    half = np.sqrt(0.5)
    document.animate((0, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, half, half]], "LINEAR"),
                     (1, "weights", [0, 0.5, 1], [0, 1, 0.5], "LINEAR"),
                     (1, "translation", [0, 0.5], [[0, 0, 0], [0, 2, 0]], "STEP"),
                     (1, "scale", [0, 1], [[0, 0, 0], [1, 1, 1], [0, 0, 0]]
                      + [[0, 0, 0], [3, 1, 1], [0, 0, 0]], "CUBICSPLINE"))
    document.write(tmp_path / "ball.glb")
    sequence = opened(tmp_path / "ball.glb", reading=Reading("mm", "mm"), rate=4)
    assert len(sequence) == 5
    expected = []
    for t in (0, 0.25, 0.5, 0.75, 1):
        weight = 2 * t if t < 0.5 else 1 - (t - 0.5)
        scale = np.array([1 + 2 * (3 * t**2 - 2 * t**3), 1, 1])
        moved = (vertices + weight * target) * scale + [0, 2 if t >= 0.5 else 0, 0]
        c, s = np.cos(t * np.pi / 2), np.sin(t * np.pi / 2)
        rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        expected.append(1000 * (moved @ rotation.T + [1, 0, 0]))
    expect_frames(sequence, expected, faces, 1e-3)
    up = opened(tmp_path / "ball.glb", reading=Reading("mm", "mm", "z"), rate=4)
    turned = [np.stack([x, -z, y], axis=1) for x, y, z in (e.T for e in expected)]
    expect_frames(up, turned, faces, 1e-3)


def test_gltf_skins(tmp_path):
    vertices, faces = sheet(2)
    document = Gltf()
    share = (vertices[:, 0] + 1) / 2
    weights = np.stack([1 - share, share, 0 * share, 0 * share], axis=1)
    joints = np.tile([0, 1, 0, 0], (len(vertices), 1))
    mesh = document.mesh(vertices, faces)
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = document.add(joints, "VEC4", 5123)
    attributes["WEIGHTS_0"] = document.add(weights, "VEC4")
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, 3, 0] = -1  # by columns: moves by -x
    document.json["nodes"] = [{"children": [1, 2]}, {"mesh": mesh, "skin": 0,
                              "translation": [9, 9, 9]}, {"children": [3]},
                              {"translation": [1, 0, 0]}]
    document.json["skins"] = [{"joints": [2, 3],
                               "inverseBindMatrices": document.add(inverse, "MAT4")}]
    document.animate((3, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, 1, 0]], "LINEAR"))
    document.write(tmp_path / "sheet.glb")
    sequence = opened(tmp_path / "sheet.glb", reading=Reading("m", "m"), rate=2)
    expected = []
    for angle in (0, np.pi / 2, np.pi):
        c, s = np.cos(angle), np.sin(angle)
        rotated = (vertices - [1, 0, 0]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        expected.append((1 - share)[:, None] * vertices + share[:, None] * (rotated + [1, 0, 0]))
    expect_frames(sequence, expected, faces, 1e-6)


def test_gltf_at_rest_is_what_load_mesh_reads(tmp_path):
    vertices, faces = ball(1)
    document = Gltf()
    mesh = document.mesh(vertices, faces)
    document.json["nodes"] = [
        {"children": [1, 2], "rotation": [0.5, 0.5, 0.5, 0.5]},
        {"mesh": mesh, "scale": [1, 2, 3]},
        {"mesh": mesh, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]}]
    document.animate((1, "scale", [0.0, 1.0], [[1, 2, 3], [1, 2, 3]], "LINEAR"))
    document.write(tmp_path / "two.glb")
    loaded = ab.load_mesh(tmp_path / "two.glb", weld=False)
    sequence = opened(tmp_path / "two.glb", reading=Reading("m", "m"), rate=1)
    expect_frames(sequence, [loaded.vertices] * 2, loaded.faces, 1e-6)


def damaged_gltf(change):
    vertices, faces = ball(0)
    document = Gltf()
    mesh = document.mesh(vertices, faces)
    document.json["nodes"] = [{"mesh": mesh}]
    document.animate((0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]], "LINEAR"))
    change(document.json)
    return document


@pytest.mark.parametrize("change, reason", [
    (lambda j: j["nodes"][0].update(children=[0]), "descendant"),
    (lambda j: j["accessors"][0].update(count=10**9), "so often|past"),
    (lambda j: j["bufferViews"][0].update(byteOffset=10**6), "past the buffer"),
    (lambda j: j["meshes"][0]["primitives"][0].update(indices=99), "component type 0"),
    (lambda j: j["meshes"][0]["primitives"][0]["attributes"].update(POSITION=True), "component type 0"),
    (lambda j: j["animations"][0]["channels"][0]["target"].update(node=7), "no element 7"),
    (lambda j: j["animations"][0]["channels"][0].update(sampler=[]), "no element \\[\\]"),
    (lambda j: j["animations"][0]["samplers"][0].update(output=0), "do not fit"),
    (lambda j: j.update(extensionsRequired=["KHR_draco_mesh_compression"]), "draco"),
    (lambda j: j.update(nodes={"a": 1}), "no element 0"),
    (lambda j: j["scenes"][0].update(nodes=[[]]), "no triangles"),
    (lambda j: j["accessors"][0].update(componentType=[]), "is not a count"),
])
def test_gltf_is_not_believed(tmp_path, change, reason):
    damaged_gltf(change).write(tmp_path / "bad.glb")
    with pytest.raises(SequenceError, match=f"bad.glb.*({reason})"):
        opened(tmp_path / "bad.glb")


def test_damaged_gltf_never_crashes(tmp_path):
    damaged_gltf(lambda j: None).write(tmp_path / "whole.glb")
    data = (tmp_path / "whole.glb").read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(300):
        changed = bytearray(data)
        for _ in range(rng.integers(1, 4)):
            changed[rng.integers(len(data))] = rng.integers(256)
        (tmp_path / "bad.glb").write_bytes(changed[:rng.integers(20, len(data) + 1)])
        try:
            sequence = opened(tmp_path / "bad.glb", rate=2)
            sequence.read(len(sequence) - 1)
        except (SequenceError, FrameError):
            pass


# ---- wrong input ---------------------------------------------------------------------------------


def only(lines, word):
    found = [line for line in lines if word in line]
    assert len(found) == 1, (word, lines)
    return found[0]


@pytest.fixture
def hose(tmp_path):
    frames, faces = hose_frames()
    return write_frames(tmp_path, "hose", frames, faces)


@pytest.mark.parametrize("damage, sentence", [
    (b"", "hose_003.ply.*export this frame again"),
    (b"ply\nformat binary_little_endian 1.0\n", "hose_003.ply.*export this frame again"),
    ("nan", "hose_003.ply.*not finite.*export this frame again"),
])
def test_a_frame_that_cannot_be_used(run, tmp_path, hose, part, damage, sentence):  # noqa: F811
    path = tmp_path / "hose_003.ply"
    if damage == "nan":
        frames, faces = hose_frames()
        frames[3, 5] = np.nan
        write_ply(path, frames[3], faces)
    else:
        path.write_bytes(damage)
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and found.out.startswith("NOT COMPLETE")
    assert len(found.errors) == 1
    assert re.search(sentence, found.errors[0]), found.errors[0]
    assert found.row("part")["frames_checked"] == "0-2; 4-5"
    assert float(found.row("part")["upper"]) > 0


def test_many_frames_that_cannot_be_used(run, tmp_path, hose, part):  # noqa: F811
    for k in (1, 2, 4):
        (tmp_path / f"hose_00{k}.ply").write_bytes(b"ply")
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and len(found.errors) == 2
    assert "2 more frames could not be used" in found.errors[1]
    assert found.row("part")["frames_checked"] == "0; 3; 5"
    for k in (0, 3, 5):
        (tmp_path / f"hose_00{k}.ply").write_bytes(b"ply")
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and "no file of hose can be read" in found.errors[0]


def test_frames_of_other_sizes(run, tmp_path, hose, part):  # noqa: F811
    """The motion from and to other triangles is unknown; all else is checked."""
    vertices, faces = ball(2)
    for k in (3, 4):
        write_ply(tmp_path / f"hose_00{k}.ply", vertices + [k, 0, 0], faces)
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and len(found.errors) == 1
    assert "triangles or vertices change between" in found.errors[0]
    assert "hose_002.ply" in found.errors[0] and "in 1 more step," in found.errors[0]
    assert found.row("part")["frames_checked"] == "0-2; 3-4; 5"


def test_triangles_that_change(run, tmp_path, hose, part):  # noqa: F811
    frames, faces = hose_frames()
    write_ply(tmp_path / "hose_005.ply", frames[5], faces[::-1])
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and "export all frames with the same mesh" in found.errors[0]
    assert found.row("part")["frames_checked"] == "0-4; 5"


def test_missing_numbers(run, tmp_path, hose, part):  # noqa: F811
    (tmp_path / "hose_002.ply").unlink()
    found = run("--moving", hose, "--parts", part)
    assert found.status == 2 and len(found.errors) == 1
    assert "hose: frame 2 is missing" in found.errors[0]
    assert found.row("part")["frames_checked"] == "0-1; 3-5"


def test_numbers_by_tens_are_complete(run, tmp_path, part):  # noqa: F811
    frames, faces = hose_frames(4)
    for k, vertices in enumerate(frames):
        write_ply(tmp_path / f"hose_{10 * k}.ply", vertices, faces)
    found = run("--moving", tmp_path / "hose_*.ply", "--parts", part)
    assert found.status == 0 and found.row("part")["frames_checked"] == "0-30"


def test_a_violation_counts_also_if_frames_are_missing(run, tmp_path, hose, part):  # noqa: F811
    (tmp_path / "hose_002.ply").unlink()
    found = run("--moving", hose, "--parts", part, "--clearance", 100)
    assert found.status == 1 and found.out.startswith("NOT KEPT")


@pytest.mark.parametrize("factor", [1000, 1e-3])
def test_units_that_differ(run, tmp_path, hose, factor):  # noqa: F811
    vertices, faces = sheet(2, 6.0 * factor)
    write_ply(tmp_path / "bay.ply", vertices + [0, 0, -20 * factor], faces)
    found = run("--moving", hose, "--parts", tmp_path / "bay.ply")
    assert "--parts-unit" in only(found.errors, "warning")
    assert "differ in size by a factor of" in found.errors[0]


def test_parts_that_overlap_in_the_first_frame(run, tmp_path, hose, part):  # noqa: F811
    frames, faces = hose_frames()
    write_ply(tmp_path / "clip.ply", frames[0] * 0.9, faces)
    found = run("--moving", hose, "--parts", part, tmp_path / "clip.ply", "--clearance", 0.1)
    assert found.status == 1 and "--ignore 'hose:clip'" in only(found.errors, "warning")
    assert found.row("clip")["frame"] == "0" and found.row("part")["kept"] == "yes"
    assert found.row("clip")["below_limit"].startswith("0-")


def test_a_part_that_cannot_be_read(run, tmp_path, hose, part):  # noqa: F811
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    found = run("--moving", hose, "--parts", part, tmp_path / "broken.stl", tmp_path / "gone.stl")
    assert found.status == 2 and len(found.errors) == 2
    assert "broken.stl" in found.errors[0] and "this part is left out" in found.errors[0]
    assert "there is no file" in found.errors[1] and found.row("part")["kept"] == "yes"


def test_a_body_that_cannot_be_read(run, tmp_path, hose, part):  # noqa: F811
    found = run("--moving", hose, "--moving", tmp_path / "pipe_*.ply", "--parts", part)
    assert found.status == 2 and "no file fits the pattern" in found.errors[0]
    assert found.row("part")["moving"] == "hose"


@pytest.mark.parametrize("save, sentence", [
    (dict(vertices=np.zeros((2, 4, 3))), "no array 'faces'"),
    (dict(vertices=np.zeros((2, 4, 3)), faces=np.zeros((1, 3))), "integers are needed"),
    (dict(vertices=np.zeros((2, 4, 3)), faces=np.array([[0, 1, 4]])), "names vertex 4 of 4"),
    (dict(vertices=np.zeros((2, 4, 2)), faces=np.array([[0, 1, 3]])), "\\(frames, vertices, 3\\)"),
    (dict(vertices=np.full((2, 4, 3), np.inf), faces=np.array([[0, 1, 3]])), "finite"),
    (dict(vertices=np.zeros((0, 4, 3)), faces=np.array([[0, 1, 3]])), "no positions"),
    (dict(vertices=np.array([None])), "cannot be read as .npz"),
])
def test_arrays_that_cannot_be_used(tmp_path, save, sentence):
    np.savez(tmp_path / "a.npz", **save)
    with pytest.raises(SequenceError, match=sentence):
        read_npz(str(tmp_path / "a.npz"), "a", "mm", "mm", None)


def test_arrays_of_another_mesh(tmp_path, run, part):  # noqa: F811
    """Faces that name vertices of another mesh would give a wrong answer."""
    frames, faces = hose_frames(3)
    np.savez(tmp_path / "hose.npz", vertices=frames)
    write_ply(tmp_path / "other.ply", *ball(2))
    write_ply(tmp_path / "same.ply", frames[0], faces)
    found = run("--moving", tmp_path / "hose.npz", tmp_path / "other.ply", "--parts", part)
    assert found.status == 2 and "name the mesh that it was made of" in found.errors[0]
    assert run("--moving", tmp_path / "hose.npz", tmp_path / "same.ply", "--parts", part).status == 0
    (tmp_path / "short.pc2").write_bytes(b"POINTCACHE2\0\1\0")
    found = run("--moving", tmp_path / "short.pc2", tmp_path / "same.ply", "--parts", part)
    assert found.status == 2 and "short.pc2 ends within its header" in found.errors[0]


def test_damaged_arrays_never_crash(tmp_path):
    frames, faces = hose_frames(2)
    np.savez_compressed(tmp_path / "whole.npz", vertices=frames, faces=faces)
    data = (tmp_path / "whole.npz").read_bytes()
    rng = np.random.default_rng(4)
    for _ in range(200):
        changed = bytearray(data)
        changed[rng.integers(len(data))] = rng.integers(256)
        (tmp_path / "bad.npz").write_bytes(changed[:rng.integers(len(data) + 1)])
        try:
            read_npz(str(tmp_path / "bad.npz"), "bad", "mm", "mm", None).read(1)
        except (SequenceError, FrameError):
            pass


def test_a_frame_of_arrays_that_cannot_be_used(run, tmp_path, part):  # noqa: F811
    frames, faces = hose_frames(4)
    frames[2, 0, 1] = np.nan
    np.savez(tmp_path / "hose.npz", vertices=frames, faces=faces)
    found = run("--moving", tmp_path / "hose.npz", "--parts", part)
    assert found.status == 2 and "vertex 0 of hose, frame 2" in found.errors[0]
    assert found.row("part")["frames_checked"] == "0-1; 3"


@pytest.mark.parametrize("names, sentence", [
    (["a.ply", "b.ply"], "no number in its name"),
    (["h_1.ply", "h_01.ply"], "are both frame 1"),
    (["c.pc2"], "name its mesh beside it"),
    (["c.pc2", "d.pc2"], "--moving once for each body"),
    (["nothing_*.ply"], "no file fits the pattern"),
])
def test_names_that_are_no_sequence(tmp_path, names, sentence):
    for name in names:
        if "*" not in name:
            (tmp_path / name).write_bytes(b"")
    with pytest.raises(SequenceError, match=sentence):
        opened(*(tmp_path / name for name in names))


# ---- wrong command lines -------------------------------------------------------------------------


@pytest.mark.parametrize("words, sentence", [
    ([], "no command is given; .* adaptive_bvh clearance --help"),
    (["clearence"], "'clearence'.*adaptive_bvh clearance --help"),
    (["clearance"], "no part is given"),
    (["clearance", "--movin", "a.ply", "--part", "b.ply"], "no option --movin; did you mean --moving"),
    (["clearance", "--clearence=5mm"], "no option --clearence; did you mean --clearance"),
    (["clearance", "--rate", "x"], "--rate.*'x'.*adaptive_bvh clearance --help"),
    (["clearance", "a.ply"], "a.ply belongs to no option"),
    (["clearance", "--parts", "PART", "--clearance", "5,5mm"], "write a number.*such as 5.5mm"),
    (["clearance", "--parts", "PART", "--moving", "FOLDER"], "is a folder; name its files.*\\*.ply"),
    (["clearance", "--study", "none.csv", "--parts", "PART"], "No such file.*after --study|pip install"),
])
def test_wrong_words_get_one_sentence(capsys, tmp_path, part, words, sentence):
    words = [str({"PART": part, "FOLDER": tmp_path}.get(word, word)) for word in words]
    try:
        status = main(words)
    except SystemExit as left:
        status = left.code
    said = capsys.readouterr()
    line, = said.err.splitlines()
    assert status == 2 and said.out == "" and re.match(f"error: .*({sentence})", line), line


def test_no_pair_is_left(run, hose, part):  # noqa: F811
    found = run("--moving", hose, "--parts", part, "--ignore", "*")
    assert found.status == 2 and found.out.startswith("NOT CHECKED")
    assert "no pair is left to check" in found.errors[-1]
