"""The inputs that all peers get: deforming meshes, frames of simulations, query points, rays.

Every function is deterministic, so that every process makes the same float64 arrays. Lengths have
no unit; a scene is about 1 to 10 wide.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field

import numpy as np

_HERE = os.path.dirname(os.path.abspath(__file__))
DATA = os.environ.get("PEERS_DATA", os.path.join(_HERE, "..", "..", "..", "shared", "data"))


@dataclass
class Frame:
    """Positions of one step.

    first: (V, 3); second: (W, 3) or None; end: (V, 3), the first mesh at the end of the step;
    bodies: (B, U, 3) in frames of the bodies; translations: (B, 3).
    """

    first: np.ndarray | None = None
    second: np.ndarray | None = None
    end: np.ndarray | None = None
    bodies: np.ndarray | None = None
    translations: np.ndarray | None = None


@dataclass
class Work:
    """One scene for one question.

    faces: (F, 3) int32; other_faces: (G, 3) int32; body_faces: (H, 3) int32, of every body;
    points, origins, directions: (N, 3), directions of length 1; distance: a limit, a length;
    shape: ("box", x, y, z), ("sphere", radius) or ("capsule", radius, length), at the origin.
    """

    scene: str
    size: int
    frames: list[Frame]
    faces: np.ndarray | None = None
    other_faces: np.ndarray | None = None
    body_faces: np.ndarray | None = None
    points: np.ndarray | None = None
    origins: np.ndarray | None = None
    directions: np.ndarray | None = None
    distance: float = 0.0
    shape: tuple = ()
    notes: dict = field(default_factory=dict)

    @property
    def triangles(self) -> int:
        """Triangles that change in a step."""
        if self.body_faces is not None:
            return len(self.body_faces) * len(self.frames[0].bodies)
        return len(self.faces) + (0 if self.other_faces is None else len(self.other_faces))

    def digest(self) -> str:
        """A short hash of all arrays: equal in all processes that compare answers."""
        sha = hashlib.sha256()
        for x in [self.faces, self.other_faces, self.points, self.origins, self.directions]:
            sha.update(b"-" if x is None else np.ascontiguousarray(x).tobytes())
        for frame in self.frames:
            for x in [frame.first, frame.second, frame.end, frame.bodies, frame.translations]:
                sha.update(b"-" if x is None else np.ascontiguousarray(x).tobytes())
        return sha.hexdigest()[:12]


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns (u, v) in [0, 1], ((n+1)^2, 2), and faces (2 n^2, 3) of a square sheet."""
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)[None, :]).ravel()
    low = np.stack([i, i + n + 1, i + n + 2], 1)
    high = np.stack([i, i + n + 2, i + 1], 1)
    faces = np.stack([low, high], 1).reshape(-1, 3)
    return np.stack([u.ravel(), v.ravel()], 1), faces.astype(np.int32)


def sphere(around: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a unit sphere of 2 around * rings faces, outward; the two poles come first."""
    polar = np.pi * np.arange(1, rings + 1) / (rings + 1)
    turn = 2 * np.pi * np.arange(around) / around
    p, t = np.meshgrid(polar, turn, indexing="ij")
    ring = np.stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)], -1).reshape(-1, 3)
    faces = []
    for i in range(around):
        j = (i + 1) % around
        faces.append([0, 2 + i, 2 + j])
        last = 2 + (rings - 1) * around
        faces.append([1, last + j, last + i])
        for r in range(rings - 1):
            a, b = 2 + r * around + i, 2 + r * around + j
            c, d = a + around, b + around
            faces += [[a, c, d], [a, d, b]]
    return np.vstack([[[0, 0, 1], [0, 0, -1]], ring]), np.array(faces, np.int32)


def tube(around: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns an open cylinder about x of radius 1, x in [0, 1], 2 around * along faces."""
    x, t = np.meshgrid(
        np.linspace(0, 1, along + 1), 2 * np.pi * np.arange(around) / around, indexing="ij"
    )
    points = np.stack([x, np.cos(t), np.sin(t)], -1).reshape(-1, 3)
    faces = []
    for r in range(along):
        for i in range(around):
            a, b = r * around + i, r * around + (i + 1) % around
            faces += [[a, b, b + around], [a, b + around, a + around]]
    return points, np.array(faces, np.int32)


def waving(uv: np.ndarray, time: float) -> np.ndarray:
    """Returns a sheet of size 2 x 2 whose folds travel; never steeper than about 60 degrees."""
    x, y = 2 * uv[:, 0] - 1, 2 * uv[:, 1] - 1
    z = 0.15 * np.sin(6 * x + time) + 0.1 * np.sin(5 * y - 0.7 * time) + 0.05 * np.cos(9 * (x + y))
    return np.stack([x + 0.05 * np.sin(7 * y + time), y, z], 1)


def blob(points: np.ndarray, time: float) -> np.ndarray:
    """Returns a sphere with travelling bumps, still closed and embedded; radius 0.8 to 1.2."""
    x, y, z = points.T
    bump = 0.12 * np.sin(5 * x + time) * np.cos(4 * y - time) + 0.06 * np.sin(7 * z + 0.5 * time)
    return points * (1 + bump)[:, None]


def times(steps: int) -> np.ndarray:
    """Times of the steps: a step moves a surface by a few thousandths of its size."""
    return 0.05 * np.arange(steps)


def two_sheets(size: int, steps: int, gap: float) -> Work:
    """Two waving sheets, `gap` apart at the origin; a negative gap lets them cross."""
    uv, faces = grid(round(28 * np.sqrt(size)))
    lift = np.array([0, 0, 0.5 + gap])
    frames = [
        Frame(first=waving(uv, t), second=waving(uv, 2 + 1.3 * t)[:, [1, 0, 2]] + lift)
        for t in times(steps)
    ]
    # Exchanged axes turn the sheet over.
    name = "sheets apart" if gap > 0 else "sheets that cross"
    return Work(name, size, frames, faces, faces[:, ::-1].copy())


def one_sheet(size: int, steps: int) -> Work:
    """A waving sheet: open."""
    uv, faces = grid(round(32 * np.sqrt(size)))
    return Work("sheet", size, [Frame(first=waving(uv, t)) for t in times(steps)], faces)


def one_blob(size: int, steps: int) -> Work:
    """A sphere with bumps: closed."""
    points, faces = sphere(round(40 * np.sqrt(size)), round(28 * np.sqrt(size)))
    return Work("blob", size, [Frame(first=blob(points, t)) for t in times(steps)], faces)


def two_ellipsoids(size: int, steps: int, gap: float) -> Work:
    """Two convex bodies that are squeezed; `gap` is their distance, or their depth if negative."""
    points, faces = sphere(round(32 * np.sqrt(size)), round(20 * np.sqrt(size)))
    frames = []
    for t in times(steps):
        first = points * [1, 0.8 + 0.1 * np.sin(t), 0.9]
        second = points * [0.9, 1, 0.7 + 0.1 * np.sin(t)] + [1.9 + gap, 0.02, 0.03]
        frames.append(Frame(first=first, second=second))
    name = "ellipsoids apart" if gap > 0 else "ellipsoids that overlap"
    return Work(name, size, frames, faces, faces)


def rods(size: int, steps: int) -> Work:
    """Two layers of four crossed rods each that are pressed together and bend."""
    points, faces = tube(round(10 * np.sqrt(size)), round(24 * np.sqrt(size)))
    many = np.concatenate([faces + k * len(points) for k in range(4)])

    def layer(t: float, turned: bool) -> np.ndarray:
        parts = []
        for k in range(4):
            x = np.stack(
                [3 * points[:, 0] - 1.5, 0.2 * points[:, 1] + 0.8 * k - 1.2, 0.2 * points[:, 2]], 1
            )
            x[:, 2] += 0.08 * np.sin(4 * x[:, 0] + t + k) * (1 if turned else -1)
            parts.append(x)
        x = np.concatenate(parts)
        return x[:, [1, 0, 2]] * [1, -1, 1] + [0, 0, 0.58 - 0.02 * np.sin(t)] if turned else x

    frames = [Frame(first=layer(t, False), second=layer(t, True)) for t in times(steps)]
    return Work("rods", size, frames, many, many)


def load_ply(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Reads vertices (V, 3) and faces (F, 3) of a PLY file, ascii or little-endian."""
    with open(path, "rb") as file:
        header = []
        while not header or header[-1] != "end_header":
            header.append(file.readline().decode().strip())
        body = file.read()
    count = {w[1]: int(w[2]) for w in (line.split() for line in header) if w[0] == "element"}
    start = header.index(next(line for line in header if line.startswith("element vertex")))
    properties = []
    for line in header[start + 1 :]:
        if not line.startswith("property"):
            break
        properties.append(line.split()[1:])
    if "format ascii 1.0" in header:
        numbers = body.split()
        width = len(properties)
        n = count["vertex"] * width
        vertices = np.array(numbers[:n], float).reshape(-1, width)[:, :3]
        faces = np.array(numbers[n : n + 4 * count["face"]], np.int64).reshape(-1, 4)[:, 1:]
        return vertices, faces.astype(np.int32)
    kinds = {"float": "<f4", "float32": "<f4", "double": "<f8", "float64": "<f8", "uchar": "u1"}
    row = np.dtype([(name, kinds[kind]) for kind, name in properties])
    table = np.frombuffer(body, row, count["vertex"])
    vertices = np.stack([table[k] for k in "xyz"], 1).astype(float)
    rest = np.frombuffer(
        body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), count["face"], row.itemsize * len(table)
    )
    return vertices, rest["v"].astype(np.int32)


def components(faces: np.ndarray) -> np.ndarray:
    """Returns the number of the component of each face, (F,): 0 is the largest one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = faces.max() + 1
    i, j = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    _, label = connected_components(coo_matrix((np.ones(len(i)), (i, j)), (n, n)), directed=False)
    label = label[faces[:, 0]]
    order = np.argsort(-np.bincount(label), kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[label]


REAL = {
    "cloth and funnel": ("cloth_funnel_227.ply", "cloth_funnel_228.ply"),
    "armadillo and rollers": ("armadillo_rollers_326.ply", "armadillo_rollers_327.ply"),
}


def real(name: str, size: int, steps: int, split: bool) -> Work | None:
    """Frames of a simulation, interpolated; None where the data is not there.

    size 4 divides each triangle in four, and so on. split: the largest component becomes the first
    mesh, all other ones the second.
    """
    paths = [os.path.join(DATA, file) for file in REAL[name]]
    if size not in (1, 16) or not all(os.path.exists(path) for path in paths):
        return None
    begin, faces = load_ply(paths[0])
    end = load_ply(paths[1])[0]
    for _ in range({1: 0, 16: 2}[size]):
        both, faces = divide(np.concatenate([begin, end], 1), faces)
        begin, end = both[:, :3], both[:, 3:]
    at = [np.ascontiguousarray(begin + (end - begin) * t) for t in np.linspace(0, 1, steps + 1)]
    if not split:
        frames = [Frame(first=at[i], end=at[i + 1]) for i in range(steps)]
        return Work(name, size, frames, faces)
    part = components(faces)
    (keep_a, a), (keep_b, b) = compact(faces[part == 0]), compact(faces[part > 0])
    frames = [Frame(first=at[i][keep_a], second=at[i][keep_b]) for i in range(steps)]
    return Work(name, size, frames, a, b)


def compact(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices that faces use, and faces with new numbers."""
    keep, new = np.unique(faces, return_inverse=True)
    return keep, new.reshape(-1, 3).astype(np.int32)


def divide(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Divides each triangle in four at the middles of its edges. vertices: (V, K)."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    middle = len(vertices) + number.reshape(-1, 3)
    a, b, c = faces.T
    ab, bc, ca = middle.T
    parts = [np.stack(x, 1) for x in [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]]
    return np.vstack([vertices, vertices[unique].mean(1)]), np.concatenate(parts).astype(np.int32)


def crowd(size: int, steps: int) -> Work:
    """The crowd of the example: soft balls that move, are squeezed and touch; 100 at size 1."""
    points, faces = sphere(16, 10)
    count = round(100 * size)
    random = np.random.default_rng(5)
    home = 7 * size ** (1 / 3) * random.uniform(-1, 1, (count, 3))
    along = random.normal(size=(count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    frames = []
    for step in range(steps):
        squeeze = np.sin(0.3 * step + home[:, 1])
        moved = (points @ along.T).T * (0.2 * squeeze)[:, None]
        bodies = points[None] - moved[:, :, None] * along[:, None, :]
        translations = home + 0.8 * np.sin(0.1 * step + home[:, :1]) * along
        frames.append(Frame(bodies=bodies, translations=translations))
    return Work("crowd", size, frames, body_faces=faces)


def tiny(steps: int) -> Work:
    """Two tetrahedra, one point and one ray: what a call costs without work."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32)
    frames = [
        Frame(
            first=points + 0.001 * t,
            second=points + [2, 0, 0.001 * t],
            end=points + 0.001 * (t + 1),
            bodies=np.stack([points, points]),
            translations=np.array([[0, 0, 0], [2, 0, 0.001 * t]]),
        )
        for t in range(steps)
    ]
    return Work("empty call", 0, frames, faces, faces, faces, shape=("sphere", 0.1), distance=0.1)


def add_points(work: Work, count: int) -> Work:
    """Adds random points in the box of the first frame, made larger by a tenth, and rays into it."""
    random = np.random.default_rng(count)
    low, high = work.frames[0].first.min(0), work.frames[0].first.max(0)
    centre, half = (low + high) / 2, 0.55 * (high - low) + 0.05 * (high - low).max()
    work.points = centre + half * random.uniform(-1, 1, (count, 3))
    out = random.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    target = centre + half * random.uniform(-0.8, 0.8, (count, 3))
    work.origins = centre + 2 * np.linalg.norm(half) * out
    work.directions = target - work.origins
    work.directions /= np.linalg.norm(work.directions, axis=1, keepdims=True)
    return work


def add_steps(work: Work) -> Work:
    """Lets each step end where the next one begins; the last step repeats the one before."""
    frames = work.frames
    for frame, after in zip(frames, frames[1:]):
        frame.end = after.first
    if len(frames) > 1:
        frames[-1].end = 2 * frames[-1].first - frames[-2].first
    return work


def joined(work: Work) -> Work:
    """Makes one mesh of two."""
    n = len(work.frames[0].first)
    faces = np.concatenate([work.faces, work.other_faces + n]).astype(np.int32)
    frames = [Frame(first=np.concatenate([f.first, f.second])) for f in work.frames]
    return Work(work.scene, work.size, frames, faces, notes=work.notes)
