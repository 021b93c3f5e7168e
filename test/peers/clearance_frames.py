"""FCL's manager beside `adaptive_bvh clearance`, on the frames that examples/tools/harness writes.

FCL answers at the frames alone. Its manager finds the nearest part; the distances to all parts are
those of the pairs one by one, and are asked in every tenth frame. python-fcl has no refit, so a model
is built anew for each frame; its time is printed apart.

    PYTHONPATH=<folder of adaptive_bvh> clearance_frames.py FOLDER [--frames N]
"""

from __future__ import annotations

import argparse
import pathlib
import resource
import subprocess
import sys
import time

import fcl
import numpy as np

import adaptive_bvh as ab

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--frames", type=int, default=10**9, help="how many; default: all")
arguments = parser.parse_args()


def fcl_object(mesh: ab.Mesh) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.faces))
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform())


frames = sorted(arguments.folder.glob("harness_*.ply"))[:arguments.frames]
parts = sorted((arguments.folder / "bay").glob("*.stl"))
manager = fcl.DynamicAABBTreeCollisionManager()
part_objects = [fcl_object(ab.load_mesh(path)) for path in parts]
manager.registerObjects(part_objects)
manager.setup()

seconds = {"reading": 0.0, "building": 0.0, "nearest part": 0.0}
distances, of_all_parts = [], []
for number, path in enumerate(frames):
    begin = time.process_time()
    mesh = ab.load_mesh(path, weld=False)
    read = time.process_time()
    harness = fcl_object(mesh)
    built = time.process_time()
    data = fcl.DistanceData()
    manager.distance(harness, data, fcl.defaultDistanceCallback)
    distances.append(data.result.min_distance)
    for name, passed in zip(seconds, (read - begin, built - read, time.process_time() - built)):
        seconds[name] += passed
    if number % 10 == 0:
        begin = time.process_time()
        for part in part_objects:
            fcl.distance(harness, part, fcl.DistanceRequest(), fcl.DistanceResult())
        of_all_parts.append(time.process_time() - begin)

before = resource.getrusage(resource.RUSAGE_CHILDREN)
tool = subprocess.run([sys.executable, "-m", "adaptive_bvh", "clearance", "--threads", "1",
                       "--clearance", "5mm", "--moving", *frames, "--parts", *parts],
                      capture_output=True, text=True)
after = resource.getrusage(resource.RUSAGE_CHILDREN)
ours = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

lowest = int(np.argmin(distances))
print(f"{len(frames)} frames, {len(parts)} parts")
print("FCL at the frames: " + ", ".join(f"{name} {passed:.3g} s" for name, passed in seconds.items())
      + f", each part {np.mean(of_all_parts) * len(frames):.3g} s (by every tenth frame)")
print(f"least {distances[lowest]:.4f} mm in frame {lowest + 1}, "
      f"{sum(d < 5 for d in distances)} frames below 5 mm")
print(f"adaptive_bvh clearance, over the motion, each part: {ours:.3g} s with start and files; says:")
print(tool.stdout)
