"""ContactSet: pairs that are kept from step to step, against new queries."""

import gc
import threading

import numpy as np
import pytest
from meshes import ball, place, sheet

import adaptive_bvh as ab

KINDS = ("vertex_face", "face_vertex", "edge_edge")


def as_set(pairs):
    return {tuple(p) for p in pairs.tolist()}


def held(numbered):
    assert len(numbered) == len(numbered.numbers)
    return as_set(numbered.pairs[numbered.numbers])


@pytest.mark.parametrize("is_self", [True, False])
def test_triangles_are_those_of_a_new_query(is_self):
    rng = np.random.default_rng(3)
    first, second = ab.DeformableMesh(*sheet(9)), ab.DeformableMesh(*ball(1))
    near = ab.ContactSet(first, 0.2) if is_self else ab.ContactSet(first, second, 0.2)
    assert len(near) == 0
    known = {}
    for step in range(30):
        first.update(first.vertices + 0.01 * rng.normal(size=first.vertices.shape))
        tf = place(0.01 * step, 0, 0.9)
        if is_self:
            count = near.update()
            found = ab.self_pairs_within(first, 0.2)
        else:
            count = near.update(None, tf)
            found = ab.pairs_within(first, second, 0.2, tf2=tf)
        numbered = near.triangles
        assert count == len(near) == len(found) == len(numbered)
        assert held(numbered) == as_set(found.triangles)
        for number, pair in zip(numbered.removed.tolist(), numbered.removed_pairs.tolist()):
            assert known.pop(number) == tuple(pair)
        for number in numbered.added.tolist():
            assert number not in known
            known[number] = tuple(numbered.pairs[number])
        assert set(known.values()) == held(numbered)
        free = np.setdiff1d(np.arange(len(numbered.pairs)), numbered.numbers)
        assert (numbered.pairs[free] == -1).all()
        if step % 10 == 9:
            moved = near.compact().triangles
            known = {moved[number]: pair for number, pair in known.items()}
            assert sorted(known) == list(range(len(near)))


def test_features_are_those_of_a_new_query():
    mesh = ab.DeformableMesh(*sheet(8))
    near = ab.ContactSet(mesh, 0.2, elements="features")
    rest = mesh.vertices
    for step in range(12):
        mesh.update(rest + 0.003 * np.sin(step + 9 * rest[:, [1, 0, 0]]))
        near.update()
        found = ab.self_feature_pairs_within(mesh, 0.2)
        for kind in KINDS:
            numbered = getattr(near, kind)
            assert held(numbered) == as_set(getattr(found, kind))
            details = near.details(numbered.numbers, kind)
            pairs = ab.FeaturePairs(**{kind: numbered.pairs[numbered.numbers]})
            expected = getattr(ab.self_feature_pair_details(mesh, pairs), kind)
            np.testing.assert_array_equal(expected.distances, details.distances)
            np.testing.assert_array_equal(expected.normals, details.normals)
            np.testing.assert_array_equal(
                details.distances, near.details(kind=kind).distances)
    assert near.searches < 8
    assert 0 < near.tested < near.candidates


def test_of_a_scene():
    scene = ab.Scene()
    meshes = [ab.DeformableMesh(*ball(1)) for _ in range(4)]
    ids = [scene.add(m, place(1.9 * i, 0, 0)) for i, m in enumerate(meshes)]
    near = ab.ContactSet(scene, 0.2)
    for step in range(10):
        meshes[1].update(meshes[1].vertices * 1.01)
        scene.set_transform(ids[2], place(3.8, 0.02 * step, 0))
        scene.update()
        near.update()
        found = scene.pairs_within(0.2)
        numbered = near.triangles
        bodies = numbered.bodies[numbered.numbers]
        pairs = numbered.pairs[numbered.numbers]
        expected = set()
        for i, (a, b) in enumerate(found.bodies.tolist()):
            for pair in found.found.triangles[found.begins[i]:found.begins[i + 1]].tolist():
                expected.add((a, b, *pair))
        assert {(*b, *p) for b, p in zip(bodies.tolist(), pairs.tolist())} == expected
    scene.set_transform(ids[0], place(9, 9, 9))
    with pytest.raises(Exception):
        near.update()
    scene.update()
    near.update()
    del scene
    gc.collect()
    near.update()
    assert len(near) > 0


def test_details_of_some_pairs_and_of_all():
    a, b = ab.DeformableMesh(*ball(2)), ab.DeformableMesh(*ball(2))
    near = ab.ContactSet(a, b, 0.3)
    near.update(place(0, 0, 0), place(0, 0, 2.05))
    numbered = near.triangles
    every = near.details()
    found = ab.pairs_within(a, b, 0.3, tf1=place(0, 0, 0), tf2=place(0, 0, 2.05), enable_distances=True)
    distances = {tuple(p): d for p, d in zip(found.triangles.tolist(), found.distances)}
    assert len(every.distances) == len(near) == len(distances) > 20
    for pair, distance in zip(numbered.pairs[numbered.numbers].tolist(), every.distances):
        assert distances[tuple(pair)] == distance
    np.testing.assert_allclose(np.linalg.norm(every.normals, axis=1), 1)
    between = every.nearest_points[:, 1] - every.nearest_points[:, 0]
    np.testing.assert_allclose(between, every.normals * every.distances[:, None], atol=1e-12)
    chosen = numbered.numbers[::-3]
    some = near.details(chosen)
    np.testing.assert_array_equal(some.distances, every.distances[::-3])
    np.testing.assert_array_equal(some.nearest_points, every.nearest_points[::-3])
    assert len(near.details(np.array([], dtype=np.int32)).distances) == 0


def test_arrays_move_with_compacted_numbers():
    mesh = ab.DeformableMesh(*sheet(9))
    rest = mesh.vertices
    near = ab.ContactSet(mesh, 0.2)
    near.update()
    value_of = {tuple(p): float(i) for i, p in enumerate(near.triangles.pairs.tolist())}
    values = np.arange(len(near.triangles.pairs), dtype=float)
    mesh.update(rest * [1, 2.4, 1])  # fewer pairs are near
    near.update()
    numbered = near.triangles
    assert len(numbered.removed) > 0
    values = np.resize(values, len(numbered.pairs))
    values[numbered.added] = -1
    to = near.compact().triangles
    assert to.shape == values.shape and (to >= 0).sum() == len(near)
    moved = np.empty(len(near))
    moved[to[to >= 0]] = values[to >= 0]
    for pair, value in zip(near.triangles.pairs.tolist(), moved):
        assert value_of.get(tuple(pair), -1) == value


def test_contacts_are_those_of_collide():
    a, b = ab.DeformableMesh(*ball(1)), ab.DeformableMesh(*ball(1))
    near = ab.ContactSet(a, b, 0)
    for step in range(5):
        tf = place(0, 0.1, 1.9 - 0.05 * step)
        near.update(None, tf)
        contacts, expected = near.contacts(), ab.collide(a, b, tf2=tf)
        assert as_set(contacts.pairs) == as_set(expected.pairs)
        assert len(contacts) == len(expected)


def test_ignored_and_labels():
    mesh = ab.DeformableMesh(*sheet(6))
    labels = np.arange(mesh.num_faces) % 2
    by_labels = ab.SurfaceNeighbourhood.by_labels
    for ignored in (by_labels(mesh, labels), by_labels(mesh, labels, "within"), [[9, 2], [3, 30]],
                    ab.Ignored(neighbours="none"),
                    ab.Ignored([[9, 2]], surface=by_labels(mesh, labels))):
        expected = as_set(ab.self_pairs_within(mesh, 0.25, ignored=ignored).triangles)
        near = ab.ContactSet(mesh, 0.25, ignored=ignored)
        del ignored
        gc.collect()
        near.update()
        assert held(near.triangles) == expected
    some = ab.self_feature_pairs_within(mesh, 0.25)
    ignored = ab.FeaturePairs(edge_edge=some.edge_edge[::2])
    near = ab.ContactSet(mesh, 0.25, elements="features", ignored=ignored)
    near.update()
    assert held(near.edge_edge) == as_set(some.edge_edge) - as_set(some.edge_edge[::2])


def test_what_is_refused():
    mesh = ab.DeformableMesh(*sheet(3))
    for distance in (-1, np.nan):
        with pytest.raises(ValueError):
            ab.ContactSet(mesh, distance)
    for options in ({"elements": "edges"}, {"ignored": ab.Ignored(neighbours="beyond shared")}):
        with pytest.raises(ValueError):
            ab.ContactSet(mesh, 0.1, **options)
    near = ab.ContactSet(mesh, 0.5)
    near.update()
    with pytest.raises(ValueError):
        near.update(place(0, 0, 0), place(0, 0, 0))
    for numbers in ([-1], [len(near.triangles.pairs)]):
        with pytest.raises(IndexError):
            near.details(numbers)
    with pytest.raises(ValueError, match="has no pairs of features"):
        near.details([0], "edge_edge")
    with pytest.raises(ValueError):
        near.details([0], "edges")
    with pytest.raises(TypeError):
        ab.ContactSet.__new__(ab.ContactSet).update()


def test_updates_and_sets_on_threads():
    mesh = ab.DeformableMesh(*sheet(9))
    rest = mesh.vertices
    near = [ab.ContactSet(mesh, 0.2) for _ in range(2)]
    done = threading.Event()

    def follow(one):
        while not done.is_set():
            one.update()
            len(one.triangles)

    threads = [threading.Thread(target=follow, args=(one,)) for one in near]
    for thread in threads:
        thread.start()
    for step in range(50):
        mesh.update(rest + 0.001 * step)
    done.set()
    for thread in threads:
        thread.join()
    for one in near:
        one.update()
        assert held(one.triangles) == as_set(ab.self_pairs_within(mesh, 0.2).triangles)
