import meshes
import numpy as np
import pytest
from brute_force import points_to_triangles, segments, triangle_distances

import adaptive_bvh as ab


def test_a_falling_vertex_hits_a_face_in_time(tolerance):
    sheet = ab.DeformableMesh([[-2, -2, 0], [2, -2, 0], [0, 2, 0]], [[0, 1, 2]])
    tip = np.array([[0, 0, 1], [-1, 0, 2], [1, 0.5, 2.0]])
    arrow = ab.DeformableMesh(tip, [[0, 1, 2]])
    fall = ab.Motion(arrow, tip, tip - [0, 0, 4])
    still = ab.Motion(sheet, sheet.vertices)
    impact = ab.earliest_impact(fall, still)
    assert impact.exists and impact.kind == "vertex-face" and impact.pair == (0, 0)
    assert impact.time == pytest.approx(0.25, abs=tolerance) and impact.time <= 0.25
    assert ab.time_of_impact(fall, still, "vertex-face", (0, 0)) == impact.time
    assert ab.largest_safe_step(fall, still) == impact.time
    early = ab.largest_safe_step(fall, still, 0.2)
    assert early == pytest.approx(0.2, abs=tolerance)
    swapped = ab.earliest_impact(still, fall)
    assert (swapped.kind, swapped.pair, swapped.time) == ("face-vertex", (0, 0), impact.time)
    by_pose = ab.Motion(arrow, tip, tip, None, (np.eye(3), [0, 0, -4]))
    assert ab.largest_safe_step(by_pose, still) == pytest.approx(0.25, abs=tolerance)
    safe = ab.safe_displacements(fall, still)
    assert safe[0].shape == (3,) and safe[1].shape == (3,)
    assert safe[0][0] <= 1 + tolerance and safe[0][0] + safe[1].max() <= 1 + tolerance
    away = ab.Motion(arrow, tip, tip + [0, 0, 4])
    assert ab.earliest_impact(away, still).time == np.inf
    assert not ab.earliest_impact(away, still).exists
    assert ab.largest_safe_step(away, still) == 1


def feature_distances(pairs, w1, f1, w2, f2):
    """Of each of the three lists of pairs, on positions in the world."""
    corners = lambda w, f, t: np.moveaxis(w[f[t]], 1, 0)
    ends = lambda w, f, e: (w[f[e // 3, e % 3]], w[f[e // 3, (e + 1) % 3]])
    v, t = pairs.vertex_face.T
    first = points_to_triangles(w1[v], *corners(w2, f2, t))
    t, v = pairs.face_vertex.T
    second = points_to_triangles(w2[v], *corners(w1, f1, t))
    e, g = pairs.edge_edge.T
    return first, second, segments(*ends(w1, f1, e), *ends(w2, f2, g))


def test_times_of_impact_are_those_of_the_features():
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(4)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    start1, end1 = meshes.wave(v1, 0), meshes.wave(v1, 1)
    start2, end2 = meshes.wave(v2, 0), meshes.wave(v2, 1)
    from_tf, to_tf = (np.eye(3), [0, 0, 3]), (np.eye(3), [0.2, 0, 0.6])
    first = ab.Motion(a, start1, end1, from_tf, to_tf)
    second = ab.Motion(b, start2, end2)
    at = lambda t: (
        (1 - t) * (start1 + from_tf[1]) + t * (end1 + to_tf[1]),
        (1 - t) * start2 + t * end2,
    )
    step = ab.largest_safe_step(first, second)
    assert 0 < step < 1
    for t in (0, 0.3 * step, 0.9 * step):
        w1, w2 = at(t)
        assert triangle_distances(w1, f1, w2, f2).min() > 0
    pairs = ab.candidates(first, second)
    times = ab.times_of_impact(first, second, pairs)
    lists = times.vertex_face, times.face_vertex, times.edge_edge
    assert min(t.min() for t in lists) == step
    number = 0
    for kind_index, t in enumerate(lists):
        for k in np.flatnonzero(np.isfinite(t))[:20]:
            w1, w2 = at(t[k])
            assert feature_distances(pairs, w1, f1, w2, f2)[kind_index][k] < 1e-5
            number += 1
    assert number > 20
    impact = ab.earliest_impact(first, second)
    assert ab.time_of_impact(first, second, impact.kind, impact.pair) == step
    chosen = ab.FeaturePairs(edge_edge=pairs.edge_edge[::-1])
    turned = ab.times_of_impact(first, second, chosen)
    np.testing.assert_array_equal(turned.edge_edge, times.edge_edge[::-1])
    assert turned.vertex_face.shape == (0,)


def test_one_mesh_with_itself():
    vertices, faces = meshes.sheet(4)
    mesh = ab.DeformableMesh(vertices, faces)
    x, y = vertices[:, 0], vertices[:, 1]
    start = np.stack([x, y, np.abs(x)], axis=1)  # a V, whose left side goes through the right
    right = np.stack([np.abs(x) * 0.9, y + 0.03, np.abs(x) * 0.3], axis=1)
    end = np.where((x < 0)[:, None], right, start)
    motion = ab.Motion(mesh, start, end)
    pairs = ab.self_candidates(motion)
    assert len(pairs.vertex_face) and len(pairs.edge_edge) and len(pairs.face_vertex) == 0
    times = ab.self_times_of_impact(motion, pairs)
    impact = ab.self_earliest_impact(motion)
    earliest = min(times.vertex_face.min(), times.edge_edge.min())
    assert impact.exists and impact.time == earliest == ab.self_largest_safe_step(motion)
    assert ab.self_time_of_impact(motion, impact.kind, impact.pair) == earliest
    safe = ab.self_safe_displacements(motion)
    wanted = np.linalg.norm(end - start, axis=1)
    assert safe.shape == (len(vertices),) and (safe <= wanted + 1e-5).all()


def test_truncated_motions_stay_apart():
    vertices, faces = meshes.sheet(6)
    mesh = ab.DeformableMesh(vertices, faces)
    rng = np.random.default_rng(5)
    upper = vertices + [0, 0, 0.05]
    end = upper - [0, 0, 0.2] * rng.random((len(vertices), 1))
    fall, still = ab.Motion(mesh, upper, end), ab.Motion(mesh, vertices, vertices)
    shares, of_still = ab.truncate_motion(fall, still)
    assert shares.shape == of_still.shape == (len(vertices),)
    assert (of_still == 1).all() and (shares >= 0).all() and (shares < 0.5).any()
    there = upper + shares[:, None] * (end - upper)
    assert (there[:, 2] > 0).all()
    for _ in range(5):
        at = upper + rng.random((len(vertices), 1)) * (there - upper)
        assert not ab.earliest_impact(ab.Motion(mesh, upper, at), still).exists
    assert (ab.self_truncate_motion(ab.Motion(mesh, vertices, vertices + [0.3, 0, 0])) == 1).all()
    with pytest.raises(ValueError, match="is -1"):
        ab.self_truncate_motion(fall, -1.0)


def test_a_motion_keeps_copies():
    vertices, faces = meshes.sheet(2)
    mesh = ab.DeformableMesh(vertices, faces)
    start = vertices + [0, 0, 1]
    motion = ab.Motion(mesh, start)  # to where the mesh is now
    ball = ab.DeformableMesh(*meshes.ball(0, 0.25))
    still = ab.Motion(ball, ball.vertices)
    before = ab.largest_safe_step(motion, still)
    assert before == pytest.approx(0.75)
    start[:] = np.nan
    mesh.update(vertices + 7)
    assert ab.largest_safe_step(motion, still) == before


def test_a_motion_of_two_frames():
    vertices, faces = meshes.sheet(2)
    mesh = ab.DeformableMesh(vertices + [0, 0, 1], faces)
    for start in ({}, {"end": vertices}):
        with pytest.raises(ValueError, match="not update_two_frames"):
            ab.Motion(mesh, **start)
    ball = ab.DeformableMesh(*meshes.ball(0, 0.25))
    still = ab.Motion(ball, ball.vertices)
    mesh.update_two_frames(vertices)
    expected = ab.largest_safe_step(ab.Motion(mesh, vertices + [0, 0, 1], vertices), still)
    assert expected == pytest.approx(0.75)
    assert ab.largest_safe_step(ab.Motion(mesh), still) == expected
    assert ab.largest_safe_step(ab.Motion(mesh, end=vertices), still) == expected
    assert ab.largest_safe_step(ab.Motion(mesh, end=vertices + [0, 0, 1]), still) == 1
    mesh.update(vertices)
    with pytest.raises(ValueError, match="start is missing"):
        ab.Motion(mesh)


def test_wrong_arguments_are_refused():
    mesh = ab.DeformableMesh(*meshes.ball(0))
    motion = ab.Motion(mesh, mesh.vertices)
    with pytest.raises(ValueError, match="a row for each vertex"):
        ab.Motion(mesh, np.zeros((5, 3)))
    with pytest.raises(TypeError):
        ab.Motion(None, np.zeros((5, 3)))
    with pytest.raises(ValueError, match="kind is 'edge'"):
        ab.self_time_of_impact(motion, "edge", (0, 1))
    with pytest.raises(IndexError, match="names 6"):
        ab.self_time_of_impact(motion, "vertex-face", (6, 0))
    with pytest.raises(IndexError, match="names 24"):
        ab.self_times_of_impact(motion, ab.FeaturePairs(edge_edge=[[0, 24]]))
    with pytest.raises(IndexError, match="names -1"):
        ab.FeaturePairs(vertex_face=[[-1, 0]])
    with pytest.raises(ValueError):
        ab.candidates(motion, motion, -1.0)
    with pytest.raises(ValueError):
        ab.self_candidates(ab.Motion(mesh, np.full((6, 3), np.inf)))
