"""What a run is asked for."""

from typing import NamedTuple

import numpy as np

from ._frames import Floats


class Settings(NamedTuple):
    limit: float  # the clearance to be kept
    tolerance: float  # between the bounds of distances that are about the limit
    far: float = 0.02  # of distances beyond twice the limit: the tolerance as a share of the rest

    def tolerance_at(self, seen: float) -> float:
        """Between the bounds of a least distance that is about what was seen."""
        return max(self.tolerance, self.far * (seen - 2 * self.limit))

    def wanted(self, seen: float, is_below: bool = False) -> float:
        """The lower bound with which a pair needs no more work, by the distance that was seen.
        `is_below`: that the pair is below the limit is known."""
        if seen == np.inf:
            return seen
        if is_below:  # as near as a search for the times would come
            return seen - self.tolerance_at(seen) / 2
        return max(self.limit, seen - self.tolerance_at(seen))

    def all_wanted(self, seen: Floats) -> Floats:
        """The same for many pairs."""
        with np.errstate(invalid="ignore"):
            enough = seen - np.maximum(self.tolerance, self.far * (seen - 2 * self.limit))
        return np.where(seen < np.inf, np.maximum(self.limit, enough), seen)
