"""The search over the frames of one moving body.

A point of a triangle moves by at most as much as its fastest corner. So a distance d of a chunk of
the body, known at one time, is at least d - D at another one, if no vertex of the chunk is farther
than D from where it was. Between frames vertices are on straight lines, so the largest D of a piece
of frames is that of one of them. Used three times:

- over a piece of frames, from its first one: most chunks are out of reach of a part in all of them;
- from the last frame at which the distance was asked, by the way since then;
- during a step, from both ends of it: with d and e there it is at least (d + e - D) / 2 in between.

What is neither above the limit nor above the least distance seen is asked during the step.
"""

import threading
from typing import Callable, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from ._chunks import Body, Chunks, box_gaps
from ._frames import Floats, Frame, FrameError, Ints, Sequence, Topology
from ._motion import Step
from ._opening import Part
from ._results import BodyResult, Nearest, PairResult, joined

_ROUNDING = 1e-13  # of a distance, as a share of the largest coordinate


class Settings(NamedTuple):
    limit: float  # the clearance to be kept
    tolerance: float  # between the bounds of distances that are about the limit
    far: float = 0.02  # of distances beyond twice the limit: the tolerance as a share of the rest


class _Step(NamedTuple):
    topology: Topology
    before: Floats
    after: Floats


def common(a: Frame, b: Frame) -> Optional[Tuple[Topology, Floats, Floats]]:
    """The topology in which both frames have vertices; None if their triangles differ."""
    if a.shape is not b.shape:
        return None
    for topology in a.shape.topologies:
        before, after = topology.vertices(a.positions), topology.vertices(b.positions)
        if before is not None and after is not None:
            return topology, before, after
    return None


class _Reach:
    """Parts and chunks that may matter, as arrays: their numbers, and lower bounds of their
    distances at the first frame and at the present one."""

    def __init__(self, parts: Ints, chunks: Ints, first: Floats, now: Floats):
        self.parts, self.chunks, self.first, self.now = parts, chunks, first, now


class Look(NamedTuple):
    """The distances at a frame: of pairs, and lower bounds of (part, chunk)."""

    pairs: List[PairResult]
    chunks: Optional[Chunks]  # None where the frame could not be read
    bounds: Floats


class Search:
    """One moving body against all parts, in pieces of consecutive frames."""

    def __init__(self, sequence: Sequence, parts: List[Part], settings: Settings,
                 advance: Callable[[int], None], stop: threading.Event):
        self.sequence, self.parts, self._settings = sequence, parts, settings
        self._advance, self._stop = advance, stop
        self._seen = np.full(len(parts), np.inf)  # the least distances at the pieces' first frames
        corners = [part.mesh.vertices for part in parts]
        self._low = np.array([c.min(axis=0) for c in corners]).reshape(-1, 3)
        self._high = np.array([c.max(axis=0) for c in corners]).reshape(-1, 3)
        self._extent = max([float(abs(c).max()) for c in corners], default=0.0)
        self._errors: Dict[int, str] = {}  # of frames
        self._changes: List[int] = []  # frames after which the triangles change
        self._chunks: Dict[Topology, Chunks] = {}
        self._lock = threading.Lock()

    @property
    def size(self) -> Optional[float]:
        """The longest side of the body's box, in a frame that was used."""
        for chunks in self._chunks.values():
            low = np.min([mesh.vertices.min(axis=0) for mesh in chunks.meshes], axis=0)
            high = np.max([mesh.vertices.max(axis=0) for mesh in chunks.meshes], axis=0)
            return float((high - low).max())
        return None

    # ---- pieces ------------------------------------------------------------------------------

    def look(self, frame: int) -> Look:
        """The distances at a frame. They bound what the pieces look for."""
        pairs = self._pairs()
        now = self._read(frame)
        if now is None or self._stop.is_set():
            return Look(pairs, None, np.empty(0))
        body = self._body_of(now)
        bounds, slack = self._bounds(body), self._slack(body)
        for p, pair in enumerate(pairs):
            self._find_nearest(pair, body, p, bounds[p], slack, frame)
            pair.lower = max(pair.upper - slack, 0.0)
        return Look(pairs, body.chunks, bounds)

    def start(self, looks: List[Look]) -> None:
        """Before the pieces: what was found at their first frames."""
        for look in looks:
            self._seen = np.minimum(self._seen, [pair.upper for pair in look.pairs])

    def run(self, begin: int, end: int, look: Look) -> BodyResult:
        """The steps from frame `begin`, at which a look was taken, to frame `end`."""
        result = BodyResult(self.sequence.name, len(self.sequence), self._pairs())
        frames = [self._read(frame) for frame in range(begin, end + 1)]
        steps = self._steps(frames, begin)
        for i, frame in enumerate(frames):
            is_last = i == len(steps) and end < len(self.sequence) - 1  # the next piece has it
            if frame is not None and not is_last and not any(steps[max(i - 1, 0):i + 1]):
                self._still(result, frame, begin + i)
        i = 0
        while i < len(steps) and not self._stop.is_set():
            first, count = steps[i], 0
            if first is None:
                self._advance(1)
                i += 1
                continue
            vertices = [first.before]
            while i + count < len(steps):
                step = steps[i + count]
                if step is None or step.topology is not first.topology:
                    break
                vertices.append(step.after)
                count += 1
            body = self._body(first.topology, vertices[0])
            bounds = look.bounds if i == 0 and look.chunks is body.chunks else self._bounds(body)
            done = self._follow(result, body, vertices, bounds, begin + i)
            result.checked = joined(result.checked + [(begin + i, begin + i + done)])
            i += count
        return result

    def joined(self, looks: List[Look], pieces: List[BodyResult]) -> BodyResult:
        """The result of the whole motion."""
        body = BodyResult(self.sequence.name, len(self.sequence), self._pairs())
        for piece in pieces:
            body.checked = joined(body.checked + piece.checked)
        for pairs in [look.pairs for look in looks] + [piece.pairs for piece in pieces]:
            for pair, other in zip(body.pairs, pairs):
                pair.add(other)
        return body

    # ---- sentences ---------------------------------------------------------------------------

    def overlaps(self, first: List[PairResult]) -> List[str]:
        """About parts that the body touches at the first frame."""
        touching = [pair.part for pair in first if pair.upper == 0]
        return [f"{self.sequence.name} touches {part} in its first frame already; if they belong "
                f"together, leave the pair out by --ignore '{self.sequence.name}:{part}'"
                for part in touching]

    def problems(self) -> List[str]:
        """About what keeps the answer from being complete."""
        name, label = self.sequence.name, self.sequence.label
        said = list(self.sequence.problems)
        frames = sorted(self._errors)
        if frames:
            said.append(self._errors[frames[0]])
        if len(frames) > 1:
            said.append(f"{name}: {len(frames) - 1} more frames could not be used, the last of "
                        f"them {label(frames[-1])}; export them again")
        changes = sorted(set(self._changes))
        if changes:
            more = f", and at {len(changes) - 1} more frames" if len(changes) > 1 else ""
            said.append(f"{name}: triangles or vertices change between {label(changes[0])} and "
                        f"{label(changes[0] + 1)}{more}, so the motion between them is unknown; "
                        f"export all frames with the same mesh")
        return said

    # ---- frames ------------------------------------------------------------------------------

    def _read(self, frame: int) -> Optional[Frame]:
        try:
            return self.sequence.read(frame)
        except FrameError as error:
            self._errors[frame] = str(error)
            return None

    def _steps(self, frames: List[Optional[Frame]], begin: int) -> List[Optional[_Step]]:
        """What is known about the motion after each frame but the last."""
        joined_vertices = [frame and frame.shape.topologies[0].vertices(frame.positions)
                           for frame in frames]
        steps: List[Optional[_Step]] = []
        for i, (a, b) in enumerate(zip(frames, frames[1:])):
            step = None
            if a is not None and b is not None and begin + i not in self.sequence.gaps:
                before, after = joined_vertices[i], joined_vertices[i + 1]
                if a.shape is not b.shape:
                    self._changes.append(begin + i)
                elif before is not None and after is not None:
                    step = _Step(a.shape.topologies[0], before, after)
                else:
                    step = _Step(a.shape.topologies[-1], a.positions, b.positions)
            steps.append(step)
        return steps

    def _pairs(self) -> List[PairResult]:
        return [PairResult(self.sequence.name, part.name) for part in self.parts]

    def _body(self, topology: Topology, vertices: Floats) -> Body:
        with self._lock:
            if topology not in self._chunks:
                self._chunks[topology] = Chunks(topology)
            chunks = self._chunks[topology]
        return Body(chunks, vertices, self.parts)

    def _body_of(self, frame: Frame) -> Body:
        found = common(frame, frame)
        assert found is not None  # the last topology has all vertices
        return self._body(found[0], found[1])

    def _slack(self, body: Body) -> float:
        return _ROUNDING * max(self._extent, float(body.vertices.max()), -float(body.vertices.min()))

    def _bounds(self, body: Body) -> Floats:
        """(parts, chunks): lower bounds of distances, by boxes."""
        gaps = box_gaps(self._low, self._high, *body.chunks.boxes(body.vertices))
        return gaps - self._slack(body)

    def _enough(self, seen):
        """The lower bounds with which a search for the least distance may end."""
        limit, tolerance, far = self._settings
        return seen - np.maximum(tolerance, far * (seen - 2 * limit))

    def _wanted(self, seen):
        """The lower bounds with which a pair needs no more work."""
        return np.maximum(self._settings.limit, self._enough(seen))

    # ---- at a frame --------------------------------------------------------------------------

    def _see(self, pair: PairResult, body: Body, part: int, chunk: int, frame: int) -> float:
        distance, found = body.distance(part, chunk)
        if distance < pair.upper:
            triangles = np.array(found.triangles, np.int64)
            triangles[0] = body.triangle(chunk, triangles[0])
            pair.see(Nearest(distance, frame, found.points, triangles))
        return distance

    def _find_nearest(self, pair: PairResult, body: Body, part: int, bounds: Floats,
                      slack: float, frame: int) -> None:
        """The distance of a part at a frame: the chunks in the order of their bounds, which become
        better."""
        for chunk in np.argsort(bounds, kind="stable"):
            if bounds[chunk] >= pair.upper:
                break
            bounds[chunk] = self._see(pair, body, part, chunk, frame) - slack

    def _still(self, result: BodyResult, frame: Frame, at: int) -> None:
        """A frame between which and its neighbours nothing is known."""
        body = self._body_of(frame)
        bounds, slack, limit = self._bounds(body), self._slack(body), self._settings.limit
        for p, pair in enumerate(result.pairs):
            here = PairResult(pair.moving, pair.part)
            self._find_nearest(here, body, p, bounds[p], slack, at)
            here.lower = max(here.upper - slack, 0.0)
            if here.is_violated(limit):
                here.below = [(at, at)]
            pair.add(here)
        result.checked = joined(result.checked + [(at, at)])

    # ---- between frames ----------------------------------------------------------------------

    def _follow(self, result: BodyResult, body: Body, vertices: List[Floats], bounds: Floats,
                first: int) -> int:
        """Consecutive steps, from frame `first` on, with lower bounds of the distances there.
        Returns how many were checked."""
        away = np.array([body.chunks.farthest(now, vertices[0]) for now in vertices])
        reach = self._within_reach(result, body, bounds, away.max(axis=0), first)
        for i, now in enumerate(vertices[1:]):
            if self._stop.is_set():
                return i
            self._step(result, body, now, reach, away[i:i + 2], first + i)
            self._advance(1)
        return len(vertices) - 1

    def _within_reach(self, result: BodyResult, body: Body, bounds: Floats, away: Floats,
                      frame: int) -> _Reach:
        """The parts and chunks that may matter, if chunks move away by so much at most. Counts the
        others for the result."""
        pairs, slack = result.pairs, self._slack(body)
        bounds = bounds.copy()
        seen = np.minimum(self._seen, [pair.upper for pair in pairs])
        wanted = self._wanted(seen)[:, None] + away
        for p, chunk in np.argwhere(bounds < wanted):
            bounds[p, chunk] = self._see(pairs[p], body, p, chunk, frame) - slack
        seen = np.minimum(seen, [pair.upper for pair in pairs])
        is_within = bounds < self._wanted(seen)[:, None] + away
        self._count(pairs, np.where(is_within, np.inf, bounds - away).min(axis=1, initial=np.inf))
        parts, chunks = np.nonzero(is_within)
        first = bounds[parts, chunks]
        return _Reach(parts, chunks, first, first.copy())

    def _count(self, pairs: List[PairResult], lower: Floats) -> None:
        for pair, least in zip(pairs, lower):
            pair.lower = min(pair.lower, max(float(least), 0.0))

    def _step(self, result: BodyResult, body: Body, vertices: Floats, reach: _Reach,
              away: Floats, frame: int) -> None:
        """One step. `away`: of each chunk from the first frame, at the start and the end of it."""
        start, pairs, slack = body.vertices, result.pairs, self._slack(body)
        way = body.move(vertices)[reach.chunks]
        floor = np.maximum(reach.now - way, reach.first - away.max(axis=0)[reach.chunks])
        before = np.maximum(reach.now, reach.first - away[0][reach.chunks])
        after = np.maximum(reach.now - way, reach.first - away[1][reach.chunks])
        seen = np.minimum(self._seen, [pair.upper for pair in pairs])
        open_pairs = []
        for i in np.flatnonzero(floor < self._wanted(seen)[reach.parts]):
            p = reach.parts[i]
            after[i] = self._see(pairs[p], body, p, reach.chunks[i], frame + 1) - slack
            seen[p] = min(seen[p], pairs[p].upper)
            floor[i] = max(floor[i], after[i] - way[i], (before[i] + after[i] - way[i]) / 2)
            open_pairs.append(i)
        steps: Dict[int, Step] = {}
        for i in sorted(open_pairs, key=lambda i: floor[i]):
            p, chunk = int(reach.parts[i]), int(reach.chunks[i])
            if floor[i] >= self._wanted(seen[p]):
                continue
            if chunk not in steps:
                rows = body.chunks.vertices[chunk]
                steps[chunk] = Step(body.mesh(chunk), start[rows], vertices[rows])
            floor[i] = self._during(pairs[p], body, steps[chunk], p, chunk, frame,
                                    float(seen[p] - self._enough(seen[p])), slack)
            seen[p] = min(seen[p], pairs[p].upper)
        reach.now = after
        lower = np.full(len(pairs), np.inf)
        np.minimum.at(lower, reach.parts, floor)
        self._count(pairs, lower)

    def _during(self, pair: PairResult, body: Body, moving: Step, part: int, chunk: int,
                frame: int, tolerance: float, slack: float) -> float:
        """A lower bound of the distance during a step, as near to the distance as is wanted."""
        limit, mesh = self._settings.limit, self.parts[part].mesh
        finest = 100 * slack  # a smaller tolerance is refused
        usual = max(self._settings.tolerance, finest)
        closest = moving.least(mesh, max(tolerance / 2, usual / 2, finest))
        if closest.lower < limit <= closest.upper:  # a tolerance too large to decide
            closest = moving.least(mesh, max(usual / 100, finest))
        if closest.upper < pair.upper:
            triangles = np.array(closest.triangles, np.int64)
            triangles[0] = body.triangle(chunk, triangles[0])
            pair.see(Nearest(closest.upper, frame + closest.time, closest.points, triangles))
        if closest.lower < limit or closest.upper == 0:
            pair.below = joined(pair.below + [
                (frame + begin, frame + end)
                for begin, end in moving.below(mesh, limit, usual)])
        return closest.lower
