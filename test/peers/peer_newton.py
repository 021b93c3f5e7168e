"""Newton on the CPU. Its soft contacts are vertices near a mesh of constant shape."""

from __future__ import annotations

import newton  # noqa: F401  (the rows say what it lacks; its absence must be noticed)

precision = "single"
update = "rebuild"
absent = {
    "closest points": "by wp.Mesh: see warp",
    "inside": "by wp.Mesh: see warp",
    "winding numbers": "by wp.Mesh: see warp",
    "first hits": "intersect_ray is of shapes; of meshes by wp.Mesh: see warp",
    "pairs within d": "TriMeshCollisionDetector belongs to SolverVBD, which makes and updates it",
    "self-contacts": "within SolverVBD only, vertex-triangle and edge-edge pairs within a radius",
    "": "no such query without its solver",
}

answers: dict = {}
