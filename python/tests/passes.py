"""Bodies that pass each other in one interval, and their least distance by samples in NumPy."""

import math

import numpy as np
from brute_force import triangle_distances


def rod(radius=5.0, length=60.0):
    """Along z, its middle at the origin: vertices, faces."""
    vertices = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    faces = [[end, 2 + (i + end) % 4, 2 + (i + 1 - end) % 4] for end in (0, 1) for i in range(4)]
    return vertices * [radius, radius, length / 2], np.array(faces)


def post(width=8.0, height=120.0):
    """A flat one: vertices, faces."""
    vertices = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    return vertices * [width / 2, 1, height / 2], np.array([[0, 1, 2], [0, 2, 3]])


def turned(axis, angle):
    """A rotation matrix."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across


def sampled_least(positions, faces, other, samples=2000):
    """The least distance that samples find, of a mesh whose vertices are positions(t), (N, 3) at a
    time from 0 to 1, and another one: in equal steps of time, then around the least of these."""
    times = np.linspace(0, 1, samples + 1)
    for _ in range(3):
        vertices = np.array([positions(t) for t in times])
        all_faces = faces + len(vertices[0]) * np.arange(len(times))[:, None, None]
        distances = triangle_distances(vertices.reshape(-1, 3), all_faces.reshape(-1, 3), *other)
        of_times = distances.reshape(len(times), -1).min(axis=1)
        nearest = times[np.argmin(of_times)]
        step = times[1] - times[0]
        times = np.clip(np.linspace(nearest - step, nearest + step, 61), 0, 1)
    return of_times.min()


def random_pass(rng, turn=1.0, way=200.0):
    """A rod that goes past a post in one interval: its poses (R, t) before and after."""
    direction = rng.normal(size=3)
    direction *= way / np.linalg.norm(direction)
    side = np.cross(direction, rng.normal(size=3))
    middle = side / np.linalg.norm(side) * rng.uniform(10, 80)
    start = turned(rng.normal(size=3), rng.uniform(0, np.pi))
    end = turned(rng.normal(size=3), turn) @ start
    share = rng.uniform(0.2, 0.8)
    return (start, middle - share * direction), (end, middle + (1 - share) * direction)
