import meshes
import numpy as np
import pytest
from brute_force import triangle_distances

import adaptive_bvh as ab


def brute(a, tf1, b, tf2):
    """Of two meshes as they stand."""
    return triangle_distances(
        meshes.placed(a.vertices, tf1),
        a.faces,
        meshes.placed(b.vertices, tf2),
        b.faces,
    )


def test_equals_brute_force_in_every_step(tolerance):
    rng = np.random.default_rng(1)
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(4)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    pair = ab.CoherentDistance(a, b)
    for step in range(12):
        a.update(meshes.wave(v1, 0.3 * step))
        b.update(meshes.wave(v2, -0.2 * step))
        tf1, tf2 = meshes.pose(rng), meshes.pose(rng, 0.5 + 0.3 * step)
        expected = brute(a, tf1, b, tf2).min()
        for result in (ab.distance(a, b, tf1=tf1, tf2=tf2), pair.distance(tf1, tf2)):
            assert result.distance == pytest.approx(expected, abs=tolerance)
            gap = np.linalg.norm(result.points[0] - result.points[1])
            assert gap == pytest.approx(expected, abs=10 * tolerance)
    assert a.validate() and b.validate()


def test_points_are_on_the_named_triangles(tolerance):
    (v1, f1), (v2, f2) = meshes.ball(1), meshes.sheet(3)
    a, b = ab.DeformableMesh(v1, f1), ab.DeformableMesh(v2, f2)
    tf = meshes.pose(np.random.default_rng(2), 3)
    result = ab.distance(a, b, tf2=tf)
    assert result.points.shape == (2, 3) and result.points.dtype == np.float64
    assert result.triangles.shape == (2,) and result.triangles.dtype == np.int32
    for side, (v, f) in enumerate(((v1, f1), (meshes.placed(v2, tf), f2))):
        corners = v[f[result.triangles[side]]]
        weights = np.linalg.lstsq(
            np.vstack([corners.T, np.ones(3)]), np.append(result.points[side], 1), rcond=None
        )[0]
        assert np.all(weights > -10 * tolerance)
        np.testing.assert_allclose(weights @ corners, result.points[side], atol=10 * tolerance)


def test_meshes_that_touch_have_distance_zero_and_a_common_point(tolerance):
    a, b = ab.DeformableMesh(*meshes.ball(1)), ab.DeformableMesh(*meshes.sheet(3))
    result = ab.distance(a, b)
    assert result.distance == 0
    np.testing.assert_allclose(result.points[0], result.points[1], atol=10 * tolerance)


def test_without_nearest_points_they_are_nan():
    a, b = ab.DeformableMesh(*meshes.ball(1)), ab.DeformableMesh(*meshes.sheet(3))
    tf = (np.eye(3), [0, 0, 3])
    assert np.isnan(ab.distance(a, b, tf2=tf, nearest_points=False).points).all()
    assert np.isnan(ab.CoherentDistance(a, b).distance(None, tf, nearest_points=False).points).all()


def test_all_forms_of_a_pose_mean_the_same():
    a, b = ab.DeformableMesh(*meshes.ball(1)), ab.DeformableMesh(*meshes.sheet(3))
    matrix = meshes.pose(np.random.default_rng(3), 3)
    rotation, translation = matrix[:3, :3], matrix[:3, 3]
    expected = ab.distance(a, b, tf2=matrix).distance
    forms = [
        matrix.tolist(),
        (rotation, translation),
        [rotation, translation],
        (rotation.tolist(), tuple(translation)),
        (rotation, translation[:, None]),
        np.asfortranarray(matrix),
        np.repeat(matrix, 2, axis=1)[:, ::2],
    ]
    for tf in forms:
        assert ab.distance(a, b, tf2=tf).distance == expected
    rounded = ab.distance(a, b, tf2=matrix.astype(np.float32)).distance
    assert rounded == pytest.approx(expected, abs=1e-5)
    assert ab.distance(a, b, tf1=np.eye(4), tf2=matrix).distance == expected


@pytest.mark.parametrize(
    "tf, sentence",
    [
        (2 * np.eye(4), "last row"),
        (np.diag([2.0, 1, 1, 1]), "not orthonormal"),
        (np.diag([1.0, 1, -1, 1]), "mirrors"),
        (np.eye(3), "4 x 4 are needed"),
        ((np.eye(3), [0, 0]), "3 x 1 are needed"),
        ((np.eye(3), [0, 0, np.nan]), "not finite"),
        ((np.full((3, 3), np.nan), [0, 0, 0]), "not finite"),
        ((np.eye(3), [0, 0, 1e300]), "too far"),
        (np.zeros((4, 4, 4)), "has the shape"),
        (np.eye(4) * (1 + 0j), "real numbers"),
    ],
)
def test_what_is_no_pose_is_refused(tf, sentence):
    a = ab.DeformableMesh(*meshes.ball(0))
    with pytest.raises((ValueError, TypeError), match=sentence):
        ab.distance(a, a, tf2=tf)


def test_other_objects_are_refused():
    a = ab.DeformableMesh(*meshes.ball(0))
    for pair in ((a, 1), (None, a), (ab.Sphere(1), 1), ("a", "b")):
        for query in (ab.distance, ab.collide):
            with pytest.raises(TypeError, match="two objects are needed, each a DeformableMesh or a Shape, not"):
                query(*pair)
