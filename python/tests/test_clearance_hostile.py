"""Files that `adaptive_bvh clearance` must refuse in one sentence, within limits of time and memory,
and glTF that load_mesh and animations must read alike."""

import base64
import json
import os
import pathlib
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest
from long_mode import LONG, SEED
from meshes import ball
from sequence_files import Gltf, write_obj, write_pc2, write_ply, write_stl
from test_clearance import run  # noqa: F401

import adaptive_bvh as ab
from adaptive_bvh._clearance._arrays import read_npz
from adaptive_bvh._clearance._files import Reading
from adaptive_bvh._clearance._frames import FrameError, SequenceError
from adaptive_bvh._clearance._opening import open_moving

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
METRES = Reading("m", "m")

# Opens a moving body in another process, reads its frames, and prints why not.
OPENS = """
import resource, sys
from adaptive_bvh._clearance._files import Reading
from adaptive_bvh._clearance._opening import open_moving
before = resource.getrusage(resource.RUSAGE_SELF)
try:
    sequence, = open_moving(sys.argv[2:], Reading("m", "m"), 30.0)
    for frame in range(len(sequence))[:int(sys.argv[1])]:
        sequence.read(frame)
except ValueError as error:
    print(error)
after = resource.getrusage(resource.RUSAGE_SELF)
print(after.ru_utime - before.ru_utime, (after.ru_maxrss - before.ru_maxrss) / 1000)
"""


def opened_within_limits(*paths, frames=1000):
    """Why files were refused, or "": in at most a second and 100 MB for each megabyte that is begun
    (threefold: a busy processor)."""
    megabytes = sum(1 + os.path.getsize(path) // 10**6 for path in paths)
    found = subprocess.run(
        [sys.executable, "-c", OPENS, str(frames), *map(str, paths)], capture_output=True, text=True, timeout=60,
        env={**os.environ, "PYTHONPATH": str(pathlib.Path(ab.__file__).parent.parent)})
    assert found.returncode == 0, found.stderr
    *reason, cost = found.stdout.splitlines()
    seconds, memory = map(float, cost.split())
    assert seconds < 3 * megabytes and memory < 100 * megabytes, (seconds, memory, reason)
    return " ".join(reason)


# ---- archives ------------------------------------------------------------------------------------


def test_an_archive_of_zeros(tmp_path):
    np.savez_compressed(tmp_path / "zeros.npz", vertices=np.zeros((250_000, 4, 3)), faces=[[0, 1, 2]])
    assert (tmp_path / "zeros.npz").stat().st_size < 10**6
    assert "more than 64 times its own bytes" in opened_within_limits(tmp_path / "zeros.npz")


def test_an_archive_of_many_arrays(tmp_path):
    np.savez(tmp_path / "many.npz", **{f"a{k}": np.zeros(1) for k in range(1001)})
    assert "more than 1000 arrays" in opened_within_limits(tmp_path / "many.npz")


def test_every_damaged_byte_of_an_archive(tmp_path):
    """Also zlib.error, which is no error of Python's."""
    np.savez_compressed(tmp_path / "whole.npz", v=np.arange(18.0).reshape(2, 3, 3), f=[[0, 1, 2]])
    data = (tmp_path / "whole.npz").read_bytes()
    reasons = set()
    for at in range(len(data)):
        changed = bytearray(data)
        changed[at] ^= 1 << at % 8
        (tmp_path / "bad.npz").write_bytes(changed)
        try:
            read_npz(str(tmp_path / "bad.npz"), "bad", "mm", "mm", None).read(0)
        except (SequenceError, FrameError) as error:
            reasons.add(str(error))
    assert any("decompressing" in reason for reason in reasons)


def test_negative_shapes(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -4, 3), }".ljust(117) + b"\n"
        archive.writestr("v.npy", b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(SequenceError, match="announces more than it holds"):
        read_npz(str(tmp_path / "a.npz"), "a", "mm", "mm", None)


# ---- no files ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a.npz", "a.pc2", "a.csv", "a.glb", "a.ply", "a.stl", "a.txt"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_what_never_ends(tmp_path, name, kind):
    path = tmp_path / name
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    write_obj(tmp_path / "mesh.obj", TRIANGLE, [[0, 1, 2]])
    names = [path, tmp_path / "mesh.obj"] if name in ("a.pc2", "a.csv") else [path]
    assert "no regular file" in opened_within_limits(*names)


def test_a_frame_that_never_ends(run, tmp_path):  # noqa: F811
    for k in range(3):
        write_ply(tmp_path / f"h{k}.ply", TRIANGLE + [k, 0, 0], [[0, 1, 2]])
    write_ply(tmp_path / "part.ply", TRIANGLE + [0, 0, 3], [[0, 1, 2]])
    (tmp_path / "h1.ply").unlink()
    os.mkfifo(tmp_path / "h1.ply")
    os.mkfifo(tmp_path / "pipe.stl")
    found = run("--moving", tmp_path / "h*.ply", "--parts", tmp_path / "part.ply", tmp_path / "pipe.stl")
    assert found.status == 2 and all("no regular file" in error for error in found.errors)
    assert len(found.errors) == 2 and found.row("part")["frames_checked"] == "0; 2"


def test_a_build_that_reads_no_files(run, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.delattr(ab._core, "_open_gltf")
    write_ply(tmp_path / "a.ply", TRIANGLE, [[0, 1, 2]])
    found = run("--moving", tmp_path / "a.ply", "--parts", tmp_path / "a.ply")
    assert found.status == 2 and "was built without assimp" in found.errors[0]


# ---- numbers and names ---------------------------------------------------------------------------


@pytest.mark.parametrize("number", [1e300, -1e100, 2.0**252 * (1 + 2**-52)])
def test_a_coordinate_that_is_too_large(run, tmp_path, number):  # noqa: F811
    for k in range(4):
        vertices = TRIANGLE + [k, 0, 0]
        vertices[1, 2] = number if k == 2 else 0
        write_ply(tmp_path / f"h{k}.ply", vertices, [[0, 1, 2]])
        if k == 2:
            write_ply(tmp_path / "large.ply", vertices, [[0, 1, 2]])
    frames = np.array([TRIANGLE] * 4)
    frames[2, 1, 2] = number
    np.savez(tmp_path / "a.npz", v=frames, f=[[0, 1, 2]])
    write_ply(tmp_path / "part.ply", TRIANGLE + [0, 0, 3], [[0, 1, 2]])
    for moving in ("h*.ply", "a.npz"):
        found = run("--moving", tmp_path / moving, "--parts", tmp_path / "part.ply")
        assert found.status == 2 and found.row("part")["frames_checked"] == "0-1; 3"
        assert len(found.errors) == 1 and "is too large" in found.errors[0]
    found = run("--moving", tmp_path / "large.ply", "--parts", tmp_path / "part.ply",
                tmp_path / "large.ply")
    assert found.status == 2 and sum("too large" in error for error in found.errors) == 2
    assert all("large.ply" in error for error in found.errors)


def test_the_largest_coordinate(run, tmp_path):  # noqa: F811
    write_ply(tmp_path / "h0.ply", TRIANGLE * 2.0**252, [[0, 1, 2]])
    write_ply(tmp_path / "part.ply", TRIANGLE, [[0, 1, 2]])
    found = run("--moving", tmp_path / "h0.ply", "--parts", tmp_path / "part.ply")
    assert found.status == 1 and float(found.row("part")["upper"]) == 0


def test_names_that_are_not_utf8(run, tmp_path):  # noqa: F811
    for k in range(2):
        write_ply(tmp_path / "h.ply", TRIANGLE + [k, 0, 0], [[0, 1, 2]])
        (tmp_path / "h.ply").rename(tmp_path / os.fsdecode(b"h\xe9_%d.ply" % k))
    for name in (b"p\xe9\n.ply", b"a/p\xe9.ply"):
        (tmp_path / "a").mkdir(exist_ok=True)
        write_ply(tmp_path / "p.ply", TRIANGLE + [0, 0, 3], [[0, 1, 2]])
        (tmp_path / "p.ply").rename(tmp_path / os.fsdecode(name))
    found = run("--moving", tmp_path / os.fsdecode(b"h\xe9*.ply"), "--parts",
                tmp_path / os.fsdecode(b"p\xe9\n.ply"), tmp_path / "a" / os.fsdecode(b"p\xe9.ply"),
                "--report", tmp_path / "page.html")
    assert found.status == 0 and found.errors == []
    assert {row["moving"] for row in found.rows} == {"h\\xE9"}
    assert {row["part"] for row in found.rows} == {"p\\xE9\\x0A", "p\\xE9"}
    assert "p\\xE9\\x0A" in found.out


# ---- glTF ----------------------------------------------------------------------------------------


def moving_gltf(nodes=({"mesh": 0},)):
    """A triangle whose first node moves by (1, 0, 0)."""
    document = Gltf()
    document.mesh(TRIANGLE, [[0, 1, 2]])
    document.json["nodes"] = list(nodes)
    document.animate((0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]], "LINEAR"))
    return document


def expect_alike(path):
    """The first frame has the triangles of load_mesh, corner by corner, and in its order."""
    mesh = ab.load_mesh(path, weld=False)
    sequence, = open_moving([str(path)], METRES, 1.0)
    frame = sequence.read(0)
    np.testing.assert_array_equal(frame.shape.triangles, mesh.faces)
    np.testing.assert_allclose(frame.positions, mesh.vertices, rtol=0, atol=1e-12)
    return sequence


def test_a_file_that_is_its_own_buffer_many_times(tmp_path):
    document = moving_gltf()
    for view in document.json["bufferViews"]:
        view["buffer"] = 2000
    own = {"uri": "data:," + base64.b64encode(document.data).decode()}
    for k in range(2000):
        document.json["bufferViews"].append({"buffer": k, "byteLength": 36})
        document.json["accessors"].append({"bufferView": len(document.json["bufferViews"]) - 1,
                                           "componentType": 5121, "count": 12, "type": "VEC3"})
        document.json["meshes"][0]["primitives"].append(
            {"attributes": {"POSITION": len(document.json["accessors"]) - 1}})
    document.json["buffers"] = [{"uri": "own.gltf", "byteLength": 10**5}] * 2000 + [own]
    text = json.dumps(document.json)
    (tmp_path / "own.gltf").write_text(text + " " * (600_000 - len(text)))
    assert opened_within_limits(tmp_path / "own.gltf") == ""


def test_many_equal_triangles(tmp_path):
    document = moving_gltf()
    primitive = {"attributes": {"POSITION": 0}}
    document.json["meshes"][0]["primitives"] = [primitive] * 2000
    document.write(tmp_path / "equal.glb")
    assert opened_within_limits(tmp_path / "equal.glb") == ""
    sequence = expect_alike(tmp_path / "equal.glb")
    assert sequence.num_vertices == 3 and len(sequence.read(0).shape.triangles) == 2000


@pytest.mark.parametrize("kind", ["nodes", "placements", "skins", "targets", "channels"])
def test_documents_of_many_elements(tmp_path, kind):
    """Of a megabyte each."""
    document = moving_gltf([{"mesh": 0, "children": [1]}, {}])
    nodes, mesh = document.json["nodes"], document.json["meshes"][0]
    if kind == "nodes":
        nodes[0]["children"] = list(range(1, 90_000))
        nodes += [{} for _ in range(90_000)]
    elif kind == "placements":
        nodes[0]["children"] = [1] * 19_000
        nodes[1]["mesh"] = 0
    elif kind == "skins":
        document.json["skins"] = [{"joints": [1] * 20} for _ in range(8_000)]
        mesh["primitives"][0]["attributes"].update(
            JOINTS_0=document.add(np.zeros((3, 4)), "VEC4", 5123),
            WEIGHTS_0=document.add([[1, 0, 0, 0]] * 3, "VEC4"))
        nodes[0]["children"] = list(range(1, 8_001))
        nodes += [{"mesh": 0, "skin": k} for k in range(8_000)]
    elif kind == "targets":
        mesh["primitives"] = [{"attributes": {"POSITION": 0, "WEIGHTS_0": k}, "targets": [{}] * 90}
                              for k in range(2_000)]
    else:
        channel = document.json["animations"][0]["channels"][0]
        document.json["animations"][0]["channels"] = [channel] * 12_000
    document.write(tmp_path / "a.glb")
    assert os.path.getsize(tmp_path / "a.glb") < 10**6 + 200_000
    opened_within_limits(tmp_path / "a.glb", frames=2)


def test_equal_triangles_are_asked_once(run, tmp_path):  # noqa: F811
    """Where the body touches the part, each triangle takes long. Numbers are those of the file."""
    document = moving_gltf()
    half = np.sqrt(0.5)
    document.json["animations"] = []
    document.animate((0, "translation", [0, 1], [[0, 0, 0], [4, 0, -4]], "LINEAR"),
                     (0, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, half, half]], "LINEAR"))
    document.json["meshes"][0]["primitives"] *= 2000
    document.write(tmp_path / "equal.glb")
    vertices, faces = ball(2)
    write_ply(tmp_path / "ball.ply", vertices + [2, 0, -2], faces)
    begin = time.process_time()
    found = run("--moving", tmp_path / "equal.glb", "--parts", tmp_path / "ball.ply", "--rate", 10)
    assert time.process_time() - begin < 10
    assert found.status == 1 and found.row("ball")["triangle_moving"] == "0"
    frames = np.array([[TRIANGLE[[0, 0, 0]], TRIANGLE + [0, 0, 9]]] * 2).reshape(2, 6, 3)
    np.savez(tmp_path / "a.npz", v=frames, f=[[0, 1, 2], [0, 2, 1], [3, 4, 5], [5, 4, 3]])
    found = run("--moving", tmp_path / "a.npz", "--parts", tmp_path / "ball.ply", "--unit", "m")
    assert found.row("ball")["triangle_moving"] == "0"
    write_ply(tmp_path / "ball.ply", vertices + [0, 0, 12], faces)
    found = run("--moving", tmp_path / "a.npz", "--parts", tmp_path / "ball.ply", "--unit", "m")
    assert found.row("ball")["triangle_moving"] == "2"


def test_primitives_that_share_positions_and_not_morph_targets(tmp_path):
    document = moving_gltf()
    offset = document.add(np.full((3, 3), 5.0), "VEC3")
    primitive = {"attributes": {"POSITION": 0}}
    document.json["meshes"][0]["primitives"] = [
        {**primitive, "targets": [{"POSITION": offset}]}, {**primitive, "targets": [{}]},
        {**primitive, "targets": [{}]}]
    document.json["meshes"][0]["weights"] = [1]
    document.write(tmp_path / "targets.glb")
    positions = open_moving([str(tmp_path / "targets.glb")], METRES, 1.0)[0].read(0).positions
    np.testing.assert_array_equal(positions, np.concatenate([TRIANGLE + 5, TRIANGLE]))


@pytest.mark.parametrize("uri", ["a%00.bin", "%00", "a\\u0000.bin", "../a.bin", "%2e%2e/a.bin",
                                 "/dev/zero", "pipe", "folder", "a.bin", "x" * 5000])
def test_buffers_that_are_no_files(tmp_path, uri):
    document = moving_gltf()
    document.json["buffers"] = [{"uri": "URI", "byteLength": len(document.data)}]
    (tmp_path / "sub" / "folder").mkdir(parents=True)
    (tmp_path / "a.bin").write_bytes(document.data)
    os.mkfifo(tmp_path / "sub" / "pipe")
    (tmp_path / "sub" / "a.gltf").write_text(json.dumps(document.json).replace("URI", uri))
    assert "a.gltf" in opened_within_limits(tmp_path / "sub" / "a.gltf")


@pytest.mark.parametrize("extension, is_read", [
    ("KHR_materials_emissive_strength", True), ("EXT_texture_webp", True),
    ("KHR_mesh_quantization", True), ("KHR_draco_mesh_compression", False),
    ("EXT_meshopt_compression", False)])
def test_extensions(tmp_path, extension, is_read):
    document = moving_gltf()
    document.json["extensionsRequired"] = [extension]
    document.write(tmp_path / "a.glb")
    if is_read:
        assert len(expect_alike(tmp_path / "a.glb")) == 2
        return
    for read in (lambda path: ab.load_mesh(path), lambda path: open_moving([path], METRES, 1.0)):
        with pytest.raises(ValueError, match=extension):
            read(str(tmp_path / "a.glb"))


@pytest.mark.parametrize("nodes", [
    [{"mesh": 0, "scale": [-1, 1, 1]}],  # mirrored: triangles are reversed
    [{"children": [1]}, {"mesh": 0, "scale": [2, -3, 1], "rotation": [0.5, 0.5, 0.5, 0.5]}],
    [{"children": [1, 2]}, {"children": [3], "translation": [1, 2, 3]},
     {"children": [3], "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, -1, 0, 5, 6, 7, 1]},
     {"mesh": 0}],  # a child with two parents is placed twice
    [{"children": [1, 2]}, {"mesh": 0, "skin": 0, "translation": [1, 2, 3]}, {}],  # no JOINTS_0
])
def test_nodes_are_placed_as_load_mesh_does(tmp_path, nodes):
    document = moving_gltf(nodes)
    document.json["skins"] = [{"joints": [len(nodes) - 1]}]
    document.write(tmp_path / "a.glb")
    sequence = expect_alike(tmp_path / "a.glb")
    moved = sequence.read(1).positions - sequence.read(0).positions
    np.testing.assert_allclose(moved, np.broadcast_to([1, 0, 0], moved.shape), atol=1e-12)


def random_transform(rng):
    """Some are mirrored."""
    if rng.random() < 0.2:
        columns = np.eye(4)
        columns[:, :3] = rng.normal(size=(4, 3))
        return {"matrix": columns.ravel().tolist()}
    parts = {"translation": rng.normal(size=3), "rotation": rng.normal(size=4),
             "scale": rng.choice([-1, 0.5, 1, 2], 3)}
    return {name: part.tolist() for name, part in parts.items() if rng.random() < 0.5}


@pytest.mark.parametrize("seed", range(400 if LONG else 40))
def test_random_scenes_are_placed_as_load_mesh_does(tmp_path, seed):
    """Trees, some of whose nodes have two parents, and primitives that share positions."""
    rng = np.random.default_rng([seed, int(SEED or 0)])
    document = Gltf()
    for _ in range(rng.integers(1, 4)):
        vertices, faces = ball(0)
        mesh = document.mesh(vertices, faces[:rng.integers(1, 9)])
        primitives = document.json["meshes"][mesh]["primitives"]
        primitives += [dict(primitives[0], mode=int(rng.integers(4, 7))) for _ in range(rng.integers(3))]
    count = int(rng.integers(2, 8))
    nodes = [random_transform(rng) for _ in range(count)]
    for node in range(1, count):
        for parent in set(rng.integers(node, size=rng.integers(1, 3)).tolist()):
            nodes[parent].setdefault("children", []).append(node)
    for node in {count - 1, *rng.integers(count, size=2).tolist()}:
        nodes[node]["mesh"] = int(rng.integers(len(document.json["meshes"])))
    document.json["nodes"] = nodes + [{"children": [0]}]
    document.json["scenes"] = [{"nodes": [count]}]
    document.animate((count, "translation", [0, 1], [[0, 0, 0], [1, 2, 3]], "LINEAR"))
    document.write(tmp_path / "a.glb")
    sequence = expect_alike(tmp_path / "a.glb")
    moved = sequence.read(1).positions - sequence.read(0).positions
    np.testing.assert_allclose(moved, np.broadcast_to([1, 2, 3], moved.shape), atol=1e-12)


@pytest.mark.parametrize("animations", [None, [], {}, {"walk": {"channels": []}}, 3])
def test_documents_without_animations_are_parts_of_a_sequence(tmp_path, animations):
    document = moving_gltf()
    document.json["animations"] = animations
    document.write(tmp_path / "a_1.glb")
    assert len(expect_alike(tmp_path / "a_1.glb")) == 1


def test_documents_with_no_scene(tmp_path):
    document = moving_gltf([{"mesh": 0}, {"mesh": 0, "translation": [4, 0, 0]}])
    del document.json["scenes"], document.json["scene"]
    document.write(tmp_path / "a.glb")
    assert len(expect_alike(tmp_path / "a.glb").read(0).shape.triangles) == 2


# ---- the unit is that of the content -------------------------------------------------------------

COLLADA = """<COLLADA><asset><unit meter="0.01"/></asset><library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="f" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#f" count="3" stride="3"/></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#s"/></vertices><triangles count="1">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="w"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>
<instance_visual_scene url="#w"/></scene></COLLADA>"""
AMF = """<amf unit="inch"><object id="0"><mesh><vertices>{}</vertices><volume><triangle><v1>0</v1>
<v2>1</v2><v3>2</v3></triangle></volume></mesh></object></amf>""".format("".join(
    "<vertex><coordinates><x>{:g}</x><y>{:g}</y><z>{:g}</z></coordinates></vertex>".format(*p)
    for p in TRIANGLE))


def write_as(kind, path):
    """The triangle; returns the unit that the file declares, in metres, or None."""
    if kind in ("dae", "amf"):
        path.write_text(COLLADA if kind == "dae" else AMF)
    elif kind == "glb":
        moving_gltf().write(path)
    else:
        {"ply": write_ply, "stl": write_stl, "obj": write_obj}[kind](path, TRIANGLE, np.array([[0, 1, 2]]))
    return {"dae": 0.01, "glb": 1.0, "amf": 0.0254}.get(kind)


@pytest.mark.parametrize("kind, names", [
    ("glb", ["a.glb", "a.model", "a.glb\n", "a.model\n", "a"]), ("dae", ["a.dae", "a.model", "a"]),
    ("amf", ["a.amf"]), ("ply", ["a.ply", "a.gltf", "a.dae"]), ("stl", ["a.stl", "a"]),
    ("obj", ["a.obj", "a"])])
def test_units_are_those_of_the_content(tmp_path, kind, names):
    for name in names:
        declared = write_as(kind, tmp_path / name)
        try:
            assert ab._core._declares_unit(str(tmp_path / name)) == (declared is not None), name
        except ab.MeshLoadError:
            continue
        mesh = ab.load_mesh(tmp_path / name, unit=0.001, undeclared_unit=0.3048)
        assert np.abs(mesh.vertices).max() == pytest.approx(1000 * (declared or 0.3048), rel=1e-6), name
        same = ab.load_mesh(tmp_path / name, unit=0.3048, undeclared_unit=0.3048)
        if declared is None:
            assert np.abs(same.vertices).max() == 1  # exactly
        sequence, = open_moving([str(tmp_path / name)], Reading("mm", "ft"), 1.0)
        size = np.abs(sequence.read(0).positions).max()
        assert size == pytest.approx(1000 * (declared or 0.3048), rel=1e-6), name
        (tmp_path / name).unlink()


def test_a_gltf_of_any_name_in_millimetres(run, tmp_path):  # noqa: F811
    for name in ("a.glb", "a.model", "a.model\n"):
        moving_gltf().write(tmp_path / name)
        write_ply(tmp_path / "part.ply", TRIANGLE * 1000 + [0, 0, 250], [[0, 1, 2]])
        found = run("--moving", tmp_path / name, "--parts", tmp_path / "part.ply", "--unit", "mm",
                    "--rate", "2")
        assert found.status == 0 and found.errors == []
        assert float(found.row("part")["upper"]) == pytest.approx(250)
        write_ply(tmp_path / "far.ply", TRIANGLE + [0, 0, 7], [[0, 1, 2]])
        moving_gltf([{"mesh": 0, "translation": [0, 0, 5]}]).write(tmp_path / "part.model")
        found = run("--moving", tmp_path / name, "--parts", tmp_path / "part.model", "--rate", "2")
        assert found.row("part")["unit"] == "m"  # all files declare theirs
        assert float(found.row("part")["upper"]) == pytest.approx(5)
        found = run("--moving", tmp_path / name, "--parts", tmp_path / "far.ply", "--rate", "2")
        assert found.row("far")["unit"] == "mm"


def test_parts_and_motions_of_a_study_have_one_unit(tmp_path):
    """Parts that declare their unit, motions that do not."""
    from adaptive_bvh._clearance import _study, main
    units = []
    (tmp_path / "study.csv").write_text("name,moving\na,a.ply\nb,b.ply\n")
    write_ply(tmp_path / "a.ply", TRIANGLE, [[0, 1, 2]])
    write_ply(tmp_path / "b.ply", TRIANGLE, [[0, 1, 2]])
    moving_gltf().write(tmp_path / "part.glb")
    before = _study._import_distributed, _study._compute
    _study._import_distributed = lambda: None
    _study._compute = lambda arguments, given, *rest: units.append(given["unit"]) or False
    try:
        main(["clearance", "--study", str(tmp_path / "study.csv"), "--parts",
              str(tmp_path / "part.glb")])
    finally:
        _study._import_distributed, _study._compute = before
    assert units == ["mm"]
