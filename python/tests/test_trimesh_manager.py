"""adaptive_bvh.trimesh without trimesh: what its own tests, in test/peers, do not ask."""

from types import SimpleNamespace

import numpy as np
import pytest
from brute_force import surface_distances
from meshes import ball, rotation

import adaptive_bvh as ab
from adaptive_bvh.trimesh import CollisionManager

BOX = ab.shape_mesh(ab.Box(1, 1.2, 1.4))


def convex(mesh, scale=1.0):
    return SimpleNamespace(vertices=scale * mesh.vertices, faces=mesh.faces, is_convex=True)


def placed(vertices, pose):
    return vertices @ pose[:3, :3].T + pose[:3, 3]


@pytest.mark.parametrize("seed", range(20))
def test_points_of_an_overlap_are_on_both_surfaces(seed):
    """A depth apart, and on the bodies: also where a face meets an edge, a vertex or a face."""
    rng = np.random.default_rng(seed)
    pose = np.eye(4)
    if seed % 2:
        pose[:3, :3] = rotation(rng)
    pose[:3, 3] = rng.uniform(-0.6, 0.6, 3)
    meshes = {"box": (convex(BOX), np.eye(4)),
              "other": (convex(BOX if seed % 3 else SimpleNamespace(**dict(zip(("vertices", "faces"), ball(1)))), 0.9), pose)}
    manager = CollisionManager()
    for name, (mesh, at) in meshes.items():
        manager.add_object(name, mesh, at)
    depth, found = manager.min_distance_internal(return_data=True)
    assert depth < 0 and found.distance == depth
    assert np.linalg.norm(found.point("box") - found.point("other")) == pytest.approx(-depth, abs=1e-9)
    for name, (mesh, at) in meshes.items():
        surface = surface_distances(found.point(name)[None], placed(mesh.vertices, at), mesh.faces)
        assert surface.min() < 1e-8


@pytest.mark.parametrize("given", ["hose.stl", np.zeros((3, 3)), None, ab.Sphere(1.0)])
def test_what_is_no_mesh_is_refused(given):
    manager = CollisionManager()
    for call in (lambda: manager.add_object("hose", given),
                 lambda: manager.in_collision_single(given)):
        with pytest.raises(TypeError, match=f"mesh is {type(given).__name__}; a Trimesh"):
            call()
    assert not manager.in_collision_internal()
