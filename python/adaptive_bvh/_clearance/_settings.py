"""What a run is asked for."""

from typing import NamedTuple

import numpy as np

from ._frames import Floats


class Settings(NamedTuple):
    limit: float  # the clearance to be kept
    tolerance: float  # between the bounds of a least distance

    def wanted(self, seen: float, is_below: bool = False) -> float:
        """The lower bound with which a pair needs no more work, by the distance that was seen.
        `is_below`: that the pair is below the limit is known."""
        if is_below:  # as near as a search for the times would come
            return seen - self.tolerance / 2
        return max(self.limit, seen - self.tolerance)

    def all_wanted(self, seen: Floats) -> Floats:
        """The same for many pairs."""
        return np.maximum(self.limit, seen - self.tolerance)
