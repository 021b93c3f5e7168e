"""MeshLib, in single precision. New points discard its trees: they are built by the next query."""

from __future__ import annotations

import numpy as np
from meshlib import mrmeshnumpy
from meshlib import mrmeshpy as mr

from scenes import Work

precision = "single"
update = "rebuild"
absent = {
    "scene distance": "no scene: pairs of meshes only",
    "scene contacts": "no scene: pairs of meshes only",
    "shape distance": "no shapes: a mesh of the shape",
    "pairs within d": "findDistance has a limit, but returns the nearest pair only",
    "self-intersection": "see self-contacts",
    "": "no motion",
}


def set_threads(threads: int) -> None:
    """TBB's number of threads has no setting in Python: the processors of the process limit it."""


class _Mesh:
    def __init__(self, positions: np.ndarray, faces: np.ndarray):
        self.mesh = mrmeshnumpy.meshFromFacesVerts(faces, positions)

    def update(self, positions: np.ndarray) -> mr.Mesh:
        self.mesh.points = mr.VertCoords(_vector(positions))
        self.mesh.invalidateCaches()
        return self.mesh


def _vector(points: np.ndarray):
    return mrmeshnumpy.fromNumpyArray(np.ascontiguousarray(points))


def _one(work: Work, ask):
    mesh = _Mesh(work.frames[0].first, work.faces)
    return lambda frame: ask(mesh.update(frame.first))


def _two(work: Work, ask):
    first = _Mesh(work.frames[0].first, work.faces)
    second = _Mesh(work.frames[0].second, work.other_faces)
    return lambda frame: ask(first.update(frame.first), second.update(frame.second))


def _closest(work: Work):
    points, none = _vector(work.points), mr.AffineXf3f()

    def ask(mesh: mr.Mesh):
        projector, found = mr.PointsToMeshProjector(), mr.std_vector_MeshProjectionResult()
        projector.updateMeshData(mesh)
        projector.findProjections(found, points, none, none, 3.4e38, 0.0)
        return found

    return _one(work, ask), lambda found: np.sqrt([x.distSq for x in found])


def _winding(work: Work):
    points = _vector(work.points)

    def ask(mesh: mr.Mesh):
        found = mr.std_vector_float()
        fast = mr.FastWindingNumber(mesh)
        fast.calcFromVector(found, points, 2.0, mr.FaceId(), mr.func_bool_from_float())
        return found

    return _one(work, ask)


def _first_hits(work: Work):
    origins, directions = _vector(work.origins), _vector(work.directions)

    def ask(mesh: mr.Mesh):
        found, lengths = mr.MultiRayMeshIntersectResult(), mr.std_vector_float()
        hits = mr.BitSet()
        found.rayDistances, found.intersectingRays = lengths, hits
        mr.multiRayMeshIntersect(mr.MeshPart(mesh), origins, directions, found)
        return hits, lengths

    def read(found):
        hits, lengths = mrmeshnumpy.getNumpyBitSet(found[0]), np.array(list(found[1]))
        t = np.full(len(work.origins), np.inf)
        t[: len(hits)][hits] = lengths[: len(hits)][hits]
        return t

    return _one(work, ask), read


def _distance_of(a: mr.Mesh, b: mr.Mesh) -> float:
    return float(np.sqrt(mr.findDistance(mr.MeshPart(a), mr.MeshPart(b)).distSq))


def _signed_of(a: mr.Mesh, b: mr.Mesh) -> float:
    return mr.findSignedDistance(mr.MeshPart(a), mr.MeshPart(b)).signedDist


def _contacts_of(a: mr.Mesh, b: mr.Mesh):
    return mr.findCollidingTriangles(mr.MeshPart(a), mr.MeshPart(b))


def _pairs(found) -> np.ndarray:
    return np.array([(x.aFace.get(), x.bFace.get()) for x in found]).reshape(-1, 2)


def _self_contacts(work: Work):
    def ask(mesh: mr.Mesh):
        return mr.findSelfCollidingTriangles(mr.MeshPart(mesh), touchIsIntersection=True)

    def read(found):
        pairs = np.sort(_pairs(found), axis=1)
        common = [np.intersect1d(work.faces[a], work.faces[b]).size for a, b in pairs]
        return pairs[np.array(common, int) == 0]

    return _one(work, ask), read


answers = {
    "closest points": _closest,
    "inside": lambda w: (_winding(w), lambda x: np.array(list(x)) > 0.5),
    "winding numbers": lambda w: (_winding(w), lambda x: np.array(list(x))),
    "first hits": _first_hits,
    "distance": lambda w: _two(w, _distance_of),
    "contacts": lambda w: (_two(w, _contacts_of), _pairs),
    "self-contacts": _self_contacts,
    "signed distance": lambda w: _two(w, _signed_of),
}
