import meshes
import numpy as np
import pytest
from brute_force import ray_hits, surface_distances

import adaptive_bvh as ab


@pytest.fixture
def moved():
    vertices, faces = meshes.ball(2)
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.update(meshes.wave(vertices, 2))
    return mesh, mesh.vertices, faces


def test_closest_points_equal_brute_force(moved, tolerance):
    mesh, vertices, faces = moved
    points = np.random.default_rng(7).normal(size=(200, 3))
    distances = surface_distances(points, vertices, faces)
    closest = ab.closest_points(mesh, points)
    assert len(closest) == 200 and closest.triangles.dtype == np.int32
    np.testing.assert_allclose(closest.distances, distances.min(axis=1), atol=tolerance)
    named = distances[np.arange(200), closest.triangles]
    np.testing.assert_allclose(named, closest.distances, atol=tolerance)
    gaps = np.linalg.norm(closest.points - points, axis=1)
    np.testing.assert_allclose(gaps, closest.distances, atol=tolerance)
    one = ab.closest_point(mesh, points[3])
    assert one.distance == closest.distances[3] and one.triangle == closest.triangles[3]
    np.testing.assert_array_equal(one.point, closest.points[3])
    assert len(ab.closest_points(mesh, np.zeros((0, 3)))) == 0


def test_rays_equal_brute_force(moved, tolerance):
    mesh, vertices, faces = moved
    rng = np.random.default_rng(8)
    origins, directions = rng.normal(size=(2, 100, 3))
    t = np.array([ray_hits(o, d, vertices, faces) for o, d in zip(origins, directions)])
    first = ab.first_hit(mesh, origins, directions)
    assert len(first) == 100 and first.rays.tolist() == list(range(100))
    np.testing.assert_allclose(first.t, t.min(axis=1), rtol=1e3 * tolerance)
    missed = np.isinf(first.t)
    assert 0 < missed.sum() < 100 and (first.triangles[missed] == -1).all()
    hits = ab.ray_hits(mesh, origins, directions)
    assert len(hits) == np.isfinite(t).sum()
    np.testing.assert_allclose(hits.t, t[hits.rays, hits.triangles], rtol=1e3 * tolerance)
    corners = vertices[faces[hits.triangles]]
    weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)[..., None]
    points = origins[hits.rays] + hits.t[:, None] * directions[hits.rays]
    np.testing.assert_allclose((weights * corners).sum(axis=1), points, atol=1e3 * tolerance)
    ray = np.flatnonzero(~missed)[0]
    one = ab.first_hit(mesh, origins[ray], directions[ray])
    assert (one.t, one.triangles) == (first.t[[ray]], first.triangles[[ray]])
    alone = ab.ray_hits(mesh, origins[ray], directions[ray])
    np.testing.assert_array_equal(alone.triangles, hits.triangles[hits.rays == ray])
    assert (np.diff(alone.t) >= 0).all() and (alone.rays == 0).all()


def test_closest_features_equal_brute_force(moved, tolerance):
    mesh, vertices, faces = moved
    rng = np.random.default_rng(17)
    far = 1.2 * rng.normal(size=(200, 3))
    corners = vertices[rng.integers(len(vertices), size=100)]
    points = np.concatenate([far, 2.5 * corners, corners * 0.9])
    limit = 0.8
    distances = surface_distances(points, vertices, faces)
    nearest = distances.min(axis=1)
    found = ab.closest_features(mesh, points, limit)
    has_any = found.triangles >= 0
    np.testing.assert_array_equal(has_any, nearest <= limit)
    assert 0 < has_any.sum() < len(points) == len(found)
    assert np.isinf(found.distances[~has_any]).all() and np.isnan(found.points[~has_any]).all()
    assert set(found.features[~has_any]) == {"none"} and (found.numbers[~has_any] == -1).all()
    np.testing.assert_allclose(found.distances[has_any], nearest[has_any], atol=tolerance)
    triangles = found.triangles[has_any]
    named = distances[has_any, triangles]
    np.testing.assert_allclose(named, nearest[has_any], atol=tolerance)
    weights = found.barycentric[has_any]
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=tolerance)
    placed = (weights[..., None] * vertices[faces[triangles]]).sum(axis=1)
    np.testing.assert_allclose(found.points[has_any], placed, atol=4 * tolerance)
    assert {"face", "edge", "vertex"} == set(found.features[has_any])
    sides = vertices[faces]
    outward = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    angles = np.stack(
        [
            np.arccos(np.clip(np.sum(a * b, 1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1), -1, 1))
            for a, b in (
                (sides[:, (k + 1) % 3] - sides[:, k], sides[:, (k + 2) % 3] - sides[:, k])
                for k in range(3)
            )
        ],
        axis=1,
    )
    for i in np.flatnonzero(has_any):
        t, number, weights = found.triangles[i], found.numbers[i], found.barycentric[i]
        if found.features[i] == "face":
            assert number == t
            expected = outward[t]
        elif found.features[i] == "edge":
            ends = {faces[number // 3, number % 3], faces[number // 3, (number + 1) % 3]}
            assert ends < set(faces[t]) and weights.min() == pytest.approx(0, abs=tolerance)
            expected = sum(outward[k] for k, face in enumerate(faces) if ends < set(face))
        else:
            assert number in faces[t] and weights.max() == pytest.approx(1, abs=tolerance)
            expected = (outward[:, None] * ((faces == number) * angles)[..., None]).sum(axis=(0, 1))
        expected = expected / np.linalg.norm(expected)
        np.testing.assert_allclose(found.normals[i], expected, atol=100 * tolerance)
    everything = ab.closest_features(mesh, points)
    np.testing.assert_allclose(everything.distances, nearest, atol=tolerance)
    for wrong in (-1.0, np.nan):
        with pytest.raises(ValueError, match="a positive length is needed"):
            ab.closest_features(mesh, points, wrong)


def test_open_edges():
    vertices, faces = meshes.ball(1)
    assert ab.open_edges(ab.DeformableMesh(vertices, faces)).shape == (0, 4)
    mesh = ab.DeformableMesh(vertices, faces[1:])
    missing = {(int(a), int(b)) for a, b in zip(faces[0], np.roll(faces[0], -1))}
    found = ab.open_edges(mesh)
    assert {(b, a) for a, b in found[:, :2]} == missing and (found[:, 3] == 1).all()
    for a, b, t, _ in found:
        assert {a, b} < set(faces[1:][t])
    assert not ab.is_watertight(mesh) and (np.diff(found[:, 2]) >= 0).all()


@pytest.mark.parametrize("begin, end", [(0.0, np.inf), (0.0, 1.0), (0.5, 2.0), (3.0, 3.0)])
def test_a_range_of_rays_keeps_what_lies_in_it(moved, begin, end):
    mesh, _, _ = moved
    origins, directions = np.random.default_rng(9).normal(size=(2, 100, 3))
    all_hits = ab.ray_hits(mesh, origins, directions)
    kept = (all_hits.t >= begin) & (all_hits.t <= end)
    hits = ab.ray_hits(mesh, origins, directions, begin=begin, end=end)
    np.testing.assert_array_equal(hits.triangles, all_hits.triangles[kept])
    np.testing.assert_array_equal(hits.t, all_hits.t[kept])
    is_hit = np.isin(np.arange(100), hits.rays)
    any_hit = ab.any_hit(mesh, origins, directions, begin=begin, end=end)
    assert any_hit.dtype == np.bool_
    np.testing.assert_array_equal(any_hit, is_hit)
    first = ab.first_hit(mesh, origins, directions, begin=begin, end=end)
    np.testing.assert_array_equal(first.triangles >= 0, is_hit)
    assert ab.any_hit(mesh, origins[3], directions[3], begin=begin, end=end).tolist() == [is_hit[3]]
    one = ab.first_hit(mesh, origins[3], directions[3], begin=begin, end=end)
    assert one.triangles == first.triangles[[3]] and one.t == first.t[[3]]


def test_rays_share_an_origin_or_a_direction(moved):
    mesh, *_ = moved
    random = np.random.default_rng(5)
    many = random.uniform(-1, 1, (20, 3))
    expected = ab.first_hit(mesh, np.tile([3.0, 2, 1], (20, 1)), many - [3.0, 2, 1])
    for origin in ([3.0, 2, 1], [[3.0, 2, 1]]):
        np.testing.assert_array_equal(
            ab.first_hit(mesh, origin, many - [3.0, 2, 1]).t, expected.t
        )
    down = ab.first_hit(mesh, many + [0, 0, 5], np.tile([0.0, 0, -1], (20, 1)))
    np.testing.assert_array_equal(ab.first_hit(mesh, many + [0, 0, 5], [0, 0, -1]).t, down.t)
    assert len(ab.first_hit(mesh, [0, 0, 0], np.zeros((0, 3)))) == 0



def test_what_is_no_point_or_ray_is_refused(moved):
    mesh, _, _ = moved
    for query, sentence in (
        (lambda: ab.closest_point(mesh, [0, 0]), "has the shape"),
        (lambda: ab.closest_point(mesh, [0, 0, np.nan]), "not finite"),
        (lambda: ab.closest_points(mesh, [0, 0, 0]), "has the shape"),
        (lambda: ab.first_hit(mesh, [0, 0, 0], [0, 0, 0]), "direction is zero"),
        (lambda: ab.first_hit(mesh, np.zeros((2, 3)), np.ones((3, 3))), "2 origins and 3"),
        (lambda: ab.ray_hits(mesh, np.zeros((3, 3)), np.ones((2, 3))), "3 origins and 2"),
        (lambda: ab.ray_hits(mesh, np.zeros((2, 3)), [[np.inf, 0, 0]] * 2), "not finite"),
        (lambda: ab.first_hit(mesh, [0, 0, 0], [1, 0, 0], end=np.nan), "range of a ray is NaN"),
        (lambda: ab.any_hit(mesh, [[0, 0, 0]], [[1, 0, 0]], begin=-1), "begins below t = 0"),
        (lambda: ab.ray_hits(mesh, [0, 0, 0], [1, 0, 0], begin=2, end=1), "ends before it begins"),
    ):
        with pytest.raises(ValueError, match=sentence):
            query()
