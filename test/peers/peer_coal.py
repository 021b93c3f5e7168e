"""coal. BVHModelOBBRSS; endReplaceModel refits bottom-up, and keeps the tree of the first step."""

from __future__ import annotations

import coal
import numpy as np

from scenes import Frame, Work

precision = "double"
update = "refit"
absent = {
    "closest points": "no query of a point but a sphere against a mesh, one at a time",
    "first hits": "no rays",
    "self-intersection": "a mesh against itself reports each triangle with itself and neighbours",
    "self-contacts": "a mesh against itself reports each triangle with itself and neighbours",
    "signed distance": "depths of meshes are those of single triangles",
    "": "no such query",
}

_IDENTITY = coal.Transform3s.Identity()


def _points(positions: np.ndarray) -> coal.StdVec_Vec3s:
    points = coal.StdVec_Vec3s()
    points.extend(list(positions))
    return points


class _Mesh:
    """A model and its update. Positions go through a std::vector, the only way for many at once."""

    def __init__(self, positions: np.ndarray, faces: np.ndarray):
        self.model = coal.BVHModelOBBRSS()
        self.model.beginModel(len(faces), len(positions))
        self.model.addVertices(positions)
        self.model.addTriangles(faces.astype(np.int64))
        self.model.endModel()

    def update(self, positions: np.ndarray) -> coal.BVHModelOBBRSS:
        self.model.beginReplaceModel()
        self.model.replaceSubModel(_points(positions))
        self.model.endReplaceModel(True, True)
        return self.model


def _distance_of(a, b) -> float:
    result = coal.DistanceResult()
    coal.distance(a, _IDENTITY, b, _IDENTITY, coal.DistanceRequest(), result)
    return max(result.min_distance, 0.0)


def _two(work: Work, ask):
    first = _Mesh(work.frames[0].first, work.faces)
    second = _Mesh(work.frames[0].second, work.other_faces)
    return lambda frame: ask(first.update(frame.first), second.update(frame.second))


def _contacts_of(a, b) -> coal.CollisionResult:
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.num_max_contacts = 10_000_000
    request.enable_contact = False
    coal.collide(a, _IDENTITY, b, _IDENTITY, request, result)
    return result


def _pairs(result: coal.CollisionResult) -> np.ndarray:
    return np.array([(c.b1, c.b2) for c in result.getContacts()]).reshape(-1, 2)


def _shape(work: Work):
    kind, *sizes = work.shape
    return {"box": coal.Box, "sphere": coal.Sphere, "capsule": coal.Capsule}[kind](*sizes)


def _shape_distance(work: Work):
    mesh, shape = _Mesh(work.frames[0].first, work.faces), _shape(work)
    return lambda frame: _distance_of(mesh.update(frame.first), shape)


def _scene(work: Work, ask):
    meshes = [_Mesh(x, work.body_faces) for x in work.frames[0].bodies]
    objects = [coal.CollisionObject(m.model, _IDENTITY) for m in meshes]
    manager = coal.DynamicAABBTreeCollisionManager()
    for each in objects:
        manager.registerObject(each)
    manager.setup()
    number = {mesh.model.id(): i for i, mesh in enumerate(meshes)}

    def step(frame: Frame):
        for i, (mesh, each) in enumerate(zip(meshes, objects)):
            mesh.update(frame.bodies[i])
            mesh.model.computeLocalAABB()
            each.setTranslation(frame.translations[i])
            each.computeAABB()
        manager.update()
        return ask(manager)

    def read(contacts):
        return sorted({tuple(sorted((number[c.o1.id()], number[c.o2.id()]))) for c in contacts})

    return step, read


def _least(manager) -> float:
    callback = coal.DistanceCallBackDefault()
    manager.distance(callback)
    return max(callback.data.result.min_distance, 0.0)


def _touching(manager):
    """All contacts of triangles: Python gets neither CollisionCallBackCollect's pairs nor a
    callback of its own, and the default one has no limit for each pair."""
    callback = coal.CollisionCallBackDefault()
    callback.data.request.num_max_contacts = 10_000_000
    callback.data.request.enable_contact = False
    manager.collide(callback)
    return callback.data.result.getContacts()


answers = {
    "distance": lambda w: _two(w, _distance_of),
    "contacts": lambda w: (_two(w, _contacts_of), _pairs),
    "shape distance": _shape_distance,
    "scene distance": lambda w: _scene(w, _least)[0],
    "scene contacts": lambda w: _scene(w, _touching),
}
