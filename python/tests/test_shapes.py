import copy
import pickle

import meshes
import numpy as np
import pytest
from brute_force import segments, surface_distances, triangle_distances

import adaptive_bvh as ab


def box_mesh(x, y, z):
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) / 2.0
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return corners * [x, y, z], np.array(faces)


def round_mesh(bottom, top, lz, n=100):
    """A frustum around z."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], 1)
    vertices = np.concatenate([bottom * ring - [0, 0, lz / 2], top * ring + [0, 0, lz / 2]])
    vertices = np.concatenate([vertices, [[0, 0, -lz / 2], [0, 0, lz / 2]]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    parts = [(i, j, n + j), (i, n + j, n + i), (i, j, low), (n + i, n + j, high)]
    return vertices, np.concatenate([np.stack(p, 1) for p in parts])


def capsule_distance(v, f, radius, lz, tf):
    tip = np.array([0, 0, lz / 2])
    p, q = meshes.placed(np.array([tip, -tip]), tf)
    corners = v[f]
    sides = [segments(p[None], q[None], corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)]
    ends = surface_distances(np.array([p, q]), v, f)
    return min(np.min(sides), ends.min()) - radius


def mesh_distance(v, f, other, tf):
    return triangle_distances(v, f, meshes.placed(other[0], tf), other[1]).min()


CASES = {
    "sphere": (ab.Sphere(0.4), lambda v, f, tf: surface_distances(tf[None, :3, 3], v, f).min() - 0.4),
    "box": (ab.Box(0.5, 0.7, 0.9), lambda v, f, tf: mesh_distance(v, f, box_mesh(0.5, 0.7, 0.9), tf)),
    "capsule": (ab.Capsule(0.2, 0.8), lambda v, f, tf: capsule_distance(v, f, 0.2, 0.8, tf)),
    "cylinder": (
        ab.Cylinder(0.3, 0.8),
        lambda v, f, tf: mesh_distance(v, f, round_mesh(0.3, 0.3, 0.8), tf),
    ),
    "cone": (
        ab.Cone(0.3, 0.8),
        lambda v, f, tf: mesh_distance(v, f, round_mesh(0.3, 0.0, 0.8), tf),
    ),
    "ellipsoid": (
        ab.Ellipsoid(0.3, 0.4, 0.5),
        lambda v, f, tf: mesh_distance(v, f, _ellipsoid(), tf),
    ),
}


def _ellipsoid():
    vertices, faces = meshes.ball(4)
    return vertices * [0.3, 0.4, 0.5], faces


@pytest.mark.parametrize("name", CASES)
def test_distance_equals_brute_force(name):
    shape, brute = CASES[name]
    rng = np.random.default_rng(6)
    vertices, faces = meshes.sheet(2)
    mesh = ab.DeformableMesh(vertices, faces)
    for step in range(2):
        moved = meshes.wave(vertices, step)
        mesh.update(moved)
        tf = meshes.pose(rng, 2.5)
        expected = brute(moved, faces, tf)
        result = ab.distance(mesh, shape, tf2=tf)
        assert result.distance == pytest.approx(expected, abs=2e-3)
        swapped = ab.distance(shape, mesh, tf1=tf)
        assert swapped.distance == result.distance
        np.testing.assert_array_equal(swapped.points, result.points[::-1])
        assert tuple(swapped.triangles) == tuple(result.triangles[::-1])
        assert result.triangles[1] == -1 and result.triangles[0] >= 0
        gap = np.linalg.norm(result.points[0] - result.points[1])
        assert gap == pytest.approx(result.distance, abs=1e-3)
        assert len(ab.collide(mesh, shape, tf2=tf)) == 0


@pytest.mark.parametrize("name", CASES)
def test_shapes_that_touch(name):
    shape, _ = CASES[name]
    vertices, faces = meshes.sheet(4)
    mesh = ab.DeformableMesh(vertices, faces)
    tf = (np.eye(3), [0.1, 0.2, 0.05])
    contacts, swapped = ab.collide(mesh, shape, tf2=tf), ab.collide(shape, mesh, tf1=tf)
    assert len(contacts) == len(swapped) > 0
    assert (contacts.pairs[:, 1] == -1).all() and (swapped.pairs[:, 0] == -1).all()
    np.testing.assert_array_equal(contacts.pairs, swapped.pairs[:, ::-1])
    np.testing.assert_array_equal(contacts.normals, -swapped.normals)
    assert ab.distance(mesh, shape, tf2=tf).distance == 0


def half_space_distance(v, normal, offset, tf, is_plane):
    along = v @ (tf[:3, :3] @ normal) - offset - normal @ tf[:3, :3].T @ tf[:3, 3]
    if is_plane:
        return max(along.min(), -along.max(), 0)
    return max(along.min(), 0)


@pytest.mark.parametrize("shape_type", [ab.Plane, ab.Halfspace])
def test_planes_and_half_spaces_equal_brute_force(shape_type, tolerance):
    rng = np.random.default_rng(11)
    vertices, faces = meshes.sheet(3)
    mesh = ab.DeformableMesh(vertices, faces)
    touching = 0
    for step in range(8):
        moved = meshes.wave(vertices, step)
        mesh.update(moved)
        normal, offset, tf = meshes.rotation(rng)[0], rng.normal(), meshes.pose(rng, 1.5)
        shape = shape_type(normal, offset)
        expected = half_space_distance(moved, normal, offset, tf, shape_type is ab.Plane)
        result = ab.distance(mesh, shape, tf2=tf)
        assert result.distance == pytest.approx(expected, abs=10 * tolerance)
        assert ab.distance(shape, mesh, tf1=tf).distance == result.distance
        assert result.triangles[1] == -1 and result.triangles[0] >= 0
        gap = np.linalg.norm(result.points[0] - result.points[1])
        assert gap == pytest.approx(expected, abs=10 * tolerance)
        contacts = ab.collide(mesh, shape, tf2=tf)
        assert (len(contacts) > 0) == (expected == 0) and (contacts.depths >= 0).all()
        touching += expected == 0
    assert 0 < touching < 8


def test_planes_can_be_read_and_need_a_unit_normal():
    plane, half = ab.Plane([0, 0.6, 0.8], 2), ab.Halfspace((0, 0, -1))
    np.testing.assert_allclose(plane.normal, [0, 0.6, 0.8], atol=1e-15)
    assert (plane.offset, half.offset) == (2, 0)
    assert repr(half) == "Halfspace((0.0, 0.0, -1.0), 0.0)"
    for normal in ([0, 0, 0], [0, 0, 2], [0, 0, np.nan], [0, np.inf, 1]):
        with pytest.raises(ValueError, match="the normal has the length"):
            ab.Plane(normal)
    for offset in (1e9, np.inf, np.nan):
        with pytest.raises(ValueError, match="-1e8 to 1e8"):
            ab.Halfspace([1, 0, 0], offset)
    with pytest.raises(ValueError, match="has the shape"):
        ab.Plane([1, 0])
    with pytest.raises(TypeError):
        ab.Plane("z")


def test_sphere_contact_has_normal_from_the_first_to_the_second():
    mesh = ab.DeformableMesh(*meshes.sheet(1))
    above = ab.collide(mesh, ab.Sphere(1), tf2=(np.eye(3), [0, 0, 0.9]))
    np.testing.assert_allclose(above.normals, [[0, 0, 1]] * len(above), atol=1e-9)
    np.testing.assert_allclose(above.depths, 0.1, atol=1e-9)


def test_sizes_can_be_read_and_must_be_lengths():
    assert (ab.Box(1, 2, 3).x, ab.Box(1, 2, 3).y, ab.Box(1, 2, 3).z) == (1, 2, 3)
    assert ab.Sphere(2).radius == 2
    assert (ab.Capsule(1, 2).radius, ab.Capsule(1, 2).lz) == (1, 2)
    assert (ab.Ellipsoid(1, 2, 3).a, ab.Ellipsoid(1, 2, 3).c) == (1, 3)
    assert repr(ab.Cone(0.5, 2)) == "Cone(0.5, 2.0)"
    for size in (0, -1, np.nan, np.inf, 1e30):
        with pytest.raises(ValueError, match="1e-8 to 1e8"):
            ab.Sphere(size)
    with pytest.raises(TypeError):
        ab.Box("1", 2, 3)


def test_shapes_can_be_copied_and_pickled():
    for shape in (
        ab.Box(1, 2, 3),
        ab.Sphere(0.1),
        ab.Ellipsoid(1, 2, 3),
        ab.Capsule(1, 2),
        ab.Cylinder(1, 2),
        ab.Cone(1, 2),
        ab.Plane([0, 0.6, 0.8], -2),
        ab.Halfspace([1, 0, 0], 3),
    ):
        for other in (copy.copy(shape), copy.deepcopy(shape), pickle.loads(pickle.dumps(shape))):
            assert type(other) is type(shape) and repr(other) == repr(shape)


@pytest.mark.parametrize(
    "shape, volume",
    [
        (ab.Box(1, 2, 3), 6),
        (ab.Sphere(2), 4 / 3 * np.pi * 8),
        (ab.Capsule(1, 3), 4 / 3 * np.pi + 3 * np.pi),
        (ab.Cylinder(2, 5), 20 * np.pi),
        (ab.Cone(2, 3), 4 * np.pi),
        (ab.Ellipsoid(1, 2, 3), 8 * np.pi),
    ],
)
def test_surfaces_of_shapes_are_closed_meshes(shape, volume):
    mesh = ab.shape_mesh(shape)
    corners = mesh.vertices[mesh.faces]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(volume, rel=0.01)
    assert ab.is_watertight(ab.DeformableMesh(mesh))
    assert len(ab.shape_mesh(shape, turn=8).faces) <= len(mesh.faces)
    with pytest.raises(ValueError, match="0 edges around a turn"):
        ab.shape_mesh(shape, turn=0)


def test_the_surface_of_a_plane_is_a_square():
    mesh = ab.shape_mesh(ab.Plane([0, 0.6, 0.8], 2))
    np.testing.assert_allclose(mesh.vertices @ [0, 0.6, 0.8], 2)
    assert len(mesh.vertices) == 4


def hull(mesh):
    return ab.Convex(*mesh)


CUBE = box_mesh(0.5, 0.7, 0.9)


def test_a_convex_answers_as_the_box_that_it_is():
    rng = np.random.default_rng(11)
    mesh = ab.DeformableMesh(*meshes.ball(2, 0.5))
    for _ in range(30):
        tf = meshes.pose(rng, 0.9)
        for other in (mesh, ab.Sphere(0.4), ab.Cone(0.3, 0.8), ab.Box(0.4, 0.4, 0.4)):
            found = ab.distance(other, hull(CUBE), tf2=tf)
            expected = ab.distance(other, ab.Box(0.5, 0.7, 0.9), tf2=tf)
            assert found.distance == pytest.approx(expected.distance, abs=1e-10)
            touching = ab.collide(other, hull(CUBE), tf2=tf)
            box = ab.collide(other, ab.Box(0.5, 0.7, 0.9), tf2=tf)
            np.testing.assert_array_equal(touching.pairs, box.pairs)
            np.testing.assert_allclose(touching.depths, box.depths, atol=1e-9)
        np.testing.assert_allclose(
            ab.signed_distance(mesh, hull(CUBE), 1e-6, tf2=tf).upper,
            ab.signed_distance(mesh, ab.Box(0.5, 0.7, 0.9), 1e-6, tf2=tf).upper,
            atol=2e-6,
        )


def test_a_convex_has_its_arrays():
    vertices, faces = CUBE
    convex = hull(CUBE)
    np.testing.assert_array_equal(convex.vertices, vertices)
    np.testing.assert_array_equal(convex.faces, faces)
    assert not convex.vertices.flags.writeable
    assert repr(convex) == "<adaptive_bvh.Convex: 8 vertices, 12 faces>"
    for other in (copy.deepcopy(convex), pickle.loads(pickle.dumps(convex))):
        np.testing.assert_array_equal(other.vertices, vertices)
    drawn = ab.shape_mesh(convex)
    assert ab.is_watertight(ab.DeformableMesh(drawn))
    assert np.ptp(drawn.vertices, axis=0) == pytest.approx([0.5, 0.7, 0.9])


def refusals():
    vertices, faces = CUBE
    ring = meshes.ball(1)
    two = (np.concatenate([vertices, vertices + 9.0]), np.concatenate([faces, faces + 8]))
    dented = ring[0].copy()
    dented[0] *= 0.5
    yield "has one face", vertices, faces[1:]
    yield "in the same direction", vertices, np.concatenate([faces, faces[:1]])
    yield "inward", vertices, faces[:, ::-1]
    yield "inward", dented, ring[1]
    yield "several bodies", *two
    yield "a vertex has no face", np.concatenate([vertices, [[0.0, 0.0, 0.0]]]), faces
    yield "not finite", vertices * np.nan, faces
    yield "no faces", vertices, np.zeros((0, 3), int)


@pytest.mark.parametrize("text, vertices, faces", refusals())
def test_what_is_not_convex_is_refused(text, vertices, faces):
    with pytest.raises(ValueError, match="Convex: .*" + text):
        ab.Convex(vertices, faces)


def test_two_shapes_have_a_distance_and_a_contact():
    apart = ab.distance(ab.Sphere(1.0), ab.Box(1.0, 1.0, 1.0), tf2=meshes.place(3.0, 0.0, 0.0))
    assert apart.distance == pytest.approx(1.5) and list(apart.triangles) == [-1, -1]
    np.testing.assert_allclose(apart.points, [[1.0, 0, 0], [2.5, 0, 0]], atol=1e-12)
    swapped = ab.distance(ab.Box(1.0, 1.0, 1.0), ab.Sphere(1.0), tf1=meshes.place(3.0, 0.0, 0.0))
    np.testing.assert_allclose(swapped.points, apart.points[::-1], atol=1e-12)
    pair = ab.Sphere(1.0), ab.Sphere(1.0)
    assert np.isnan(ab.distance(*pair, nearest_points=False).points).all()
    contacts = ab.collide(*pair, tf2=meshes.place(1.5, 0.0, 0.0))
    np.testing.assert_allclose(contacts.normals, [[1.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(contacts.depths, [0.5])
    assert len(ab.collide(*pair, tf2=meshes.place(2.5, 0.0, 0.0))) == 0
    assert len(ab.collide(*pair, max_contacts=0)) == 0
