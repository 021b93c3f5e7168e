"""The recipes of docs/guide.md: this library beside simulators, viewers and learning."""

import time

import numpy as np
import pytest

import adaptive_bvh as ab
from scenes import grid, sphere

MARGIN = 0.01  # where contact begins, a length


def torus(around=48, across=24, outer=0.3, inner=0.1):
    """A closed mesh that no convex body is: vertices, faces."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * i / around, 2 * np.pi * j / across
    r = outer + inner * np.cos(b)
    vertices = np.stack([r * np.cos(a), r * np.sin(a), inner * np.sin(b)], -1).reshape(-1, 3)
    at = lambda i, j: ((i % around) * across + j % across).ravel()  # noqa: E731
    p, q, s, t = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return vertices, np.concatenate([np.stack([p, q, s], 1), np.stack([p, s, t], 1)])


def contact_forces(cloth, obstacle, stiffness):
    """Forces on the cloth's vertices, (N, 3); force and torque about the origin on the obstacle."""
    contacts = ab.vertex_contacts(cloth, obstacle, MARGIN)
    depth = MARGIN - contacts.distances
    push = (stiffness * depth * contacts.areas)[:, None] * contacts.normals  # on the obstacle
    forces = np.zeros((cloth.num_vertices, 3))
    np.add.at(forces, contacts.vertices, -push)
    torque = np.cross(contacts.nearest_points, push).sum(axis=0)
    return forces, np.concatenate([push.sum(axis=0), torque])


def falls_and_rests(step, positions, steps, weight):
    """Runs a simulation; the obstacle bears the weight at the end, and nothing went through it."""
    obstacle = ab.DeformableMesh(*torus())
    uv, faces = grid(int(np.sqrt(len(positions()))) - 1)
    cloth = ab.DeformableMesh(positions(), faces)
    borne = []
    for i in range(steps):
        cloth.update(positions())  # read in place
        forces, wrench = contact_forces(cloth, obstacle, 3e5)
        step(forces)
        if i > 0.8 * steps:
            borne.append(-wrench[2])
    assert np.mean(borne) == pytest.approx(weight, rel=0.15)
    assert ab.signed_distances(obstacle, np.asarray(positions(), float)).min() > -MARGIN
    assert np.abs(wrench[3:5]).max() < 0.1 * weight  # it lies in the middle


def test_a_flex_of_mujoco_rests_on_a_concave_mesh():
    """MuJoCo has the cloth's elasticity, this library the contact with the torus."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string("""
      <mujoco><option timestep="0.001" integrator="discrete"/><worldbody>
        <flexcomp name="cloth" type="grid" dim="2" count="17 17 1" spacing=".04 .04 .04"
                  pos="0 0 .115" mass=".2" radius=".001">
          <contact contype="0" conaffinity="0" selfcollide="none"/>
          <elasticity young="3e4" poisson="0.2" thickness="2e-3" damping="1e-2" elastic2d="both"/>
        </flexcomp></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = model.flex_vertbodyid

    def step(forces):
        data.xfrc_applied[bodies, :3] = forces - 0.05 * data.qvel.reshape(-1, 3)  # and drag
        mujoco.mj_step(model, data)

    falls_and_rests(step, lambda: data.flexvert_xpos, 1500, weight=0.2 * 9.81)


def newton_cloth(count, spacing, height, mass):
    newton = pytest.importorskip("newton")
    wp = pytest.importorskip("warp")
    wp.config.quiet = True
    builder = newton.ModelBuilder()
    half = spacing * count / 2
    builder.add_cloth_grid(
        pos=wp.vec3(-half, -half, height), rot=wp.quat_identity(), vel=wp.vec3(0.0, 0.0, 0.0),
        dim_x=count, dim_y=count, cell_x=spacing, cell_y=spacing, mass=mass / (count + 1) ** 2,
        tri_ke=100.0, tri_ka=100.0, tri_kd=0.1, edge_ke=0.01, edge_kd=0.001,
        particle_radius=0.001,
    )  # fmt: skip
    with wp.ScopedDevice("cpu"):
        model = builder.finalize()
        return newton, wp, model


def test_a_cloth_of_newton_rests_on_a_concave_mesh():
    """Newton integrates the cloth; particle_f takes the forces. Its arrays are read in place."""
    newton, wp, model = newton_cloth(16, 0.04, 0.115, 0.2)
    with wp.ScopedDevice("cpu"):
        solver = newton.solvers.SolverSemiImplicit(model=model)
        states, dt = [model.state(), model.state()], 5e-4

        def step(forces):
            before, after = states
            before.clear_forces()
            before.particle_f.assign((forces - 0.05 * before.particle_qd.numpy()).astype(np.float32))
            solver.step(before, after, None, None, dt)
            states.reverse()

        falls_and_rests(step, lambda: states[0].particle_q, 3000, weight=0.2 * 9.81)


def skinned(bend):
    """A body of 10,000 triangles whose two arms bend towards each other by linear blend skinning."""
    uv, faces = sphere(40, 42)
    rest = uv * [0.15, 0.15, 0.3]
    points, all_faces = [rest], [faces]
    for side in (-1, 1):
        arm = uv[:, [2, 0, 1]] * [0.4, 0.06, 0.06] + [side * 0.5, 0.0, 0.15]
        points.append(arm)
        all_faces.append(faces + len(uv) * len(all_faces))
    x = np.concatenate(points)
    shoulder = np.array([0.1, 0.0, 0.15])
    moved = x.copy()
    for side in (-1, 1):
        weight = np.clip((side * x[:, 0] - 0.1) / 0.2, 0.0, 1.0)[:, None]
        c, s = np.cos(bend), np.sin(bend)
        turn = np.array([[c, s * side, 0.0], [-s * side, c, 0.0], [0.0, 0.0, 1.0]])
        about = shoulder * [side, 1, 1]
        moved += weight * ((x - about) @ turn.T + about - x)
    return moved, np.concatenate(all_faces)


def test_self_intersection_of_a_skinned_body():
    """In place of an unmaintained CUDA extension (mesh_intersection): pairs of triangles that meet,
    of parts that are not neighbours."""
    vertices, faces = skinned(0.0)
    part = np.arange(len(faces)) // (len(faces) // 3)
    mesh = ab.DeformableMesh(vertices, faces)
    same_part = ab.SurfaceNeighbourhood.by_labels(mesh, part)
    counts, seconds = [], []
    for bend in np.linspace(0.0, 2.4, 25):
        moved, _ = skinned(bend)
        begin = time.perf_counter()
        mesh.update(moved)
        pairs = ab.self_collide(mesh, enable_contact=False, ignored=same_part).pairs
        seconds.append(time.perf_counter() - begin)
        arms = np.isin(part[pairs], [1, 2]).all(axis=1)
        counts.append(int(arms.sum()))
    assert len(faces) >= 10_000 and counts[0] == 0 and counts[-1] > 0
    print(f"\n{len(faces)} triangles: {1e3 * min(seconds):.2f} ms a frame, {counts[-1]} pairs at the end")


def test_meshes_of_pyvista_in_place():
    pyvista = pytest.importorskip("pyvista")
    surface = pyvista.Sphere(radius=1.0, theta_resolution=40, phi_resolution=40)
    part = pyvista.Sphere(radius=0.5, center=(2.0, 0.0, 0.0))
    mesh = ab.DeformableMesh(surface.points, surface.regular_faces)
    other = ab.DeformableMesh(part.points, part.regular_faces)
    surface["clearance"] = ab.vertex_distances(mesh, other)
    nearest = surface.points[np.argmin(surface["clearance"])]
    assert np.linalg.norm(nearest - [1, 0, 0]) < 0.1
    surface.points[:, 0] *= 1.2  # in place, float32
    mesh.update(surface.points)
    assert ab.distance(mesh, other).distance == pytest.approx(0.3, abs=0.01)


def test_meshes_of_trimesh_in_place():
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3)
    mesh = ab.DeformableMesh(ball)  # anything with vertices and faces
    ball.vertices[:, 2] *= 2.0
    mesh.update(ball.vertices)
    assert ab.distance(mesh, ab.Sphere(1.0), tf2=(np.eye(3), (0, 0, 4.0))).distance == (
        pytest.approx(1.0, abs=0.01)
    )
    back = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert back.volume == pytest.approx(ball.volume)


def test_distances_in_torch():
    """The torch.autograd.Function of docs/guide.md, by gradcheck and in a descent."""
    torch = pytest.importorskip("torch")
    import pathlib
    import re

    guide = pathlib.Path(__file__).resolve().parents[3] / "docs" / "guide.md"
    (program,) = re.findall(r"```python\n(import numpy as np\nimport torch\n.*?)```",
                            guide.read_text(), re.S)
    names = {}
    exec(program, names)
    apply = names["FeatureDistances"].apply
    uv, faces = grid(4)
    low = np.concatenate([uv, np.zeros((len(uv), 1))], 1)
    points = np.concatenate([low, low + [0.03, 0.02, 0.05]])
    mesh = ab.DeformableMesh(points, np.concatenate([faces, faces + len(low)]))
    pairs = ab.self_feature_pairs_within(mesh, 0.08)
    x = torch.tensor(points, requires_grad=True)
    assert torch.autograd.gradcheck(lambda y: apply(y, mesh, pairs), (x,), eps=1e-7, atol=1e-4)
    loss = ((apply(x, mesh, pairs) - 0.1) ** 2).sum()
    loss.backward()
    with torch.no_grad():
        x -= 0.01 * x.grad
    assert ((apply(x, mesh, pairs) - 0.1) ** 2).sum() < loss
