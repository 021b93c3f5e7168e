"""libigl. `AABB` and its winding number's tree have no refit: both are built anew in each step."""

from __future__ import annotations

import igl
import numpy as np

from scenes import Frame, Work

# Rays go through single precision.
precision = {"": "double", "first hits": "single"}
update = "rebuild"
absent = {
    "distance": "no call for two meshes: all_pairs_distances is of points",
    "contacts": "not bound: intersections of meshes are in igl.copyleft.cgal, which is not shipped",
    "self-intersection": "not bound: only single pairs (tri_tri_overlap_test_3d)",
    "self-contacts": "not bound: only single pairs (tri_tri_overlap_test_3d)",
    "": "no broad phase, no motion, no scene, no shapes",
}


def _faces(work: Work) -> np.ndarray:
    return work.faces.astype(np.int64)


def _closest(work: Work):
    faces = _faces(work)

    def step(frame: Frame):
        tree = igl.AABB()
        tree.init(frame.first, faces)
        return tree.squared_distance(frame.first, faces, work.points)[0]

    return step, np.sqrt


def _fast(work: Work):
    faces = _faces(work)
    return lambda frame: igl.fast_winding_number(frame.first, faces, work.points)


def _exact(work: Work):
    faces = _faces(work)
    return lambda frame: igl.winding_number(frame.first, faces, work.points)


def _first_hits(work: Work):
    faces = _faces(work)

    def step(frame: Frame):
        tree = igl.AABB()
        tree.init(frame.first, faces)
        found = tree.intersect_ray_first(frame.first, faces, work.origins, work.directions)
        return np.where(found[0] >= 0, found[1], np.inf)

    return step


answers = {
    "closest points": _closest,
    "inside": {
        "fast": lambda w: (_fast(w), lambda x: x > 0.5),
        "exact": lambda w: (_exact(w), lambda x: x > 0.5),
    },
    "winding numbers": {"fast": _fast, "exact": _exact},
    "first hits": _first_hits,
}
