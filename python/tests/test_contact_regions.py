import meshes
import numpy as np
import pytest

import adaptive_bvh as ab


def pose(x, y, z):
    tf = np.eye(4)
    tf[:3, 3] = x, y, z
    return tf


@pytest.fixture
def ball():
    vertices, faces = meshes.ball(4)
    vertices = vertices / np.linalg.norm(vertices, axis=1)[:, None]
    return ab.DeformableMesh(vertices, faces)


def test_regions_of_balls_are_caps(ball):
    apart = 1.4
    found = ab.contact_regions(ball, ball, tf1=pose(0, 0, 3), tf2=pose(0, 0, 3 + apart))
    assert len(found) == 1
    volume = np.pi * (4 + apart) * (2 - apart) ** 2 / 12
    area = 2 * np.pi * (1 - apart / 2)
    np.testing.assert_allclose(found.volumes, volume, rtol=0.05)
    np.testing.assert_allclose(found.depths, 2 - apart, rtol=0.03)
    np.testing.assert_allclose(found.normals, [[0, 0, 1]], atol=0.01)
    for side in (found.first, found.second):
        np.testing.assert_allclose(side.areas, area, rtol=0.05)
        assert side.begins.tolist() == [0, len(side.triangles)]
        assert (np.diff(side.triangles) > 0).all()
    np.testing.assert_allclose(found.first.centroids[0, 2], 3.85, atol=0.02)
    np.testing.assert_allclose(found.second.centroids[0, 2], 3.55, atol=0.02)
    np.testing.assert_allclose(found.curve_points[:, 2], 3.7, atol=0.02)
    assert found.curve_begins.tolist() == [0, len(found.curve_points)]
    assert found.curve_regions.tolist() == [0]
    assert np.isin(found.curve_first, found.first.triangles).all()
    assert np.isin(found.curve_second, found.second.triangles).all()
    assert len(ab.contact_regions(ball, ball, tf2=pose(5, 0, 0))) == 0


def test_a_tracker_follows_a_region(ball):
    tracker = ab.ContactTracker()

    def step(z):
        return tracker.track(ab.contact_regions(ball, ball, tf2=pose(0, 0, z)))

    assert step(3) == []
    assert step(1.5) == [("born", 1, 1)]
    assert step(1.4) == [("persisting", 1, 1)]
    assert tracker.ids.tolist() == [1]
    assert step(3) == [("gone", 1, 1)]
    assert step(1.5) == [("born", 2, 2)]
    tracker.clear()
    assert step(1.5) == [("born", 3, 3)]


def test_open_meshes_are_refused(ball):
    open_mesh = ab.DeformableMesh(ball.vertices, ball.faces[1:])
    for pair in ((open_mesh, ball), (ball, open_mesh)):
        with pytest.raises(ValueError, match="the edge from vertex"):
            ab.contact_regions(*pair)


def test_flush_boxes_have_the_axis_as_normal_whichever_way_they_face():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    sides = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
    cube = ab.DeformableMesh(corners, np.array(sides))
    inside_out = ab.DeformableMesh(corners, np.array(sides)[:, ::-1])
    for first in (cube, inside_out):
        for x in (0.75, -0.75):
            found = ab.contact_regions(first, cube, tf2=pose(x, 0, 0))
            np.testing.assert_allclose(found.volumes, [0.25], rtol=1e-6)
            np.testing.assert_allclose(found.normals, [[np.sign(x), 0, 0]], atol=1e-6)
