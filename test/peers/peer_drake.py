"""Drake's SceneGraph. A mesh cannot move its vertices: all is registered anew in each step."""

from __future__ import annotations

import logging

from pydrake.common.value import Value
from pydrake.geometry import (
    Convex,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)
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


def _register(graph: SceneGraph, source, name: str, shape) -> tuple:
    frame = graph.RegisterFrame(source, GeometryFrame(name))
    instance = GeometryInstance(RigidTransform(), shape, name)
    instance.set_proximity_properties(ProximityProperties())
    return frame, graph.RegisterGeometry(source, frame, instance)


def _signed(work: Work):
    """Distance of convex hulls, which are computed from the vertices in each step."""

    def step(frame: Frame):
        graph = SceneGraph()
        source = graph.RegisterSource("peers")
        made = [
            _register(graph, source, name, Convex(x.T, name))
            for name, x in [("first", frame.first), ("second", frame.second)]
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
