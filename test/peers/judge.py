"""The third judge: brute force in whole numbers; winding numbers in extended precision.

It shares no code with any peer. A power of two makes all coordinates of a work whole, and Python's
integers have no limit. So squared distances, touching pairs and hits of rays are exact.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

Point = tuple[int, int, int]
Triangle = list[Point]
Square = Fraction | int


def whole(*arrays: np.ndarray) -> tuple[list[list[Point]], int]:
    """Returns arrays (N, 3), times the least power of two that makes all whole; and this power."""
    ratios = [[[x.as_integer_ratio() for x in p] for p in a.tolist()] for a in arrays]
    unit = max(d for a in ratios for p in a for _, d in p)
    return [[tuple(n * (unit // d) for n, d in p) for p in a] for a in ratios], unit


def triangles(points: list[Point], faces: np.ndarray) -> list[Triangle]:
    return [[points[i] for i in face] for face in faces.tolist()]


def edges(triangle: Triangle) -> list[tuple[Point, Point]]:
    a, b, c = triangle
    return [(a, b), (b, c), (c, a)]


def sub(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a: Point, b: Point) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def normal(triangle: Triangle) -> Point:
    a, b, c = triangle
    return cross(sub(b, a), sub(c, a))


def root(square: Square, unit: int) -> float:
    """Returns the square root as a length, rounded once from 200 bits."""
    if not square:
        return 0.0
    value = Fraction(square) / unit**2
    shift = max(0, 200 - (value.numerator.bit_length() - value.denominator.bit_length()) // 2)
    scaled = math.isqrt((value.numerator << (2 * shift)) // value.denominator)
    return float(Fraction(scaled, 1 << shift))


def point_segment(p: Point, a: Point, b: Point) -> Square:
    """Squared distance of a point and a segment, which may be a point."""
    ab, ap, bp = sub(b, a), sub(p, a), sub(p, b)
    t, length = dot(ap, ab), dot(ab, ab)
    if t <= 0:
        return dot(ap, ap)
    if t >= length:
        return dot(bp, bp)
    return Fraction(dot(ap, ap) * length - t * t, length)


def point_triangle(p: Point, triangle: Triangle) -> Square:
    """Squared distance of a point and a triangle, which may be a segment or a point."""
    n = normal(triangle)
    if any(n) and all(dot(cross(sub(y, x), sub(p, x)), n) >= 0 for x, y in edges(triangle)):
        return Fraction(dot(sub(p, triangle[0]), n) ** 2, dot(n, n))
    return min(point_segment(p, x, y) for x, y in edges(triangle))


def inner_distance(a: Point, b: Point, c: Point, d: Point) -> Square | None:
    """Squared distance of two lines, if their nearest points are one pair, within both segments."""
    u, v, w = sub(b, a), sub(d, c), sub(a, c)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    determinant = uu * vv - uv * uv
    if not determinant:
        return None
    s, t = uv * vw - vv * uw, uu * vw - uv * uw
    if not (0 <= s <= determinant and 0 <= t <= determinant):
        return None
    return Fraction(dot(cross(u, v), w) ** 2, determinant)


def passes(origin: Point, direction: Point, triangle: Triangle, towards: int) -> bool:
    """Whether a line meets a closed triangle: towards = direction * normal, not 0.

    The three volumes over edges are the barycentric coordinates, times `towards`.
    """
    corners = [sub(x, origin) for x in triangle]
    return all(dot(direction, cross(x, y)) * towards >= 0 for x, y in edges(corners))


def pierces(a: Point, b: Point, triangle: Triangle) -> bool:
    """Whether a segment that is not parallel to the triangle's plane meets the closed triangle."""
    n = normal(triangle)
    above, below = dot(sub(a, triangle[0]), n), dot(sub(b, triangle[0]), n)
    if above == below or above * below > 0:
        return False
    return passes(a, sub(b, a), triangle, below - above)


def triangle_triangle(one: Triangle, two: Triangle) -> Square:
    """Squared distance of two triangles; 0 exactly if they have a common point."""
    if any(pierces(*e, two) for e in edges(one)) or any(pierces(*e, one) for e in edges(two)):
        return 0
    found = [point_triangle(p, two) for p in one] + [point_triangle(p, one) for p in two]
    between = (inner_distance(*e, *f) for e in edges(one) for f in edges(two))
    return min(found + [d for d in between if d is not None])


def ray_time(
    origin: Point, direction: Point, triangle: Triangle, in_plane: bool
) -> Square | None:
    """t >= 0 of the first common point of a ray and a closed triangle, or None.

    A ray in the plane of a triangle, which meets its edges or starts in it, counts if `in_plane`.
    """
    n = normal(triangle)
    towards = dot(direction, n)
    if towards:
        t = Fraction(dot(sub(triangle[0], origin), n), towards)
        return t if t >= 0 and passes(origin, direction, triangle, towards) else None
    if not in_plane:
        return None
    if point_triangle(origin, triangle) == 0:
        return 0
    times = [_ray_segment(origin, direction, *edge) for edge in edges(triangle)]
    return min((t for t in times if t is not None), default=None)


def _ray_segment(o: Point, d: Point, a: Point, b: Point) -> Square | None:
    """t of the first common point of a ray and a segment that lie in one plane."""
    u, w = sub(b, a), sub(a, o)
    n = cross(d, u)
    if dot(n, w):
        return None
    if any(n):
        nn, t, s = dot(n, n), dot(cross(w, u), n), dot(cross(w, d), n)
        return Fraction(t, nn) if t >= 0 and 0 <= s <= nn else None
    if any(cross(w, d)):
        return None
    times = [Fraction(dot(sub(x, o), d), dot(d, d)) for x in (a, b)]
    return min((t for t in times if t >= 0), default=None)


def winding_number(positions: np.ndarray, faces: np.ndarray, point: np.ndarray) -> float:
    """Generalised winding number by solid angles, in extended precision (64 bits or more).

    With unit vectors a, b, c to the corners, the two arguments of the arc tangent have the norm
    sqrt(2 (1 + ab) (1 + bc) (1 + ca)); 1 + ab is small where the point is near the edge, at most
    two of the three are. A point that is farther from the surface than 1e-5 of the edges' lengths
    has a norm above 1e-10, so that an angle is wrong by less than 100 * 2^-64 / 1e-10 < 1e-7.
    """
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
    if question == "closest points":
        (mesh, points), unit = whole(frame.first, work.points[chosen])
        first = triangles(mesh, work.faces)
        return np.array([root(min(point_triangle(p, t) for t in first), unit) for p in points])
    if question == "first hits":
        origins, directions = work.origins[chosen], work.directions[chosen]
        (mesh, origins, directions), _ = whole(frame.first, origins, directions)
        first = triangles(mesh, work.faces)
        return np.array([_first_hit(o, d, first) for o, d in zip(origins, directions)])
    (mesh, other), unit = whole(frame.first, frame.second)
    first, second = triangles(mesh, work.faces), triangles(other, work.other_faces)
    if question == "distance":
        return np.array([root(_distance(first, second), unit)])
    near = [(i, j) for gap, i, j in _gaps(first, second) if gap == 0]
    return np.array([(i, j) for i, j in near if _touch(first[i], second[j])]).reshape(-1, 2)


def _touch(one: Triangle, two: Triangle) -> bool:
    """Whether no axis separates two triangles: of normals, or in their common plane.

    Those are the normals of the facets of the set of differences of two points, one of each.
    """
    n, m = normal(one), normal(two)
    if not any(n) or not any(m):
        return triangle_triangle(one, two) == 0
    if _is_between(n, one, two) or _is_between(m, one, two):
        return False
    sides, others = ([sub(y, x) for x, y in edges(t)] for t in (one, two))
    if any(cross(n, m)):
        axes = (cross(u, v) for u in sides for v in others)
    else:
        axes = (cross(n, u) for u in sides + others)
    return not any(_is_between(axis, one, two) for axis in axes)


def _is_between(axis: Point, one: Triangle, two: Triangle) -> bool:
    """Whether the triangles are apart along an axis."""
    a, b = ([dot(axis, p) for p in t] for t in (one, two))
    return max(a) < min(b) or max(b) < min(a)


def _distance(first: list[Triangle], second: list[Triangle]) -> Square:
    """Least squared distance: pairs whose boxes are nearest come first, until boxes are farther."""
    least: Square | None = None
    for gap, i, j in sorted(_gaps(first, second)):
        if least is not None and gap >= least:
            break
        found = triangle_triangle(first[i], second[j])
        least = found if least is None else min(least, found)
    assert least is not None
    return least


def _gaps(first: list[Triangle], second: list[Triangle]) -> list[tuple[int, int, int]]:
    """Squared distance of the boxes of each pair of triangles, and the pair."""
    boxes = [[[(min(x), max(x)) for x in zip(*t)] for t in mesh] for mesh in (first, second)]
    return [(_gap(a, b), i, j) for i, a in enumerate(boxes[0]) for j, b in enumerate(boxes[1])]


def _gap(a: list[tuple[int, int]], b: list[tuple[int, int]]) -> int:
    """Squared distance of two boxes."""
    return sum(max(0, x[0] - y[1], y[0] - x[1]) ** 2 for x, y in zip(a, b))


def _hits(
    o: Point, d: Point, mesh: list[Triangle], in_plane: bool = False
) -> list[tuple[Square, int]]:
    """t of the hits of a ray, each with the number of its triangle."""
    times = [(ray_time(o, d, triangle, in_plane), k) for k, triangle in enumerate(mesh)]
    return [(t, k) for t, k in times if t is not None]


def _first_hit(o: Point, d: Point, mesh: list[Triangle], in_plane: bool = False) -> float:
    hits = _hits(o, d, mesh, in_plane)
    return float(min(hits)[0]) if hits else math.inf


def hits_near(work, entry: int, shift: float) -> list[float]:
    """t of the first hit of a ray, of eight parallel rays that are `shift` beside it, and of edges
    that it passes within twice of `shift`: sharp corners may lie between the nine rays. Also of
    the planes of triangles that the nine hit, and of the ray if triangles count in whose plane it
    lies: libraries differ in that.

    An answer between the least and the largest of them has an error of the ray of at most `shift`.
    """
    origin, d = work.origins[entry], work.directions[entry]
    side = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
    side /= np.linalg.norm(side)
    up = np.cross(d, side) / np.linalg.norm(d)
    turns = np.arange(8) * np.pi / 4
    beside = [shift * (np.cos(t) * side + np.sin(t) * up) for t in turns]
    starts = np.array([origin] + [origin + x for x in beside])
    positions = work.frames[0].first
    (points, starts, (direction,)), _ = whole(positions, starts, d[None])
    mesh = triangles(points, work.faces)
    hits = [_hits(o, direction, mesh) for o in starts]
    found = [float(min(h)[0]) if h else math.inf for h in hits]
    for k in {min(h)[1] for h in hits if h}:
        n = normal(mesh[k])
        t = Fraction(dot(sub(mesh[k][0], starts[0]), n), dot(direction, n))
        found.append(max(0.0, float(t)))
    found.append(_first_hit(starts[0], direction, mesh, in_plane=True))
    return found + _passed(work, origin, d, 2 * shift)


def _passed(work, origin: np.ndarray, d: np.ndarray, shift: float) -> list[float]:
    """t >= 0 between which edges are within `shift` of a ray, two for each edge; in doubles."""
    corners = work.frames[0].first[work.faces]
    a = corners.reshape(-1, 3) - origin
    u = np.roll(corners, -1, 1).reshape(-1, 3) - origin - a
    # Parts across the ray: |a + s u| = shift there.
    unit = d / np.linalg.norm(d)
    flat_a, flat_u = a - np.outer(a @ unit, unit), u - np.outer(u @ unit, unit)
    aa, au, uu = ((x * y).sum(1) for x, y in ((flat_a, flat_a), (flat_a, flat_u), (flat_u, flat_u)))
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = np.where(uu > 0, -au / uu, 0.0)
        least = np.maximum(aa + middle * au, 0.0)
        half = np.where(uu > 0, np.sqrt(np.maximum(shift**2 - least, 0.0) / uu), 1.0)
    low, high = np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
    near = (least <= shift**2) & (middle + half >= 0) & (middle - half <= 1)
    times = [(a + s[:, None] * u)[near] @ d / (d @ d) for s in (low, high)]
    return np.maximum(np.concatenate(times), 0.0).tolist()
