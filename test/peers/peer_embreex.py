"""embreex: Embree 4 for rays, in single precision. Made anew in each step: no refit is bound."""

from __future__ import annotations

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from scenes import Frame, Work

precision = "single"
update = "rebuild"
absent = {
    "closest points": "rtcPointQuery is not bound",
    "inside": "only by counting rays",
    "winding numbers": "rays only",
    "": "rays only: rtcCollide is not bound",
}


def _first_hits(work: Work):
    origins, directions = work.origins.astype(np.float32), work.directions.astype(np.float32)

    def step(frame: Frame):
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, frame.first.astype(np.float32), work.faces)
        found = scene.run(origins, directions, output=True)
        return np.where(found["primID"] >= 0, found["tfar"], np.inf)

    return step


answers = {"first hits": _first_hits}
