"""A moving mesh in chunks of neighbouring triangles.

Cables move fast in the middle and hardly at their clamps. A bound of each chunk's distance decreases
by the motion of this chunk alone, and only chunks that may be near are updated and asked.
"""

from typing import Dict, List, Tuple

import numpy as np

from .. import CoherentDistance, DeformableMesh, DistanceResult
from ._frames import Floats, Ints, Topology
from ._opening import Part

_MOST_TRIANGLES = 320  # of a chunk


def _distinct(triangles: Ints) -> Ints:
    """The numbers of triangles without those that have the corners of an earlier one, because 2,000
    equal triangles would take 2,000 times as long."""
    corners = np.sort(triangles, axis=1)
    order = np.lexsort(corners.T)  # stable: equal ones stay in their order
    is_first = np.ones(len(order), bool)
    is_first[1:] = (corners[order][1:] != corners[order][:-1]).any(axis=1)
    return np.sort(order[is_first])


def _split(centres: Floats, triangles: Ints, chunks: List[Ints]) -> None:
    """Halves the triangles along the longest side of their box until they are few."""
    if len(triangles) <= _MOST_TRIANGLES:
        chunks.append(np.sort(triangles))
        return
    of = centres[triangles]
    axis = int(np.argmax(np.ptp(of, axis=0)))
    order = np.argsort(of[:, axis], kind="stable")
    half = len(order) // 2
    _split(centres, triangles[order[:half]], chunks)
    _split(centres, triangles[order[half:]], chunks)


class Chunks:
    """The chunks of a topology, at its first vertices."""

    def __init__(self, topology: Topology):
        corners, vertices = topology.triangles, topology.first
        self.triangles: List[Ints] = []  # numbers of each chunk's triangles
        _split(vertices[corners].mean(axis=1), _distinct(corners), self.triangles)
        self.vertices: List[Ints] = []  # numbers of each chunk's vertices
        self.meshes: List[DeformableMesh] = []
        for numbers in self.triangles:
            used, local = np.unique(corners[numbers], return_inverse=True)
            self.vertices.append(used)
            self.meshes.append(DeformableMesh(vertices[used], local.reshape(-1, 3)))
        self._all = np.concatenate(self.vertices)
        counts = [len(used) for used in self.vertices]
        self._begins = np.concatenate([[0], np.cumsum(counts)[:-1]])

    def __len__(self) -> int:
        return len(self.meshes)

    def largest(self, of_vertices: Floats) -> Floats:
        """The largest of the numbers of each chunk's vertices, or of rows of numbers."""
        return np.maximum.reduceat(of_vertices.take(self._all, axis=0), self._begins)

    def farthest(self, a: Floats, b: Floats) -> Floats:
        """The largest distance of a vertex of each chunk between two frames, rounded up."""
        way = a - b
        return np.sqrt(self.largest(np.einsum("ij,ij->i", way, way))) * (1 + 1e-12)

    def boxes(self, vertices: Floats) -> Tuple[Floats, Floats]:
        """The lower and the upper corners of the chunks' boxes."""
        return -self.largest(-vertices), self.largest(vertices)


class Body:
    """The chunks at a frame, as one thread follows them."""

    def __init__(self, chunks: Chunks, vertices: Floats, parts: List[Part]):
        self.chunks = chunks
        self.vertices = vertices
        self._meshes = [mesh.copy() for mesh in chunks.meshes]
        self._frames = np.full(len(chunks), -1)  # which vertices each mesh has
        self._now = 0
        self._parts = parts
        self._queries: Dict[Tuple[int, int], CoherentDistance] = {}
        self._found: Dict[Tuple[int, int], DistanceResult] = {}

    def move(self, vertices: Floats) -> Floats:
        """The largest displacement of each chunk, rounded up. Their meshes follow when asked."""
        way = self.chunks.farthest(vertices, self.vertices)
        self.vertices = vertices
        self._now += 1
        return way

    def mesh(self, chunk: int) -> DeformableMesh:
        """The chunk, at the present vertices."""
        if self._frames[chunk] != self._now:
            self._meshes[chunk].update(self.vertices.take(self.chunks.vertices[chunk], axis=0))
            self._frames[chunk] = self._now
        return self._meshes[chunk]

    def distance(self, part: int, chunk: int) -> Tuple[float, DistanceResult]:
        """Triangles of the result are those of the chunk."""
        mesh = self.mesh(chunk)
        query = self._queries.get((part, chunk))
        if query is None:
            query = CoherentDistance(mesh, self._parts[part].mesh)
            self._queries[part, chunk] = query
        found = query.distance()
        self._found[part, chunk] = found
        return max(found.distance, 0.0), found

    def normal(self, part: int, chunk: int) -> Floats:
        """From the chunk to the part, by the nearest points that were found last; 0 if none."""
        found = self._found.get((part, chunk))
        way = found.points[1] - found.points[0] if found else np.zeros(3)
        return way / (np.linalg.norm(way) or 1.0)

    def triangle(self, chunk: int, number: int) -> int:
        """The number in the whole mesh of a chunk's triangle."""
        return int(self.chunks.triangles[chunk][number])


def box_gaps(low: Floats, high: Floats, other_low: Floats, other_high: Floats) -> Floats:
    """(N, M): how far boxes are apart, by their corners (N, 3) and (M, 3)."""
    gap = np.maximum(low[:, None] - other_high[None], other_low[None] - high[:, None])
    np.maximum(gap, 0.0, out=gap)
    return np.sqrt((gap * gap).sum(axis=2))
