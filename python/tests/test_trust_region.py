"""TrustRegion: iterates stay apart, whatever a solver proposes."""

import gc

import numpy as np
import pytest

import adaptive_bvh as ab
import meshes
from brute_force import points_to_triangles, segments


def edges_of(faces):
    """Each edge once: pairs of vertices."""
    return np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def least_distance(v1, f1, v2, f2):
    """Of all features of two meshes that do not intersect."""
    a, b = edges_of(f1), edges_of(f2)
    i, j = (x.ravel() for x in np.indices((len(a), len(b))))
    least = [segments(*v1[a[i]].swapaxes(0, 1), *v2[b[j]].swapaxes(0, 1)).min()]
    for v, (w, f) in ((v1, (v2, f2)), (v2, (v1, f1))):
        i, j = (x.ravel() for x in np.indices((len(v), len(f))))
        least.append(points_to_triangles(v[i], *w[f[j]].swapaxes(0, 1)).min())
    return min(least)


def test_iterates_keep_the_distance():
    (v1, f1), (v2, f2) = meshes.sheet(5), meshes.ball(1, 0.5)
    v1 = v1 + [0, 0, 0.7]
    sheet, ball = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    region = ab.TrustRegion(sheet, 0.1, distance=0.05)
    assert region.add_obstacle(ball) == 0
    region.begin(v1)
    rng = np.random.default_rng(3)
    accepted, held = v1, 0
    for _ in range(12):
        before = accepted
        proposed = before - [0, 0, 0.08] + 0.05 * rng.standard_normal(v1.shape)
        accepted, report = region.truncate(proposed)
        assert accepted.shape == v1.shape and accepted.dtype == np.float64
        differ = (accepted != proposed).any(axis=1).sum()
        assert differ <= report.held_back and report.held_by_radius <= report.held_back
        held += report.held_back
        for share in (1, rng.random((len(v1), 1)), rng.integers(0, 2, (len(v1), 1))):
            at = before + share * (accepted - before)
            assert least_distance(at, f1, v2, f2) > 0.05 * (1 - 1e-6)
    assert held > 50 and accepted[:, 2].min() < 0.3 and region.num_pairs > 0


def test_searches_again_only_when_too_many_are_held():
    vertices, faces = meshes.sheet(4)
    for most_held in (0.5, 1):
        region = ab.TrustRegion(ab.DeformableMesh(vertices, faces), 0.02, most_held=most_held)
        region.begin(vertices)
        reports = [region.truncate(vertices + [0, 0, 0.05])[1] for _ in range(2)]
        assert reports[0].held_by_radius == len(vertices)
        assert [r.has_searched for r in reports] == [False, most_held < 1]
    assert "held_back=25" in repr(reports[0])


def test_obstacles_are_where_begin_found_them():
    vertices, faces = meshes.sheet(4)
    mesh = ab.DeformableMesh(vertices, faces)
    region = ab.TrustRegion(mesh, 0.3)
    below = np.eye(4)
    below[2, 3] = -0.1
    number = region.add_obstacle(ab.DeformableMesh(vertices, faces), below)
    gc.collect()  # the region keeps the obstacle
    region.begin(vertices)
    accepted, report = region.truncate(vertices - [0, 0, 0.2])
    assert report.held_back == len(vertices) and (accepted[:, 2] > -0.1).all()
    below[2, 3] = -1
    region.set_transform(number, below)
    region.begin(vertices)
    accepted, report = region.truncate(vertices - [0, 0, 0.2])
    assert report.held_back == 0 and (accepted[:, 2] == -0.2).all()


def test_refuses():
    vertices, faces = meshes.sheet(2)
    mesh = ab.DeformableMesh(vertices, faces)
    for bad in ({"radius": 0}, {"radius": np.nan}, {"radius": 1, "distance": -1.0}):
        with pytest.raises(ValueError):
            ab.TrustRegion(mesh, **bad)
    region = ab.TrustRegion(mesh, 0.1)
    with pytest.raises(ValueError, match="begin"):
        region.truncate(vertices)
    region.begin(vertices)
    for bad in (vertices[1:], vertices[:, :2], vertices * np.nan):
        with pytest.raises(ValueError):
            region.truncate(bad)
        with pytest.raises(ValueError):
            region.begin(bad)
    with pytest.raises(IndexError):
        region.set_transform(0, np.eye(4))
    with pytest.raises(TypeError):
        ab.TrustRegion.__new__(ab.TrustRegion).begin(vertices)
