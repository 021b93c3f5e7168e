"""Derivatives of distances, against differences; and the guide's function for PyTorch."""

import pathlib
import re

import meshes
import numpy as np
import pytest

import adaptive_bvh as ab

GUIDE = pathlib.Path(__file__).parents[2] / "docs" / "guide.md"
STEP = 1e-6


def change_of(gradients, displacements):
    """By how much each distance changes."""
    moved = displacements[gradients.vertices]  # (K, k, 3)
    return (gradients.gradients * moved).sum(axis=(1, 2))


def differences(distances, a, b, by_a, by_b):
    """Of all distances, where both sides agree, and whether they do."""
    v, w = a.vertices, b.vertices

    def at(t):
        a.update(v + t * by_a)
        if a is not b:
            b.update(w + t * by_b)
        return distances()

    after, before, now = at(STEP), at(-STEP), at(0)
    is_smooth = np.abs(after + before - 2 * now) < 1e-4 * STEP
    return (after - before) / (2 * STEP), is_smooth


def two_bodies(gap):
    rng = np.random.default_rng(int(10 * gap))
    a, b = (ab.DeformableMesh(meshes.wave(v, 1), f) for v, f in (meshes.ball(1), meshes.ball(1)))
    tf1, tf2 = meshes.pose(rng), meshes.pose(rng)
    tf2[:3, 3] = tf1[:3, 3] + (0, gap, 0)
    return a, b, tf1, tf2, rng.normal(size=(18, 3)), rng.normal(size=(18, 3))


def test_of_feature_pairs():
    a, b, tf1, tf2, by_a, by_b = two_bodies(2.6)
    pairs = ab.feature_pairs_within(a, b, 1.2, tf1=tf1, tf2=tf2)
    for kind, k, m in (("vertex_face", 1, 3), ("face_vertex", 3, 1), ("edge_edge", 2, 2)):

        def details():
            return ab.feature_pair_details(a, b, pairs, tf1=tf1, tf2=tf2)

        expected, is_smooth = differences(
            lambda kind=kind: getattr(details(), kind).distances, a, b, by_a, by_b
        )
        found = getattr(ab.distance_derivatives(a, b, pairs, details(), tf1=tf1, tf2=tf2), kind)
        count = len(getattr(pairs, kind))
        assert len(found.first) == len(found.second) == count > 10
        assert found.first.vertices.shape == (count, k)
        assert found.second.gradients.shape == (count, m, 3)
        assert is_smooth.mean() > 0.8
        change = change_of(found.first, by_a) + change_of(found.second, by_b)
        np.testing.assert_allclose(change[is_smooth], expected[is_smooth], atol=1e-5)


def test_of_one_mesh():
    v, f = meshes.sheet(6)
    folded = np.stack([np.abs(v[:, 0]), v[:, 1], 0.1 + 0.2 * v[:, 0]], axis=1)
    mesh = ab.DeformableMesh(meshes.wave(folded, 0.3), f)
    pairs = ab.self_feature_pairs_within(mesh, 0.3)
    by = np.random.default_rng(3).normal(size=v.shape)
    expected, is_smooth = differences(
        lambda: ab.self_feature_pair_details(mesh, pairs).edge_edge.distances, mesh, mesh, by, by
    )
    details = ab.self_feature_pair_details(mesh, pairs)
    found = ab.self_distance_derivatives(mesh, pairs, details).edge_edge
    change = change_of(found.first, by) + change_of(found.second, by)
    assert is_smooth.sum() > 10
    np.testing.assert_allclose(change[is_smooth], expected[is_smooth], atol=1e-5)


def test_of_contacts():
    a, b, tf1, tf2, by_a, by_b = two_bodies(1.2)

    def contacts():
        return ab.vertex_contacts(a, b, np.inf, tf1=tf1, tf2=tf2)

    expected, is_smooth = differences(lambda: contacts().distances, a, b, by_a, by_b)
    found = ab.distance_derivatives(a, b, contacts(), tf1=tf1, tf2=tf2)
    assert (contacts().distances < 0).any()
    assert found.first.vertices.shape == (18, 1) and found.second.vertices.shape == (18, 3)
    change = change_of(found.first, by_a) + change_of(found.second, by_b)
    assert is_smooth.mean() > 0.8
    np.testing.assert_allclose(change[is_smooth], expected[is_smooth], atol=1e-5)
    ball = ab.Sphere(0.5)
    of_shape = ab.distance_derivatives(a, ball, ab.vertex_contacts(a, ball, 9.0))
    assert of_shape.first.gradients.shape == (18, 1, 3)
    assert of_shape.second.gradients.shape == (0, 0, 3) and len(of_shape.second) == 0
    away = a.vertices / np.linalg.norm(a.vertices, axis=1)[:, None]
    np.testing.assert_allclose(of_shape.first.gradients[:, 0], away, atol=1e-12)


def test_of_two_meshes():
    v, f = meshes.ball(1)
    a, b = ab.DeformableMesh(v, f), ab.DeformableMesh(v, f)
    pair = ab.CoherentDistance(a, b)
    tf = meshes.place(0.1, 0.3, 2.5)
    found = ab.distance_derivatives(a, b, pair.distance(None, tf), tf2=tf)
    assert found.first.vertices.shape == found.second.vertices.shape == (1, 3)
    points = pair.distance(None, tf).points
    normal = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    np.testing.assert_allclose(found.second.gradients.sum(axis=1)[0], normal, atol=1e-9)
    np.testing.assert_allclose(found.first.gradients.sum(axis=1)[0], -normal, atol=1e-9)
    touching = ab.distance(a, b)
    assert touching.distance == 0
    assert not ab.distance_derivatives(a, b, touching).first.gradients.any()


def test_what_does_not_fit_is_refused():
    a, b, tf1, tf2, _, _ = two_bodies(2.6)
    pairs = ab.feature_pairs_within(a, b, 1.2, tf1=tf1, tf2=tf2)
    details = ab.feature_pair_details(a, b, pairs, tf1=tf1, tf2=tf2)
    with pytest.raises(ValueError):
        ab.distance_derivatives(a, b, ab.FeaturePairs(), details, tf1=tf1, tf2=tf2)
    with pytest.raises(IndexError):
        ab.distance_derivatives(a, b, ab.FeaturePairs(vertex_face=[[0, 10**6]]), details)
    with pytest.raises(ValueError):
        ab.distance_derivatives(a, b, ab.distance(a, ab.Sphere(0.1)))
    with pytest.raises(ValueError):
        ab.distance_derivatives(a, b, ab.vertex_contacts(a, ab.Sphere(0.1), 9.0))
    with pytest.raises(TypeError):
        ab.distance_derivatives(a, b, pairs)


def test_function_for_pytorch():
    """The class that the guide shows: its gradient equals differences of its values."""
    torch = pytest.importorskip("torch")
    if not GUIDE.exists():
        pytest.skip("the guide is not here")
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    (program,) = [block for block in blocks if "torch.autograd.Function" in block]
    names = {}
    exec(program, names)  # noqa: S102
    v, f = meshes.sheet(5)
    folded = np.stack([np.abs(v[:, 0]), v[:, 1], 0.1 + 0.2 * v[:, 0]], axis=1)
    folded += 0.03 * np.random.default_rng(5).normal(size=v.shape)  # no edges are parallel
    mesh = ab.DeformableMesh(folded, f)
    pairs = ab.self_feature_pairs_within(mesh, 0.3)
    details = ab.self_feature_pair_details(mesh, pairs)
    positions = torch.tensor(folded, requires_grad=True)
    distances = names["FeatureDistances"].apply(positions, mesh, pairs)
    expected = np.concatenate([details.vertex_face.distances, details.edge_edge.distances])
    np.testing.assert_array_equal(distances.detach().numpy(), expected)
    assert len(expected) > 20
    assert torch.autograd.gradcheck(
        lambda x: names["FeatureDistances"].apply(x, mesh, pairs).pow(2).sum(), (positions,)
    )
