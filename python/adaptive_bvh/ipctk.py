"""Candidates of this library inside ipc-toolkit: pass `adaptive_bvh.ipctk.BroadPhase()` wherever
ipctk takes a broad phase.

    broad_phase = adaptive_bvh.ipctk.BroadPhase()        # once: its tree follows the positions
    candidates = ipctk.Candidates()
    candidates.build(mesh, vertices, dhat / 2, broad_phase)

Candidates are the pairs that come as near as two radii of inflation, decided exactly, so a box that
is inflated has no part in it: there are fewer than boxes find, and as many collisions. What is no
surface of triangles (two dimensions, edges and vertices without a face) goes to ipctk.LBVH.
"""

import ipctk
import numpy as np

from . import _core

__all__ = ["BroadPhase"]


def _keys(pairs, count):
    """A number for each pair of vertices, in either order."""
    return pairs.min(axis=1) * count + pairs.max(axis=1)


class _Surface:
    """A mesh of triangles whose edges have ipctk's numbers."""

    def __init__(self, vertices, edges, faces):
        self.faces, self.edges = faces, edges
        self.mesh = _core.DeformableMesh(vertices, faces)
        count = len(vertices)
        order = np.argsort(_keys(edges, count))
        corners = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
        at = np.searchsorted(_keys(edges, count), _keys(corners, count), sorter=order)
        self._numbers = order[at]

    def fits(self, vertices, edges, faces):
        return (
            len(vertices) == self.mesh.num_vertices
            and np.array_equal(faces, self.faces)
            and np.array_equal(edges, self.edges)
        )

    def numbers(self, edges):
        """ipctk's of edges of triangles: edge k of triangle t is 3 t + k."""
        return self._numbers[edges]


def _is_surface(vertices, edges, faces):
    """Whether each vertex and edge has a face, and each edge of a face is there, once."""
    if vertices.shape[1] != 3 or len(faces) == 0 or len(np.unique(faces)) != len(vertices):
        return False
    corners = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    keys = _keys(edges, len(vertices))
    return np.array_equal(np.sort(keys), np.unique(_keys(corners, len(vertices))))


class BroadPhase(ipctk.BroadPhase):
    """One tree, refitted by each build of the same faces."""

    def __init__(self):
        super().__init__()
        self._surface = None
        self._lbvh = None
        self._built = None

    def name(self):
        return "adaptive_bvh"

    def build(self, *arrays, inflation_radius=0.0):
        """build(vertices, edges, faces, inflation_radius), or of a step build(vertices_t0,
        vertices_t1, edges, faces, inflation_radius)."""
        if np.ndim(arrays[-1]) == 0:
            *arrays, inflation_radius = arrays
        super().build(*arrays, inflation_radius)
        *positions, edges, faces = (np.array(each, order="C") for each in arrays)
        edges, faces = edges.reshape(-1, 2).astype(np.int64), faces.reshape(-1, 3).astype(np.int64)
        self._built, self._radius = (positions, edges, faces), float(inflation_radius)
        self._lbvh = self._pairs = None
        begin = positions[0]
        if self._surface is not None and self._surface.fits(begin, edges, faces):
            self._surface.mesh.update(begin)
        elif _is_surface(begin, edges, faces):
            self._surface = _Surface(begin, edges, faces)
        else:
            self._surface = None

    def clear(self):
        super().clear()
        self._built = self._lbvh = self._pairs = None

    def _distance(self):
        """Two radii, and what ipctk's distances are rounded by."""
        largest = max(np.abs(x).max() for x in self._built[0])
        return 2 * self._radius * (1 + 1e-12) + 1e-14 * largest

    def _features(self):
        if self._pairs is None:
            mesh, (positions, *_) = self._surface.mesh, self._built
            if len(positions) == 1:
                self._pairs = _core.self_feature_pairs_within(mesh, self._distance())
            else:
                motion = _core.Motion(mesh, *positions)
                self._pairs = _core.self_candidates(motion, self._distance())
        return self._pairs

    def _handed_on(self, detect):
        """What ipctk.LBVH finds."""
        if self._lbvh is None:
            positions, edges, faces = self._built
            integers = (np.asfortranarray(each, dtype=np.int32) for each in (edges, faces))
            self._lbvh = ipctk.LBVH()
            self._lbvh.can_vertices_collide = self.can_vertices_collide
            self._lbvh.build(*map(np.asfortranarray, positions), *integers, self._radius)
        return getattr(self._lbvh, detect)()

    def _admitted(self, kind, pairs, first, second):
        """Candidates of pairs in which vertices of both may collide."""
        can = self.can_vertices_collide
        kept = np.fromiter(map(can, first[:, 0].tolist(), second[:, 0].tolist()), bool)
        for i in np.flatnonzero(~kept):
            kept[i] = any(can(v, w) for v in first[i].tolist() for w in second[i].tolist())
        return list(map(kind, *pairs[kept].T.tolist()))

    def detect_face_vertex_candidates(self):
        if self._surface is None:
            return self._handed_on("detect_face_vertex_candidates")
        pairs = self._features().vertex_face[:, ::-1]
        faces = self._surface.faces[pairs[:, 0]]
        return self._admitted(ipctk.FaceVertexCandidate, pairs, pairs[:, 1:], faces)

    def detect_edge_edge_candidates(self):
        if self._surface is None:
            return self._handed_on("detect_edge_edge_candidates")
        pairs = self._surface.numbers(self._features().edge_edge)
        ends = self._surface.edges[pairs]
        return self._admitted(ipctk.EdgeEdgeCandidate, pairs, ends[:, 0], ends[:, 1])

    def detect_edge_face_candidates(self):
        """Edges of triangles that are near, with the other triangle; of neighbours, of those that
        meet beyond what they share. has_intersections asks for them."""
        surface = self._surface
        if surface is None or len(self._built[0]) == 2:
            return self._handed_on("detect_edge_face_candidates")
        near = _core.self_pairs_within(surface.mesh, self._distance()).triangles
        beyond = _core.Ignored(neighbours="beyond shared")
        met = _core.self_collide(surface.mesh, enable_contact=False, ignored=beyond).pairs
        meeting = np.concatenate([near, near[:, ::-1], met, met[:, ::-1]]).astype(np.int64)
        pairs = np.repeat(meeting, 3, axis=0)
        pairs[:, 0] = surface.numbers((3 * meeting[:, :1] + np.arange(3)).reshape(-1))
        pairs = np.unique(pairs, axis=0)
        ends, faces = surface.edges[pairs[:, 0]], surface.faces[pairs[:, 1]]
        apart = (ends[:, :, None] != faces[:, None, :]).all(axis=(1, 2))
        return self._admitted(
            ipctk.EdgeFaceCandidate, pairs[apart], ends[apart], faces[apart]
        )

    def detect_vertex_vertex_candidates(self):
        return self._handed_on("detect_vertex_vertex_candidates")

    def detect_edge_vertex_candidates(self):
        return self._handed_on("detect_edge_vertex_candidates")

    def detect_face_face_candidates(self):
        return self._handed_on("detect_face_face_candidates")
