import meshes
import numpy as np
import pytest
from brute_force import surface_distances, winding_numbers

import adaptive_bvh as ab


@pytest.fixture
def ball():
    vertices, faces = meshes.ball(2)
    return ab.DeformableMesh(vertices, faces), vertices, faces


def pose(x, y, z):
    tf = np.eye(4)
    tf[:3, 3] = x, y, z
    return tf


def test_vertex_contacts_equal_brute_force(ball, tolerance):
    mesh, vertices, faces = ball
    radius = np.linalg.norm(vertices, axis=1).max()
    tf = pose(0, 0, 1.8 * radius)
    found = ab.vertex_contacts(mesh, mesh, 0.3 * radius, tf1=tf)
    placed = mesh.vertices + tf[:3, 3]
    near = surface_distances(placed, mesh.vertices, faces).min(axis=1)
    inside = ab.signed_distances(mesh, placed) < 0
    np.testing.assert_array_equal(found.vertices, np.flatnonzero(inside | (near < 0.3 * radius)))
    assert 0 < inside.sum() < len(found)
    signed = np.where(inside, -near, near)[found.vertices]
    np.testing.assert_allclose(found.distances, signed, atol=tolerance)
    np.testing.assert_allclose(found.positions, placed[found.vertices], atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-6)
    corners = mesh.vertices[faces[found.triangles]]
    nearest = (found.barycentric[..., None] * corners).sum(axis=1)
    np.testing.assert_allclose(found.nearest_points, nearest, atol=10 * tolerance)
    force = (-(0.3 * radius - found.distances) * found.areas)[:, None] * found.normals
    assert force.sum(axis=0)[2] > 0  # apart


def test_vertex_contacts_with_a_shape(ball, tolerance):
    mesh, _, _ = ball
    positions = mesh.vertices
    found = ab.vertex_contacts(mesh, ab.Sphere(0.9), 0.3, tf2=pose(0.21, 0, 0))
    distances = np.linalg.norm(positions - [0.21, 0, 0], axis=1) - 0.9
    np.testing.assert_array_equal(found.vertices, np.flatnonzero(distances <= 0.3))
    np.testing.assert_allclose(found.distances, distances[found.vertices], atol=tolerance)
    assert (found.triangles == -1).all()


def test_vertex_contacts_of_both_are_two_calls(ball):
    first, vertices, faces = ball
    second = ab.DeformableMesh(0.7 * meshes.wave(vertices, 1), faces)
    tf1, tf2 = pose(0.1, 0, 0), pose(1.4, 0.2, 0.1)
    both = ab.vertex_contacts_of_both(first, second, 0.1, tf1=tf1, tf2=tf2)
    assert isinstance(both, tuple)
    alone = (ab.vertex_contacts(first, second, 0.1, tf1=tf1, tf2=tf2),
             ab.vertex_contacts(second, first, 0.1, tf1=tf2, tf2=tf1))
    for found, expected in zip(both, alone):
        assert (expected.distances < 0).any() and (expected.distances > 0).any()
        for name in ("vertices", "distances", "positions", "nearest_points", "normals",
                     "triangles", "barycentric", "areas"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    assert both[0].normals[:, 0].mean() > 0 > both[1].normals[:, 0].mean()
    assert [len(found) for found in ab.vertex_contacts_of_both(first, first, tf2=pose(9, 0, 0))] == [
        0, 0]
    open_mesh = ab.DeformableMesh(vertices, faces[1:])
    for pair in ((open_mesh, first), (first, open_mesh)):
        with pytest.raises(ValueError, match="the edge from vertex"):
            ab.vertex_contacts_of_both(*pair)
    with pytest.raises(ValueError, match="a positive length is needed"):
        ab.vertex_contacts_of_both(first, second, -1)
    with pytest.raises(TypeError):
        ab.vertex_contacts_of_both(first, ab.Sphere(1))


def test_signs_and_winding_numbers_of_points(ball):
    mesh, vertices, faces = ball
    points = np.random.default_rng(3).normal(size=(300, 3))
    radii, size = np.linalg.norm(points, axis=1), np.linalg.norm(vertices, axis=1).max()
    signed, winding = ab.signed_distances(mesh, points), ab.winding_numbers(mesh, points)
    clear = np.abs(radii - size) > 0.1 * size
    assert ((signed < 0) == (radii < size))[clear].all()
    np.testing.assert_allclose(winding[clear], signed[clear] < 0, atol=0)
    assert ab.is_watertight(mesh)
    open_mesh = ab.DeformableMesh(vertices, faces[1:])
    assert not ab.is_watertight(open_mesh)
    for query in (
        lambda: ab.signed_distances(open_mesh, points),
        lambda: ab.vertex_contacts(open_mesh, open_mesh),
    ):
        with pytest.raises(ValueError, match="the edge from vertex"):
            query()
    with pytest.raises(ValueError, match="a positive length is needed"):
        ab.vertex_contacts(mesh, mesh, -1)
    with pytest.raises(ValueError, match="not finite"):
        ab.winding_numbers(mesh, [[0, np.nan, 0]])


def test_winding_numbers_where_rays_lie_in_planes():
    """Of triangles in the plane y = z: rays along x meet their edges, but not the triangles."""
    random = np.random.default_rng(54)
    faces = np.arange(9).reshape(3, 3)
    for _ in range(100):
        vertices = random.integers(-3, 4, (9, 3)).astype(float)
        points = random.integers(-4, 5, (20, 3)).astype(float)
        for x in vertices, points:
            in_plane = random.integers(0, 4, len(x)) > 0
            x[in_plane, 2] = x[in_plane, 1]
        mesh = ab.DeformableMesh(vertices, faces)
        points = points[ab.closest_points(mesh, points).distances > 1e-3]
        expected = winding_numbers(points, vertices, faces)
        np.testing.assert_allclose(ab.winding_numbers(mesh, points), expected, atol=1e-6)


def test_signed_distance_of_two_bodies(ball, tolerance):
    mesh, vertices, _ = ball
    radius = np.linalg.norm(vertices, axis=1).max()
    deep = ab.signed_distance(mesh, mesh, 1e-3 * radius, tf2=pose(1.6 * radius, 0, 0))
    assert deep.upper - deep.lower <= 1e-3 * radius + tolerance
    np.testing.assert_allclose([deep.lower, deep.upper], -0.4 * radius, atol=0.15 * radius)
    assert deep.deep_body in ("first", "second")
    assert deep.normal[0] > 0.8
    np.testing.assert_allclose(
        deep.points[1] - deep.points[0], deep.upper * deep.normal, atol=10 * tolerance
    )
    assert repr(deep).startswith("SignedDistance(lower=-")
    apart = ab.signed_distance(mesh, mesh, 0, tf2=pose(3 * radius, 0, 0))
    assert apart.deep_body == "none"
    np.testing.assert_allclose(
        [apart.lower, apart.upper], np.linalg.norm(apart.points[1] - apart.points[0]),
        atol=10 * tolerance,
    )


def test_signed_distance_of_a_body_and_a_shape(ball):
    mesh, vertices, faces = ball
    radius = np.linalg.norm(vertices, axis=1).max()
    found = ab.signed_distance(mesh, ab.Sphere(radius), 1e-3, tf2=pose(0, 0, 1.6 * radius))
    np.testing.assert_allclose([found.lower, found.upper], -0.4 * radius, atol=0.15 * radius)
    below = ab.signed_distance(mesh, ab.Halfspace([0, 0, 1], 0.0), 0)
    np.testing.assert_allclose(below.upper, mesh.vertices[:, 2].min(), atol=1e-5)
    with pytest.raises(ValueError, match="no inside"):
        ab.signed_distance(mesh, ab.Plane([0, 0, 1], 0.0), 0)
    with pytest.raises(ValueError, match="the edge from vertex"):
        open_mesh = ab.DeformableMesh(vertices, faces[1:])
        ab.signed_distance(open_mesh, mesh, 0)
    with pytest.raises(ValueError, match="tolerance"):
        ab.signed_distance(mesh, mesh, np.nan)
