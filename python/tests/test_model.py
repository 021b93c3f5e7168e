import gc
import pathlib
import tracemalloc
import types

import meshes
import numpy as np
import pytest

import adaptive_bvh as ab


def test_built_model_knows_its_mesh(kind):
    vertices, faces = meshes.ball(1)
    model = ab.Model(vertices, faces, **kind)
    assert (model.num_vertices, model.num_faces) == (len(vertices), len(faces))
    assert model.volume == kind["volume"] and model.dtype == np.dtype(kind["dtype"])
    assert model.vertices.dtype == model.dtype
    np.testing.assert_array_equal(model.vertices, vertices.astype(kind["dtype"]))
    np.testing.assert_array_equal(model.faces, faces)
    assert model.validate() is True
    assert kind["volume"] in repr(model)


@pytest.mark.parametrize("integer", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4"])
def test_faces_of_any_integer(integer):
    vertices, faces = meshes.ball(0)
    np.testing.assert_array_equal(ab.Model(vertices, faces.astype(integer)).faces, faces)


def test_mesh_objects_are_accepted():
    vertices, faces = meshes.ball(0)
    mesh = types.SimpleNamespace(vertices=vertices, faces=faces)
    np.testing.assert_array_equal(ab.Model(mesh).vertices, vertices)
    np.testing.assert_array_equal(ab.Model(ab.weld_vertices(vertices, faces)).faces, faces)
    assert ab.Model(mesh, volume="obbrss").volume == "obbrss"
    with pytest.raises(TypeError, match="faces are missing"):
        ab.Model(vertices)


def test_a_real_trimesh_is_accepted():
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box((1, 2, 3))
    model = ab.Model(mesh)
    assert (model.num_vertices, model.num_faces) == (8, 12)
    model.update(mesh.vertices * 2)
    np.testing.assert_array_equal(model.vertices, mesh.vertices * 2)


def test_update_moves_and_reports(kind):
    vertices, faces = meshes.sheet(6)
    model = ab.Model(vertices, faces, **kind)
    assert model.last_update.resynchronised
    moved = meshes.wave(vertices, 1)
    report = model.update(moved)
    np.testing.assert_array_equal(model.vertices, moved.astype(kind["dtype"]))
    largest = np.linalg.norm(moved - vertices, axis=1).max()
    assert report.largest_displacement == pytest.approx(largest, rel=1e-4)
    assert report.nodes == 2 * len(faces) - 1 and report.propagated > 0 and report.seconds > 0
    assert report.refitted == report.refitted_leaves + report.refitted_inner
    assert model.last_update.propagated == report.propagated
    assert model.validate()


def test_update_of_some_vertices(kind):
    vertices, faces = meshes.sheet(6)
    model = ab.Model(vertices, faces, **kind)
    expected = vertices.copy()
    expected[[40, 3]] += [0.1, 0.2, 0.3]
    for indices in ([40, 3], np.array([40, 3], "u1"), np.array([0, 3, 0, 40])[::-2]):
        model.update(vertices)
        model.update(indices, expected[np.asarray(indices, int)])
        np.testing.assert_array_equal(model.vertices, expected.astype(kind["dtype"]))
    model.update([5, 5], [[9, 9, 9], [1, 1, 1]])
    np.testing.assert_array_equal(model.vertices[5], [1, 1, 1])
    before = model.vertices
    model.update([], np.zeros((0, 3)))
    np.testing.assert_array_equal(model.vertices, before)
    assert model.validate()


def refused(call, error, sentence, model):
    before = model.vertices
    with pytest.raises(error, match=sentence):
        call()
    np.testing.assert_array_equal(model.vertices, before)
    assert model.validate()


def test_wrong_updates_are_refused_and_leave_no_trace(kind):
    vertices, faces = meshes.ball(0)
    model = ab.Model(vertices, faces, **kind)
    model.update(vertices * 1.5)
    nan, huge = vertices.copy(), vertices.copy()
    nan[4, 1], huge[2, 0] = np.nan, 1e100
    wrong = [
        (lambda: model.update(vertices[:5]), ValueError, r"has the shape \(5, 3\); \(6, 3\)"),
        (lambda: model.update(vertices[:, :2]), ValueError, r"\(N, 3\) is needed"),
        (lambda: model.update(vertices.ravel()), ValueError, r"has the shape \(18,\)"),
        (lambda: model.update(nan), ValueError, "coordinate y of vertex 4 is nan"),
        (lambda: model.update(huge), ValueError, "coordinate x of vertex 2 is"),
        (lambda: model.update(vertices * 1j), TypeError, "complex128; real numbers"),
        (lambda: model.update(vertices.astype(str)), TypeError, "real numbers"),
        (lambda: model.update(vertices > 0), TypeError, "bool; real numbers"),
        (lambda: model.update(None), TypeError, "real numbers"),
        (lambda: model.update([[1, 2], [3]]), TypeError, "numbers"),
        (lambda: model.update(), TypeError, "update"),
        (lambda: model.update([6], [[0, 0, 0]]), IndexError, "names 6; there are 6 vertices"),
        (lambda: model.update([-1], [[0, 0, 0]]), IndexError, "names -1"),
        (lambda: model.update([2**63], [[0, 0, 0]]), IndexError, "indices"),
        (lambda: model.update([0.0], [[0, 0, 0]]), TypeError, "integers are needed"),
        (lambda: model.update([[0]], [[0, 0, 0]]), ValueError, "has the shape"),
        (lambda: model.update([0, 1], [[0, 0, 0]]), ValueError, "there are 2 indices"),
        (lambda: model.update([0], [[0, 0, np.inf]]), ValueError, "coordinate z of vertex 0"),
    ]
    for call, error, sentence in wrong:
        if kind["dtype"] == "float64" and "x of vertex 2" in sentence:
            continue  # 1e100 is a number like others there
        refused(call, error, sentence, model)


def test_wrong_meshes_are_refused():
    vertices, faces = meshes.ball(0)
    wrong = [
        ((vertices, faces + 1), ValueError, None),
        ((vertices, faces - 1), IndexError, "names -1"),
        ((vertices, faces.astype(float)), TypeError, "integers are needed"),
        ((vertices, faces[:, :2]), ValueError, r"\(N, 3\)"),
        ((vertices * np.nan, faces), ValueError, "coordinate x of vertex 0 is nan"),
        ((vertices * 1e200, faces), ValueError, "too large"),
        ((vertices, faces, "aabb"), ValueError, "'rss' or 'obbrss' is needed"),
        ((vertices, faces, "rss", "int32"), TypeError, "float64 or float32 is needed"),
        ((vertices, faces, "rss", "float64", 3), TypeError, "RefitPolicy"),
        ((vertices, faces, "rss", "float64", None, "up"), ValueError, "'bottom-up' or 'top-down'"),
    ]
    wrong[0] = ((vertices, faces + 1), IndexError, "names 6; there are 6 vertices")
    for arguments, error, sentence in wrong:
        with pytest.raises(error, match=sentence):
            ab.Model(*arguments)


def test_a_model_without_triangles_can_be_updated_but_not_queried():
    for vertices in (np.ones((4, 3)), np.ones((1, 3))):
        model = ab.Model(vertices, np.zeros((0, 3), int))
        model.update(vertices * 2)
        np.testing.assert_array_equal(model.vertices, vertices * 2)
        ball = ab.Model(*meshes.ball(0))
        for query in (ab.distance, ab.collide, ab.clearance):
            with pytest.raises(ValueError, match="no triangles"):
                query(ball, model)
        with pytest.raises(ValueError, match="no triangles"):
            ab.self_collide(model)


def test_float64_in_c_order_is_read_in_place():
    vertices, faces = meshes.sheet(100)
    for dtype in ("float64", "float32"):
        mine = np.ascontiguousarray(vertices, dtype)
        model = ab.Model(mine, faces, dtype=dtype)
        tracemalloc.start()
        model.update(mine)
        in_place = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        model.update(np.asfortranarray(mine))
        copied = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert in_place < mine.nbytes / 4 < mine.nbytes <= copied


def test_a_model_keeps_nothing_of_the_arrays():
    vertices, faces = meshes.ball(1)
    mine, triangles = vertices.copy(), faces.copy()
    model = ab.Model(mine, triangles)
    mine[:], triangles[:] = np.nan, 0
    np.testing.assert_array_equal(model.vertices, vertices)
    np.testing.assert_array_equal(model.faces, faces)
    model.update(model.vertices)  # what it gave out is its own no more
    got = model.vertices
    got[:] = 5
    np.testing.assert_array_equal(model.vertices, vertices)
    mine[:] = vertices  # the array that the model was built of, written and handed back
    mine *= 2
    model.update(mine)
    np.testing.assert_array_equal(model.vertices, 2 * vertices)


def test_policies():
    policy = ab.RefitPolicy()
    assert policy == ab.RefitPolicy("AD") and policy.criterion == "AD"
    assert hash(policy) == hash(ab.RefitPolicy()) and policy != 3
    other = ab.RefitPolicy("ABOrBC", max_inflation=0.5, propagation="displacements")
    assert eval(repr(other), {"RefitPolicy": ab.RefitPolicy}) == other != policy
    assert ab.RefitPolicy.from_json(other.to_json()) == other
    assert ab.RefitPolicy.thesis("B").criterion == "B"
    vertices, faces = meshes.sheet(6)
    model = ab.Model(vertices, faces, policy=other)
    assert model.policy == other
    model.policy = policy
    assert model.policy == policy
    for name in ("A", "B", "AB", "BC", "ABC", "AOrBC", "ABOrBC", "RefitAll", "RefitNone", "AD"):
        model.policy = ab.RefitPolicy(name)
        assert model.policy.criterion == name
        model.update(meshes.wave(vertices, len(name)))
        assert model.validate()
    model.policy = ab.RefitPolicy("RefitAll")
    assert model.update(vertices).refitted == model.last_update.nodes
    for wrong, sentence in (
        (dict(criterion="Z"), "criterion is 'Z'; it is one of 'A', 'B'"),
        (dict(max_inflation=-1), "max_inflation"),
        (dict(axes_tolerance=np.nan), "axes_tolerance"),
        (dict(reference="x"), "'node size', 'original radius'"),
        (dict(propagation="x"), "propagation is 'x'"),
    ):
        with pytest.raises(ValueError, match=sentence):
            ab.RefitPolicy(**wrong)
    with pytest.raises(AttributeError):
        policy.max_inflation = 1
    with pytest.raises(ValueError):
        ab.RefitPolicy.from_json("{")


def test_threads_are_at_least_one():
    vertices, faces = meshes.sheet(4)
    model = ab.Model(vertices, faces)
    model.set_update_threads(2)
    model.set_query_threads(2)
    model.update(meshes.wave(vertices, 1))
    ab.self_collide(model)
    for call in (model.set_update_threads, model.set_query_threads):
        with pytest.raises(ValueError, match="at least 1"):
            call(0)


def test_hierarchies():
    for hierarchy in ("bottom-up", "top-down"):
        assert ab.Model(*meshes.ball(2), hierarchy=hierarchy).validate()


def test_results_outlive_what_they_came_from():
    model = ab.Model(*meshes.ball(1))
    kept = [model.vertices, ab.collide(model, ab.Box(1, 1, 9)).points, ab.clearance(model, model)]
    copies = [array.copy() for array in kept]
    del model
    gc.collect()
    for array, copy in zip(kept, copies):
        np.testing.assert_array_equal(array, copy)
        array[:] = 1  # theirs


def test_a_watching_pair_keeps_its_models():
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(3)
    tf = (np.eye(3), [0, 0, 3])
    for _ in range(15):
        first, second = ab.Model(v1, f1), ab.Model(v2, f2)
        watchers = ab.CoherentDistance(first, second), ab.CoherentProximity(first, second)
        motion = ab.Motion(first, v1 + [0, 0, 9])
        expected = ab.distance(first, second, None, tf).distance
        del first, second
        gc.collect()
        noise = [ab.Model(v2 * 5, f2) for _ in range(3)]
        assert watchers[0].distance(None, tf).distance == expected
        assert watchers[0].front_size >= 0
        assert watchers[1].is_nearer(expected - 0.1, None, tf) is False
        assert ab.largest_safe_step(motion, motion) == 0
        del noise


def test_load_mesh_and_weld(tmp_path):
    data = pathlib.Path(__file__).parents[2] / "examples" / "data" / "helmet.obj"
    for path in (data, str(data), bytes(data)):
        mesh = ab.load_mesh(path)
        assert mesh.vertices.shape[1] == mesh.faces.shape[1] == 3 and len(mesh.faces) == 710
    model = ab.Model(mesh)
    assert model.num_faces == 710 and model.validate()
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
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
