"""Open3D's RaycastingScene (Embree, single precision), made anew in each step: it has no refit."""

from __future__ import annotations

import numpy as np
import open3d as o3d

from scenes import Frame, Work

precision = "single"
update = "rebuild"
absent = {
    "winding numbers": "compute_occupancy and compute_signed_distance count hits of rays",
    "distance": "TriangleMesh has none; RaycastingScene.compute_distance is of points",
    "contacts": "TriangleMesh.is_intersecting answers yes or no, by brute force",
    "self-contacts": "get_self_intersecting_triangles is brute force: minutes at this size",
    "self-intersection": "is_self_intersecting is brute force: minutes at this size",
    "": "no such query",
}

_threads = 1


def set_threads(threads: int) -> None:
    global _threads
    _threads = threads


def _one(work: Work, ask):
    faces = o3d.core.Tensor(work.faces.astype(np.uint32))

    def step(frame: Frame):
        scene = o3d.t.geometry.RaycastingScene(nthreads=_threads)
        scene.add_triangles(o3d.core.Tensor(frame.first.astype(np.float32)), faces)
        return ask(scene)

    return step


def _points(work: Work):
    return o3d.core.Tensor(work.points.astype(np.float32))


def _first_hits(work: Work):
    rays = np.concatenate([work.origins, work.directions], 1).astype(np.float32)
    return _one(
        work,
        lambda scene: scene.cast_rays(o3d.core.Tensor(rays), nthreads=_threads)["t_hit"].numpy(),
    )


answers = {
    "closest points": lambda w: _one(
        w, lambda s: s.compute_distance(_points(w), nthreads=_threads).numpy()
    ),
    "inside": lambda w: _one(
        w, lambda s: s.compute_occupancy(_points(w), nthreads=_threads).numpy()
    ),
    "first hits": _first_hits,
}
