"""A frame of a sequence, and how the vertices of its triangles are joined."""

import os
from collections import Counter
from typing import Dict, List, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from ._rotations import Pose, Screw, best_fit_angle

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
_LARGEST = 2.0**252  # coordinate of a DeformableMesh


class FrameError(ValueError):
    """A frame that cannot be used. Says why, and what to do."""


class SequenceError(ValueError):
    """Files that are no sequence or part. Says why, and what to do."""


class Topology:
    """Triangles, and the vertices that they have: all of a file, or one of those at the same place.

    Many formats repeat a vertex for each triangle (STL always does). Vertices that coincide in the
    first frame are joined, in all frames in which they still coincide. The number of a triangle is
    the same in both.
    """

    def __init__(self, positions: Floats, triangles: Ints, kept: Optional[Ints] = None,
                 same: Optional[Ints] = None):
        self.triangles = triangles
        self.first = positions if kept is None else positions.take(kept, axis=0)  # vertices
        self._kept = kept  # the vertices of a file that are vertices here; None: all
        self._same = same  # (K, 2), of the others: each, and the one that it is joined with

    def vertices(self, positions: Floats) -> Optional[Floats]:
        """Those of the positions in a file; None where vertices to be joined have come apart."""
        if self._kept is None or self._same is None:
            return positions
        if not np.array_equal(positions[self._same[:, 0]], positions[self._same[:, 1]]):
            return None
        return positions.take(self._kept, axis=0)


class Shape:
    """The triangles of a file, with the topologies that they may have: joined first, if any are."""

    def __init__(self, positions: Floats, triangles: Ints):
        self.triangles = triangles
        self.count = len(positions)
        self.topologies: List[Topology] = [Topology(positions, triangles)]
        order = np.lexsort(positions.T)  # stable: equal vertices stay in the order of the file
        rows = positions[order]
        first = np.ones(len(rows), bool)
        first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
        if not first.all():
            into = np.empty(len(rows), np.int64)
            into[order] = order[first][np.cumsum(first) - 1]  # which vertex stands for each
            is_kept = into == np.arange(len(into))
            others = np.flatnonzero(~is_kept)
            rank = np.cumsum(is_kept) - 1
            self.topologies.insert(0, Topology(
                positions, rank[into][triangles], np.flatnonzero(is_kept),
                np.stack([others, into[others]], axis=1)))

    def is_of(self, positions: Floats, triangles: Ints) -> bool:
        """Whether these may be a frame of this shape."""
        if len(positions) != self.count or triangles.shape != self.triangles.shape:
            return False
        return bool(np.array_equal(triangles, self.triangles)) or is_same_surface(
            triangles, self.triangles)


def _add_edges(boundary: Counter, triangle: Ints, sign: int) -> None:
    for u, v in zip(triangle, np.roll(triangle, -1)):
        edge = (min(u, v), max(u, v))
        boundary[edge] += sign if u < v else -sign
        if boundary[edge] == 0:
            del boundary[edge]


def is_same_surface(a: Ints, b: Ints) -> bool:
    """Whether triangles differ at most in the diagonals of polygons.

    A polygon that is not flat may be cut along other diagonals in another frame. The triangles of a
    polygon follow each other, have the polygon's outline as their boundary in both frames, and no
    corners but those of the outline.
    """
    outline: Counter = Counter()  # of the triangles of a since the last polygon that was complete
    difference: Counter = Counter()  # of that outline and the one in b
    corners: set = set()
    for row in np.flatnonzero((a != b).any(axis=1)):
        _add_edges(outline, a[row], 1)
        _add_edges(difference, a[row], 1)
        _add_edges(difference, b[row], -1)
        corners.update(a[row], b[row])
        if not difference:
            if corners != {vertex for edge in outline for vertex in edge}:
                return False
            outline.clear()
            corners.clear()
    return not difference


class Frame:
    """Positions as in the file, in the unit of the run. Frames of equal triangles share `shape`.
    Frames of a body that is rigid between them have a pose."""

    def __init__(self, positions: Floats, shape: Shape, pose: Optional[Pose] = None):
        self.positions, self.shape, self.pose = positions, shape, pose
        self._vertices: Dict[Topology, Optional[Floats]] = {}

    def vertices(self, topology: Topology) -> Optional[Floats]:
        """Those of one of the shape's topologies; None where they have come apart."""
        if topology not in self._vertices:
            self._vertices[topology] = topology.vertices(self.positions)
        return self._vertices[topology]


class Step(NamedTuple):
    """Two frames in one topology. Between them each vertex is on a straight line, or the body on a
    screw."""

    topology: Topology
    before: Floats
    after: Floats
    screw: Optional[Screw] = None

    @property
    def stretch(self) -> float:
        """By which the way of a vertex is at most longer than the line between its ends."""
        return self.screw.stretch if self.screw else 1.0

    def angle(self) -> float:
        """By how far the body turns."""
        return self.screw.angle if self.screw else best_fit_angle(self.before, self.after)

    def at(self, share: float) -> Floats:
        """The vertices at a time from 0 to 1."""
        if self.screw:
            return self.screw.at(share, self.after)
        return self.before + share * (self.after - self.before)


def step_between(a: Optional[Frame], b: Optional[Frame]) -> Optional[Step]:
    """None if a frame is, or if their triangles differ."""
    if a is None or b is None or a.shape is not b.shape:
        return None
    for topology in a.shape.topologies:
        before, after = a.vertices(topology), b.vertices(topology)
        if before is not None and after is not None:
            screw = Screw(a.pose, b.pose) if a.pose and b.pose else None
            return Step(topology, before, after, screw)
    return None


class Sequence:
    """A body that moves from frame to frame. Frames are read one by one, by any thread."""

    def __init__(self, name: str, numbers: List[float]):
        self.name = name
        self.numbers = numbers  # of each frame, as the user counts: of its file, or 0, 1, ...
        self.gaps: List[int] = []  # frames after which some are missing
        self.problems: List[str] = []  # sentences about what is missing
        self.warnings: List[str] = []  # sentences about what is there

    def __len__(self) -> int:
        return len(self.numbers)

    def label(self, frame: int) -> str:
        """What the user calls this frame."""
        return f"frame {self.numbers[frame]:g}"

    @property
    def num_vertices(self) -> int:
        """Of a frame, as in its file; frames of other triangles may have others."""
        raise NotImplementedError

    def read(self, frame: int) -> Frame:
        """FrameError when the frame cannot be used."""
        raise NotImplementedError


def checked(positions: Floats, label: str) -> Floats:
    """The positions. FrameError when one is not finite, or too large for the library."""
    usable = np.abs(positions) <= _LARGEST
    if not usable.all():
        vertex = int(np.argmin(usable.all(axis=1)))
        place = positions[vertex]
        wrong = "too large" if np.isfinite(place).all() else "not finite"
        raise FrameError(f"vertex {vertex} of {label} is {wrong}; export this frame again")
    return positions


def read_text(path: str, what: str) -> str:
    """A table. SequenceError when the file cannot be read, or is no regular one."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise SequenceError(f"{path} is no regular file; name {what}")
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not in UTF-8"
        raise SequenceError(f"{path} cannot be read ({reason}); name {what}") from None
