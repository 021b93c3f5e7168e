"""Clearance over a whole motion, against distances at many times."""

import meshes
import numpy as np
import pytest

import adaptive_bvh as ab


def moved(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def turned(angle, x, y, z):
    pose = moved(x, y, z)
    c, s = np.cos(angle), np.sin(angle)
    pose[:2, :2] = [[c, -s], [s, c]]
    return pose


def test_a_pass_between_two_frames():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    other = ab.DeformableMesh(vertices, faces)
    motion = ab.Motion.rigid(ball, moved(-5, 2.5, 0), moved(5, 2.5, 0))
    least = ab.least_distance(motion, other, 1e-5)
    assert least.lower <= least.upper <= least.lower + 1.0001e-5
    assert not least.meets
    sampled = min(
        ab.distance(ball, other, tf1=moved(-5 + 10 * t, 2.5, 0)).distance
        for t in np.linspace(0, 1, 201)
    )
    assert least.lower <= sampled
    there = ab.distance(ball, other, tf1=moved(-5 + 10 * least.time, 2.5, 0)).distance
    assert there == pytest.approx(least.upper, abs=1e-9)
    assert least.elements.shape == (2,)
    gap = np.linalg.norm(least.points[0] - least.points[1])
    assert gap == pytest.approx(least.upper, abs=1e-9)

    times = ab.intervals_below(motion, other, 1.0, 1e-4)
    assert times.shape == (1, 2)
    for t in np.linspace(0, 1, 101):
        d = ab.distance(ball, other, tf1=moved(-5 + 10 * t, 2.5, 0)).distance
        inside = times[0, 0] <= t <= times[0, 1]
        assert d <= 1.0001 if inside else d >= 1.0 - 1e-9


def test_a_mesh_that_deforms_and_shapes():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    motion = ab.Motion(ball, vertices, 1.5 * np.asarray(vertices))
    floor = ab.Motion.rigid(ab.Halfspace((0, 0, 1), -2))
    least = ab.least_distance(motion, floor, 1e-6)
    assert least.upper == pytest.approx(2 - 1.5 * np.max(-np.asarray(vertices)[:, 2]), abs=2e-6)
    assert least.time == pytest.approx(1, abs=1e-6)
    assert least.elements[1] == -1
    post = ab.Motion.rigid(ab.Sphere(0.5), moved(3, 0, 0), moved(0, 0, 0))
    meets = ab.least_distance(motion, post, 1e-6)
    assert meets.meets and meets.lower == meets.upper == 0
    assert 0 < meets.time < 1
    bar = ab.Motion.rigid(ab.Box(4, 0.1, 0.1), moved(0, 3, 0), turned(1, 0, 3, 0), path="screw")
    assert ab.least_distance(bar, ab.Motion(ball, vertices, vertices), 1e-4).upper > 0.1


def test_a_mesh_with_itself():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    near = ab.SurfaceNeighbourhood.by_distance(ball, 2.0)
    assert near.contains(0, 0)
    rings = ab.SurfaceNeighbourhood.by_rings(ball, 2)
    labels = ab.SurfaceNeighbourhood.by_labels(ball, np.arange(len(faces)) % 2, "between")
    assert labels.contains(0, 2) and rings.contains(0, 0)
    still = ab.self_least_distance(ball, near, 1e-4)
    flat = np.array(vertices)
    flat[:, 2] *= 0.1
    over = ab.self_least_distance(ab.Motion(ball, vertices, flat), near, 1e-4)
    assert over.upper < still.upper
    times = ab.self_intervals_below(ab.Motion(ball, vertices, flat), near, over.upper + 0.01, 1e-3)
    assert times.shape[1] == 2 and len(times) >= 1
    without = ab.self_least_distance(
        ball, ab.Ignored([still.elements], surface=near), 1e-4)
    assert without.elements.tolist() != still.elements.tolist()


def test_a_scene():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    scene = ab.Scene()
    first = scene.add(ball)
    second = scene.add(ab.Sphere(0.5), moved(0, 4, 0))
    third = scene.add(ball, moved(-6, 2.2, 0))
    scene.begin_step()
    scene.set_transform(third, moved(6, 2.2, 0))
    scene.update()
    least = scene.least_distance(first, 1e-4)
    assert least.bodies == (first, third)
    assert 0.1 < least.clearance.upper < 0.4
    two = scene.least_distances(first, 2, 1e-4)
    assert [d.bodies[1] for d in two] == [third, second]
    ((a, b, times),) = scene.intervals_below(0.5, 1e-3, path="screw")[:1]
    assert (a, b) == (first, third) and times.shape[1] == 2


def test_what_is_refused():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    with pytest.raises(ValueError):
        ab.least_distance(ball, ball, 0)
    with pytest.raises(ValueError):
        ab.Motion.rigid(ball, path="bent")
    with pytest.raises(TypeError):
        ab.Motion.rigid("ball")
    with pytest.raises(ValueError):
        ab.Motion(ball, vertices, vertices, path="bent")
    with pytest.raises(ValueError):
        ab.SurfaceNeighbourhood.by_distance(ball, -1)
    other = ab.DeformableMesh(vertices, faces)
    with pytest.raises(ValueError):
        ab.self_least_distance(other, ab.SurfaceNeighbourhood(ball), 1e-3)


def test_one_motion_for_all_queries():
    vertices, faces = meshes.ball(2)
    ball = ab.DeformableMesh(vertices, faces)
    rigid = ab.Motion.rigid(ball, moved(0, 0, 3), moved(0, 0, 1))
    still = ab.Motion.rigid(ball)
    assert ab.earliest_impact(rigid, still).exists
    ball.update(0.25 * np.asarray(vertices))
    assert not ab.earliest_impact(rigid, still).exists  # of the present positions
    assert ab.least_distance(ab.Sphere(0.5), ball, 1e-3).meets  # both stand still
    shape = ab.Motion.rigid(ab.Sphere(0.5))
    screw = ab.Motion(ball, vertices, vertices, path="screw")
    for bad in (shape, screw):
        for call in (ab.candidates, ab.earliest_impact, ab.truncate_motion):
            with pytest.raises(ValueError):
                call(bad, still)
            with pytest.raises(ValueError):
                call(still, bad)
        with pytest.raises(ValueError):
            ab.self_earliest_impact(bad)
    with pytest.raises(ValueError, match="shape"):
        ab.time_of_impact(shape, still, "vertex-face", (0, 0))
