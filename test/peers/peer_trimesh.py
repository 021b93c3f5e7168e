"""trimesh's CollisionManager, on python-fcl. A body that deforms is removed and added again.

Poses are rounded to single precision there, so that positions here are those in the world.
"""

from __future__ import annotations

import trimesh
from trimesh.collision import CollisionManager

from scenes import Frame, Work

precision = "double"
update = "rebuild"
absent = {
    "closest points": "proximity needs rtree and searches in Python",
    "inside": "contains casts rays by embreex: see embreex",
    "first hits": "by embreex: see embreex",
    "contacts": "see python-fcl, which it calls",
    "shape distance": "a shape becomes a mesh",
    "": "no such query",
}


def _mesh(positions, faces) -> trimesh.Trimesh:
    return trimesh.Trimesh(positions, faces, process=False)


def _manager(work: Work, frame: Frame) -> CollisionManager:
    manager = CollisionManager()
    for i, (x, t) in enumerate(zip(frame.bodies, frame.translations)):
        manager.add_object(str(i), _mesh(x + t, work.body_faces))
    return manager


def _distance(work: Work):
    def step(frame: Frame):
        manager = CollisionManager()
        manager.add_object("first", _mesh(frame.first, work.faces))
        return max(manager.min_distance_single(_mesh(frame.second, work.other_faces)), 0.0)

    return step


def _scene_distance(work: Work):
    return lambda frame: max(_manager(work, frame).min_distance_internal(), 0.0)


def _scene_contacts(work: Work):
    def step(frame: Frame):
        return _manager(work, frame).in_collision_internal(return_names=True)[1]

    return step, lambda names: sorted(sorted((int(a), int(b))) for a, b in names)


answers = {
    "distance": _distance,
    "scene distance": _scene_distance,
    "scene contacts": _scene_contacts,
}
