import copy
import gc
import os
import pathlib
import tracemalloc
import types

import meshes
import numpy as np
import pytest

import adaptive_bvh as ab


def test_built_mesh_knows_its_arrays(number):
    vertices, faces = meshes.ball(1)
    vertices = vertices.astype(number)
    mesh = ab.DeformableMesh(vertices, faces)
    assert (mesh.num_vertices, mesh.num_faces) == (len(vertices), len(faces))
    assert mesh.vertices.dtype == np.float64 and mesh.faces.dtype == np.int64
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    assert mesh.validate() is True
    assert repr(mesh) == "<adaptive_bvh.DeformableMesh: 18 vertices, 32 faces>"


@pytest.mark.parametrize("integer", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4"])
def test_faces_of_any_integer(integer):
    vertices, faces = meshes.ball(0)
    np.testing.assert_array_equal(ab.DeformableMesh(vertices, faces.astype(integer)).faces, faces)


def test_mesh_objects_are_accepted():
    vertices, faces = meshes.ball(0)
    arrays = types.SimpleNamespace(vertices=vertices, faces=faces)
    np.testing.assert_array_equal(ab.DeformableMesh(arrays).vertices, vertices)
    np.testing.assert_array_equal(ab.DeformableMesh(ab.weld_vertices(vertices, faces)).faces, faces)
    with pytest.raises(TypeError, match="faces are missing"):
        ab.DeformableMesh(vertices)


def test_there_is_no_dtype():
    vertices, faces = meshes.ball(0)
    for call in (
        lambda: ab.DeformableMesh(vertices, faces, dtype="float64"),
        lambda: ab.DeformableMesh(vertices, faces, "float64"),
        lambda: ab.Scene(dtype="float64"),
        lambda: ab.Scene("float64"),
    ):
        with pytest.raises(TypeError, match="incompatible constructor arguments"):
            call()
    assert not hasattr(ab.DeformableMesh, "dtype")


def test_a_real_trimesh_is_accepted():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((1, 2, 3))
    mesh = ab.DeformableMesh(box)
    assert (mesh.num_vertices, mesh.num_faces) == (8, 12)
    mesh.update(box.vertices * 2)
    np.testing.assert_array_equal(mesh.vertices, box.vertices * 2)


def test_update_moves_and_reports():
    vertices, faces = meshes.sheet(6)
    mesh = ab.DeformableMesh(vertices, faces)
    assert mesh.last_update.largest_displacement == 0
    moved = meshes.wave(vertices, 1)
    report = mesh.update(moved)
    np.testing.assert_array_equal(mesh.vertices, moved)
    largest = np.linalg.norm(moved - vertices, axis=1).max()
    assert report.largest_displacement == pytest.approx(largest, rel=1e-4)
    assert report.vertices == len(vertices) and report.seconds > 0 and report.turned in (True, False)
    assert mesh.last_update.largest_displacement == report.largest_displacement
    assert str(len(vertices)) in repr(report)
    assert mesh.update([3], moved[[3]]).vertices == 1
    assert report.vertices == len(vertices)  # a copy
    assert mesh.validate()


def test_two_frames(number):
    vertices, faces = meshes.sheet(6)
    mesh = ab.DeformableMesh(vertices, faces)
    assert mesh.previous_vertices.shape == (0, 3)
    first, second = (meshes.wave(vertices, t).astype(number) for t in (1, 2))
    mesh.update(first)
    report = mesh.update_two_frames(np.asfortranarray(second))
    assert report.vertices == len(vertices) and report.largest_displacement > 0
    np.testing.assert_array_equal(mesh.previous_vertices, first)
    np.testing.assert_array_equal(mesh.vertices, second)
    assert mesh.previous_vertices.dtype == np.float64 and mesh.validate()
    np.testing.assert_array_equal(mesh.copy().previous_vertices, first)
    for wrong in (second[:5], second * np.nan):
        with pytest.raises(ValueError):
            mesh.update_two_frames(wrong)
    np.testing.assert_array_equal(mesh.previous_vertices, first)
    np.testing.assert_array_equal(mesh.vertices, second)
    mesh.update(first)
    assert mesh.previous_vertices.shape == (0, 3) and mesh.previous_vertices.dtype == np.float64


def test_a_copy_is_a_snapshot():
    vertices, faces = meshes.sheet(6)
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.update(meshes.wave(vertices, 1))
    other, tf = ab.DeformableMesh(*meshes.ball(1)), (np.eye(3), [0, 0, 3])
    expected, before = ab.distance(mesh, other, tf2=tf).distance, mesh.vertices
    for snapshot in (mesh.copy(), copy.copy(mesh), copy.deepcopy(mesh)):
        mesh.update(vertices)
        np.testing.assert_array_equal(snapshot.vertices, before)
        np.testing.assert_array_equal(snapshot.faces, faces)
        assert snapshot.validate()
        assert ab.distance(snapshot, other, tf2=tf).distance == expected
        snapshot.update(vertices * 3)  # nor does the original see it
        np.testing.assert_array_equal(mesh.vertices, vertices)
        assert mesh.validate() and snapshot.validate()
        mesh.update(before)
    snapshot = mesh.copy()
    del mesh
    gc.collect()
    assert ab.distance(snapshot, other, tf2=tf).distance == expected
    assert len(copy.deepcopy([snapshot, snapshot])) == 2


def test_update_of_some_vertices(number):
    vertices, faces = meshes.sheet(6)
    vertices = vertices.astype(number)
    mesh = ab.DeformableMesh(vertices, faces)
    expected = vertices.copy()
    expected[[40, 3]] += np.array([0.1, 0.2, 0.3], number)
    for indices in ([40, 3], np.array([40, 3], "u1"), np.array([0, 3, 0, 40])[::-2]):
        mesh.update(vertices)
        mesh.update(indices, expected[np.asarray(indices, int)])
        np.testing.assert_array_equal(mesh.vertices, expected)
    mesh.update([5, 5], [[9, 9, 9], [1, 1, 1]])
    np.testing.assert_array_equal(mesh.vertices[5], [1, 1, 1])
    before = mesh.vertices
    mesh.update([], np.zeros((0, 3)))
    np.testing.assert_array_equal(mesh.vertices, before)
    assert mesh.validate()


def refused(call, error, sentence, mesh):
    before = mesh.vertices
    with pytest.raises(error, match=sentence):
        call()
    np.testing.assert_array_equal(mesh.vertices, before)
    assert mesh.validate()


def test_wrong_updates_are_refused_and_leave_no_trace():
    vertices, faces = meshes.ball(0)
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.update(vertices * 1.5)
    nan, huge = vertices.copy(), vertices.copy()
    nan[4, 1], huge[2, 0] = np.nan, 1e100
    wrong = [
        (lambda: mesh.update(vertices[:5]), ValueError, r"has the shape \(5, 3\); \(6, 3\)"),
        (lambda: mesh.update(vertices[:, :2]), ValueError, r"\(N, 3\) is needed"),
        (lambda: mesh.update(vertices.ravel()), ValueError, r"has the shape \(18,\)"),
        (lambda: mesh.update(nan), ValueError, "coordinate y of vertex 4 is nan"),
        (lambda: mesh.update(huge), ValueError, "coordinate x of vertex 2 is"),
        (lambda: mesh.update(vertices * 1j), TypeError, "complex128; real numbers"),
        (lambda: mesh.update(vertices.astype(str)), TypeError, "real numbers"),
        (lambda: mesh.update(vertices > 0), TypeError, "bool; real numbers"),
        (lambda: mesh.update(None), TypeError, "real numbers"),
        (lambda: mesh.update([[1, 2], [3]]), TypeError, "numbers"),
        (lambda: mesh.update(), TypeError, "update"),
        (lambda: mesh.update([6], [[0, 0, 0]]), IndexError, "names 6; there are 6 vertices"),
        (lambda: mesh.update([-1], [[0, 0, 0]]), IndexError, "names -1"),
        (lambda: mesh.update([2**63], [[0, 0, 0]]), IndexError, "indices"),
        (lambda: mesh.update([0.0], [[0, 0, 0]]), TypeError, "integers are needed"),
        (lambda: mesh.update([[0]], [[0, 0, 0]]), ValueError, "has the shape"),
        (lambda: mesh.update([0, 1], [[0, 0, 0]]), ValueError, "there are 2 indices"),
        (lambda: mesh.update([0], [[0, 0, np.inf]]), ValueError, "coordinate z of vertex 0"),
    ]
    for call, error, sentence in wrong:
        refused(call, error, sentence, mesh)


def test_wrong_meshes_are_refused():
    vertices, faces = meshes.ball(0)
    wrong = [
        ((vertices, faces + 1), ValueError, None),
        ((vertices, faces - 1), IndexError, "names -1"),
        ((vertices, faces.astype(float)), TypeError, "integers are needed"),
        ((vertices, faces[:, :2]), ValueError, r"\(N, 3\)"),
        ((vertices * np.nan, faces), ValueError, "coordinate x of vertex 0 is nan"),
        ((vertices * 1e200, faces), ValueError, "too large"),
        ((vertices + np.inf, faces), ValueError, "coordinate x of vertex 0 is inf"),
        ((vertices, faces[:0]), ValueError, "no triangles"),
        ((vertices[:0], faces[:0]), ValueError, "no triangles"),
        ((vertices[:0], faces), IndexError, "there are 0 vertices"),
    ]
    wrong[0] = ((vertices, faces + 1), IndexError, "names 6; there are 6 vertices")
    for arguments, error, sentence in wrong:
        with pytest.raises(error, match=sentence):
            ab.DeformableMesh(*arguments)


def in_memory(array):
    """The same numbers in arrays that are read as they lie, and in arrays that are converted. The
    numbers must be exact in float32."""
    padded = np.zeros((len(array), 5), array.dtype)
    padded[:, 1:4] = array
    other = np.float32 if array.dtype == np.float64 else np.float64
    in_place = [array, np.asfortranarray(array), padded[:, 1:4], np.repeat(array, 2, axis=0)[::2]]
    twice = np.asfortranarray(np.concatenate([array, array]))
    in_place += [np.asfortranarray(padded)[:, 1:4], twice[: len(array)]]
    turned = array[:, ::-1].copy()[:, ::-1]
    fixed = array.copy()
    fixed.flags.writeable = False
    return in_place + [fixed, array.astype(other)], [turned, array[::-1].copy()[::-1]]


def test_arrays_in_either_order_need_no_other_array(number):
    vertices, faces = meshes.sheet(100)
    mine = np.ascontiguousarray(meshes.wave(vertices, 1), np.float32).astype(number)
    mesh = ab.DeformableMesh(vertices, faces)
    for are_converted, arrays in enumerate(in_memory(mine)):
        for array in arrays:
            mesh.update(vertices)
            tracemalloc.start()
            mesh.update(array)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            np.testing.assert_array_equal(mesh.vertices, mine)
            assert (peak >= mine.nbytes) if are_converted else (peak < mine.nbytes / 4)
    assert mesh.validate()


@pytest.mark.parametrize("count", [3, 4])
def test_few_vertices_in_any_order(number, count):
    rows = np.random.default_rng(13).normal(size=(count, 3)).astype(np.float32).astype(number)
    mesh = ab.DeformableMesh(rows * 2, [[0, 1, 2]])
    for array in sum(in_memory(rows), []):
        mesh.update(rows * 2)
        mesh.update(array)
        np.testing.assert_array_equal(mesh.vertices, rows)
    alone = ab.DeformableMesh(rows[:1], [[0, 0, 0]])
    for array in sum(in_memory(rows[1:2]), []):
        alone.update(array)
        np.testing.assert_array_equal(alone.vertices, rows[1:2])


def answers(mesh):
    """The bytes of what a mesh holds and of what queries of it find."""
    tf = meshes.place(0.1, 0.2, 1.9)
    other = ab.DeformableMesh(*meshes.ball(1))
    found = [mesh.vertices, mesh.previous_vertices, ab.vertex_distances(mesh, other, tf1=tf)]
    found += [ab.distance(mesh, other, tf2=tf).points, ab.collide(mesh, other).points]
    found += [ab.closest_points(mesh, meshes.ball(1, 2.0)[0]).points]
    return [array.tobytes() for array in found]


def test_arrays_of_float32_give_what_the_same_numbers_in_float64_give():
    vertices, faces = meshes.sheet(6)
    first, second, third = (meshes.wave(vertices, t).astype(np.float32) for t in range(3))
    some = [3, 40, 7]
    for form in range(len(in_memory(first)[0])):
        given = [in_memory(rows)[0][form] for rows in (first, second, third)]
        mesh = ab.DeformableMesh(given[0], faces)
        same = ab.DeformableMesh(first.astype(float), faces)
        for of_array, of_same in (
            (lambda: None, lambda: None),
            (lambda: mesh.update(given[1]), lambda: same.update(second.astype(float))),
            (lambda: mesh.update(some, given[2][some]),
             lambda: same.update(some, third[some].astype(float))),
            (lambda: mesh.update_two_frames(given[2]),
             lambda: same.update_two_frames(third.astype(float))),
        ):
            of_array()
            of_same()
            assert answers(mesh) == answers(same)
    assert not np.array_equal(mesh.vertices, meshes.wave(vertices, 2))  # the numbers were rounded


def test_a_mesh_keeps_nothing_of_the_arrays():
    vertices, faces = meshes.ball(1)
    mine, triangles = vertices.copy(), faces.copy()
    mesh = ab.DeformableMesh(mine, triangles)
    mine[:], triangles[:] = np.nan, 0
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    mesh.update(mesh.vertices)  # what it gave out is its own no more
    np.testing.assert_array_equal(mesh.vertices, vertices)
    mine[:] = vertices  # the array that the mesh was built of, written and handed back
    mine *= 2
    mesh.update(mine)
    np.testing.assert_array_equal(mesh.vertices, 2 * vertices)


def test_threads_are_at_least_one():
    vertices, faces = meshes.sheet(4)
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.set_threads(2)
    mesh.update(meshes.wave(vertices, 1))
    ab.self_collide(mesh)
    with pytest.raises(ValueError, match="at least 1"):
        mesh.set_threads(0)


def test_results_outlive_what_they_came_from():
    mesh = ab.DeformableMesh(*meshes.ball(1))
    kept = [mesh.vertices, ab.collide(mesh, ab.Box(1, 1, 9)).points, ab.vertex_distances(mesh, mesh)]
    other = ab.DeformableMesh(meshes.ball(1)[0] + [0, 0, 1], meshes.ball(1)[1])
    kept += [ab.contact_regions(mesh, other).first.areas]  # an array of a part of a result
    near = ab.feature_pairs_within(mesh, other, 0.5)
    kept += [ab.feature_pair_details(mesh, other, near).edge_edge.normals]
    assert all(array.size for array in kept)
    copies = [array.copy() for array in kept]
    del mesh
    gc.collect()
    for array, copy in zip(kept, copies):
        np.testing.assert_array_equal(array, copy)
    for array in kept[1:]:  # theirs
        array[:] = 1


def test_a_watching_pair_keeps_its_meshes():
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(3)
    tf = (np.eye(3), [0, 0, 3])
    for _ in range(15):
        first, second = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
        watchers = ab.CoherentDistance(first, second), ab.CoherentProximity(first, second)
        motion = ab.Motion(first, v1 + [0, 0, 9])
        expected = ab.distance(first, second, tf2=tf).distance
        del first, second
        gc.collect()
        noise = [ab.DeformableMesh(v2 * 5, f2) for _ in range(3)]
        assert watchers[0].distance(None, tf).distance == expected
        assert watchers[1].is_nearer(expected - 0.1, tf2=tf) is False
        assert ab.largest_safe_step(motion, motion) == 0
        del noise


def test_load_mesh_and_weld(tmp_path):
    data = pathlib.Path(__file__).parents[2] / "examples" / "data" / "helmet.obj"
    for path in (data, str(data), bytes(data)):
        loaded = ab.load_mesh(path)
        assert loaded.vertices.shape[1] == loaded.faces.shape[1] == 3 and len(loaded.faces) == 710
    mesh = ab.DeformableMesh(loaded)
    assert mesh.num_faces == 710 and mesh.validate()
    corners = loaded.vertices[loaded.faces].reshape(-1, 3)
    loose = np.arange(len(corners)).reshape(-1, 3)
    welded = ab.weld_vertices(corners, loose)
    assert len(welded.vertices) == len(np.unique(corners, axis=0))
    np.testing.assert_array_equal(welded.vertices[welded.faces], corners[loose])
    assert issubclass(ab.MeshLoadError, ValueError)
    broken = tmp_path / "broken.ply"
    broken.write_bytes(b"ply\nformat")
    for path in (tmp_path / "none.obj", tmp_path, broken):
        with pytest.raises(ab.MeshLoadError, match=str(path)):
            ab.load_mesh(path)
    for path in (None, 3, "a\0b"):
        with pytest.raises((TypeError, ValueError)):
            ab.load_mesh(path)


def test_buffers_of_gltf_are_in_the_folder_of_the_document(tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    for path in (tmp_path / "a.bin", folder / "a.bin"):
        path.write_bytes(corners)
    document = (
        """{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":"%s"}]}"""
    )
    mesh = folder / "mesh.gltf"
    for name in ("a.bin", "../a.bin", "%2e%2e/a.bin", str(tmp_path / "a.bin")):
        mesh.write_text(document % name)
        if name != "a.bin":
            with pytest.raises(ab.MeshLoadError, match="not in its folder or below it"):
                ab.load_mesh(mesh)
        assert len(ab.load_mesh(mesh, buffers_outside_folder=name != "a.bin").faces) == 1


def test_load_mesh_quotes_bytes_that_are_not_utf8(tmp_path):
    path = os.fsencode(tmp_path) + b"/caf\xe9.off"
    for content, why in ((b"OFF\n3 \xe9 0\n", r"'\xE9' faces"), (b"", "caf")):
        with open(path, "wb") as file:
            file.write(content)
        with pytest.raises(ab.MeshLoadError) as error:
            ab.load_mesh(path)
        assert why in str(error.value) and r"caf\xE9.off" in str(error.value)
    with pytest.raises(ab.MeshLoadError, match="does not exist"):
        ab.load_mesh(os.fsencode(tmp_path) + b"/\xff.obj")
    with open(path, "wb") as file:
        file.write(b"\xef\xbb\xbfOFF\n3 1 0\n9 9 9\n1 0 0\n0 1 0\n3 0 1 2\n")
    assert ab.load_mesh(path).vertices[0].tolist() == [9, 9, 9]


def test_load_mesh_options(tmp_path):
    scene = tmp_path / "scene.dae"
    scene.write_text(
        """<COLLADA><asset><unit meter="0.5"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">2 4 6 0 0 0 0.25 0 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
    )
    for options, first in (
        ({}, [1, 2, 3]),
        ({"metres": False}, [2, 4, 6]),
        ({"up": "z"}, [1, 2, 3]),
        ({"up": "y"}, [1, 3, -2]),
        ({"up": "x", "scale": 2}, [6, -2, -4]),
    ):
        np.testing.assert_array_equal(ab.load_mesh(scene, **options).vertices[0], first)
    assert len(ab.load_mesh(scene).vertices) == 3
    with pytest.raises(ab.MeshLoadError, match="no triangles left"):
        ab.load_mesh(scene, weld_tolerance=0.2)
    for bad in ({"up": "w"}, {"scale": 0}, {"scale": float("nan")}, {"weld_tolerance": -1}):
        with pytest.raises(ValueError):
            ab.load_mesh(scene, **bad)
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1e-9, 0], [1, 1, 0], [0, 1, 1e-9]]
    welded = ab.weld_vertices(vertices, [[0, 1, 2], [3, 4, 5], [1, 3, 4]], tolerance=1e-8)
    np.testing.assert_array_equal(welded.vertices, np.delete(vertices, (3, 5), axis=0))
    np.testing.assert_array_equal(welded.faces, [[0, 1, 2], [1, 3, 2]])
    with pytest.raises(ValueError):
        ab.weld_vertices(vertices, [[0, 1, 2]], tolerance=-1)


def test_arrays_of_a_mesh_are_copies_that_cannot_be_written():
    mesh = ab.DeformableMesh(np.eye(3), [[0, 1, 2]])
    mesh.update_two_frames(2 * np.eye(3))
    for array in (mesh.vertices, mesh.previous_vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 5
