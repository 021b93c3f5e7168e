"""The queries of a moving mesh and another body between two frames."""

from typing import Callable, Union

import numpy as np

from .. import (
    DeformableMesh,
    Motion,
    MotionClearance,
    intervals_below,
    least_distance,
)
from ._frames import Floats, Ints, Step
from ._results import Nearest, PairResult, joined
from ._settings import Settings

ROUNDING = 1e-13  # of a distance, as a share of the largest coordinate
Other = Union[DeformableMesh, Motion]


def over(step: Step, mesh: DeformableMesh, rows: Union[Ints, slice] = slice(None)) -> Motion:
    """The motion over a step of a mesh of the vertices `rows`."""
    after = step.after[rows]
    if step.screw:
        return Motion(mesh, after, after, start_tf=step.screw.back, path="screw")
    return Motion(mesh, step.before[rows], after)


def _below(motion: Motion, other: Other, limit: float, tolerance: float) -> Floats:
    """The times at which the distance is below the limit; limit 0: at most the tolerance."""
    if limit == 0:
        limit, tolerance = tolerance / 2, tolerance / 2
    return intervals_below(motion, other, limit, tolerance)


def _decided(motion: Motion, other: Other, settings: Settings, seen: float,
             slack: float, is_below: bool) -> MotionClearance:
    """The least distance, if it is below what is wanted, and whether it is below the limit."""
    finest = 100 * slack  # a smaller tolerance is refused
    usual = max(settings.tolerance, finest)
    tolerance = max(usual / 2, finest)
    wanted = max(settings.wanted(seen, is_below), usual)  # bodies are always at least 0 apart
    closest = least_distance(motion, other, tolerance, wanted)
    if not is_below and closest.lower < settings.limit <= closest.upper:  # a tolerance too large to decide
        closest = least_distance(motion, other, max(usual / 100, finest), wanted)
    return closest


def follow(pair: PairResult, motion: Motion, other: Other, frame: int, settings: Settings,
           seen: float, slack: float,
           number: Callable[[int], int] = lambda triangle: triangle,
           is_below: bool = False) -> float:
    """Adds what happens in the step after a frame to the result of a pair. Returns a lower bound of
    the distance in this step, as near to it as is wanted, if `seen` is known already. `number`: of
    a triangle of the moving mesh, in the body. `is_below`: the result has that the pair is below the
    limit at all times of the step."""
    closest = _decided(motion, other, settings, seen, slack, is_below)
    if closest.upper < pair.upper:
        triangles = np.array(closest.elements, np.int64)
        triangles[0] = number(triangles[0])
        pair.see(Nearest(closest.upper, frame + closest.time, closest.points, triangles))
    if not is_below and (closest.lower < settings.limit or closest.upper == 0):
        usual = max(settings.tolerance, 100 * slack)
        pair.below = joined(pair.below + [
            (frame + float(begin), frame + float(end))
            for begin, end in _below(motion, other, settings.limit, usual)])
    return closest.lower
