"""A soft ring is pressed into the ground: the signs of distances, normals and contact forces.

    python3 contact_signs.py              # prints the forces
    python3 contact_signs.py page.html    # also writes a page that shows them
"""
import sys

import numpy as np

import adaptive_bvh as ab

radius, width, distance, stiffness = 0.3, 0.12, 0.02, 1e6  # m, m, m, pressure per length in N/m^3
around, across = 72, 6

# A ring around the y axis, of squares with two triangles each.
angle, y = np.meshgrid(np.linspace(0, 2 * np.pi, around, endpoint=False),
                       np.linspace(-width / 2, width / 2, across + 1), indexing="ij")
rest = np.stack([radius * np.sin(angle), y, -radius * np.cos(angle)], axis=-1).reshape(-1, 3)
index = np.arange(len(rest)).reshape(angle.shape)
a, b = index[:, :-1].ravel(), np.roll(index, -1, axis=0)[:, :-1].ravel()
faces = np.concatenate([np.stack([a, b, b + 1], axis=1), np.stack([a, b + 1, a + 1], axis=1)])
ring, ground = ab.DeformableMesh(rest, faces), ab.Halfspace([0, 0, 1])  # solid below z = 0

recording = None
if len(sys.argv) > 1:
    recording = ab.Recording(title="A soft ring is pressed into the ground", unit="m")
    recording.add(ring, name="ring")
    recording.add(ground, name="ground")

for depth in (-0.01, 0.01, 0.03):
    ring.update(rest + [0, 0, radius - depth])
    contacts = ab.vertex_contacts(ring, ground, distance)
    size = stiffness * (distance - contacts.distances) * contacts.areas
    force = -size[:, None] * contacts.normals
    print(f"distance {-depth:+.2f} m: {len(contacts)} vertices, {force[:, 2].sum():.1f} N upward")
    if recording:
        all_distances = ab.vertex_contacts(ring, ground, np.inf).distances  # of every vertex
        recording.frame(
            vertex_distances={0: np.clip(all_distances, -0.03, 0.03)},
            arrows={"force on the ring, N": (contacts.positions, force),
                    "normal": (contacts.positions, contacts.normals, 0.05)},
            note=f"{len(contacts)} vertices are nearer than {1e3 * distance:.0f} mm, or inside")
if recording:
    recording.write(sys.argv[1])
