"""The page: plays the motion, jumps to the tightest moments, and has the table."""

import math
from typing import Dict, List, NamedTuple, Optional, Sequence as Many

import numpy as np

from .. import CoherentDistance, DeformableMesh, DistanceResult, Recording, vertex_distances
from ._frames import Floats, FrameError, Sequence, step_between
from ._lengths import text_of
from ._opening import Part
from ._report_html import Moment, page_with_results
from ._results import PairResult
from ._run import Outcome
from ._table import Numbering, write_whole

_MOST_POSITIONS = 5_000_000  # of vertices in all frames shown: a page of about 40 megabytes
_MOST_MOMENTS = 40  # pairs whose nearest moment has a frame of its own
_COLOUR_RANGE = 4  # clearances


class _Shown:
    """A moving body on the page."""

    def __init__(self, sequence: Sequence, parts: Many[Part], frames: range):
        self.sequence, self._frames = sequence, frames
        self.first = next(frame for frame in frames if self._read(frame) is not None)
        self._topology = self._shape().topologies[0]
        vertices = self.at(self.first)
        assert vertices is not None
        self.mesh = DeformableMesh(vertices, self._topology.triangles)
        self.number = -1  # in the recording
        self.known = True  # whether its vertices are, at the present time
        self.around: List[DeformableMesh] = [_all_of(parts)] if parts else []
        self._queries = [CoherentDistance(self.mesh, mesh) for mesh in self.around]
        self._others: List["_Shown"] = []
        self.least = np.full(len(vertices), np.inf)  # clearance of each vertex

    def _read(self, frame: int):
        try:
            return self.sequence.read(frame)
        except FrameError:
            return None

    def _shape(self):
        frame = self._read(self.first)
        assert frame is not None
        return frame.shape

    def at(self, time: float) -> Optional[Floats]:
        """The vertices at a time between two frames; None when they are not known."""
        last = len(self.sequence) - 1
        begin = min(int(time), last)
        a = self._read(begin)
        b = self._read(min(begin + 1, last)) if time > begin else a
        step = step_between(a, b)
        if step is None or step.topology is not self._topology:
            return None
        return step.at(time - begin)

    def add(self, other: "_Shown") -> None:
        """Another moving body that counts."""
        self._others.append(other)
        self._queries.append(CoherentDistance(self.mesh, other.mesh))

    def move(self, time: float) -> None:
        """Moves the body, if it is known where it is."""
        vertices = self.at(time)
        self.known = vertices is not None
        if vertices is not None:
            self.mesh.update(vertices)

    def distances(self) -> List[DistanceResult]:
        """From the parts together, and from each moving body that counts."""
        first = len(self.around)
        return [query.distance() for i, query in enumerate(self._queries)
                if self.known and (i < first or self._others[i - first].known)]

    def paint(self, most: float) -> None:
        """Lowers the clearances of the vertices to the present ones, and those of other bodies."""
        if not self.known:
            return
        for mesh in self.around:
            self.least = np.minimum(self.least, vertex_distances(self.mesh, mesh, most))
        for other in self._others:
            if other.known:
                ours = vertex_distances(self.mesh, other.mesh, most)
                theirs = vertex_distances(other.mesh, self.mesh, most)
                self.least = np.minimum(self.least, ours)
                other.least = np.minimum(other.least, theirs)


def _all_of(parts: Many[Part]) -> DeformableMesh:
    vertices, faces, first = [], [], 0
    for part in parts:
        vertices.append(part.mesh.vertices)
        faces.append(part.mesh.faces + first)
        first += part.mesh.num_vertices
    return DeformableMesh(np.concatenate(vertices), np.concatenate(faces))


class _Moments(NamedTuple):
    times: List[float]  # of all frames of the page
    of_pair: Dict[int, int]  # by id of a pair: the number of its frame on the page


def _choose_times(outcome: Outcome, vertices: int) -> _Moments:
    """Frames at equal distances, and the nearest moments of the nearest pairs."""
    last = max((body.checked[-1][1] for body in outcome.bodies if body.checked), default=0)
    stride = max(math.ceil((last + 1) * vertices / _MOST_POSITIONS), 1)
    times = {float(t) for t in range(0, int(last) + 1, stride)}
    pairs = [pair for pair in outcome.pairs if pair.nearest is not None]
    times |= {pair.nearest.at for pair in pairs[:_MOST_MOMENTS] if pair.nearest is not None}
    ordered = sorted(times)
    of_pair = {id(pair): int(np.argmin(np.abs(np.array(ordered) - pair.nearest.at)))
               for pair in pairs if pair.nearest is not None}
    return _Moments(ordered, of_pair)


def _colour_range(outcome: Outcome, shown: List[_Shown]) -> float:
    """The clearance at which the colours end."""
    if outcome.limit > 0:
        return _COLOUR_RANGE * outcome.limit
    return 0.1 * max(float(np.ptp(body.mesh.vertices, axis=0).max()) for body in shown)


def write_report(path: str, outcome: Outcome, sequences: Many[Sequence], parts: Many[Part],
                 numberings: Dict[str, Numbering], up: str) -> None:
    """Writes the page. OSError or RuntimeError when that fails."""
    shown: List[_Shown] = []
    checked = {(pair.moving, pair.part) for pair in outcome.pairs}
    for sequence in sequences:
        near = [part for part in parts if (sequence.name, part.name) in checked]
        try:
            shown.append(_Shown(sequence, near, range(len(sequence))))
        except StopIteration:
            continue  # no frame can be read, as the problems say
    for i, body in enumerate(shown):
        for other in shown[i + 1:]:
            if (body.sequence.name, other.sequence.name) in checked:
                body.add(other)
    moments = _choose_times(outcome, sum(body.mesh.num_vertices for body in shown))
    most = _colour_range(outcome, shown)
    for time in moments.times:
        for body in shown:
            body.move(time)
        for body in shown:
            body.paint(most)
    recording = Recording(title=_title(outcome), unit=outcome.unit,
                          up={"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[up])
    for body in shown:
        body.number = recording.add(body.mesh, name=body.sequence.name)
    for part in parts:
        recording.add(part.mesh, name=part.name)
    pairs_at: Dict[int, List[PairResult]] = {}
    for pair in outcome.pairs:
        if id(pair) in moments.of_pair:
            pairs_at.setdefault(moments.of_pair[id(pair)], []).append(pair)
    for number, time in enumerate(moments.times):
        _record(recording, shown, time, pairs_at.get(number, []), outcome, numberings)
    rows = [Moment(pair, moments.of_pair.get(id(pair))) for pair in outcome.pairs]
    write_whole(path, page_with_results(recording.html(), outcome, rows, numberings, len(shown)))


def _title(outcome: Outcome) -> str:
    bodies = list(dict.fromkeys(body.name for body in outcome.bodies))
    names = ", ".join(bodies[:3])
    more = ", ..." if len(bodies) > 3 else ""
    return f"Clearance of {names}{more}"


def _record(recording: Recording, shown: List[_Shown], time: float, pairs: List[PairResult],
            outcome: Outcome, numberings: Dict[str, Numbering]) -> None:
    """One frame: the bodies at this time, the nearest points, and the pairs that are nearest now."""
    for body in shown:
        body.move(time)
    found = [result for body in shown for result in body.distances()]
    least = min([max(result.distance, 0.0) for result in found], default=math.inf)
    numbering = numberings[shown[0].sequence.name]
    note = f"Frame {numbering(time):.6g} of the motion."
    segments: Dict[str, List[Floats]] = {}
    for pair in pairs:
        if pair.nearest is None or abs(pair.nearest.at - time) > 1e-9:
            continue
        if pair is pairs[0] or pair.upper < 2 * outcome.limit:
            note += (f" {pair.moving} comes nearest to {pair.part}: "
                     f"{text_of(pair.upper, outcome.unit)}.")
        if pair.upper > least * (1 + 1e-6):
            segments.setdefault("nearest moment of a pair", []).append(pair.nearest.points)
    colours = {body.number: body.least for body in shown if np.isfinite(body.least).all()}
    order = sorted(found, key=lambda result: result.distance)
    recording.frame(order or None, vertex_distances=colours, note=note,
                    segments={label: np.array(points) for label, points in segments.items()})
