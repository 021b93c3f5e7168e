"""Small inputs for the differential tests, by number.

The same number makes the same input in every process. All coordinates are single-precision numbers,
so that peers in single precision get the same input.
"""

from __future__ import annotations

import numpy as np

import scenes
from scenes import Frame, Work

FAMILIES = [
    "random",
    "lattice",
    "needles",
    "coplanar",
    "tilted plane",
    "far",
    "closed",
    "open",
    "near",
]


def _single(x: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(x.astype(np.float32).astype(np.float64))


def _soup(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mesh of (F, 3, 3) corners without common vertices; triangles without area are left out."""
    corners = _single(corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[np.abs(normal).max(1) > 0]
    return corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)


def _random(random, count: int):
    return _soup(random.uniform(-1, 1, (count, 1, 3)) + random.normal(size=(count, 3, 3)) * 0.4)


def _lattice(random, count: int):
    return _soup(random.integers(-3, 4, (count, 3, 3)).astype(float))


def _needles(random, count: int):
    corners = random.uniform(-1, 1, (count, 3, 3))
    thin = 10.0 ** random.uniform(-6, -2, (count, 1))
    corners[:, 2] = corners[:, 1] + thin * random.normal(size=(count, 3))
    return _soup(corners)


def _coplanar(random, count: int):
    corners = random.integers(-4, 5, (count, 3, 3)).astype(float)
    corners[:, :, 2] = 0.0
    return _soup(corners)


def _tilted(random, count: int):
    """In the plane x + y + z = 0, with integers."""
    corners = random.integers(-4, 5, (count, 3, 3)).astype(float)
    corners[:, :, 2] = -corners[:, :, 0] - corners[:, :, 1]
    return _soup(corners)


def _far(random, count: int):
    points, faces = _random(random, count)
    return _single(points + np.array([4096.0, -2048.0, 1024.0])), faces


def _closed(random, count: int):
    points, faces = scenes.sphere(max(3, count // 4), 2)
    stretch = random.uniform(0.4, 1.0, 3)
    bumps = 1 + 0.2 * random.uniform(-1, 1, (len(points), 1))
    return _single(points * stretch * bumps + random.uniform(-0.9, 0.9, 3)), faces


def _open(random, count: int):
    uv, faces = scenes.grid(max(1, round(np.sqrt(count / 2))))
    z = random.uniform(-0.3, 0.3, len(uv))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    points = np.stack([2 * uv[:, 0] - 1, 2 * uv[:, 1] - 1, z], 1) @ turn
    return _single(points + random.uniform(-0.7, 0.7, 3)), faces


_MAKERS = dict(
    zip(FAMILIES, [_random, _lattice, _needles, _coplanar, _tilted, _far, _closed, _open])
)


def _near(random, count: int):
    """Two parallel layers whose distance is from 1e-6 to 1e-2."""
    points, faces = _open(random, count)
    gap = 10.0 ** random.uniform(-6, -2)
    normal = np.cross(*(points[faces[0][i]] - points[faces[0][0]] for i in (1, 2)))
    return points, faces, _single(points + gap * normal / np.linalg.norm(normal))


def make(question: str, number: int) -> tuple[str, Work]:
    """Returns the family and the work of case `number`."""
    family = FAMILIES[number % len(FAMILIES)]
    random = np.random.default_rng([number, len(question)])
    count = int(random.integers(1, 17))
    if family == "near":
        first, faces, second = _near(random, count)
        other = faces
    else:
        first, faces = _MAKERS[family](random, count)
        second, other = _MAKERS[family](random, int(random.integers(1, 17)))
    if not len(faces) or not len(other):
        first, faces = second, other = _random(random, 2)
    work = Work(family, count, [Frame(first=first, second=second)], faces, other)
    _add_queries(work, family, random)
    return family, work


def _add_queries(work: Work, family: str, random) -> None:
    """Eight points and rays: at random, into faces, on a lattice.

    Of closed meshes half of the rays go through vertices and edges: there none may pass.
    """
    first = work.frames[0].first
    centre = first.mean(0)
    points = centre + random.uniform(-1.5, 1.5, (8, 3))
    weights = random.dirichlet([1, 1, 1], 6)
    if family == "closed":
        weights[:4] = [[1, 0, 0], [0, 1, 0], [0.5, 0.5, 0], [0, 0.25, 0.75]]
    corners = first[work.faces[random.integers(0, len(work.faces), 6)]]
    targets = np.concatenate([(weights[:, :, None] * corners).sum(1), points[:2]])
    if family in ("lattice", "coplanar", "tilted plane"):
        points = random.integers(-5, 6, (8, 3)).astype(float)
        targets = random.integers(-3, 4, (8, 3)).astype(float)
    origins = centre + random.uniform(-4, 4, (8, 3))
    if family in ("lattice", "coplanar", "tilted plane"):
        origins = random.integers(-6, 7, (8, 3)).astype(float)
    work.points, work.origins = _single(points), _single(origins)
    directions = _single(targets) - work.origins
    directions[np.abs(directions).max(1) == 0] = [0, 0, 1]
    work.directions = _single(directions)
