import meshes
import numpy as np
import pytest
from brute_force import (
    no_shared_vertices,
    pair_set,
    points_to_triangles,
    segments,
    surface_distances,
    triangle_distances,
)

import adaptive_bvh as ab

NEAR = 0.35


def moved_meshes(step):
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(4)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    moved1, moved2 = meshes.wave(v1, 0.3 * step), meshes.wave(v2, -0.2 * step)
    a.update(moved1)
    b.update(moved2)
    rng = np.random.default_rng(step)
    tf1, tf2 = meshes.pose(rng), meshes.pose(rng, 0.5 + 0.9 * step)
    world1, world2 = meshes.placed(moved1, tf1), meshes.placed(moved2, tf2)
    return (a, tf1, world1, f1), (b, tf2, world2, f2)


@pytest.mark.parametrize("step", range(4))
def test_pairs_within_equals_brute_force(tolerance, step):
    (a, tf1, w1, f1), (b, tf2, w2, f2) = moved_meshes(step)
    distances = triangle_distances(w1, f1, w2, f2)
    nearest = distances.min()
    assert (nearest == 0) == (step < 1)
    limit = nearest + NEAR
    while np.abs(distances - limit).min() < 2 * tolerance:
        limit += 10 * tolerance
    pairs = ab.pairs_within(
        a, b, limit, tf1=tf1, tf2=tf2, enable_distances=True, enable_nearest_points=True
    )
    assert pair_set(pairs.triangles) == pair_set(np.argwhere(distances <= limit))
    i, j = pairs.triangles.T
    np.testing.assert_allclose(pairs.distances, distances[i, j], atol=tolerance)
    gaps = np.linalg.norm(pairs.nearest_points[:, 0] - pairs.nearest_points[:, 1], axis=1)
    np.testing.assert_allclose(gaps, distances[i, j], atol=10 * tolerance)
    assert len(pairs) == len(pairs.triangles)
    plain = ab.pairs_within(a, b, limit, tf1=tf1, tf2=tf2)
    np.testing.assert_array_equal(plain.triangles, pairs.triangles)
    assert plain.distances.shape == (0,) and plain.nearest_points.shape == (0, 2, 3)
    watch = ab.CoherentProximity(a, b)
    for ask in (lambda d: ab.is_nearer(a, b, d, tf1=tf1, tf2=tf2),
                lambda d: watch.is_nearer(d, tf1=tf1, tf2=tf2)):
        assert ask(nearest + 2 * tolerance) is True
        if nearest > 0:
            assert ask(nearest - 2 * tolerance) is False
    assert watch.searches >= (nearest > 0)


def test_is_nearer_to_a_shape(tolerance):
    (a, tf, world, faces), _ = moved_meshes(1)
    centre = np.array([1.5, 0.5, -1.0])
    gap = surface_distances(centre[None], world, faces).min() - 0.4
    assert gap > 0.1
    for limit, expected in ((gap + 2 * tolerance, True), (gap - 2 * tolerance, False), (0, False)):
        assert ab.is_nearer(a, ab.Sphere(0.4), limit, tf1=tf, tf2=(np.eye(3), centre)) is expected
    with pytest.raises(ValueError):
        ab.is_nearer(a, ab.Sphere(0.4), -1)


def test_pairs_within_one_model(tolerance):
    vertices, faces = meshes.sheet(5)
    mesh = ab.DeformableMesh(vertices, faces)
    moved = meshes.wave(vertices, 1)
    mesh.update(moved)
    distances = triangle_distances(moved, faces, moved, faces)
    apart = np.triu(no_shared_vertices(faces), 1)
    pairs = ab.self_pairs_within(mesh, 0.41, enable_distances=True)
    assert pair_set(pairs.triangles) == pair_set(np.argwhere((distances <= 0.41) & apart))
    i, j = pairs.triangles.T
    np.testing.assert_allclose(pairs.distances, distances[i, j], atol=tolerance)


def edges_of(faces):
    """The number of each edge, its two vertices."""
    first = {}
    for t, face in enumerate(faces):
        for k in range(3):
            first.setdefault(frozenset((face[k], face[(k + 1) % 3])), 3 * t + k)
    numbers = np.array(sorted(first.values()))
    return numbers, faces[numbers // 3, numbers % 3], faces[numbers // 3, (numbers + 1) % 3]


def test_feature_pairs_within_equals_brute_force():
    (a, tf1, w1, f1), (b, tf2, w2, f2) = moved_meshes(1)
    pairs = ab.feature_pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2)
    to_second = surface_distances(w1, w2, f2)
    to_first = surface_distances(w2, w1, f1)
    assert pair_set(pairs.vertex_face) == pair_set(np.argwhere(to_second <= NEAR))
    assert pair_set(pairs.face_vertex[:, ::-1]) == pair_set(np.argwhere(to_first <= NEAR))
    (n1, p, q), (n2, r, s) = edges_of(f1), edges_of(f2)
    near = segments(w1[p][:, None], w1[q][:, None], w2[r][None], w2[s][None]) <= NEAR
    i, j = np.nonzero(near)
    assert pair_set(pairs.edge_edge) == set(zip(n1[i].tolist(), n2[j].tolist()))
    assert len(pairs) == sum(map(len, (pairs.vertex_face, pairs.face_vertex, pairs.edge_edge)))
    assert len(ab.self_feature_pairs_within(a, 0.5)) > 0


def expect_details(found, pairs, first, second, tolerance):
    """first, second: the nearest points by the coordinates that were found."""
    assert len(found) == len(pairs) == len(found.coordinates)
    points = found.nearest_points
    assert points.shape == (len(pairs), 2, 3)
    np.testing.assert_allclose(points[:, 0], first, atol=4 * tolerance)
    np.testing.assert_allclose(points[:, 1], second, atol=4 * tolerance)
    difference = points[:, 1] - points[:, 0]
    np.testing.assert_allclose(
        np.linalg.norm(difference, axis=1), found.distances, atol=8 * tolerance
    )
    apart = found.distances > 1e-2
    assert apart.any()
    np.testing.assert_allclose(
        found.normals[apart],
        difference[apart] / found.distances[apart, None],
        atol=1e3 * tolerance,
    )


def test_details_of_feature_pairs(tolerance):
    (a, tf1, w1, f1), (b, tf2, w2, f2) = moved_meshes(1)
    pairs = ab.feature_pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2)
    details = ab.feature_pair_details(a, b, pairs, tf1=tf1, tf2=tf2)

    def on_face(vertices, faces, triangles, coordinates):
        return (vertices[faces[triangles]] * coordinates[..., None]).sum(axis=1)

    def on_edge(vertices, faces, edges, along):
        p = vertices[faces[edges // 3, edges % 3]]
        q = vertices[faces[edges // 3, (edges + 1) % 3]]
        return p + along[:, None] * (q - p)

    (v, t), c = pairs.vertex_face.T, details.vertex_face.coordinates
    expect_details(
        details.vertex_face, pairs.vertex_face, w1[v], on_face(w2, f2, t, c), tolerance
    )
    distances = surface_distances(w1, w2, f2)[v, t]
    np.testing.assert_allclose(details.vertex_face.distances, distances, atol=tolerance)
    (t, v), c = pairs.face_vertex.T, details.face_vertex.coordinates
    expect_details(
        details.face_vertex, pairs.face_vertex, on_face(w1, f1, t, c), w2[v], tolerance
    )
    (e, f), c = pairs.edge_edge.T, details.edge_edge.coordinates
    expect_details(
        details.edge_edge,
        pairs.edge_edge,
        on_edge(w1, f1, e, c[:, 0]),
        on_edge(w2, f2, f, c[:, 1]),
        tolerance,
    )
    own = ab.self_feature_pairs_within(a, 0.5)
    assert len(ab.self_feature_pair_details(a, own).edge_edge) == len(own.edge_edge)
    with pytest.raises(IndexError):
        ab.self_feature_pair_details(a, ab.FeaturePairs(vertex_face=[[0, 10**6]]))


def test_ignored_pairs_are_left_out():
    (a, tf1, _, _), (b, tf2, _, _) = moved_meshes(1)

    def expect_rest(everything, ignored, rest):
        assert len(ignored) > 0
        assert pair_set(rest) == pair_set(everything) - pair_set(ignored)
        assert len(rest) == len(everything) - len(ignored)

    pairs = ab.pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2).triangles
    ignored = pairs[::-3]
    rest = ab.pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2, ignored=ignored)
    expect_rest(pairs, ignored, rest.triangles)
    own = ab.self_pairs_within(a, 0.9).triangles
    for ignored in (own[::2], own[::2, ::-1]):  # either triangle may come first
        expect_rest(own, own[::2], ab.self_pairs_within(a, 0.9, ignored=ignored).triangles)
    features = ab.feature_pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2)
    some = ab.FeaturePairs(features.vertex_face[::-2], edge_edge=features.edge_edge[::-3])
    rest = ab.feature_pairs_within(a, b, NEAR, tf1=tf1, tf2=tf2, ignored=some)
    expect_rest(features.vertex_face, some.vertex_face, rest.vertex_face)
    expect_rest(features.edge_edge, some.edge_edge, rest.edge_edge)
    np.testing.assert_array_equal(rest.face_vertex, features.face_vertex)
    features = ab.self_feature_pairs_within(a, 0.5)
    some = features.edge_edge[::2]
    for edges in (some, some[:, ::-1]):
        ignored = ab.FeaturePairs(edge_edge=edges)
        rest = ab.self_feature_pairs_within(a, 0.5, ignored=ignored)
        expect_rest(features.edge_edge, some, rest.edge_edge)
    crossed = ab.DeformableMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -1], [0.3, 0.2, -1], [0.2, 0.3, 1]],
        [[0, 1, 2], [3, 4, 5]],
    )
    assert len(ab.self_collide(crossed)) == 1
    assert len(ab.self_collide(crossed, ignored=[[0, 1]])) == 0
    assert len(ab.self_collide(crossed, ignored=[[1, 0]])) == 0


def test_vertex_distances_equal_brute_force(tolerance):
    (a, tf1, w1, f1), (b, tf2, w2, f2) = moved_meshes(2)
    expected = surface_distances(w1, w2, f2).min(axis=1)
    result = ab.vertex_distances(a, b, np.inf, tf1=tf1, tf2=tf2)
    assert result.shape == (len(w1),) and result.dtype == np.float64
    np.testing.assert_allclose(result, expected, atol=tolerance)
    limited = ab.vertex_distances(a, b, 0.9, tf1=tf1, tf2=tf2)
    np.testing.assert_allclose(limited, np.minimum(expected, 0.9), atol=tolerance)


def test_signed_vertex_distances_are_negative_inside(tolerance):
    sheet = ab.DeformableMesh(*meshes.sheet(4))
    ball = ab.DeformableMesh(*meshes.ball(2))
    signed, plain = ab.signed_vertex_distances(sheet, ball), ab.vertex_distances(sheet, ball)
    np.testing.assert_allclose(np.abs(signed), plain, atol=tolerance)
    radii = np.linalg.norm(sheet.vertices, axis=1)
    assert (signed[radii < 0.9] < 0).all() and (signed[radii > 1.01] > 0).all()
    with pytest.raises(ValueError):
        ab.signed_vertex_distances(ball, sheet)  # which is not closed


def test_a_distance_must_be_a_distance():
    a = ab.DeformableMesh(*meshes.ball(0))
    for distance in (-1.0, np.nan):
        for query in (
            lambda d: ab.is_nearer(a, a, d),
            lambda d: ab.pairs_within(a, a, d),
            lambda d: ab.self_pairs_within(a, d),
            lambda d: ab.self_feature_pairs_within(a, d),
            lambda d: ab.vertex_distances(a, a, d),
            lambda d: ab.CoherentProximity(a, a).is_nearer(d),
        ):
            with pytest.raises(ValueError, match="a positive length is needed"):
                query(distance)
    assert points_to_triangles(*np.zeros((4, 3))) == 0  # the oracle, of a point that is a triangle
