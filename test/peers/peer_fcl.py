"""python-fcl. Its BVHModel (OBBRSS) has no replace or update in Python: it is built anew."""

from __future__ import annotations

import fcl
import numpy as np

from scenes import Frame, Work

precision = "double"
update = "rebuild"
absent = {
    "closest points": "no query of a point but a sphere against a mesh, one at a time",
    "first hits": "no rays",
    "self-intersection": "a mesh against itself reports each triangle with itself and neighbours",
    "self-contacts": "a mesh against itself reports each triangle with itself and neighbours",
    "signed distance": "depths of meshes are those of single triangles",
    "": "no such query",
}

# FCL keeps num_max_contacts of contacts; more than any scene here has.
_ALL = 10_000_000


def _model(positions: np.ndarray, faces: np.ndarray) -> fcl.BVHModel:
    model = fcl.BVHModel()
    model.beginModel(len(faces), len(positions))
    model.addSubModel(positions, faces)
    model.endModel()
    return model


def _object(positions: np.ndarray, faces: np.ndarray) -> fcl.CollisionObject:
    return fcl.CollisionObject(_model(positions, faces), fcl.Transform())


def _distance(work: Work):
    def step(frame: Frame):
        a, b = _object(frame.first, work.faces), _object(frame.second, work.other_faces)
        return max(fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()), 0.0)

    return step


def _contacts(work: Work):
    def step(frame: Frame):
        a, b = _object(frame.first, work.faces), _object(frame.second, work.other_faces)
        result = fcl.CollisionResult()
        fcl.collide(a, b, fcl.CollisionRequest(_ALL, False), result)
        return result

    return step, lambda result: np.array([(c.b1, c.b2) for c in result.contacts]).reshape(-1, 2)


def _shape(work: Work) -> fcl.CollisionObject:
    kind, *sizes = work.shape
    make = {"box": fcl.Box, "sphere": fcl.Sphere, "capsule": fcl.Capsule}[kind]
    return fcl.CollisionObject(make(*sizes), fcl.Transform())


def _shape_distance(work: Work):
    shape = _shape(work)

    def step(frame: Frame):
        mesh = _object(frame.first, work.faces)
        return max(fcl.distance(mesh, shape, fcl.DistanceRequest(), fcl.DistanceResult()), 0.0)

    return step


def _manager(work: Work, frame: Frame):
    """Returns what must live as long as the manager, and the manager."""
    objects = []
    for x, t in zip(frame.bodies, frame.translations):
        model = _model(x, work.body_faces)
        objects.append((model, fcl.CollisionObject(model, fcl.Transform(t))))
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects([o for _, o in objects])
    manager.setup()
    return objects, manager


def _scene_distance(work: Work):
    def step(frame: Frame):
        kept, manager = _manager(work, frame)
        data = fcl.DistanceData()
        manager.distance(data, fcl.defaultDistanceCallback)
        del kept
        return max(data.result.min_distance, 0.0)

    return step


def _scene_contacts(work: Work):
    """Pairs of bodies: one contact a pair, by a callback. FCL's default stops at its limit."""

    def step(frame: Frame):
        kept, manager = _manager(work, frame)
        # The callback gets new wrappers: bodies are known by their translations.
        number = {tuple(t): i for i, t in enumerate(frame.translations)}
        found = []

        def callback(a, b, _):
            if fcl.collide(a, b, fcl.CollisionRequest(1, False), fcl.CollisionResult()):
                found.append(sorted(number[tuple(o.getTranslation())] for o in (a, b)))
            return False

        manager.collide(None, callback)
        del kept
        return found

    return step


answers = {
    "distance": _distance,
    "contacts": _contacts,
    "shape distance": _shape_distance,
    "scene distance": _scene_distance,
    "scene contacts": _scene_contacts,
}
