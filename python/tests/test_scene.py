"""Scenes against all pairs of bodies, in NumPy."""

import copy
import gc
import itertools
import pickle
import threading
import weakref

import numpy as np
import pytest
from brute_force import (
    edge_distances,
    no_shared_vertices,
    owned_edges,
    pair_set,
    ray_hits,
    surface_distances,
    triangle_distances,
    winding_numbers,
)
from meshes import ball, place, placed, pose, sheet, wave

import adaptive_bvh as ab


class Crowd:
    """A scene of deformed balls, an open sheet and a sphere, and the same in NumPy."""

    def __init__(self, count=6, seed=3, size=2.2):
        rng = np.random.default_rng(seed)
        self.scene = ab.Scene()
        self.meshes, self.poses, self.ids, self.world, self.faces = [], [], [], [], []
        for i in range(count):
            vertices, faces = sheet(4) if i == count - 1 else ball(1, 0.8)
            mesh = ab.DeformableMesh(vertices, faces)
            mesh.update(wave(vertices, i))
            tf = pose(rng)
            tf[:3, 3] = rng.uniform(-size / 2, size / 2, 3)
            self.meshes.append(mesh)
            self.poses.append(tf)
            self.faces.append(faces)
            self.world.append(placed(mesh.vertices, tf))
            self.ids.append(self.scene.add(mesh, tf))
        self.centre = np.array([0.2, -0.1, 0.3])
        self.sphere = self.scene.add(ab.Sphere(0.5), place(*self.centre))
        self.scene.update()
        # [i, j][t, u]: distances of triangles
        self.gaps = {
            (i, j): triangle_distances(self.world[i], faces1, self.world[j], faces2)
            for (i, faces1), (j, faces2) in itertools.combinations(enumerate(self.faces), 2)
        }

    def distances(self):
        """(B, B): of all bodies, the sphere last; infinite of a body with itself."""
        count = len(self.meshes)
        result = np.full((count + 1, count + 1), np.inf)
        for (i, j), gaps in self.gaps.items():
            result[i, j] = result[j, i] = gaps.min()
        for i, (world, faces) in enumerate(zip(self.world, self.faces)):
            gap = surface_distances(self.centre[None], world, faces).min() - 0.5
            result[i, count] = result[count, i] = max(gap, 0)
        return result


@pytest.fixture
def crowd():
    return Crowd()


def rows_of(found, begins, i):
    return found[begins[i] : begins[i + 1]]


def test_collide(crowd):
    distances = crowd.distances()
    touching = [list(p) for p in np.argwhere(distances <= 0) if p[0] < p[1]]
    found = crowd.scene.collide()
    assert found.bodies.tolist() == touching and 3 < len(touching) < 20
    assert len(found) == len(touching) and len(found.begins) == len(touching) + 1
    for i, (a, b) in enumerate(touching):
        pairs = rows_of(found.contacts.pairs, found.begins, i)
        if b == crowd.sphere:
            near = surface_distances(crowd.centre[None], crowd.world[a], crowd.faces[a])[0] <= 0.5
            assert set(pairs[:, 0]) == set(np.flatnonzero(near)) and (pairs[:, 1] == -1).all()
            normals = rows_of(found.contacts.normals, found.begins, i)
            np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
        else:
            assert pair_set(pairs) == pair_set(np.argwhere(crowd.gaps[a, b] == 0))
    assert len(crowd.scene.collide(contacts_per_pair=0).contacts) == 0
    few = crowd.scene.collide(contacts_per_pair=2)
    assert few.bodies.tolist() == touching and (np.diff(few.begins) <= 2).all()
    assert np.isnan(crowd.scene.collide(enable_contact=False).contacts.points).all()
    assert crowd.scene.collide(first_only=True).bodies.tolist() == touching[:1]


def test_pairs_within(crowd, tolerance):
    found = crowd.scene.pairs_within(0.1, enable_distances=True, enable_nearest_points=True)
    named = {}
    for i, (a, b) in enumerate(found.bodies):
        for t, u in rows_of(found.found.triangles, found.begins, i):
            named[a, b, t, u] = True
    expected = {
        (a, b, t, u): gaps[t, u]
        for (a, b), gaps in crowd.gaps.items()
        for t, u in np.argwhere(gaps <= 0.1 + tolerance)
    }
    assert {k for k, gap in expected.items() if gap < 0.1 - tolerance} <= set(named)
    assert set(named) <= set(expected) and len(named) == len(found.found) > 100
    np.testing.assert_allclose(
        found.found.distances, [expected[k] for k in named], atol=tolerance
    )
    gaps = np.linalg.norm(np.diff(found.found.nearest_points, axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(gaps, found.found.distances, atol=4 * tolerance)
    assert len(crowd.scene.pairs_within(0.1).found.distances) == 0


def test_feature_pairs_within(crowd, tolerance):
    found = crowd.scene.feature_pairs_within(0.1)
    assert found.begins.shape == (len(found) + 1, 3)
    bodies = [tuple(p) for p in found.bodies]
    assert len(bodies) > 3

    def expect(distances, pairs, numbers1, numbers2):
        named = pair_set(pairs)
        inside = np.argwhere(distances <= 0.1 - tolerance)
        near = np.argwhere(distances <= 0.1 + tolerance)
        assert {(numbers1[i], numbers2[j]) for i, j in inside} <= named
        assert named <= {(numbers1[i], numbers2[j]) for i, j in near}
        assert len(named) == len(pairs)

    for a, b in itertools.combinations(range(len(crowd.meshes)), 2):
        kinds = [np.zeros((0, 2), int)] * 3
        if (a, b) in bodies:
            at = bodies.index((a, b))
            lists = found.found.vertex_face, found.found.face_vertex, found.found.edge_edge
            kinds = [rows_of(x, found.begins[:, k], at) for k, x in enumerate(lists)]
        (v, f), (w, g) = ((crowd.world[i], crowd.faces[i]) for i in (a, b))
        every = np.arange(10**4)
        expect(surface_distances(v, w, g), kinds[0], every, every)
        expect(surface_distances(w, v, f).T, kinds[1], every, every)
        (numbers1, edges1), (numbers2, edges2) = owned_edges(f), owned_edges(g)
        expect(edge_distances(v, edges1, w, edges2), kinds[2], numbers1, numbers2)


def test_vertex_contacts(crowd, tolerance):
    distance = 0.05
    found = crowd.scene.vertex_contacts(distance)
    bodies = [tuple(p) for p in found.bodies]
    total = 0
    last = len(crowd.meshes) - 1  # the sheet, which is open
    for a, b in itertools.permutations(range(len(crowd.meshes)), 2):
        assert (a, last) not in bodies
        if b == last:
            continue
        world, faces = crowd.world[b], crowd.faces[b]
        distances = surface_distances(crowd.world[a], world, faces).min(axis=1)
        is_inside = np.abs(winding_numbers(crowd.world[a], world, faces)) > 0.5
        expect_contacts(crowd, found, bodies, (a, b), np.where(is_inside, -1, 1) * distances,
                        distance, tolerance)
        total += (a, b) in bodies
    for a in range(len(crowd.meshes)):
        distances = np.linalg.norm(crowd.world[a] - crowd.centre, axis=1) - 0.5
        expect_contacts(crowd, found, bodies, (a, crowd.sphere), distances, distance, tolerance)
        total += (a, crowd.sphere) in bodies
    assert total == len(bodies) > 5
    assert len(crowd.scene.vertex_contacts().found) < len(found.found)


def expect_contacts(crowd, found, bodies, pair, distances, distance, tolerance):
    names = np.flatnonzero(distances <= distance)
    if not len(names):
        assert pair not in bodies
        return
    at = bodies.index(pair)
    np.testing.assert_array_equal(rows_of(found.found.vertices, found.begins, at), names)
    np.testing.assert_allclose(
        rows_of(found.found.distances, found.begins, at), distances[names], atol=tolerance
    )
    np.testing.assert_allclose(
        rows_of(found.found.positions, found.begins, at),
        crowd.world[pair[0]][names],
        atol=tolerance,
    )


def test_nearest(crowd, tolerance):
    distances = crowd.distances()
    scene = crowd.scene
    count = len(distances)
    for body in range(count):
        nearest = scene.nearest(body)
        assert nearest.bodies[0] == body
        assert max(nearest.distance, 0) == pytest.approx(distances[body].min(), abs=tolerance)
        some = scene.nearest(body, 4)
        assert len(some) == 4 and all(one.bodies[0] == body for one in some)
        assert len({one.bodies[1] for one in some}) == 4
        expected = np.sort(distances[body])[:4]
        found = [max(one.distance, 0) for one in some]
        np.testing.assert_allclose(found, expected, atol=tolerance)
        named = [distances[one.bodies] for one in some]
        np.testing.assert_allclose(named, expected, atol=tolerance)
        for one in some:
            if one.distance > 0.01:
                gap = np.linalg.norm(one.points[0] - one.points[1])
                assert gap == pytest.approx(one.distance, abs=4 * tolerance)
        assert len(scene.nearest(body, 99)) == count - 1 and scene.nearest(body, 0) == []
    assert max(scene.distance().distance, 0) == pytest.approx(distances.min(), abs=tolerance)
    for limit in (0.0, 0.05, 1.0):
        assert scene.is_nearer(limit) == (distances.min() <= limit)


def sphere_hits(origin, direction, radius):
    """(2,): where a ray crosses a sphere around 0; infinite where it does not."""
    a, b, c = direction @ direction, origin @ direction, origin @ origin - radius**2
    if b * b < a * c:
        return np.full(2, np.inf)
    t = (-b + np.array([-1, 1]) * np.sqrt(b * b - a * c)) / a
    return np.where(t >= 0, t, np.inf)


def test_points_and_rays(crowd, tolerance):
    rng = np.random.default_rng(4)
    for point in rng.uniform(-2, 2, (20, 3)):
        gaps = [
            surface_distances(point[None], w, f)[0] for w, f in zip(crowd.world, crowd.faces)
        ]
        gaps.append(np.array([abs(np.linalg.norm(point - crowd.centre) - 0.5)]))
        nearest = crowd.scene.nearest_point(point)
        assert nearest.distance == pytest.approx(min(g.min() for g in gaps), abs=tolerance)
        assert gaps[nearest.body][nearest.element] == pytest.approx(
            nearest.distance, abs=tolerance
        )
        assert np.linalg.norm(nearest.point - point) == pytest.approx(
            nearest.distance, abs=4 * tolerance
        )
    origins, directions = rng.normal(size=(2, 60, 3)) * 2
    t = [
        [ray_hits(o, d, w, f) for w, f in zip(crowd.world, crowd.faces)]
        + [sphere_hits(o - crowd.centre, d, 0.5)]
        for o, d in zip(origins, directions)
    ]
    for begin, end in ((0.0, np.inf), (0.2, 0.9)):
        hits = crowd.scene.first_hit(origins, directions, begin=begin, end=end)
        assert len(hits) == 60 and 0 < (hits.bodies < 0).sum() < 60
        for i, of_bodies in enumerate(t):
            inside = [np.where((x >= begin) & (x <= end), x, np.inf) for x in of_bodies]
            assert hits.t[i] == pytest.approx(min(x.min() for x in inside), rel=1e3 * tolerance)
            if hits.bodies[i] == crowd.sphere:
                assert hits.elements[i] == -1 and inside[-1].min() < np.inf
            elif hits.bodies[i] >= 0:
                named = inside[hits.bodies[i]][hits.elements[i]]
                assert named == pytest.approx(hits.t[i], rel=1e3 * tolerance)
            else:
                assert np.isinf(hits.t[i]) and hits.elements[i] == -1
    alone = crowd.scene.first_hit(origins[5], directions[5])
    assert len(alone) == 1 and alone.t[0] == crowd.scene.first_hit(origins, directions).t[5]


@pytest.mark.parametrize("distance", [0.0, 0.05])
def test_the_first_impact_of_a_step(distance):
    vertices, faces = ball(1, 0.5)
    scene = ab.Scene()
    starts = [place(0, 0, 0), place(2, 0.1, 0.2), place(-3, 0.1, 0.1), place(0, 4, 0)]
    ends = [place(0.3, 0, 0), place(0.4, 0, 0), place(-0.2, 0, 0.1), place(0, 3, 0)]
    meshes = [ab.DeformableMesh(vertices, faces) for _ in starts]
    ids = [scene.add(m, tf) for m, tf in zip(meshes, starts)]
    scene.begin_step()
    grown = [vertices * (1 + 0.1 * i) for i in range(len(ids))]
    for body, mesh, tf, end in zip(ids, meshes, ends, grown):
        scene.set_transform(body, tf)
        mesh.update_two_frames(end)
    scene.update()
    first = [placed(vertices, tf) for tf in starts]
    last = [placed(end, tf) for end, tf in zip(grown, ends)]

    def distances(time):
        world = [(1 - time) * a + time * b for a, b in zip(first, last)]
        return {
            pair: triangle_distances(world[pair[0]], faces, world[pair[1]], faces).min()
            for pair in itertools.combinations(range(len(ids)), 2)
        }

    found = scene.earliest_impact(distance)
    time = found.impact.time
    assert found.exists and 0 < time < 1
    assert scene.largest_safe_step(distance) == time
    assert min(distances(time - 1e-4).values()) > distance
    after = distances(time + 1e-4)
    assert after[found.bodies] == min(after.values()) <= distance + 1e-5
    assert found.impact.kind in ("vertex-face", "face-vertex", "edge-edge")
    scene.ignore(*found.bodies)
    assert scene.earliest_impact(distance).bodies != found.bodies
    scene.begin_step()
    for mesh, end in zip(meshes, grown):
        mesh.update(end)
    for body in ids:
        scene.set_transform(body, place(4.0 * body, 0, 0))
    scene.begin_step()
    scene.update()
    assert not scene.earliest_impact().exists and scene.largest_safe_step() == 1


def test_pairs_of_shapes():
    vertices, faces = ball(1, 0.5)
    scene = ab.Scene()
    box, sphere = scene.add(ab.Box(1, 1, 1)), scene.add(ab.Sphere(1), place(0.5, 0, 0))
    scene.add(ab.DeformableMesh(vertices, faces), place(10, 0, 0))
    floor = scene.add(ab.Halfspace((0, 0, 1), -3))
    scene.update()
    found = scene.collide()
    assert [tuple(pair) for pair in found.bodies] == [(box, sphere)]
    assert scene.is_nearer(0) and scene.nearest(box).bodies == (box, sphere)
    assert scene.distance().distance == 0
    nearest = scene.nearest_point((0, 0, -2.75))
    assert (nearest.body, nearest.element) == (floor, -1)
    assert nearest.distance == pytest.approx(0.25)
    hit = scene.first_hit((0.25, 0, -2), (0, 0, 1))
    assert hit.bodies[0] == sphere and hit.elements[0] == -1
    assert hit.t[0] == pytest.approx(2 - np.sqrt(1 - 0.25**2), rel=1e-6)
    scene.set_transform(sphere, place(3, 0, 0))
    scene.begin_step()
    scene.set_transform(sphere, place(0, 0, 0))
    scene.update()
    impact = scene.earliest_impact()
    assert impact.bodies == (box, sphere) and impact.impact.pair == (-1, -1)
    assert scene.largest_safe_step() == pytest.approx(0.5, abs=1e-6)
    assert scene.largest_safe_step() <= 0.5


def touching_pairs(scene):
    scene.update()
    return [tuple(pair) for pair in scene.collide(contacts_per_pair=0).bodies]


def test_which_pairs_count():
    vertices, faces = ball(1)
    mesh = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    ids = [scene.add(mesh, place(0.1 * i, 0, 0), user=10 + i) for i in range(6)]
    every = list(itertools.combinations(ids, 2))
    assert touching_pairs(scene) == every
    scene.ignore(4, 1)
    assert touching_pairs(scene) == [p for p in every if p != (1, 4)]
    scene.unignore(1, 4)
    scene.ignore_neighbours([3, 1, 5])
    assert touching_pairs(scene) == [p for p in every if p not in ((1, 3), (1, 5))]
    scene.unignore(1, 3)
    scene.unignore(1, 5)
    calls = []

    def is_even(a, b):
        calls.append((a, b))
        return [] if (a + b) % 2 else "yes"

    scene.set_filter(is_even)
    assert touching_pairs(scene) == [p for p in every if sum(p) % 2 == 0]
    assert sorted(calls) == every
    scene.set_filter(None)
    groups, masks = [1, 2, 4, 1, 2, 4], [7, 1, 4, 2, 7, 5]
    for body, group, mask in zip(ids, groups, masks):
        scene.set_options(body, group=group, mask=mask, user=20 + body)
    expected = [(a, b) for a, b in every if groups[a] & masks[b] and groups[b] & masks[a]]
    assert touching_pairs(scene) == expected and 0 < len(expected) < len(every)
    options = scene.options(ids[3])
    assert (options.group, options.mask, options.self_collision, options.user) == (1, 2, False, 23)


def test_a_body_with_itself():
    vertices, faces = sheet(4)
    mesh = ab.DeformableMesh(vertices, faces)
    x, y, _ = vertices.T
    is_right = x > 0  # that half is folded back, through the other
    folded = np.stack(
        [
            np.where(is_right, 0.03 - 0.9 * x, x),
            np.where(is_right, y + 0.02, y),
            np.where(is_right, 0.2 * (x - 0.6), 0),
        ],
        axis=1,
    )
    mesh.update(folded)
    scene = ab.Scene()
    tf = place(1, 2, 3)
    body = scene.add(mesh, tf, self_collision=True)
    other = scene.add(mesh, place(100, 0, 0))
    scene.update()
    gaps = triangle_distances(folded, faces, folded, faces)
    counts = np.triu(no_shared_vertices(faces), 1)
    touching = pair_set(np.argwhere((gaps == 0) & counts))
    found = scene.collide()
    assert found.bodies.tolist() == [[body, body]]
    assert pair_set(found.contacts.pairs) == touching and len(touching) > 0
    near = scene.pairs_within(0.1, enable_nearest_points=True)
    assert pair_set(near.found.triangles) == pair_set(np.argwhere((gaps <= 0.1) & counts))
    corners = placed(folded, tf)[faces[near.found.triangles[:, 0]]]
    low, high = corners.min(axis=1) - 1e-9, corners.max(axis=1) + 1e-9
    assert ((low <= near.found.nearest_points[:, 0]) & (near.found.nearest_points[:, 0] <= high)).all()
    assert len(scene.feature_pairs_within(0.1)) == 1
    scene.set_options(body)
    scene.update()
    assert len(scene.collide()) == 0 and other in scene


def test_solid_bodies_touch_what_is_inside():
    outer, inner = ab.DeformableMesh(*ball(2, 2.0)), ab.DeformableMesh(*ball(1, 0.3))
    scene = ab.Scene()
    around = scene.add(outer, solid=True)
    small, shape = scene.add(inner, place(0.5, 0, 0)), scene.add(ab.Sphere(0.2), place(-0.5, 0, 0))
    assert touching_pairs(scene) == [(around, small), (around, shape)]
    assert scene.is_nearer(0) and scene.options(around).solid
    scene.set_options(around)
    assert touching_pairs(scene) == [] and not scene.is_nearer(0)
    with pytest.raises(ValueError, match="edge"):
        scene.add(ab.DeformableMesh(*sheet(2)), solid=True)
    with pytest.raises(ValueError):
        scene.add(ab.Sphere(1), solid=True)


def test_bodies_come_and_go():
    mesh = ab.DeformableMesh(*ball(1))
    sphere = ab.Sphere(2.0)
    scene = ab.Scene()
    assert repr(scene) == "<adaptive_bvh.Scene: 0 bodies>"
    first, second = scene.add(mesh, (np.eye(3), [1, 2, 3])), scene.add(sphere)
    assert scene.bodies.tolist() == [first, second] and len(scene) == 2
    assert scene.geometry(first) is mesh and scene.geometry(second) is sphere
    np.testing.assert_array_equal(scene.transform(first), place(1, 2, 3))
    scene.set_transform(first, place(3, 2, 1))
    np.testing.assert_array_equal(scene.transform(first), place(3, 2, 1))
    scene.remove(first)
    assert first not in scene and second in scene and -1 not in scene and len(scene) == 1
    third = scene.add(mesh)
    assert third not in (first, second)
    for call in (scene.remove, scene.transform, scene.geometry, scene.options, scene.nearest):
        scene.update()
        with pytest.raises(ValueError, match="no body"):
            call(first)


def test_queries_need_an_update():
    crowd = Crowd(3)
    scene, mesh = crowd.scene, crowd.meshes[0]
    mesh.update(mesh.vertices + 1)
    for query in (
        scene.collide,
        scene.distance,
        scene.vertex_contacts,
        scene.earliest_impact,
        lambda: scene.nearest(0, 1),
        lambda: scene.pairs_within(1),
        lambda: scene.feature_pairs_within(1),
        lambda: scene.first_hit([0, 0, 0], [1, 0, 0]),
        lambda: scene.nearest_point([0, 0, 0]),
    ):
        with pytest.raises(RuntimeError, match="update"):
            query()
    scene.update()
    scene.distance()


def test_errors_in_a_filter():
    crowd = Crowd()
    scene, mesh = crowd.scene, crowd.meshes[0]
    expected = scene.collide().bodies

    def refuse(a, b):
        raise KeyError("mine")

    def change(a, b):
        mesh.update(mesh.vertices)

    queries = (
        scene.collide,
        scene.distance,
        lambda: scene.nearest(0),
        lambda: scene.nearest(0, 2),
        lambda: scene.is_nearer(0.1),
        lambda: scene.vertex_contacts(0.1),
        scene.earliest_impact,
    )
    for threads in (1, 2):
        scene.set_threads(threads)
        scene.set_filter(refuse)
        for query in queries:
            with pytest.raises(KeyError, match="mine"):
                query()
        for call in (change, lambda a, b: scene.remove(a), lambda a, b: scene.distance()):
            scene.set_filter(call)
            for query in queries:
                with pytest.raises(RuntimeError, match="must not change"):
                    query()
        scene.set_filter(None)
        np.testing.assert_array_equal(scene.collide().bodies, expected)
        mesh.update(mesh.vertices)
    with pytest.raises(TypeError, match="function"):
        scene.set_filter(3)


def test_a_filter_may_query():
    crowd, other = Crowd(), Crowd()
    scene, mesh = crowd.scene, crowd.meshes[0]
    queries = (
        lambda: scene.collide().bodies.tolist(),
        lambda: scene.distance().distance,
        lambda: scene.nearest(0).distance,
        lambda: scene.is_nearer(0.1),
        lambda: len(scene.vertex_contacts(0.1)),
    )
    nested = (
        lambda: other.scene.collide().bodies.tolist(),
        lambda: ab.closest_points(mesh, mesh.vertices[:5] + 1).points.tolist(),
        lambda: len(scene),
        lambda: len(scene.vertex_contacts(0.1)),
        lambda: ab.distance(mesh, other.meshes[1]).distance,
    )
    expected = [query() for query in queries]
    of_nested = [query() for query in nested]
    depth = 0

    def ask(a, b):
        nonlocal depth
        if depth < 2:  # the filter is called by its own query, too
            depth += 1
            for query, answer in zip(nested, of_nested):
                assert query() == answer
            depth -= 1
        return True

    scene.set_filter(ask)
    for query, answer in zip(queries, expected):
        assert query() == answer


def test_a_filter_may_refer_to_the_owner_of_its_scene():
    class Simulation:
        def __init__(self):
            self.mesh = ab.DeformableMesh(*ball(1))
            self.scene = ab.Scene()
            self.ids = [self.scene.add(self.mesh) for _ in range(3)]
            self.scene.set_filter(self.admits)

        def admits(self, a, b):
            return a == self.ids[0]

    simulation = Simulation()
    assert touching_pairs(simulation.scene) == [(0, 1), (0, 2)]
    gc.collect()
    assert touching_pairs(simulation.scene) == [(0, 1), (0, 2)]
    alive = weakref.ref(simulation)
    del simulation
    gc.collect()
    assert alive() is None
    collected = ab.Scene()  # also while a query calls a filter
    collected.set_filter(lambda a, b, s=collected: s)
    crowd = Crowd(3)
    del collected
    crowd.scene.set_filter(lambda a, b: gc.collect() >= 0)
    crowd.scene.is_nearer(10)
    for _ in range(50):  # filters and scenes end in any order
        scene = ab.Scene()
        scene.set_filter(lambda a, b, s=scene: s)
        scene.set_filter(lambda a, b: True)
        ab.Scene.__new__(ab.Scene)
    del scene
    gc.collect()


def test_threads_share_a_scene_with_a_filter():
    crowd = Crowd()
    crowd.scene.set_filter(lambda a, b: a + b != 3)
    expected = crowd.scene.collide()
    assert all(a + b != 3 for a, b in expected.bodies)
    wrong = []

    def read():
        for _ in range(20):
            found = crowd.scene.collide()
            if not np.array_equal(found.contacts.pairs, expected.contacts.pairs):
                wrong.append(found)

    def write():
        for _ in range(20):
            crowd.meshes[1].update(crowd.meshes[1].vertices)  # which moves nothing
            crowd.scene.set_filter(lambda a, b: a + b != 3)

    threads = [threading.Thread(target=f) for f in (read, read, write)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_what_does_not_fit_is_refused():
    vertices, faces = ball(1)
    scene = ab.Scene()
    with pytest.raises(TypeError, match="not str"):
        scene.add("body")
    with pytest.raises(TypeError, match="int32"):
        ab.Scene("int32")
    with pytest.raises(ValueError):
        scene.add(ab.Sphere(1.0), self_collision=True)
    assert len(scene) == 0
    mesh = ab.DeformableMesh(vertices, faces)
    body = scene.add(mesh)
    scene.update()
    for wrong in (-1.0, np.nan):
        for query in (
            scene.is_nearer,
            scene.pairs_within,
            scene.feature_pairs_within,
            scene.vertex_contacts,
            scene.earliest_impact,
        ):
            with pytest.raises(ValueError):
                query(wrong)
    with pytest.raises(ValueError, match="range of a ray"):
        scene.first_hit([0, 0, 0], [1, 0, 0], begin=2, end=1)
    with pytest.raises(ValueError):
        scene.first_hit([0, 0, 0], [0, 0, 0])
    with pytest.raises(ValueError):
        scene.set_transform(body, 2 * np.eye(4))
    alone = scene.nearest(body)
    assert alone.bodies == (-1, -1) and np.isinf(alone.distance) and np.isnan(alone.points).all()


def same_answers(scene, other):
    assert list(other.bodies) == list(scene.bodies)
    assert repr(other.collide()) == repr(scene.collide())
    assert other.distance().distance == scene.distance().distance
    assert other.earliest_impact().impact.time == scene.earliest_impact().impact.time
    for body in scene.bodies:
        np.testing.assert_array_equal(other.transform(body), scene.transform(body))
        assert repr(other.options(body)) == repr(scene.options(body))


def eventful():
    """A scene in which numbers are missing, pairs are left out, and a step is under way."""
    crowd = Crowd(count=5)
    scene = crowd.scene
    late = scene.add(ab.Box(1, 1, 1), place(0.2, 0.1, 0.0), user=7, group=3)
    scene.remove(crowd.ids[1])
    scene.remove(scene.add(ab.Sphere(1)))
    twin = scene.add(crowd.meshes[0], place(0.0, 0.0, 0.9))
    scene.ignore(late, crowd.ids[2])
    scene.ignore_neighbours([twin, crowd.ids[0], crowd.ids[3]])
    scene.unignore(crowd.ids[0], crowd.ids[3])
    scene.ignore(crowd.sphere, crowd.ids[4])
    scene.begin_step()
    scene.set_transform(late, place(0.5, 0.4, 0.1))
    scene.update()
    return crowd, scene, twin


@pytest.mark.parametrize("copied", [lambda s: s.snapshot(), copy.copy, copy.deepcopy,
                                    lambda s: pickle.loads(pickle.dumps(s))])
def test_a_copy_answers_the_same_and_stays(copied):
    crowd, scene, twin = eventful()
    other = copied(scene)
    same_answers(scene, other)
    before = repr(other.collide())
    mesh = crowd.meshes[0]
    assert other.geometry(crowd.ids[0]) is other.geometry(twin) is not mesh
    mesh.update(mesh.vertices + 100.0)
    scene.update()
    assert repr(scene.collide()) != before == repr(other.collide())
    # Each goes on by itself, with the same numbers for new bodies.
    assert scene.add(ab.Sphere(1)) == other.add(ab.Sphere(1))
    other.geometry(twin).update(mesh.vertices)
    other.update()
    other.unignore(twin, crowd.ids[0])


def test_a_copy_keeps_the_filter_and_what_was_left_out_of_removed_bodies():
    scene = ab.Scene()
    mesh = ab.DeformableMesh(*ball())
    a, b, c = scene.add(mesh), scene.add(mesh), scene.add(mesh)
    scene.ignore(a, b)
    scene.set_filter(lambda first, second: (first, second) != (b, c))
    scene.remove(a)
    other = scene.snapshot()
    assert len(other.collide()) == 0
    other.set_filter(None)
    assert len(other.collide()) == 1
    with pytest.raises((AttributeError, pickle.PicklingError)):
        pickle.dumps(scene)  # pickle refuses the lambda


def test_snapshots_are_of_one_moment():
    """All meshes of a snapshot are those of one update, while another thread moves them."""
    meshes_, scene = [ab.DeformableMesh(*ball()) for _ in range(20)], ab.Scene()
    ids = [scene.add(mesh) for mesh in meshes_]
    rest = meshes_[0].vertices
    done = threading.Event()

    def move():
        step = 0
        while not done.is_set():
            step += 1
            for mesh in meshes_:
                mesh.update(rest + step)

    thread = threading.Thread(target=move)
    thread.start()
    try:
        for _ in range(20):
            other = scene.snapshot()
            steps = [other.geometry(i).vertices[0, 0] - rest[0, 0] for i in ids]
            # The mover is at one mesh: those before it are one step ahead.
            assert max(steps) - min(steps) <= 1 and sorted(steps, reverse=True) == steps
    finally:
        done.set()
        thread.join()


def test_add_names_what_is_wrong():
    vertices, faces = ball()
    with pytest.raises(TypeError, match="a body must be a DeformableMesh or a Shape, not ndarray"):
        ab.Scene().add(vertices, faces)
