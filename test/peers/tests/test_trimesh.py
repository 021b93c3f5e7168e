"""adaptive_bvh.trimesh.CollisionManager beside trimesh's, and in trimesh's own tests."""

import importlib.util
import os
import sys
import types

import numpy as np
import pytest

import adaptive_bvh as ab
from adaptive_bvh.trimesh import CollisionManager, scene_to_collision

trimesh = pytest.importorskip("trimesh")


def placed(x, y=0.0, z=0.0):
    return trimesh.transformations.translation_matrix([x, y, z])


def torus():
    return trimesh.creation.torus(1.0, 0.3, major_sections=24, minor_sections=12)


def moved(name_and_mesh_and_pose):
    theirs = trimesh.collision.CollisionManager()
    ours = CollisionManager()
    for row in name_and_mesh_and_pose:
        theirs.add_object(*row)
        ours.add_object(*row)
    return ours, theirs


def bodies(seed, count):
    """Convex and concave ones, some of which meet; no two touch exactly."""
    random = np.random.default_rng(seed)
    kinds = [torus(), trimesh.creation.icosphere(2, 0.8), trimesh.creation.box([1.0, 2.0, 0.5])]
    rows = []
    for i in range(count):
        pose = trimesh.transformations.random_rotation_matrix(random.random(3))
        pose[:3, 3] = random.uniform(-3, 3, 3)
        rows.append((f"body {i}", kinds[i % 3], pose.astype(np.float32).astype(np.float64)))
    return rows


@pytest.mark.parametrize("seed", range(5))
def test_answers_are_those_of_trimesh(seed):
    pytest.importorskip("fcl")
    ours, theirs = moved(bodies(seed, 12))
    assert ours.in_collision_internal(True) == theirs.in_collision_internal(True)
    other, their_other = moved(bodies(seed + 100, 7))
    assert ours.in_collision_other(other, True) == theirs.in_collision_other(their_other, True)
    for i, (_, mesh, pose) in enumerate(bodies(seed + 200, 6)):
        assert ours.in_collision_single(mesh, pose, True) == theirs.in_collision_single(
            mesh, pose, True
        )
        distance, name = theirs.min_distance_single(mesh, pose, True)
        if distance > 0:  # FCL's of overlapping surfaces are -1
            found, found_name, data = ours.min_distance_single(mesh, pose, True, True)
            assert found == pytest.approx(distance, abs=1e-5) and found_name == name
            gap = np.linalg.norm(data.point(name) - data.point("__external"))
            assert gap == pytest.approx(found, abs=1e-9)


def test_distances_of_many_are_those_of_trimesh():
    pytest.importorskip("fcl")
    far = [(f"{i}", torus(), placed(3.0 * i + 0.1 * i * i)) for i in range(5)]
    ours, theirs = moved(far)
    for arguments in ((), ("2",)):
        found, names, data = ours.min_distance_internal(*arguments, return_names=True, return_data=True)
        expected, expected_names = theirs.min_distance_internal(*arguments, return_names=True)
        assert found == pytest.approx(expected, abs=1e-5) and names == expected_names
        assert data.names == set(names) and data.distance == found
    ours_again, theirs_again = moved([("high", torus(), placed(1.0, 0.0, 4.0))])
    found, names = ours.min_distance_other(ours_again, return_names=True)
    expected, expected_names = theirs.min_distance_other(theirs_again, return_names=True)
    assert found == pytest.approx(expected, abs=1e-5) and names == expected_names


def test_contacts_have_faces_points_and_depths():
    manager = CollisionManager()
    manager.add_object("ring", torus())
    hit, names, contacts = manager.in_collision_single(torus(), placed(0.3), True, True)
    assert hit and names == {"ring"} and len(contacts) > 10
    for contact in contacts:
        assert contact.names == {"ring", "__external"}
        corners = torus().triangles[contact.index("ring")]
        assert np.linalg.norm(contact.point - corners, axis=1).min() < 0.5
        assert np.linalg.norm(contact.normal) == pytest.approx(1.0)
    assert manager.in_collision_single(torus(), placed(9.0), True, True) == (False, set(), [])


def test_convex_bodies_overlap_by_a_depth():
    box = trimesh.creation.box([1.0, 1.0, 1.0])
    manager = CollisionManager()
    manager.add_object("left", box)
    distance, data = manager.min_distance_single(box, placed(0.75), return_data=True)
    assert distance == pytest.approx(-0.25)
    apart = data.point("left") - data.point("__external")
    np.testing.assert_allclose(apart, [0.25, 0.0, 0.0], atol=1e-9)
    # Of several that overlap the deepest counts, whichever is found first.
    manager.add_object("deeper", box, placed(0.6))
    distance, name = manager.min_distance_single(box, placed(0.75), return_name=True)
    assert (distance, name) == (pytest.approx(-0.85), "deeper")


def test_vertices_move_in_place():
    ring, box = torus(), trimesh.creation.box([1.0, 1.0, 1.0])
    manager = CollisionManager()
    kept = manager.add_object("ring", ring)
    manager.add_object("box", box, placed(5.0))
    assert isinstance(kept, ab.DeformableMesh)
    assert manager.min_distance_internal() == pytest.approx(5.0 - 0.5 - 1.3)
    manager.update_object("ring", ring.vertices * 2)
    assert manager.min_distance_internal() == pytest.approx(5.0 - 0.5 - 2.6)
    assert manager.min_distance_single(box, placed(-5.0)) == pytest.approx(5.0 - 0.5 - 2.6)
    # A convex body stays filled while it is convex.
    inner = trimesh.creation.box([0.1, 0.1, 0.1])
    manager.update_object("box", box.vertices * 2)
    assert manager.in_collision_single(inner, placed(5.0), True) == (True, {"box"})
    dented = box.vertices * 2
    dented[0] *= 0.1
    manager.update_object("box", dented)
    assert manager.in_collision_single(inner, placed(5.5), True) == (False, set())
    with pytest.raises(ValueError):
        manager.update_object("box", dented[:4])


def test_names_that_are_not_there_and_other_errors():
    manager = CollisionManager()
    for call in (
        lambda: manager.remove_object("x"),
        lambda: manager.set_transform("x", np.eye(4)),
        lambda: manager.update_object("x", np.zeros((4, 3))),
        lambda: manager.min_distance_internal(name="x"),
        lambda: manager.add_object("x", torus(), np.eye(3)),
    ):
        with pytest.raises(ValueError):
            call()
    assert manager.in_collision_internal(True, True) == (False, set(), [])
    assert manager.min_distance_single(torus(), return_name=True) == (np.inf, None)
    manager.add_object("a", torus())
    manager.add_object("a", torus(), placed(9.0))  # replaces
    assert not manager.in_collision_single(torus())
    manager.remove_object("a")
    assert not manager.in_collision_single(torus(), placed(9.0))


def test_a_scene_of_trimesh():
    scene = trimesh.Scene([torus(), torus().apply_translation([0.0, 0.0, 5.0])])
    manager, objects = scene_to_collision(scene)
    assert len(objects) == 2 and manager.min_distance_internal() == pytest.approx(4.4)


def model(name):
    """A model of trimesh's tests: from TRIMESH_MODELS, or like it: a cube with the same corners, and
    for the scene of many parts one of two that touch."""
    folder = os.environ.get("TRIMESH_MODELS")
    if folder:
        return trimesh.load(os.path.join(folder, name))
    x = [-1, -1, -1, -1, 1, 1, 1, 1]
    y = [-1, 1, -1, 1, -1, -1, 1, 1]
    z = [1, 1, -1, -1, 1, -1, 1, -1]
    faces = [[0, 1, 2], [2, 1, 3], [4, 0, 5], [5, 0, 2], [6, 4, 7], [7, 4, 5]]
    faces += [[1, 6, 3], [3, 6, 7], [4, 6, 0], [0, 6, 1], [7, 5, 3], [3, 5, 2]]
    cube = trimesh.Trimesh(np.stack([x, y, z], axis=1) / 2, faces, process=False)
    return cube if name == "unit_cube.STL" else trimesh.Scene([cube, cube.copy()])


def test_trimesh_s_own_tests(monkeypatch):
    """test_collision.py of the trimesh that is installed, from its source distribution, with our
    class in place of theirs."""
    path = os.environ.get("TRIMESH_TESTS")
    if not path:
        pytest.skip("TRIMESH_TESTS names no test_collision.py")
    monkeypatch.setattr(trimesh.collision, "CollisionManager", CollisionManager)
    monkeypatch.setattr(trimesh.collision, "fcl", object())
    generic = types.ModuleType("generic")  # what the test takes of trimesh's tests/generic.py
    import logging
    import unittest

    generic.unittest, generic.np, generic.trimesh = unittest, np, trimesh
    generic.log = logging.getLogger("trimesh")
    generic.random = np.random.default_rng(0).random
    generic.get_mesh = model
    monkeypatch.setitem(sys.modules, "generic", generic)
    monkeypatch.setitem(sys.modules, "fcl", types.ModuleType("fcl"))
    spec = importlib.util.spec_from_file_location("trimesh_test_collision", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    suite = unittest.defaultTestLoader.loadTestsFromModule(module)
    assert suite.countTestCases() >= 5
    result = unittest.TextTestRunner(stream=sys.stderr).run(suite)
    assert result.wasSuccessful(), result.errors + result.failures
