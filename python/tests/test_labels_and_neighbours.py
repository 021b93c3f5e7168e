"""Which pairs of one mesh count: labels of triangles, ignored pairs, neighbours that meet again."""

from fractions import Fraction

import numpy as np
import pytest
from brute_force import (
    edge_distances,
    no_shared_vertices,
    owned_edges,
    pair_set,
    surface_distances,
    triangle_distances,
)
from meshes import ball, sheet, wave

import adaptive_bvh as ab


def components():
    """Three balls and a sheet through each other, in one mesh: mesh, vertices, faces, labels."""
    parts = [ball(1, 0.8), ball(1, 0.7), sheet(4), ball(0, 0.6)]
    shifts = [(0, 0, 0), (0.7, 0.2, 0.1), (0, 0, 0.3), (0.1, 0.8, 0)]
    vertices = np.concatenate([v + s for (v, _), s in zip(parts, shifts)])
    starts = np.cumsum([0] + [len(v) for v, _ in parts])
    faces = np.concatenate([f + start for (_, f), start in zip(parts, starts)])
    labels = np.repeat([7, 0, 7, 2**32 - 1], [len(f) for _, f in parts])  # two parts share one
    mesh = ab.DeformableMesh(vertices, faces)
    mesh.update(wave(vertices, 1))
    return mesh, mesh.vertices, faces, labels


@pytest.mark.parametrize("rule", ["within", "between"])
def test_labels_of_triangles(tolerance, rule):
    mesh, vertices, faces, labels = components()
    same = labels[:, None] == labels[None]
    counts = np.triu(no_shared_vertices(faces), 1) & (same if rule == "within" else ~same)
    gaps = triangle_distances(vertices, faces, vertices, faces)
    touching = pair_set(np.argwhere((gaps == 0) & counts))
    others = ab.SurfaceNeighbourhood.by_labels(mesh, labels, rule)
    assert pair_set(ab.self_collide(mesh, ignored=others).pairs) == touching and len(touching) > 10
    found = pair_set(ab.self_pairs_within(mesh, 0.1, ignored=others).triangles)
    assert pair_set(np.argwhere((gaps <= 0.1 - tolerance) & counts)) <= found
    assert found <= pair_set(np.argwhere((gaps <= 0.1 + tolerance) & counts))
    some = np.array(sorted(found))[::3]
    rest = ab.self_pairs_within(mesh, 0.1, ignored=ab.Ignored(some[::-1], surface=others))
    assert pair_set(rest.triangles) == found - pair_set(some)


@pytest.mark.parametrize("rule", ["within", "between"])
def test_labels_of_features(tolerance, rule):
    mesh, vertices, faces, labels = components()
    others = ab.SurfaceNeighbourhood.by_labels(mesh, labels, rule)
    found = ab.self_feature_pairs_within(mesh, 0.3, ignored=others)
    of_vertex = np.zeros(len(vertices), labels.dtype)
    for face, label in zip(faces[::-1], labels[::-1]):
        of_vertex[face] = label

    def expect(pairs, distances, counts, numbers1, numbers2):
        inside = np.argwhere((distances <= 0.3 - tolerance) & counts)
        near = np.argwhere((distances <= 0.3 + tolerance) & counts)
        assert {(numbers1[i], numbers2[j]) for i, j in inside} <= pair_set(pairs)
        assert pair_set(pairs) <= {(numbers1[i], numbers2[j]) for i, j in near}
        assert len(pairs) > 10

    def admits(a, b):
        same = a[:, None] == b[None]
        return same if rule == "within" else ~same

    every = np.arange(len(vertices) + len(faces))
    apart = ~(faces[None] == np.arange(len(vertices))[:, None, None]).any(axis=2)
    expect(
        found.vertex_face,
        surface_distances(vertices, vertices, faces),
        apart & admits(of_vertex, labels),
        every,
        every,
    )
    numbers, edges = owned_edges(faces)
    apart = ~(edges[:, None, :, None] == edges[None, :, None, :]).any(axis=(2, 3))
    order = numbers[:, None] < numbers[None]
    expect(
        found.edge_edge,
        edge_distances(vertices, edges, vertices, edges),
        apart & order & admits(labels[numbers // 3], labels[numbers // 3]),
        numbers,
        numbers,
    )
    ignored = ab.FeaturePairs(found.vertex_face[::2], edge_edge=found.edge_edge[::-2])
    both = ab.Ignored(ignored, surface=others)
    rest = ab.self_feature_pairs_within(mesh, 0.3, ignored=both)
    assert len(rest) == len(found) - len(ignored) and len(rest.face_vertex) == 0


def test_labels_that_are_none_are_refused():
    mesh = ab.DeformableMesh(*ball(1))
    by_labels = ab.SurfaceNeighbourhood.by_labels
    with pytest.raises(ValueError, match="one for each of 32 faces"):
        by_labels(mesh, [1, 2])
    with pytest.raises(ValueError, match="'within' or 'between'"):
        by_labels(mesh, [0] * 32, "same")
    with pytest.raises(IndexError):
        by_labels(mesh, [-1] * 32)
    with pytest.raises(TypeError):
        by_labels(mesh, [0.5] * 32)


def test_what_is_ignored_is_of_the_query_and_of_its_mesh():
    mesh, other = ab.DeformableMesh(*ball(1)), ab.DeformableMesh(*ball(1))
    surface = ab.SurfaceNeighbourhood(other)
    for query in (
        lambda ignored: ab.self_collide(mesh, ignored=ignored),
        lambda ignored: ab.self_pairs_within(mesh, 0.1, ignored=ignored),
        lambda ignored: ab.self_feature_pairs_within(mesh, 0.1, ignored=ignored),
        lambda ignored: ab.self_least_distance(mesh, ignored, 1e-3),
        lambda ignored: ab.ContactSet(mesh, 0.1, ignored=ignored),
    ):
        with pytest.raises(ValueError, match="SurfaceNeighbourhood of another mesh"):
            query(surface)
        with pytest.raises(ValueError, match="SurfaceNeighbourhood of another mesh"):
            query(ab.Ignored(surface=surface))
    with pytest.raises(TypeError, match="FeaturePairs"):
        ab.self_pairs_within(mesh, 0.1, ignored=ab.FeaturePairs())
    with pytest.raises(TypeError, match="FeaturePairs"):
        ab.self_feature_pairs_within(mesh, 0.1, ignored=[[0, 1]])
    with pytest.raises(TypeError):
        ab.Ignored(surface=mesh)


# ---- Neighbours, judged in rational numbers -------------------------------------------------------


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def clipped(polygon, normal, through):
    """The part of a convex polygon where normal . (x - through) >= 0 (Sutherland and Hodgman)."""
    heights = [dot(normal, minus(x, through)) for x in polygon]
    result = []
    for i, (x, h) in enumerate(zip(polygon, heights)):
        y, g = polygon[i - 1], heights[i - 1]
        if g * h < 0:
            t = Fraction(g) / (g - h)
            result.append([a + t * (b - a) for a, b in zip(y, x)])
        if h >= 0:
            result.append(x)
    return result


def common_points(first, second):
    """Corners of the intersection of two triangles."""
    a, b, c = second
    normal = cross(minus(b, a), minus(c, a))
    polygon = clipped(first, normal, a)
    polygon = clipped(polygon, [-x for x in normal], a)
    for x, y in ((a, b), (b, c), (c, a)):
        polygon = clipped(polygon, cross(normal, minus(y, x)), x)
    return polygon


def is_on(x, shared):
    """Whether a point is the shared vertex, or on the shared edge."""
    if len(shared) == 1:
        return x == shared[0]
    a, b = shared
    along = minus(b, a)
    return cross(along, minus(x, a)) == [0, 0, 0] and 0 <= dot(along, minus(x, a)) <= dot(along, along)


def meet_again(corners1, face1, corners2, face2):
    shared = [corners1[k] for k in range(3) if face1[k] in face2]
    if len(shared) == 3:
        return True
    points = common_points(corners1, corners2)
    return any(not is_on(x, shared) for x in points) if shared else len(points) > 0


def test_neighbours_that_meet_beyond_what_they_share():
    """Fans of triangles on a small lattice: many are folded over each other, or cross."""
    rng = np.random.default_rng(12)
    found = {1: 0, 2: 0, 3: 0}
    for _ in range(60):
        vertices = rng.integers(-2, 3, (9, 3))
        faces = np.array([rng.permutation(9)[:3] for _ in range(12)])
        faces[1] = faces[0][[1, 2, 0]]
        sides = vertices[faces][:, 1:] - vertices[faces][:, :1]
        has_area = np.cross(sides[:, 0], sides[:, 1]).any(axis=1)
        corners = [[[int(x) for x in vertices[v]] for v in face] for face in faces]
        expected = set()
        for i in range(len(faces)):
            for j in range(i + 1, len(faces)):
                shared = len(set(faces[i]) & set(faces[j]))
                if not shared or not (has_area[i] and has_area[j]):
                    continue
                if meet_again(corners[i], list(faces[i]), corners[j], list(faces[j])):
                    expected.add((i, j))
                    found[shared] += 1
        mesh = ab.DeformableMesh(vertices, faces)
        pairs = ab.self_collide(mesh, ignored=ab.Ignored(neighbours="beyond shared")).pairs
        neighbours = {
            (i, j)
            for i, j in pair_set(pairs)
            if has_area[i] and has_area[j] and set(faces[i]) & set(faces[j])
        }
        assert neighbours == expected
        apart = ab.self_collide(mesh).pairs
        assert pair_set(pairs) - neighbours == pair_set(apart)
    assert min(found.values()) > 20


def test_a_fold_is_found():
    vertices = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, 0]]
    mesh = ab.DeformableMesh(vertices, [[0, 1, 2], [1, 0, 3]])
    assert len(ab.self_collide(mesh)) == 0
    assert ab.self_collide(mesh, ignored=ab.Ignored(neighbours="beyond shared")).pairs.tolist() == [[0, 1]]
    mesh.update([3], [[0.5, -0.5, 0]])
    assert len(ab.self_collide(mesh, ignored=ab.Ignored(neighbours="beyond shared"))) == 0
    with pytest.raises(ValueError, match="BeyondShared"):
        ab.self_pairs_within(mesh, 0.1, ignored=ab.Ignored(neighbours="beyond shared"))
