"""MuJoCo. A mesh geom is a constant of the model, and collides as its convex hull; a flex moves.

A flex moves by writing flexvert_xpos of the data, and mj_collision after it.
"""

from __future__ import annotations

import mujoco
import numpy as np

from scenes import Frame, Work

# Vertices of meshes are in single precision.
precision = {"": "double", "signed distance": "single"}
update = {"": "rebuild", "first hits": "refit"}
absent = {
    "closest points": "mj_geomDistance is of two geoms, and takes convex hulls",
    "inside": "none",
    "winding numbers": "none",
    "distance": "mj_geomDistance takes convex hulls, and no flex",
    "contacts": "a flex reports contact points of its elements, thinned; no list of pairs",
    "self-intersection": "contacts of a flex with itself leave out pairs that are near on it",
    "self-contacts": "contacts of a flex with itself leave out pairs that are near on it",
    "shape distance": "mj_geomDistance takes the convex hull of the mesh",
    "scene distance": "one call of mj_geomDistance for each pair, of convex hulls",
    "scene contacts": "of convex hulls, whose meshes are constants of the model",
    "": "no such query",
}


def _signed(work: Work):
    """Convex hulls: the model is compiled in each step, since its meshes are constants."""

    def step(frame: Frame):
        spec = mujoco.MjSpec()
        for name, x, f in [
            ("a", frame.first, work.faces),
            ("b", frame.second, work.other_faces),
        ]:
            spec.add_mesh(name=name, uservert=x.ravel(), userface=f.ravel())
            body = spec.worldbody.add_body(name=name)
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        return mujoco.mj_geomDistance(model, data, 0, 1, 10.0, np.zeros(6))

    return step


def _flex(work: Work) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A model with one flex of triangles."""
    vertices = " ".join(map(repr, work.frames[0].first.ravel().tolist()))
    elements = " ".join(map(str, work.faces.ravel().tolist()))
    text = f"""<mujoco><worldbody><body name="b"/></worldbody><deformable>
      <flex name="x" dim="2" body="b" radius="1e-9" vertex="{vertices}" element="{elements}"/>
      </deformable></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _first_hits(work: Work):
    """mj_rayFlex goes through all elements: one call a ray."""
    model, data = _flex(work)

    def step(frame: Frame):
        data.flexvert_xpos[:] = frame.first
        rays = zip(work.origins, work.directions)
        found = [
            mujoco.mj_rayFlex(model, data, 0, False, False, True, False, 0, o, d) for o, d in rays
        ]
        return np.array(found)

    return step, lambda t: np.where(t >= 0, t, np.inf)


answers = {"signed distance": _signed, "first hits": _first_hits}
