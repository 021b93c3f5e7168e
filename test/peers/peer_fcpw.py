"""fcpw, in single precision. refit after new vertices, or a new tree in each step."""

from __future__ import annotations

import fcpw
import numpy as np

from scenes import Frame, Work

precision = "single"
update = {"": "refit"}
absent = {
    "winding numbers": "contains() counts hits of a ray",
    "distance": "queries of points, rays and balls only",
    "": "queries of points, rays and balls only",
}


def _columns(array: np.ndarray) -> np.ndarray:
    return np.asfortranarray(array, dtype=np.float32)


def _build(work: Work, frame: Frame):
    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(_columns(frame.first), 0)
    scene.set_object_triangles(np.asfortranarray(work.faces, dtype=np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True)
    return scene


def _one(work: Work, ask) -> dict:
    scene = _build(work, work.frames[0])

    def step(frame: Frame):
        # Only a list of single points updates an object: the array's overload replaces it.
        scene.update_object_vertices(fcpw.float_3D_list(list(frame.first.astype(np.float32))), 0)
        scene.refit()
        return ask(scene)

    return step


def _rebuilt(work: Work, ask):
    return lambda frame: ask(_build(work, frame))


def _closest(work: Work):
    points, radii = _columns(work.points), np.full(len(work.points), np.inf, np.float32)

    def ask(scene):
        found = fcpw.interaction_3D_list()
        scene.find_closest_points(points, radii, found)
        return found

    return ask, lambda found: np.array([x.d for x in found])


def _inside(work: Work):
    """Lists of points: contains() with arrays fills a copy of `result`, which stays 0 (1.2.0)."""
    points = fcpw.float_3D_list(list(work.points.astype(np.float32)))

    def ask(scene):
        result = fcpw.uint32_list()
        scene.contains(points, result)
        return result

    return ask, lambda found: np.array([found[i] for i in range(len(work.points))])


def _first_hits(work: Work):
    origins, directions = _columns(work.origins), _columns(work.directions)
    bounds = np.full(len(origins), np.inf, np.float32)

    def ask(scene):
        found = fcpw.interaction_3D_list()
        scene.intersect(origins, directions, bounds, found)
        return found

    none = 0xFFFFFFFF
    return ask, lambda found: np.array(
        [x.d if x.primitive_index not in (-1, none) else np.inf for x in found]
    )


def _both(prepare) -> dict:
    def make(way):
        def factory(work: Work):
            ask, read = prepare(work)
            return way(work, ask), read

        return factory

    return {"refit": make(_one), "rebuild": make(_rebuilt)}


answers = {
    "closest points": _both(_closest),
    "inside": _both(_inside),
    "first hits": _both(_first_hits),
}
