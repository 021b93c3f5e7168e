"""Warp on the CPU: wp.Mesh, refit in each step, one thread, single precision."""

from __future__ import annotations

import numpy as np
import warp as wp

from scenes import Frame, Work

precision = "single"
update = "refit"
absent = {
    "winding numbers": "mesh_query_point_sign_winding_number returns the sign only",
    "distance": "kernels to write: mesh_query_aabb gives triangles in a box",
    "contacts": "a kernel to write: mesh_query_aabb and intersect_tri_tri",
    "": "no such query",
}

wp.config.quiet = True
wp.init()


@wp.kernel
def _closest_kernel(mesh: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=float)):
    i = wp.tid()
    found = wp.mesh_query_point_no_sign(mesh, points[i], 1.0e30)
    nearest = wp.mesh_eval_position(mesh, found.face, found.u, found.v)
    out[i] = wp.length(points[i] - nearest)


@wp.kernel
def _inside_kernel(mesh: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=float)):
    i = wp.tid()
    found = wp.mesh_query_point_sign_winding_number(mesh, points[i], 1.0e30)
    out[i] = found.sign


@wp.kernel
def _ray_kernel(
    mesh: wp.uint64,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    out: wp.array(dtype=float),
):
    i = wp.tid()
    found = wp.mesh_query_ray(mesh, origins[i], directions[i], 1.0e30)
    out[i] = -1.0
    if found.result:
        out[i] = found.t


def _one(work: Work, kernel, inputs: list[np.ndarray], solid: bool = False):
    arrays = [wp.array(x.astype(np.float32), dtype=wp.vec3, device="cpu") for x in inputs]
    out = wp.zeros(len(inputs[0]), dtype=float, device="cpu")
    mesh = wp.Mesh(
        wp.array(work.frames[0].first.astype(np.float32), dtype=wp.vec3, device="cpu"),
        wp.array(work.faces.ravel(), dtype=wp.int32, device="cpu"),
        support_winding_number=solid,
    )

    def step(frame: Frame):
        mesh.points.numpy()[:] = frame.first
        mesh.refit()
        wp.launch(kernel, len(inputs[0]), inputs=[mesh.id, *arrays, out], device="cpu")
        return out.numpy().copy()

    return step


answers = {
    "closest points": lambda w: _one(w, _closest_kernel, [w.points]),
    "inside": lambda w: (_one(w, _inside_kernel, [w.points], True), lambda sign: sign < 0),
    "first hits": lambda w: (
        _one(w, _ray_kernel, [w.origins, w.directions]),
        lambda t: np.where(t >= 0, t, np.inf),
    ),
}
