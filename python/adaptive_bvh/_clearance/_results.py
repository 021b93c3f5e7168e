"""What was found for a moving body and a part."""

import math
from dataclasses import dataclass, field
from typing import List, Optional, Tuple

from ._frames import Floats, Ints

Interval = Tuple[float, float]


@dataclass
class Nearest:
    """The nearest that a moving body was seen to a part."""

    distance: float
    at: float  # frames from the first one, such as 12.37
    points: Floats  # (2, 3), on the moving body and on the part
    triangles: Ints  # (2,)


@dataclass
class PairResult:
    """A moving body and a part over the motion. Frames count from the first one, 0."""

    moving: str
    part: str
    lower: float = math.inf  # proven: the distance is never smaller, in the steps that were checked
    nearest: Optional[Nearest] = None
    below: List[Interval] = field(default_factory=list)  # the times at which it is below the limit

    @property
    def upper(self) -> float:
        return self.nearest.distance if self.nearest is not None else math.inf

    def see(self, nearest: Nearest) -> None:
        """Keeps the nearer one; of two that are as near, the earlier one."""
        if self.nearest is None or (nearest.distance, nearest.at) < (self.upper, self.nearest.at):
            self.nearest = nearest

    def add(self, other: "PairResult") -> None:
        """What was found for the same pair in later steps."""
        self.lower = min(self.lower, other.lower)
        if other.nearest is not None:
            self.see(other.nearest)
        self.below = joined(self.below + other.below)

    def is_kept(self, limit: float) -> bool:
        """Whether it is proven that the distance is never below the limit (0: never 0)."""
        return self.lower >= limit and self.lower > 0

    def is_violated(self, limit: float) -> bool:
        return self.upper < limit or self.upper == 0


def joined(intervals: List[Interval]) -> List[Interval]:
    """In order, without overlaps; those that touch become one."""
    result: List[Interval] = []
    for begin, end in sorted(intervals):
        if result and begin <= result[-1][1]:
            result[-1] = (result[-1][0], max(result[-1][1], end))
        else:
            result.append((begin, end))
    return result


@dataclass
class BodyResult:
    """A moving body over its motion: against the parts, or against another moving body."""

    name: str
    frames: int
    pairs: List[PairResult]
    checked: List[Interval] = field(default_factory=list)  # the frames between which all was checked
    problems: List[str] = field(default_factory=list)
    against: str = ""  # the other moving body

    @property
    def label(self) -> str:
        return f"{self.name} and {self.against}" if self.against else self.name

    @property
    def is_complete(self) -> bool:
        return self.checked == [(0, self.frames - 1)]
