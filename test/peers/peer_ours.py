"""This library. An update of `DeformableMesh` refits its tree."""

from __future__ import annotations

import adaptive_bvh as ab
import numpy as np

from scenes import Frame, Work

precision = "double"
update = "refit"
absent: dict[str, str] = {}


def set_threads(threads: int) -> None:
    """Meshes get their number of threads when they are made."""
    global _threads
    _threads = threads


_threads = 1


def _mesh(positions: np.ndarray, faces: np.ndarray) -> ab.DeformableMesh:
    mesh = ab.DeformableMesh(positions, faces)
    mesh.set_threads(_threads)
    return mesh


def _one(work: Work, ask):
    mesh = _mesh(work.frames[0].first, work.faces)

    def step(frame: Frame):
        mesh.update(frame.first)
        return ask(mesh)

    return step


def _two(work: Work, ask):
    first = _mesh(work.frames[0].first, work.faces)
    second = _mesh(work.frames[0].second, work.other_faces)

    def step(frame: Frame):
        first.update(frame.first)
        second.update(frame.second)
        return ask(first, second)

    return step


def _coherent(work: Work):
    first = _mesh(work.frames[0].first, work.faces)
    second = _mesh(work.frames[0].second, work.other_faces)
    query = ab.CoherentDistance(first, second)

    def step(frame: Frame):
        first.update(frame.first)
        second.update(frame.second)
        return query.distance().distance

    return step


def _motion(work: Work, ask):
    """The mesh keeps both ends of a step: the second frame is set by update_two_frames."""
    mesh = _mesh(work.frames[0].first, work.faces)

    def step(frame: Frame):
        mesh.update(frame.first)
        mesh.update_two_frames(frame.end)
        return ask(ab.Motion(mesh))

    return step


def _first_hits(work: Work, mesh: ab.DeformableMesh) -> np.ndarray:
    found = ab.first_hit(mesh, work.origins, work.directions)
    t = np.full(len(work.origins), np.inf)
    t[found.rays] = found.t
    return t


def _intersects(mesh: ab.DeformableMesh, neighbours: str) -> bool:
    """ "beyond shared" also tests neighbours, as ipc-toolkit does."""
    found = ab.self_collide(
        mesh, max_contacts=1, enable_contact=False, ignored=ab.Ignored(neighbours=neighbours)
    )
    return len(found) > 0


def _sizes(pairs: ab.FeaturePairs) -> np.ndarray:
    vertex_face = len(pairs.vertex_face) + len(pairs.face_vertex)
    return np.array([vertex_face, len(pairs.edge_edge)])


def _shape(work: Work) -> ab.Shape:
    kind, *sizes = work.shape
    return {"box": ab.Box, "sphere": ab.Sphere, "capsule": ab.Capsule}[kind](*sizes)


def _pose(translation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.eye(3), translation


def _scene(work: Work, ask):
    frame = work.frames[0]
    scene = ab.Scene()
    scene.set_threads(_threads)
    meshes = [_mesh(x, work.body_faces) for x in frame.bodies]
    ids = [scene.add(m, _pose(t)) for m, t in zip(meshes, frame.translations)]
    number = {body: i for i, body in enumerate(ids)}

    def step(frame: Frame):
        for mesh, body, x, t in zip(meshes, ids, frame.bodies, frame.translations):
            mesh.update(x)
            scene.set_transform(body, _pose(t))
        scene.update()
        return ask(scene)

    return step, number


def _scene_distance(work: Work):
    return _scene(work, lambda scene: scene.distance().distance)[0]


def _scene_contacts(work: Work):
    step, number = _scene(work, lambda scene: scene.collide().bodies)
    return step, lambda bodies: [sorted((number[a], number[b])) for a, b in bodies]


def _signed(first: ab.DeformableMesh, second: ab.DeformableMesh) -> float:
    """The middle of the bounds: they are within 1e-6 of each other (see the question's limit)."""
    found = ab.signed_distance(first, second, 1e-6)
    return (found.lower + found.upper) / 2


answers = {
    "closest points": lambda w: _one(w, lambda m: ab.closest_points(m, w.points).distances),
    "inside": lambda w: _one(w, lambda m: ab.winding_numbers(m, w.points) > 0.5),
    "winding numbers": lambda w: _one(w, lambda m: ab.winding_numbers(m, w.points)),
    "first hits": lambda w: _one(w, lambda m: _first_hits(w, m)),
    "distance": {
        "one call": lambda w: _two(w, lambda a, b: ab.distance(a, b).distance),
        "coherent": _coherent,
    },
    "contacts": lambda w: _two(w, lambda a, b: ab.collide(a, b, enable_contact=False).pairs),
    "self-intersection": {
        name: (lambda w, name=name: _one(w, lambda m: _intersects(m, name)))
        for name in ("beyond shared", "shared vertex")
    },
    "self-contacts": lambda w: (
        _one(w, lambda m: ab.self_collide(m, enable_contact=False).pairs),
        lambda pairs: np.sort(np.reshape(pairs, (-1, 2)), axis=1),
    ),
    "pairs within d": lambda w: (
        _one(w, lambda m: ab.self_feature_pairs_within(m, w.distance)),
        _sizes,
    ),
    "step candidates": lambda w: (_motion(w, ab.self_candidates), _sizes),
    "collision-free step": lambda w: _motion(w, ab.self_largest_safe_step),
    "scene distance": _scene_distance,
    "scene contacts": _scene_contacts,
    "signed distance": lambda w: _two(w, _signed),
    "shape distance": lambda w: _one(w, lambda m: ab.distance(m, _shape(w)).distance),
}
