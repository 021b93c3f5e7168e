"""Small meshes, and motions of them."""

import numpy as np


def sheet(n=4, size=2.0):
    """A grid of n x n squares in the plane z = 0, around the origin: vertices, faces."""
    line = np.linspace(-size / 2, size / 2, n + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    a = (i * (n + 1) + j).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return vertices, faces


def ball(levels=1, radius=1.0):
    """An octahedron, subdivided, with its corners on a sphere: closed, facing outside."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    vertices = [np.array(v, float) for v in vertices]
    for _ in range(levels):
        middles, finer = {}, []

        def middle(i, j):
            key = (min(i, j), max(i, j))
            if key not in middles:
                middles[key] = len(vertices)
                point = vertices[i] + vertices[j]
                vertices.append(point / np.linalg.norm(point))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return radius * np.array(vertices), np.array(faces)


def wave(vertices, time):
    """The vertices in a smooth motion."""
    x, y, z = vertices.T
    return np.stack(
        [
            x + 0.10 * np.sin(2 * y + time),
            y + 0.10 * np.cos(3 * z - time),
            z + 0.25 * np.sin(2 * x + time) * np.cos(y),
        ],
        axis=1,
    )


def rotation(rng):
    """A random rotation, (3, 3)."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def pose(rng, distance=0.0):
    """A random pose, (4, 4), so far from the origin."""
    away = rng.normal(size=3)
    result = np.eye(4)
    result[:3, :3] = rotation(rng)
    result[:3, 3] = distance * away / np.linalg.norm(away)
    return result


def placed(vertices, tf):
    """The vertices in the world."""
    return vertices if tf is None else vertices @ tf[:3, :3].T + tf[:3, 3]


def place(x, y, z):
    """A pose that moves, (4, 4)."""
    result = np.eye(4)
    result[:3, 3] = x, y, z
    return result
