"""Drake's SceneGraph. A mesh cannot move its vertices: all is registered anew in each step."""

from __future__ import annotations

import io
import logging

import numpy as np
from pydrake.geometry import InMemoryMesh, Mesh, ProximityProperties, SceneGraph
from pydrake.geometry import Box, Capsule, Convex, GeometryFrame, GeometryInstance, Sphere
from pydrake.geometry import FramePoseVector
from pydrake.common import MemoryFile
from pydrake.common.value import Value
from pydrake.math import RigidTransform

from scenes import Frame, Work

logging.getLogger("drake").setLevel(logging.ERROR)

precision = "double"
update = "rebuild"
absent = {
    "closest points": "see signed distances to points, one call a point; open meshes are refused",
    "inside": "by the sign of ComputeSignedDistanceToPoint, one call a point",
    "winding numbers": "none",
    "first hits": "no rays",
    "distance": "of convex hulls: a mesh that is not convex has another distance",
    "contacts": "ComputeContactSurfaces needs a compliant body with a volume mesh",
    "self-intersection": "RegisterDeformableGeometry needs a tetrahedral mesh",
    "self-contacts": "RegisterDeformableGeometry needs a tetrahedral mesh",
    "shape distance": "of the convex hull of the mesh: the sheet is not convex",
    "scene distance": "of convex hulls: the balls are not convex when they are squeezed",
    "scene contacts": "of convex hulls: HasCollisions",
    "": "no such query",
}


def _obj(positions: np.ndarray, faces: np.ndarray) -> InMemoryMesh:
    text = io.StringIO()
    for x in positions.tolist():
        text.write(f"v {x[0]!r} {x[1]!r} {x[2]!r}\n")
    for f in (faces + 1).tolist():
        text.write(f"f {f[0]} {f[1]} {f[2]}\n")
    return InMemoryMesh(MemoryFile(text.getvalue(), ".obj", "mesh"))


def _register(graph, source, shape) -> tuple:
    frame = graph.RegisterFrame(source, GeometryFrame("f" + str(graph.model_inspector().num_frames())))
    instance = GeometryInstance(RigidTransform(), shape, "g" + str(frame))
    instance.set_proximity_properties(ProximityProperties())
    return frame, graph.RegisterGeometry(source, frame, instance)


def _signed(work: Work):
    """Distance of convex hulls; the mesh goes through the text of an OBJ file."""

    def step(frame: Frame):
        graph = SceneGraph()
        source = graph.RegisterSource("peers")
        made = [
            _register(graph, source, Convex(_obj(x, f), 1.0))
            for x, f in [(frame.first, work.faces), (frame.second, work.other_faces)]
        ]
        context = graph.CreateDefaultContext()
        poses = FramePoseVector()
        for frame_id, _ in made:
            poses.set_value(frame_id, RigidTransform())
        graph.get_source_pose_port(source).FixValue(context, Value[FramePoseVector](poses))
        query = graph.get_query_output_port().Eval(context)
        return query.ComputeSignedDistancePairClosestPoints(made[0][1], made[1][1]).distance

    return step


answers = {"signed distance": _signed}
