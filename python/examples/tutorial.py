"""A ball falls into a net: distance, contact forces, a scene, rays, and a page that plays the run.

    python3 tutorial.py              # prints what it finds
    python3 tutorial.py page.html    # also writes the page
"""
import pickle
import sys

import numpy as np

import adaptive_bvh as ab


def grid(n, size):
    """n x n squares in the plane z = 0, two triangles each: vertices (N, 3), faces (M, 3)."""
    line = np.linspace(-size / 2, size / 2, n + 1)
    x, y = np.meshgrid(line, line)
    corner = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, 1:].ravel(), corner[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), faces


def ball_mesh(n, radius):
    """A closed mesh around the origin: six grids, blown up, and welded along their sides."""
    plane, faces = grid(n, 2.0)
    plane[:, 2] = 1
    sides = [plane, plane * (-1, 1, -1)]  # up and down; then the same along x and y
    axes = [0, 1, 2], [2, 0, 1], [1, 2, 0]
    sides = np.concatenate([side[:, order] for order in axes for side in sides])
    faces = np.concatenate([faces + k * len(plane) for k in range(6)])
    round_ = radius * sides / np.linalg.norm(sides, axis=1)[:, None]
    return ab.weld_vertices(round_, faces, 1e-6 * radius)


def at(x, y, z):
    """A pose: the rotation and the translation that place a body in the world."""
    return np.eye(3), (x, y, z)


# ---- 1. A mesh that deforms, and its distance to a shape -----------------------------------------
# A DeformableMesh is built once. update() takes the positions of a step, and every query then
# answers for them. Lengths are in metres.
rest, faces = grid(24, 1.0)
net = ab.DeformableMesh(rest, faces)
radius, height = 0.15, 0.4
ball = ab.Sphere(radius)
found = ab.distance(net, ball, tf2=at(0, 0, height))
low, high = found.points[:, 2]  # the nearest points
print(f"1. distance {found.distance:.4f} m, between z = {low:.4f} and {high:.4f}")

# ---- 2. Contact forces, and a page ---------------------------------------------------------------
# vertex_contacts() returns the vertices that are nearer than `distance` to the ball or inside of
# it, with their distance, area, and the normal from the net to the ball: a penalty force is one
# line. The net is a system of springs, its frame is fixed.
edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
lengths = np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1)
is_fixed = np.abs(rest[:, :2]).max(axis=1) > 0.499
spring, stiffness, distance = 300.0, 5e5, 0.005  # N/m, pressure per length in N/m^3, m
vertex_mass, ball_mass, gravity, damping, dt = 0.002, 0.5, 9.81, 6.0, 5e-4  # kg, m/s^2, 1/s, s

recording = ab.Recording(title="A ball falls into a net", unit="m") if len(sys.argv) > 1 else None
if recording:
    recording.add(net, name="net")
    drawn_ball = recording.add(ball, at(0, 0, height), name="ball")

x, v, speed = rest.copy(), 0 * rest, 0.0
for step in range(6001):
    net.update(x)
    contacts = ab.vertex_contacts(net, ball, distance, tf2=at(0, 0, height))
    size = stiffness * (distance - contacts.distances) * contacts.areas
    contact_force = size[:, None] * contacts.normals  # on the ball, N
    force = np.zeros_like(x)
    force[contacts.vertices] -= contact_force
    along = x[edges[:, 1]] - x[edges[:, 0]]
    length = np.linalg.norm(along, axis=1)
    pull = (spring * (length - lengths) / length)[:, None] * along
    for k in range(3):
        force[:, k] += np.bincount(edges[:, 0], pull[:, k], len(x))
        force[:, k] -= np.bincount(edges[:, 1], pull[:, k], len(x))
    v += dt * (force / vertex_mass - damping * v - (0, 0, gravity))
    v[is_fixed] = 0
    lift = contact_force[:, 2].sum()
    speed += dt * (lift / ball_mass - damping * speed - gravity)
    if step % 1000 == 0:
        now = f"ball at {height:.3f} m, {len(contacts)} contacts, {lift:.2f} N"
        print(f"2. t = {step * dt:.1f} s: {now}")
    if recording and step % 40 == 0:
        recording.place(drawn_ball, at(0, 0, height))
        recording.frame(arrows={"force on the net, N": (contacts.positions, -contact_force)},
                        note=f"{len(contacts)} vertices push with {lift:.2f} N")
    x += dt * v
    height += dt * speed
print(f"2. the net bears {lift / (ball_mass * gravity):.3f} of the ball's weight")
if recording:
    recording.write(sys.argv[1])

# ---- 3. Many bodies ------------------------------------------------------------------------------
# A Scene finds the pairs that may be near. update() comes after all changes of a step.
scene = ab.Scene()
bodies = {scene.add(net): "net", scene.add(ball, at(0, 0, height)): "ball"}
post = ab.DeformableMesh(ball_mesh(6, 0.1))
for i, corner in enumerate([(-0.6, -0.6, 0), (0.6, -0.6, 0), (0.6, 0.6, 0), (-0.56, 0.56, 0)]):
    bodies[scene.add(post, at(*corner))] = f"post {i}"  # several bodies may share a mesh
scene.update()
for a, b in scene.collide().bodies:
    print(f"3. touching: {bodies[a]} and {bodies[b]}")
for near in scene.nearest(0, 3):
    print(f"3. {bodies[near.bodies[1]]} is {max(near.distance, 0):.4f} m from the net")

# ---- 4. Rays -------------------------------------------------------------------------------------
# A depth camera above the net: the first hit of each of many rays, and which of the points that it
# sees a lamp lights: no triangle between them (any_hit) on the segment from 0 to 1.
pixels, _ = grid(99, 1.2)
eye, lamp = np.array([0.0, 0.0, 1.0]), np.array([0.9, 0.0, 0.02])
seen = ab.first_hit(net, np.tile(eye, (len(pixels), 1)), pixels - eye)
is_hit = seen.triangles >= 0
points = eye + seen.t[is_hit, None] * (pixels[is_hit] - eye)
lit = ~ab.any_hit(net, np.tile(lamp, (len(points), 1)), points - lamp, end=0.999)
deepest = points[:, 2].min()
hits = f"{is_hit.sum()} of {len(pixels)} rays hit"
print(f"4. {hits}, deepest at z = {deepest:.3f} m, {lit.mean():.0%} lit")

# ---- 5. Files and other processes ----------------------------------------------------------------
# A pickle, or save() and load(), keeps the tree: a worker process needs no build.
copy = pickle.loads(pickle.dumps(net))
is_same = ab.distance(copy, ball).distance == ab.distance(net, ball).distance
print("5. the copy answers the same:", is_same)
