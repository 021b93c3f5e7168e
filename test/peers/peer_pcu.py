"""point-cloud-utils. Every call builds its tree (RayMeshIntersector: once, without an update)."""

from __future__ import annotations

import numpy as np
import point_cloud_utils as pcu

from scenes import Frame, Work

precision = {"": "double", "first hits": "single"}
update = "rebuild"
absent = {
    "distance": "hausdorff_distance is of point sets, and the largest",
    "": "no such query",
}


def _closest(work: Work):
    return lambda frame: pcu.closest_points_on_mesh(work.points, frame.first, work.faces)[0]


def _winding(work: Work):
    def step(frame: Frame):
        return pcu.triangle_soup_fast_winding_number(frame.first, work.faces, work.points)

    return step


def _first_hits(work: Work):
    def step(frame: Frame):
        found = pcu.ray_mesh_intersection(frame.first, work.faces, work.origins, work.directions)
        return np.where(found[0] >= 0, found[2], np.inf)

    return step


answers = {
    "closest points": _closest,
    "inside": lambda w: (_winding(w), lambda x: x > 0.5),
    "winding numbers": _winding,
    "first hits": _first_hits,
}
