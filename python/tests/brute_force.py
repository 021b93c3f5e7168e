"""What the module computes, over all pairs of triangles, in NumPy."""

import numpy as np


def dot(a, b):
    return np.sum(a * b, axis=-1)


def ratio(a, b):
    """a / b, 0 where b is 0."""
    return np.where(b == 0, 0.0, a / np.where(b == 0, 1.0, b))


def segments(p, q, r, s):
    """Distances of the segments pq and rs, by the least of a quadratic on the unit square."""
    u, v, w = q - p, s - r, p - r
    a, b, c, d, e = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    inner = np.clip(ratio(b * e - c * d, a * c - b * b), 0, 1)
    best = np.inf
    # Once from the first segment and once from each end of it: parallel ones are no exception.
    for start in (inner, np.zeros_like(inner), np.ones_like(inner)):
        t = np.clip(ratio(b * start + e, c), 0, 1)
        x = np.clip(ratio(b * t - d, a), 0, 1)
        gap = w + x[..., None] * u - t[..., None] * v
        best = np.minimum(best, dot(gap, gap))
    return np.sqrt(best)


def points_to_triangles(p, a, b, c):
    """Distances of points to triangles, broadcast."""
    normal = np.cross(b - a, c - a)
    inside = np.ones(np.broadcast(p[..., 0], a[..., 0]).shape, bool)
    for x, y in ((a, b), (b, c), (c, a)):
        inside &= dot(np.cross(y - x, p - x), normal) >= 0
    area = np.sqrt(dot(normal, normal))
    plane = np.abs(ratio(dot(p - a, normal), area))
    sides = np.min([segments(p, p, x, y) for x, y in ((a, b), (b, c), (c, a))], axis=0)
    return np.where(inside & (area > 0), plane, sides)


def crosses(p, q, a, b, c):
    """Whether the segments pq go through the triangles."""
    normal = np.cross(b - a, c - a)
    from_p, from_q = dot(p - a, normal), dot(q - a, normal)
    along = ratio(from_p, from_p - from_q)
    hit = p + along[..., None] * (q - p)
    inside = from_p * from_q < 0
    for x, y in ((a, b), (b, c), (c, a)):
        inside &= dot(np.cross(y - x, hit - x), normal) >= 0
    return inside


def triangle_distances(vertices1, faces1, vertices2, faces2):
    """(M1, M2) distances, 0 where triangles intersect."""
    first, second = vertices1[faces1][:, None], vertices2[faces2][None]
    corners1, corners2 = np.moveaxis(first, 2, 0), np.moveaxis(second, 2, 0)
    shape = (len(faces1), len(faces2), 3)
    corners1 = [np.broadcast_to(c, shape) for c in corners1]
    corners2 = [np.broadcast_to(c, shape) for c in corners2]
    best = np.full(shape[:2], np.inf)
    for i in range(3):
        p, q = corners1[i], corners1[(i + 1) % 3]
        for j in range(3):
            r, s = corners2[j], corners2[(j + 1) % 3]
            best = np.minimum(best, segments(p, q, r, s))
        best = np.minimum(best, points_to_triangles(p, *corners2))
        best = np.minimum(best, points_to_triangles(corners2[i], *corners1))
        best = np.where(crosses(p, q, *corners2), 0, best)
        best = np.where(crosses(corners2[i], corners2[(i + 1) % 3], *corners1), 0, best)
    return best


def surface_distances(points, vertices, faces):
    """(N, M) distances of points to triangles."""
    corners = np.moveaxis(vertices[faces], 1, 0)
    return points_to_triangles(points[:, None], *(c[None] for c in corners))


def pair_set(pairs):
    return {(int(a), int(b)) for a, b in pairs}


def no_shared_vertices(faces):
    """(M, M): whether two triangles have no vertex in common."""
    return ~np.any(faces[:, None, :, None] == faces[None, :, None, :], axis=(2, 3))


def ray_hits(origin, direction, vertices, faces):
    """t of each triangle along a ray, infinite where it is missed."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    matrix = np.stack([np.broadcast_to(-direction, a.shape), b - a, c - a], axis=2)
    t, u, v = np.linalg.solve(matrix, (origin - a)[..., None])[..., 0].T
    return np.where((t >= 0) & (u >= 0) & (v >= 0) & (u + v <= 1), t, np.inf)


def winding_numbers(points, vertices, faces):
    """How often the triangles wind around each point (van Oosterom and Strackee 1983)."""
    a, b, c = np.moveaxis(vertices[faces][None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    top = dot(a, np.cross(b, c))
    bottom = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.arctan2(top, bottom).sum(axis=1) / (2 * np.pi)


def owned_edges(faces):
    """Numbers 3 t + k of all edges, each once, the smallest; and their two vertices."""
    edges = {}
    for number, (a, b) in enumerate(np.stack([faces, np.roll(faces, -1, axis=1)], 2).reshape(-1, 2)):
        edges.setdefault((min(a, b), max(a, b)), (number, a, b))
    numbers, a, b = np.array(list(edges.values())).T
    return numbers, np.stack([a, b], axis=1)


def edge_distances(vertices1, edges1, vertices2, edges2):
    """(E1, E2) distances of edges, given by their vertices."""
    p, q = (vertices1[edges1[:, k]][:, None] for k in (0, 1))
    r, s = (vertices2[edges2[:, k]][None] for k in (0, 1))
    shape = (len(edges1), len(edges2), 3)
    return segments(*(np.broadcast_to(x, shape) for x in (p, q, r, s)))
