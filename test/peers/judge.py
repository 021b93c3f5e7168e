"""The third judge: brute force in rationals and in extended precision.

It shares no code with any peer. Every input is a double, so that rationals hold it exactly. Squared
distances, touching pairs and hits of rays are exact; winding numbers are sums in extended precision
(64 bits of mantissa or more).
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

Vector = tuple[Fraction, Fraction, Fraction]
ZERO, ONE = Fraction(0), Fraction(1)


def rational(point) -> Vector:
    return tuple(Fraction(float(x)) for x in point)


def sub(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def along(a: Vector, direction: Vector, t: Fraction) -> Vector:
    return a[0] + t * direction[0], a[1] + t * direction[1], a[2] + t * direction[2]


def squared(a: Vector, b: Vector) -> Fraction:
    d = sub(a, b)
    return dot(d, d)


def clamp(t: Fraction) -> Fraction:
    return min(max(t, ZERO), ONE)


def root(value: Fraction) -> float:
    """Returns the square root, rounded once from 200 bits."""
    if value <= 0:
        return 0.0
    shift = max(0, 200 - (value.numerator.bit_length() - value.denominator.bit_length()) // 2)
    scaled = math.isqrt((value.numerator << (2 * shift)) // value.denominator)
    return float(Fraction(scaled, 1 << shift))


def point_segment(p: Vector, a: Vector, b: Vector) -> Fraction:
    """Squared distance of a point and a segment, which may be a point."""
    ab = sub(b, a)
    length = dot(ab, ab)
    t = clamp(dot(sub(p, a), ab) / length) if length else ZERO
    return squared(p, along(a, ab, t))


def point_triangle(p: Vector, triangle: list[Vector]) -> Fraction:
    """Squared distance of a point and a triangle, which may be a segment or a point."""
    a, b, c = triangle
    edges = [(a, b), (b, c), (c, a)]
    n = cross(sub(b, a), sub(c, a))
    if any(n) and all(dot(cross(sub(y, x), sub(p, x)), n) >= 0 for x, y in edges):
        return dot(sub(p, a), n) ** 2 / dot(n, n)
    return min(point_segment(p, x, y) for x, y in edges)


def segment_segment(a: Vector, b: Vector, c: Vector, d: Vector) -> Fraction:
    """Squared distance of two segments: of an inner pair of points, or of an end and a segment."""
    least = min(
        point_segment(a, c, d),
        point_segment(b, c, d),
        point_segment(c, a, b),
        point_segment(d, a, b),
    )
    u, v, w = sub(b, a), sub(d, c), sub(a, c)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    determinant = uu * vv - uv * uv
    if determinant:
        s, t = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
        if 0 <= s <= 1 and 0 <= t <= 1:
            least = min(least, squared(along(a, u, s), along(c, v, t)))
    return least


def pierces(a: Vector, b: Vector, triangle: list[Vector]) -> bool:
    """Whether a segment that is not parallel to the triangle's plane meets the closed triangle."""
    x, y, z = triangle
    n = cross(sub(y, x), sub(z, x))
    towards = dot(sub(b, a), n)
    if not towards:
        return False
    t = dot(sub(x, a), n) / towards
    if not 0 <= t <= 1:
        return False
    p = along(a, sub(b, a), t)
    return all(dot(cross(sub(j, i), sub(p, i)), n) >= 0 for i, j in [(x, y), (y, z), (z, x)])


def triangle_triangle(one: list[Vector], two: list[Vector]) -> Fraction:
    """Squared distance of two triangles; 0 exactly if they have a common point."""
    edges = [[(t[i], t[(i + 1) % 3]) for i in range(3)] for t in (one, two)]
    if any(pierces(*e, two) for e in edges[0]) or any(pierces(*e, one) for e in edges[1]):
        return ZERO
    least = min(point_triangle(p, two) for p in one)
    least = min(least, min(point_triangle(p, one) for p in two))
    return min(least, min(segment_segment(*e, *f) for e in edges[0] for f in edges[1]))


def triangles(positions: np.ndarray, faces: np.ndarray) -> list[list[Vector]]:
    """Triangles of a mesh, (F, 3, 3) as rationals."""
    points = [rational(p) for p in positions]
    return [[points[i] for i in face] for face in faces]


def ray_time(origin: Vector, direction: Vector, triangle: list[Vector]) -> Fraction | None:
    """t >= 0 of the first common point of a ray and a closed triangle, or None.

    A ray in the plane of a triangle meets its edges or starts in it.
    """
    a, b, c = triangle
    n = cross(sub(b, a), sub(c, a))
    towards = dot(direction, n)
    edges = [(a, b), (b, c), (c, a)]
    if towards:
        t = dot(sub(a, origin), n) / towards
        p = along(origin, direction, t)
        inside = all(dot(cross(sub(y, x), sub(p, x)), n) >= 0 for x, y in edges)
        return t if t >= 0 and inside else None
    if point_triangle(origin, triangle) == 0:
        return ZERO
    times = [t for x, y in edges if (t := _ray_segment(origin, direction, x, y)) is not None]
    return min(times, default=None)


def _ray_segment(o: Vector, d: Vector, a: Vector, b: Vector) -> Fraction | None:
    """t of the first common point of a ray and a segment that lie in one plane."""
    u, w = sub(b, a), sub(a, o)
    n = cross(d, u)
    if dot(n, w):
        return None
    if any(n):
        nn = dot(n, n)
        t, s = dot(cross(w, u), n) / nn, dot(cross(w, d), n) / nn
        return t if t >= 0 and 0 <= s <= 1 else None
    if any(cross(w, d)):
        return None
    times = [dot(sub(x, o), d) / dot(d, d) for x in (a, b)]
    return min((t for t in times if t >= 0), default=None)


def winding_number(positions: np.ndarray, faces: np.ndarray, point: np.ndarray) -> float:
    """Generalised winding number by solid angles, in extended precision."""
    x = positions.astype(np.longdouble)[faces] - np.asarray(point, np.longdouble)
    a, b, c = x[:, 0], x[:, 1], x[:, 2]
    la, lb, lc = (np.sqrt((v * v).sum(1)) for v in (a, b, c))
    top = (a * np.cross(b, c)).sum(1)
    low = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    pi = np.arctan2(np.longdouble(0), np.longdouble(-1))
    return float(np.arctan2(top, low).sum() / (2 * pi))


def answer(question: str, work, entry: int | None = None) -> np.ndarray:
    """The true answer of a work of one frame: (N,), (1,) or pairs (K, 2).

    entry: only this point or ray; the array then has one number.
    """
    frame = work.frames[0]
    chosen = slice(None) if entry is None else slice(entry, entry + 1)
    if question == "winding numbers":
        return np.array([winding_number(frame.first, work.faces, p) for p in work.points[chosen]])
    first = triangles(frame.first, work.faces)
    if question == "closest points":
        points = [rational(p) for p in work.points[chosen]]
        return np.array([root(min(point_triangle(p, t) for t in first)) for p in points])
    if question == "first hits":
        rays = zip(work.origins[chosen], work.directions[chosen])
        return np.array([_first(rational(o), rational(d), first) for o, d in rays])
    second = triangles(frame.second, work.other_faces)
    if question == "distance":
        return np.array([root(min(triangle_triangle(s, t) for s in first for t in second))])
    return np.array(
        [
            (i, j)
            for i, s in enumerate(first)
            for j, t in enumerate(second)
            if triangle_triangle(s, t) == 0
        ]
    ).reshape(-1, 2)


def _first(origin: Vector, direction: Vector, mesh: list[list[Vector]]) -> float:
    times = [t for x in mesh if (t := ray_time(origin, direction, x)) is not None]
    return float(min(times)) if times else math.inf


def hits_near(work, entry: int, shift: float) -> list[float]:
    """t of the first hit of a ray, of eight parallel rays that are `shift` beside it, and of edges
    that it passes within `shift`: sharp corners may lie between the nine rays.

    An answer between the least and the largest of them has an error of the ray of at most `shift`.
    """
    mesh = triangles(work.frames[0].first, work.faces)
    origin, d = work.origins[entry], work.directions[entry]
    side = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
    side /= np.linalg.norm(side)
    up = np.cross(d, side) / np.linalg.norm(d)
    turns = np.arange(8) * np.pi / 4
    beside = [shift * (np.cos(t) * side + np.sin(t) * up) for t in turns] if shift else []
    start = rational(origin)
    starts = [start] + [tuple(a + b for a, b in zip(start, rational(x))) for x in beside]
    found = [_first(o, rational(d), mesh) for o in starts]
    return found + _passed(work, origin, d, shift) if shift else found


def _passed(work, origin: np.ndarray, d: np.ndarray, shift: float) -> list[float]:
    """t >= 0 at which a ray is nearest to each edge that it passes within `shift`; in doubles."""
    corners = work.frames[0].first[work.faces]
    a = corners.reshape(-1, 3)
    u, w = np.roll(corners, -1, 1).reshape(-1, 3) - a, a - origin
    dd, du, uu, dw, uw = d @ d, u @ d, (u * u).sum(1), w @ d, (u * w).sum(1)
    determinant = dd * uu - du * du
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.where(determinant > 0, (du * dw - dd * uw) / determinant, 0.0)
    times = []
    for s in (np.clip(s, 0, 1), np.zeros(len(a)), np.ones(len(a))):
        t = np.maximum((dw + s * du) / dd, 0)
        apart = np.linalg.norm(w + s[:, None] * u - t[:, None] * d, axis=1)
        times += t[apart <= 2 * shift].tolist()
    return times


def touch(work, pair) -> bool:
    """Whether two triangles of the two meshes have a common point."""
    frame = work.frames[0]
    one = [rational(frame.first[i]) for i in work.faces[pair[0]]]
    two = [rational(frame.second[i]) for i in work.other_faces[pair[1]]]
    return triangle_triangle(one, two) == 0
