"""Two moving bodies against each other, frame by frame.

Frames that have the same number, counted from the first frame of each sequence, belong to the same
time. As in `_search`, a distance that is known at one time decreases at most by the ways of both
bodies since then.
"""

import threading
from typing import Callable, List, Optional, Tuple

import numpy as np

from .. import CoherentDistance, DeformableMesh
from ._frames import Floats, Frame, FrameError, Sequence, Step, step_between
from ._motion import ROUNDING, follow, over
from ._results import BodyResult, Nearest, PairResult, joined
from ._settings import Settings


def _way(step: Step) -> float:
    """The longest way of a vertex, rounded up."""
    way = step.after - step.before
    return float(np.sqrt(np.einsum("ij,ij->i", way, way).max())) * step.stretch * (1 + 1e-12)


class _Place:
    """Both bodies at a frame, with the meshes of one topology each."""

    def __init__(self, first: Step, second: Step):
        self.topologies = first.topology, second.topology
        self.meshes = [DeformableMesh(step.before, step.topology.triangles)
                       for step in (first, second)]
        self._query = CoherentDistance(*self.meshes)
        self.slack = ROUNDING * max(float(abs(step.before).max()) for step in (first, second))

    def is_of(self, first: Step, second: Step) -> bool:
        return self.topologies == (first.topology, second.topology)

    def see(self, pair: PairResult, frame: int, first: Floats, second: Floats) -> float:
        """Moves both bodies. Returns a lower bound of their distance."""
        for mesh, vertices in zip(self.meshes, (first, second)):
            mesh.update(vertices)
        found = self._query.distance()
        distance = max(found.distance, 0.0)
        if distance < pair.upper:
            pair.see(Nearest(distance, frame, found.points, np.array(found.triangles, np.int64)))
        return distance - self.slack


class Couple:
    """Two sequences against each other."""

    def __init__(self, first: Sequence, second: Sequence, settings: Settings,
                 advance: Callable[[int], None], stop: threading.Event):
        self.first, self.second, self._settings = first, second, settings
        self._advance, self._stop = advance, stop
        self._frames = common_frames(first.numbers, second.numbers)

    def run(self) -> BodyResult:
        """All frames that both have."""
        first, second = self.first, self.second
        pair = PairResult(first.name, second.name)
        result = BodyResult(first.name, len(first), [pair], against=second.name)
        if len(first) != len(second) or len(first) != len(self._frames):
            result.problems.append(
                f"{first.name} has {len(first)} frames and {second.name} has {len(second)}, "
                f"{len(self._frames)} of them at the same times, counted from their first frames; "
                f"only these are checked against each other; export both over the same time, or "
                f"leave the pair out by --ignore '{first.name}:{second.name}'")
        place: Optional[_Place] = None
        bound = 0.0  # of the distance at the frame, if there is a place
        after = self._read(0)
        for number, (frame, other) in enumerate(self._frames):
            if self._stop.is_set():
                break
            before, after = after, self._read(number + 1)
            is_known = (frame + 1, other + 1) in self._frames[number + 1:number + 2] and (
                frame not in first.gaps and other not in second.gaps)
            a, b = [step_between(*ends) if is_known else None for ends in zip(before, after)]
            if a is None or b is None:
                self._still(result, before, frame)
                place = None
            else:
                if place is None or not place.is_of(a, b):
                    place = _Place(a, b)
                    bound = place.see(pair, frame, a.before, b.before)
                bound = self._step(pair, place, a, b, bound, frame)
                result.checked = joined(result.checked + [(frame, frame + 1)])
            self._advance(1)
        return result

    def _read(self, number: int) -> List[Optional[Frame]]:
        """Both bodies; None where a frame cannot be used, as the search of the sequence says."""
        frames: List[Optional[Frame]] = [None, None]
        for i, sequence in enumerate((self.first, self.second)):
            if number < len(self._frames):
                try:
                    frames[i] = sequence.read(self._frames[number][i])
                except FrameError:
                    pass
        return frames

    def _step(self, pair: PairResult, place: _Place, a: Step, b: Step, before: float,
              frame: int) -> float:
        """Adds a step to the result. Returns a lower bound of the distance at its end."""
        way = _way(a) + _way(b)
        after, floor, is_below = before - way, before - way, False
        if floor < self._settings.wanted(pair.upper):
            after = place.see(pair, frame + 1, a.after, b.after)
            floor = max(floor, after - way, (before + after - way) / 2)
            is_below = after + 2 * place.slack + way < self._settings.limit  # during all of the step
            if is_below:
                pair.below = joined(pair.below + [(float(frame), float(frame + 1))])
        if floor < self._settings.wanted(pair.upper, is_below):
            first, second = place.meshes
            floor = follow(pair, over(a, first), over(b, second), frame, self._settings,
                           pair.upper, place.slack, is_below=is_below)
        pair.lower = min(pair.lower, max(floor, 0.0))
        return after

    def _still(self, result: BodyResult, frames: List[Optional[Frame]], frame: int) -> None:
        """A frame after which nothing is known."""
        a, b = [step_between(at, at) for at in frames]
        if a is None or b is None:
            return
        here = PairResult(self.first.name, self.second.name)
        here.lower = max(_Place(a, b).see(here, frame, a.before, b.before), 0.0)
        if here.is_violated(self._settings.limit):
            here.below = [(frame, frame)]
        result.pairs[0].add(here)
        result.checked = joined(result.checked + [(frame, frame)])


def common_frames(first: List[float], second: List[float]) -> List[Tuple[int, int]]:
    """The places of frames of the same time, by the numbers of the frames of two sequences."""
    times = {round(number - second[0], 6): j for j, number in enumerate(second)}
    places = [(i, times.get(round(number - first[0], 6))) for i, number in enumerate(first)]
    return [(i, j) for i, j in places if j is not None]
