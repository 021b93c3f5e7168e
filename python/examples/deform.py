"""A sheet is pressed onto a ball, and follows it."""
import numpy as np

import adaptive_bvh as ab

x, y = np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-2, 2, 41), indexing="ij")
corner = np.arange(41 * 41).reshape(41, 41)
a, b, c, d = (m.ravel() for m in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
sheet = ab.DeformableMesh(np.stack([x, y, 0 * x + 2], axis=-1).reshape(-1, 3), faces)
ball = ab.Sphere(1)
for step in range(1, 11):
    z = 2 - 0.11 * step * np.exp(-(x**2 + y**2))  # its middle sinks
    sheet.update(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    # 0 where they touch
    distance, contacts = ab.distance(sheet, ball).distance, ab.collide(sheet, ball)
    print(f"step {step}: distance {max(distance, 0):.4f}, {len(contacts)} contacts")
