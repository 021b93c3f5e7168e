"""Times what plugs into trimesh and ipc-toolkit beside what it replaces, in turns in one process.

    PYTHONPATH=<folder of our module> build/peers/venv/bin/python test/peers/plug_ins.py [--csv FILE]

A row is a task: milliseconds of the processor for a step, the least of all rounds. Both do the same work on the same
arrays, one thread; answers are compared. docs/figures.py makes the table of docs/compared_with.md.
"""

from __future__ import annotations

import argparse
import csv
import time

import ipctk
import numpy as np
import trimesh

import adaptive_bvh.ipctk
import adaptive_bvh.trimesh
from scenes import DATA, sphere


def crowd(count=100):
    """Balls that move and deform: faces, positions of a step in the world (count, N, 3)."""
    vertices, faces = sphere(16, 10)
    random = np.random.default_rng(7)
    at, speed = random.uniform(-6, 6, (count, 3)), random.normal(0, 0.05, (count, 3))

    def positions(step):
        dent = 1 + 0.2 * np.sin(3 * vertices[:, 2] + 0.3 * step)
        return (vertices * dent[:, None])[None] + (at + step * speed)[:, None]

    return faces, positions


def manager_of(kind, faces, positions):
    manager = kind()
    for i, x in enumerate(positions(0)):
        manager.add_object(str(i), trimesh.Trimesh(x, faces, process=False))
    return manager


def managers_of_crowd():
    """Ours and theirs, with the crowd's faces and positions."""
    faces, positions = crowd()
    kinds = adaptive_bvh.trimesh.CollisionManager, trimesh.collision.CollisionManager
    return *(manager_of(kind, faces, positions) for kind in kinds), faces, positions


def deforming(ask):
    """Vertices move: trimesh's manager gets the object anew."""

    def make():
        ours, theirs, faces, positions = managers_of_crowd()

        def step_ours(step):
            for i, x in enumerate(positions(step)):
                ours.update_object(str(i), x)
            return ask(ours)

        def step_theirs(step):
            for i, x in enumerate(positions(step)):
                theirs.remove_object(str(i))
                theirs.add_object(str(i), trimesh.Trimesh(x, faces, process=False))
            return ask(theirs)

        return len(positions(0)) * len(faces), step_ours, step_theirs

    return make


def rigid(ask):
    """Poses move."""

    def make():
        ours, theirs, faces, positions = managers_of_crowd()

        def stepping(manager):
            def step(number):
                for i in range(0, len(positions(0)), 2):
                    pose = trimesh.transformations.translation_matrix([0, 0, 0.03125 * number])
                    manager.set_transform(str(i), pose)
                return ask(manager)

            return step

        return len(positions(0)) * len(faces), stepping(ours), stepping(theirs)

    return make


def cloth():
    """Two frames of a simulation: mesh, positions of both."""
    frames = [trimesh.load(f"{DATA}/cloth_funnel_{i}.ply", process=False) for i in (227, 228)]
    faces = np.asfortranarray(frames[0].faces, dtype=np.int32)
    x, y = (np.asfortranarray(frame.vertices) for frame in frames)
    return ipctk.CollisionMesh(x, ipctk.edges(faces), faces), x, y


def with_broad_phases(ask):
    def make():
        mesh, x, y = cloth()
        ours, theirs = adaptive_bvh.ipctk.BroadPhase(), ipctk.LBVH()
        steps = [lambda step, b=b: ask(mesh, x, y, b) for b in (ours, theirs)]
        return len(mesh.faces), *steps

    return make


def near(mesh, x, y, broad_phase):
    found = ipctk.NormalCollisions()
    found.build(mesh, x, 1e-3 * np.ptp(x, axis=0).max(), 0.0, broad_phase)
    return len(found)


def safe_step(mesh, x, y, broad_phase):
    return ipctk.compute_collision_free_stepsize(mesh, x, y, 0.0, broad_phase)


def intersects(mesh, x, y, broad_phase):
    return ipctk.has_intersections(mesh, x, broad_phase)


def pairs_of_names(manager):
    return manager.in_collision_internal(return_names=True)


def least(manager):
    return max(manager.min_distance_internal(), 0.0)


TASKS = {
    ("trimesh, python-fcl", "names of touching pairs, vertices move"): deforming(pairs_of_names),
    ("trimesh, python-fcl", "least distance, vertices move"): deforming(least),
    ("trimesh, python-fcl", "names of touching pairs, poses move"): rigid(pairs_of_names),
    ("ipctk, LBVH", "collisions within a distance, cloth and funnel"): with_broad_phases(near),
    ("ipctk, LBVH", "collision-free step, cloth and funnel"): with_broad_phases(safe_step),
    ("ipctk, LBVH", "intersections, cloth and funnel"): with_broad_phases(intersects),
}


def same(a, b):
    if isinstance(a, tuple):
        return a == b
    return abs(a - b) <= 1e-5 * max(1.0, abs(a))


def measured(make, rounds, steps):
    """Triangles, milliseconds of theirs and ours, whether answers were equal."""
    triangles, ours, theirs = make()
    best, equal, number = {ours: np.inf, theirs: np.inf}, True, 0
    for _ in range(rounds):
        begin = number + 1
        answers = {}
        for step in (theirs, ours):
            number = begin
            passed = time.process_time()
            answers[step] = []
            for _ in range(steps):
                answers[step].append(step(number))
                number += 1
            best[step] = min(best[step], (time.process_time() - passed) / steps)
        equal &= all(map(same, answers[ours], answers[theirs]))
    return triangles, 1e3 * best[theirs], 1e3 * best[ours], equal


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--csv")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=6)
    options = parser.parse_args()
    ipctk.set_num_threads(1)
    rows = [["peer", "task", "triangles", "theirs ms", "ours ms", "answers"]]
    for (peer, task), make in TASKS.items():
        triangles, theirs, ours, equal = measured(make, options.rounds, options.steps)
        rows.append([peer, task, triangles, f"{theirs:.4g}", f"{ours:.4g}", "equal" if equal else "differ"])
        print(*rows[-1], sep=" | ", flush=True)
    if options.csv:
        with open(options.csv, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
