"""ipc-toolkit. Its broad phases are built anew in each call. Positions are columns in memory."""

from __future__ import annotations

import ipctk
import numpy as np

from scenes import Frame, Work

precision = "double"
update = "rebuild"
absent = {
    "closest points": "point_triangle_distance of one pair; no query of a mesh",
    "inside": "no winding numbers",
    "winding numbers": "no winding numbers",
    "first hits": "no rays",
    "distance": "compute_minimum_distance sees only pairs nearer than dhat, of one mesh",
    "contacts": "has_intersections answers yes or no, of one mesh",
    "self-contacts": "has_intersections answers yes or no",
    "signed distance": "no depth",
    "": "no bodies and no shapes but planes",
}


def set_threads(threads: int) -> None:
    ipctk.set_num_threads(threads)


BROAD_PHASES = {
    name: getattr(ipctk, name) for name in ("LBVH", "HashGrid", "SpatialHash", "SweepAndPrune")
}


def _mesh(work: Work) -> ipctk.CollisionMesh:
    positions = np.asfortranarray(work.frames[0].first)
    faces = np.asfortranarray(work.faces)
    return ipctk.CollisionMesh(positions, ipctk.edges(faces), faces)


def _one(ask):
    def variant(broad_phase):
        def make(work: Work):
            mesh = _mesh(work)
            return lambda frame: ask(work, mesh, np.asfortranarray(frame.first), broad_phase())

        return make

    return {name: variant(kind) for name, kind in BROAD_PHASES.items()}


def _step(ask):
    def variant(broad_phase):
        def make(work: Work):
            mesh = _mesh(work)

            def step(frame: Frame):
                ends = np.asfortranarray(frame.first), np.asfortranarray(frame.end)
                return ask(mesh, *ends, broad_phase())

            return step

        return make

    return {name: variant(kind) for name, kind in BROAD_PHASES.items()}


def _within(work: Work, mesh, positions, broad_phase):
    """Candidates of boxes made larger by half of the distance: their distances come in _near."""
    candidates = ipctk.Candidates()
    candidates.build(mesh, positions, work.distance / 2, broad_phase)
    collisions = ipctk.NormalCollisions()
    collisions.collision_set_type = ipctk.NormalCollisions.CollisionSetType.IPC
    collisions.build(candidates, mesh, positions, work.distance)
    return work, mesh, positions, candidates, collisions


def _near(found) -> np.ndarray:
    """Counts candidates within the distance, as this library does: build() merges those of them
    whose nearest features are the same."""
    work, mesh, positions, candidates, _ = found

    def count(rows) -> int:
        limit, n = work.distance**2, 0
        for candidate in rows:
            ids = candidate.vertex_ids(mesh.edges, mesh.faces)
            n += candidate.compute_distance(np.concatenate([positions[i] for i in ids])) <= limit
        return n

    return np.array([count(candidates.fv_candidates), count(candidates.ee_candidates)])


def _step_candidates(mesh, begin, end, broad_phase):
    candidates = ipctk.Candidates()
    candidates.build(mesh, begin, end, 0.0, broad_phase)
    return candidates


def _sizes(candidates) -> np.ndarray:
    return np.array([len(candidates.fv_candidates), len(candidates.ee_candidates)])


def _reading(made: dict, read) -> dict:
    return {name: (lambda work, m=make: (m(work), read)) for name, make in made.items()}


def _intersects(work: Work, mesh, positions, broad_phase):
    return ipctk.has_intersections(mesh, positions, broad_phase)


def _safe_step(mesh, begin, end, broad_phase):
    return ipctk.compute_collision_free_stepsize(mesh, begin, end, 0.0, broad_phase)


answers = {
    "self-intersection": _one(_intersects),
    "pairs within d": _reading(_one(_within), _near),
    "step candidates": _reading(_step(_step_candidates), _sizes),
    "collision-free step": _step(_safe_step),
}
