"""The queries of a moving mesh and a part between two frames."""

from typing import List, Tuple

from .. import (
    DeformableMesh,
    Motion,
    MotionClearance,
    intervals_below,
    least_distance,
)
from ._frames import Floats


class Step:
    """A mesh between two frames, at the times 0 and 1: every vertex moves on a straight line."""

    def __init__(self, mesh: DeformableMesh, before: Floats, after: Floats):
        self._motion = Motion(mesh, before, after)

    def least(self, part: DeformableMesh, tolerance: float) -> MotionClearance:
        """The least distance, between bounds that differ by at most the tolerance; 0 with the time
        of the first impact."""
        return least_distance(self._motion, part, tolerance)

    def below(self, part: DeformableMesh, limit: float,
              tolerance: float) -> List[Tuple[float, float]]:
        """The times at which the distance is below the limit; limit 0: at most the tolerance."""
        if limit == 0:
            limit, tolerance = tolerance / 2, tolerance / 2
        found = intervals_below(self._motion, part, limit, tolerance)
        return [(float(begin), float(end)) for begin, end in found]
