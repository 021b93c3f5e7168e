import meshes
import numpy as np
import pytest
from brute_force import (
    no_shared_vertices,
    pair_set,
    surface_distances,
    triangle_distances,
    winding_numbers,
)

import adaptive_bvh as ab


def crossing(distances):
    """Pairs of triangles that intersect; none of them may merely touch."""
    return pair_set(np.argwhere(distances == 0))


def test_equals_brute_force_in_every_step():
    rng = np.random.default_rng(4)
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(5)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    found = 0
    for step in range(10):
        moved1, moved2 = meshes.wave(v1, 0.3 * step), meshes.wave(v2, -0.2 * step)
        a.update(moved1)
        b.update(moved2)
        tf1, tf2 = meshes.pose(rng), meshes.pose(rng, 0.3)
        contacts = ab.collide(a, b, tf1=tf1, tf2=tf2)
        expected = crossing(
            triangle_distances(meshes.placed(moved1, tf1), f1, meshes.placed(moved2, tf2), f2)
        )
        assert pair_set(contacts.pairs) == expected
        found += len(expected)
        assert len(contacts) == len(contacts.pairs) == len(contacts.depths) >= len(expected)
        np.testing.assert_allclose(np.linalg.norm(contacts.normals, axis=1), 1, atol=1e-5)
    assert found > 100


def test_contacts_are_arrays_side_by_side():
    a, b = ab.DeformableMesh(*meshes.ball(1)), ab.DeformableMesh(*meshes.sheet(3))
    contacts = ab.collide(a, b, tf2=(np.eye(3), [0.01, 0.02, 0.03]))
    k = len(contacts)
    assert k > 0
    assert contacts.pairs.shape == (k, 2) and contacts.pairs.dtype == np.int32
    assert contacts.points.shape == contacts.normals.shape == (k, 3)
    assert contacts.depths.shape == (k,)
    for name in ("points", "normals", "depths"):
        assert getattr(contacts, name).dtype == np.float64
        assert np.isfinite(getattr(contacts, name)).all()


def test_max_contacts_and_enable_contact():
    a, b = ab.DeformableMesh(*meshes.ball(1)), ab.DeformableMesh(*meshes.sheet(3))
    tf = (np.eye(3), [0.01, 0.02, 0.03])
    everything = ab.collide(a, b, tf2=tf)
    assert len(ab.collide(a, b, tf2=tf, max_contacts=3)) == 3
    assert len(ab.collide(a, b, tf2=tf, max_contacts=0)) == 0
    pairs = ab.collide(a, b, tf2=tf, enable_contact=False)
    assert pair_set(pairs.pairs) == pair_set(everything.pairs)
    assert np.isnan(pairs.points).all() and np.isnan(pairs.depths).all()
    for query in (lambda n: ab.collide(a, b, max_contacts=n), lambda n: ab.self_collide(a, max_contacts=n)):
        with pytest.raises(ValueError, match="0 or more"):
            query(-1)
        with pytest.raises(TypeError):
            query(1.5)
    assert len(ab.collide(a, b, tf2=(np.eye(3), [0, 0, 5]))) == 0


def test_self_collide_equals_brute_force():
    vertices, faces = meshes.sheet(8)
    mesh = ab.DeformableMesh(vertices, faces)
    rolled = vertices.copy()  # a spiral that goes through itself
    angle, radius = 3.9 * vertices[:, 0], 0.5 + 0.02 * np.sin(9 * vertices[:, 0])
    rolled[:, 0], rolled[:, 2] = radius * np.cos(angle), radius * np.sin(angle)
    rolled[:, 1] += 0.013 * vertices[:, 0]
    mesh.update(rolled)
    distances = triangle_distances(rolled, faces, rolled, faces)
    apart = no_shared_vertices(faces) & np.triu(np.ones(distances.shape, bool), 1)
    expected = crossing(np.where(apart, distances, 1))
    assert len(expected) > 10
    assert pair_set(ab.self_collide(mesh).pairs) == expected
    assert pair_set(ab.self_collide(mesh, enable_contact=False).pairs) == expected
    everything = ab.self_collide(mesh, ignored=ab.Ignored(neighbours="none"), enable_contact=False)
    by_edge = ab.self_collide(mesh, ignored=ab.Ignored(neighbours="shared edge"))
    assert len(everything) > len(by_edge) > len(expected)
    with pytest.raises(ValueError, match="neighbours"):
        ab.Ignored(neighbours="all")


def test_self_collide_is_in_the_world():
    (va, fa), (vb, fb) = meshes.sheet(1), meshes.sheet(1)
    vertices = np.concatenate([va, vb[:, [2, 0, 1]] + 0.1])
    mesh = ab.DeformableMesh(vertices, np.concatenate([fa, fb + len(va)]))
    tf = meshes.pose(np.random.default_rng(5), 2)
    here, there = ab.self_collide(mesh), ab.self_collide(mesh, tf)
    assert len(here) == len(there) > 0
    np.testing.assert_allclose(meshes.placed(here.points, tf), there.points, atol=1e-12)
    np.testing.assert_allclose(here.normals @ tf[:3, :3].T, there.normals, atol=1e-12)


def test_solid_meshes_contain_what_is_inside():
    """A small ball and a shape in a large ball: inside by the winding number, depth by distance."""
    (v1, f1), (v2, f2) = meshes.ball(2, 2.0), meshes.ball(1, 0.3)
    outer, inner = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    seen = set()
    for x in np.linspace(0, 3, 13):
        tf = meshes.place(x, 0.1, 0.2)
        world = meshes.placed(v2, tf)
        touches = (triangle_distances(v1, f1, world, f2) == 0).any()
        is_inside = np.abs(winding_numbers(world[:1], v1, f1)[0]) > 0.5
        plain, solid = (ab.collide(outer, inner, tf2=tf, solid=s) for s in (False, True))
        assert (len(plain) > 0) == touches and (len(solid) > 0) == (touches or is_inside)
        assert ab.is_nearer(outer, inner, 0, tf2=tf) == touches
        assert ab.is_nearer(outer, inner, 0, tf2=tf, solid=True) == (touches or is_inside)
        seen.add((touches, is_inside))
        if touches or not is_inside:
            continue
        assert len(solid) == 1
        gaps = surface_distances(solid.points, v1, f1).min(axis=1)
        np.testing.assert_allclose(solid.depths, gaps, atol=1e-4)
        assert np.linalg.norm(world - solid.points, axis=1).min() < 1e-4
        sphere = ab.Sphere(0.2)
        assert len(ab.collide(outer, sphere, tf2=tf)) == 0
        assert len(ab.collide(outer, sphere, tf2=tf, solid=True)) == 1
        assert ab.is_nearer(outer, sphere, 0, tf2=tf, solid=True)
    assert seen >= {(False, True), (False, False)} and any(touches for touches, _ in seen)
    with pytest.raises(ValueError, match="edge"):
        ab.collide(outer, ab.DeformableMesh(*meshes.sheet(2)), solid=True)


def combs(count):
    """Two combs of `count` upright triangles each, across each other: each one meets all others."""
    at = np.linspace(0.0, 1.0, count)
    corners = np.array([[-0.5, 0.0, -0.3], [1.5, 0.0, -0.3], [0.5, 0.0, 0.7]])
    along_x = corners[None] + np.stack([0 * at, at, 0 * at], axis=1)[:, None]
    along_y = along_x[:, :, [1, 0, 2]]
    faces = np.arange(3 * count).reshape(-1, 3)
    return [ab.DeformableMesh(x.reshape(-1, 3), faces) for x in (along_x, along_y)]


def test_a_million_contacts_are_all_returned():
    first, second = combs(1000)
    contacts = ab.collide(first, second, enable_contact=False)
    assert not contacts.reached_limit
    pairs = np.unique(contacts.pairs, axis=0)
    rows = np.stack(np.meshgrid(np.arange(1000), np.arange(1000), indexing="ij"), -1).reshape(-1, 2)
    np.testing.assert_array_equal(pairs, rows)
    scene = ab.Scene()
    scene.add(first)
    scene.add(second)
    scene.update()
    found = scene.collide(enable_contact=False).contacts
    assert len(found) == len(contacts) and not found.reached_limit


def test_a_limit_says_that_it_was_reached():
    first, second = combs(10)
    both = ab.DeformableMesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.faces, second.faces + first.num_vertices]),
    )
    scene = ab.Scene()
    scene.add(first)
    scene.add(second)
    scene.update()
    for query in (
        lambda limit: ab.collide(first, second, max_contacts=limit),
        lambda limit: ab.self_collide(both, max_contacts=limit),
        lambda limit: scene.collide(contacts_per_pair=limit).contacts,
    ):
        count = len(query(None))
        for limit in (None, 0, 1, count - 1, count, count + 1):
            contacts = query(limit)
            assert contacts.reached_limit == (limit is not None and limit <= count)
            assert len(contacts) == min(count, count if limit is None else limit)
    assert scene.collide(first_only=True).contacts.reached_limit
    apart = ab.collide(first, second, tf2=meshes.place(0.0, 0.0, 9.0), max_contacts=1)
    assert not apart.reached_limit
    ball = ab.Sphere(0.2)
    assert ab.collide(first, ball, max_contacts=1).reached_limit
    assert ab.collide(ball, ball, max_contacts=1).reached_limit
    assert not ab.collide(ball, ball).reached_limit
