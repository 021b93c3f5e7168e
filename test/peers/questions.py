"""What is asked, in which scenes, and when two answers agree.

An answer is a numpy array: see `kind` of each question. Every peer's answer is compared with this
library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

import scenes
from scenes import Work

# Largest error of an answer of a peer that rounds coordinates to single precision, relative to the
# largest coordinate; and of one that computes in double precision.
SINGLE, DOUBLE = 1e-5, 1e-9


@dataclass
class Question:
    """name; kind: "lengths", "numbers", "inside", "pairs", "yes", "times" or "count".

    scenes: functions of (size, steps, points) that return Work, or None where data is missing.
    """

    name: str
    kind: str
    scenes: list[Callable[[int, int, int], Work | None]]
    says: str
    limit: float = 0.0  # Of a difference, where the kind and the precision do not give it.


def scale(work: Work) -> float:
    """Largest coordinate of the work: errors are relative to it."""
    frame = work.frames[0]
    arrays = [frame.first, frame.second, frame.bodies, frame.translations, work.points]
    arrays += [work.origins]
    return max(float(np.abs(x).max()) for x in arrays if x is not None and x.size)


def difference(kind: str, ours: np.ndarray, theirs: np.ndarray, unit: float) -> float:
    """Returns how far two answers are from each other.

    lengths: largest difference, relative to `unit` (a hit against a miss counts as infinite);
    numbers, times: largest difference; inside, yes: share of points that differ;
    pairs: number of pairs that one of both has alone; count: their ratio, less 1.
    """
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    if kind == "pairs":
        a, b = ({tuple(map(int, row)) for row in np.reshape(x, (-1, 2))} for x in (ours, theirs))
        return float(len(a ^ b))
    if ours.shape != theirs.shape:
        return np.inf
    if ours.size == 0:
        return 0.0
    if kind in ("inside", "yes"):
        return float(np.mean(ours.astype(bool) != theirs.astype(bool)))
    if kind == "count":
        return float((theirs.sum() - ours.sum()) / max(ours.sum(), 1))
    with np.errstate(invalid="ignore"):
        apart = np.where(ours == theirs, 0.0, np.abs(ours - theirs))
    apart = np.where(np.isnan(apart), np.inf, apart)
    return float(apart.max()) / (unit if kind == "lengths" else 1.0)


def differing(kind: str, ours: np.ndarray, theirs: np.ndarray, limit: float) -> np.ndarray:
    """Returns which entries of two arrays of the same shape differ by more than `limit`."""
    if kind in ("inside", "yes"):
        return np.asarray(ours).astype(bool) != np.asarray(theirs).astype(bool)
    with np.errstate(invalid="ignore"):
        return ~((ours == theirs) | (np.abs(ours - theirs) <= limit))


def _surface(make: Callable[[int, int], Work | None]) -> Callable[[int, int, int], Work | None]:
    def with_points(size: int, steps: int, points: int) -> Work | None:
        work = make(size, steps)
        return work and scenes.add_points(work, points)

    return with_points


def _plain(make: Callable[[int, int], Work | None]) -> Callable[[int, int, int], Work | None]:
    return lambda size, steps, points: make(size, steps)


def _within(make: Callable[[int, int], Work | None], share: float):
    """Sets the distance to a share of the mean edge, and the end of each step."""

    def with_distance(size: int, steps: int, points: int) -> Work | None:
        work = make(size, steps)
        if work is not None:
            x = work.frames[0].first[work.faces]
            work.distance = share * float(np.linalg.norm(x[:, 0] - x[:, 1], axis=1).mean())
            scenes.add_steps(work)
        return work

    return with_distance


def _shaped(shape: tuple):
    def with_shape(size: int, steps: int, points: int) -> Work:
        work = scenes.one_sheet(size, steps)
        for frame in work.frames:
            frame.first = frame.first + [0, 0, 1.0]
        work.scene, work.shape = f"sheet and {shape[0]}", shape
        return work

    return with_shape


def _real(name: str, split: bool):
    return lambda size, steps: scenes.real(name, size, steps, split)


def _joined_rods(size: int, steps: int) -> Work:
    return scenes.joined(scenes.rods(size, steps))


FUNNEL, ROLLERS = scenes.REAL
SURFACES = [_surface(m) for m in (scenes.one_blob, scenes.one_sheet)]
REAL_SURFACES = [_surface(_real(name, False)) for name in scenes.REAL]
APART = [
    _plain(lambda size, steps: scenes.two_sheets(size, steps, 0.1)),
    _plain(scenes.rods),
    _plain(_real(ROLLERS, True)),
]
CROSSING = [
    _plain(lambda size, steps: scenes.two_sheets(size, steps, -0.5)),
    _plain(_real(FUNNEL, True)),
]
MOVING = [_within(_joined_rods, 1.0)]
MOVING += [_within(_real(name, False), 0.2) for name in scenes.REAL]

QUESTIONS = {
    q.name: q
    for q in [
        Question("closest points", "lengths", SURFACES + REAL_SURFACES, "distances of many points"),
        Question("inside", "inside", SURFACES[:1], "whether points are inside of a closed mesh"),
        Question(
            "winding numbers", "numbers", SURFACES, "generalised winding numbers of many points"
        ),
        Question("first hits", "lengths", SURFACES + REAL_SURFACES, "t of each ray, inf: none"),
        Question("distance", "lengths", APART, "least distance of two meshes, (1,)"),
        Question("contacts", "pairs", CROSSING, "triangle pairs of two meshes that touch"),
        Question("self-intersection", "yes", MOVING, "does the mesh intersect itself, (1,)"),
        Question("self-contacts", "pairs", MOVING, "triangle pairs without a common vertex"),
        Question(
            "pairs within d",
            "count",
            MOVING,
            "vertex-face and edge-edge pairs nearer than d, (2,)",
        ),
        Question("step candidates", "count", MOVING, "pairs that a step may bring together, (2,)"),
        Question("collision-free step", "times", MOVING, "share of a step that is safe, (1,)"),
        Question(
            "scene distance", "lengths", [_plain(scenes.crowd)], "least distance of bodies, (1,)"
        ),
        Question("scene contacts", "pairs", [_plain(scenes.crowd)], "pairs of bodies that touch"),
        Question(
            "signed distance",
            "lengths",
            [
                _plain(lambda size, steps: scenes.two_ellipsoids(size, steps, 0.2)),
                _plain(lambda size, steps: scenes.two_ellipsoids(size, steps, -0.1)),
            ],
            "distance of closed convex meshes, or minus their depth, (1,)",
            limit=1e-6,
        ),
        Question(
            "shape distance",
            "lengths",
            [_shaped(s) for s in (("sphere", 0.4), ("box", 0.8, 0.6, 0.4), ("capsule", 0.2, 0.7))],
            "distance of a mesh and a shape, (1,)",
        ),
    ]
}
