"""Scenes against queries of all pairs."""

import numpy as np
import pytest

import adaptive_bvh as ab
from meshes import ball


def place(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def bodies(dtype="float64", count=8):
    random = np.random.default_rng(3)
    vertices, faces = ball(2)
    scene = ab.Scene(dtype)
    meshes = [ab.DeformableMesh(vertices, faces, dtype=dtype) for _ in range(count)]
    poses = [place(*random.uniform(-2.5, 2.5, 3)) for _ in range(count)]
    ids = [scene.add(mesh, pose) for mesh, pose in zip(meshes, poses)]
    return scene, meshes, poses, ids


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_answers_are_those_of_all_pairs(dtype):
    scene, meshes, poses, ids = bodies(dtype)
    scene.update()
    touching, near, distances = [], 0, np.full((len(ids), len(ids)), np.inf)
    for i in ids:
        for j in ids[i + 1 :]:
            if len(ab.collide(meshes[i], meshes[j], poses[i], poses[j])):
                touching.append((i, j))
            near += len(ab.pairs_within(meshes[i], meshes[j], 0.1, poses[i], poses[j]))
            d = ab.distance(meshes[i], meshes[j], poses[i], poses[j]).distance
            distances[i, j] = distances[j, i] = d
    found = scene.collisions()
    assert found.bodies.tolist() == [list(pair) for pair in touching]
    assert len(found.offsets) == len(touching) + 1 and found.offsets[-1] == len(found.depths)
    assert len(scene.collisions(contacts_per_pair=0).depths) == 0
    assert len(scene.pairs_within(0.1)) == near
    for i in ids:
        nearest = scene.nearest(i)
        assert nearest.bodies[0] == i
        assert nearest.distance == pytest.approx(distances[i].min(), abs=1e-5)
    assert scene.distance().distance == pytest.approx(distances.min(), abs=1e-5)
    assert scene.is_nearer(0.5) == bool((distances <= 0.5).any())


def test_queries_need_an_update():
    scene, meshes, _, ids = bodies()
    with pytest.raises(RuntimeError, match="update"):
        scene.distance()
    scene.update()
    scene.distance()
    meshes[0].update(meshes[0].vertices + 1)
    with pytest.raises(RuntimeError, match="update"):
        scene.collisions()
    scene.update()
    scene.remove(ids[1])
    assert len(scene) == len(ids) - 1
    with pytest.raises(ValueError, match="no body"):
        scene.remove(ids[1])


def test_shapes_filters_points_and_rays():
    vertices, faces = ball(2)
    mesh = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    shape = scene.add(ab.Sphere(1.0), place(5, 0, 0))
    body = scene.add(mesh)
    scene.update()
    assert scene.nearest(body).bodies == (body, shape)
    assert scene.nearest(body).distance == pytest.approx(3, abs=0.05)
    number, distance, point, triangle = scene.nearest_point([0, 0, 3])
    assert number == body and distance == pytest.approx(2, abs=0.05) and triangle >= 0
    assert np.linalg.norm(point) == pytest.approx(1, abs=0.05)
    t, numbers, triangles = scene.first_hits([[0, 0.01, 3], [0, 9, 3]], [[0, 0, -1], [0, 0, -1]])
    assert numbers.tolist() == [body, -1] and t[0] == pytest.approx(2, abs=0.05)
    assert np.isinf(t[1]) and triangles[1] == -1
    scene.ignore(shape, body)
    assert np.isinf(scene.nearest(body).distance)
    scene.unignore(shape, body)
    scene.begin_step()
    other = scene.add(ab.DeformableMesh(vertices, faces), place(0, 0, 10))
    scene.begin_step()
    scene.set_transform(other, place(0, 0, 0))
    scene.update()
    assert scene.largest_safe_step() == pytest.approx(0.8, abs=0.01)


def test_what_does_not_fit_is_refused():
    vertices, faces = ball(2)
    scene = ab.Scene()
    with pytest.raises(ValueError, match="numbers"):
        scene.add(ab.DeformableMesh(vertices, faces, dtype="float32"))
    with pytest.raises(TypeError):
        scene.add("body")
    with pytest.raises(TypeError):
        ab.Scene("int32")
    with pytest.raises(ValueError):
        scene.add(ab.Sphere(1.0), self_collision=True)
    scene.update()
    with pytest.raises(ValueError):
        scene.is_nearer(-1)
    assert repr(scene.collisions()) == "<adaptive_bvh.SceneCollisions: 0 pairs, 0 contacts>"
