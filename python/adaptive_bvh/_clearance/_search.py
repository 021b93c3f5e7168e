"""The search over the frames of one moving body.

A point of a triangle moves by at most as much as its fastest corner. So a distance d of a chunk of
the body, known at one time, is at least d - D at another one, if no vertex of the chunk is farther
than D from where it was. Between frames vertices are on straight lines, so the largest D of a piece
of frames is that of one of them. Used three times:

- over a piece of frames, from its first one: most chunks are out of reach of a part in all of them;
- from the last frame at which the distance was asked, by the way since then;
- during a step, from both ends of it: with d and e there it is at least (d + e - D) / 2 in between.

On straight lines the gap along a fixed direction is least at an end: if the direction is that of
the nearest points, this leaves few steps to be asked.

A rigid body goes from pose to pose on a screw. Its vertices go along arcs, which are at most
`stretch` times as long as the lines between their ends; no arc leaves both ends by more than half
its length.

What is neither above the limit nor above the least distance seen at all frames of a piece is asked
during the step.
"""

import threading
from functools import partial
from typing import Callable, Dict, List, NamedTuple, Optional

import numpy as np

from .. import Motion
from ._chunks import Body, Chunks, box_gaps
from ._frames import Floats, Frame, FrameError, Ints, Sequence, Step, Topology, step_between
from ._motion import ROUNDING, follow, over
from ._opening import Part, extent_of
from ._results import BodyResult, Nearest, PairResult, joined
from ._rotations import QUARTER
from ._settings import Settings


_FAR_ON_A_SCREW = 4 / 3 * QUARTER  # the other way round may be meant


class _Reach:
    """Parts and chunks that may matter, as arrays: their numbers, and lower bounds of their
    distances at the first frame and at the present one."""

    def __init__(self, parts: Ints, chunks: Ints, first: Floats, now: Floats):
        self.parts, self.chunks, self.first, self.now = parts, chunks, first, now


class _Open(NamedTuple):
    """What the distances at both ends of a step leave open: parts and chunks, with lower bounds of
    their distances, in the order of these; and upper bounds of the parts' distances."""

    step: Step
    parts: List[int]
    chunks: List[int]
    floor: List[float]
    normals: List[Floats]  # from the chunks to the parts
    upper: Floats


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
        self._low = np.array([part.low for part in parts]).reshape(-1, 3)
        self._high = np.array([part.high for part in parts]).reshape(-1, 3)
        self._extent = max([extent_of(part) for part in parts], default=0.0)
        self._errors: Dict[int, str] = {}  # of frames
        self._changes: List[int] = []  # frames after which the triangles change
        self._turns: Dict[int, bool] = {}  # frames after which the body turns far; if on a screw
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
            first = steps[i]
            if first is None:
                self._advance(1)
                i += 1
                continue
            following: List[Step] = []
            for step in steps[i:]:
                if step is None or step.topology is not first.topology:
                    break
                following.append(step)
            body = self._body(first.topology, first.before)
            bounds = look.bounds if i == 0 and look.chunks is body.chunks else self._bounds(body)
            done = self._follow(result, body, following, bounds, begin + i)
            result.checked = joined(result.checked + [(begin + i, begin + i + done)])
            i += len(following)
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

    def problems(self) -> List[str]:
        """About what keeps the answer from being complete."""
        name, label = self.sequence.name, self.sequence.label
        said = list(self.sequence.problems)
        frames = sorted(self._errors)
        if frames:
            said.append(self._errors[frames[0]])
        if len(frames) > 1:
            what = (f"{len(frames) - 1} more frames could not be used, the last of them"
                    if len(frames) > 2 else "one more frame could not be used,")
            said.append(f"{name}: {what} {label(frames[-1])}; export all of them again")
        changes = sorted(set(self._changes))
        if changes:
            others = len(changes) - 1
            more = f", and in {others} more step{'s' * (others > 1)}" if others else ""
            said.append(f"{name}: triangles or vertices change between {label(changes[0])} and "
                        f"{label(changes[0] + 1)}{more}, so the motion between them is unknown; "
                        f"export all frames with the same mesh")
        return said

    def warnings(self) -> List[str]:
        """About motions that may be others than those of the body."""
        frames = sorted(self._turns)
        if not frames:
            return []
        label = self.sequence.label
        places = ", ".join(f"between {label(frame)} and {label(frame + 1)}" for frame in frames[:3])
        more = f", and {len(frames) - 3} more times" if len(frames) > 3 else ""
        if self._turns[frames[0]]:
            return [f"{self.sequence.name} turns by more than a third of a turn {places}{more}; "
                    f"the shorter way round was checked, so add poses in between"]
        return [f"{self.sequence.name} turns by more than a quarter {places}{more}; its vertices "
                f"go on straight lines, so it shrinks in between; export more frames there, or, if it "
                f"is rigid, give one mesh and its poses (--poses)"]

    # ---- frames ------------------------------------------------------------------------------

    def _read(self, frame: int) -> Optional[Frame]:
        try:
            return self.sequence.read(frame)
        except FrameError as error:
            self._errors[frame] = str(error)
            return None

    def _steps(self, frames: List[Optional[Frame]], begin: int) -> List[Optional[Step]]:
        """What is known about the motion after each frame but the last."""
        steps: List[Optional[Step]] = []
        for i, (a, b) in enumerate(zip(frames, frames[1:])):
            step = step_between(a, b) if begin + i not in self.sequence.gaps else None
            if a and b and a.shape is not b.shape and begin + i not in self.sequence.gaps:
                self._changes.append(begin + i)
            if step and step.angle() > (_FAR_ON_A_SCREW if step.screw else QUARTER) + 1e-6:
                self._turns[begin + i] = step.screw is not None
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
        still = step_between(frame, frame)
        assert still is not None  # the last topology has all vertices
        return self._body(still.topology, still.before)

    def _slack(self, body: Body) -> float:
        return ROUNDING * max(self._extent, float(body.vertices.max()), -float(body.vertices.min()))

    def _bounds(self, body: Body) -> Floats:
        """(parts, chunks): lower bounds of distances, by boxes."""
        gaps = box_gaps(self._low, self._high, *body.chunks.boxes(body.vertices))
        return gaps - self._slack(body)

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

    def _follow(self, result: BodyResult, body: Body, steps: List[Step], bounds: Floats,
                first: int) -> int:
        """Consecutive steps, from frame `first` on, with lower bounds of the distances there.
        Returns how many were checked."""
        chunks, start = body.chunks, steps[0].before
        away = np.array([chunks.farthest(now, start)
                         for now in [start] + [step.after for step in steps]])
        during = np.maximum(away[:-1], away[1:])
        for i, step in enumerate(steps):
            if step.screw:
                during[i] += step.stretch / 2 * chunks.farthest(step.after, step.before)
        reach = self._within_reach(result, body, bounds, during.max(axis=0), first)
        left: List[_Open] = []
        for i, step in enumerate(steps):
            if self._stop.is_set():
                break
            left.append(self._step(result, body, step, reach,
                                   np.stack([away[i], during[i], away[i + 1]]), first + i))
        for i, what in enumerate(left):
            if self._stop.is_set():
                return i
            self._ask(result, body, what, first + i)
            self._advance(1)
        return len(left)

    def _within_reach(self, result: BodyResult, body: Body, bounds: Floats, away: Floats,
                      frame: int) -> _Reach:
        """The parts and chunks that may matter, if chunks move away by so much at most. Counts the
        others for the result."""
        pairs, slack = result.pairs, self._slack(body)
        bounds = bounds.copy()
        seen = np.minimum(self._seen, [pair.upper for pair in pairs])
        wanted = self._settings.all_wanted(seen)[:, None] + away
        for p, chunk in np.argwhere(bounds < wanted):
            bounds[p, chunk] = self._see(pairs[p], body, p, chunk, frame) - slack
        seen = np.minimum(seen, [pair.upper for pair in pairs])
        is_within = bounds < self._settings.all_wanted(seen)[:, None] + away
        self._count(pairs, np.where(is_within, np.inf, bounds - away).min(axis=1, initial=np.inf))
        parts, chunks = np.nonzero(is_within)
        first = bounds[parts, chunks]
        return _Reach(parts, chunks, first, first.copy())

    def _count(self, pairs: List[PairResult], lower: Floats) -> None:
        for pair, least in zip(pairs, lower):
            pair.lower = min(pair.lower, max(float(least), 0.0))

    def _wholly_below(self, pairs: List[PairResult], upper: Floats, frame: int) -> List[bool]:
        """The parts that are below the limit during a step, by upper bounds of their distances.
        Adds this to their pairs: a search for the times would be long where the limit is far above
        all distances."""
        below = upper < self._settings.limit
        for p in np.flatnonzero(below).tolist():
            pairs[p].below = joined(pairs[p].below + [(float(frame), float(frame + 1))])
        return below.tolist()

    def _step(self, result: BodyResult, body: Body, step: Step, reach: _Reach, away: Floats,
              frame: int) -> _Open:
        """One step, by the distances at its ends. `away`: of each chunk from the first frame, at
        the start of the step, during it at most, and at its end."""
        pairs, slack = result.pairs, self._slack(body)
        way = step.stretch * body.move(step.after)[reach.chunks]
        before, floor, after = reach.first - away[:, reach.chunks]
        before = np.maximum(reach.now, before)
        floor, after = np.maximum(reach.now - way, [floor, after])
        seen = np.minimum(self._seen, [pair.upper for pair in pairs])
        near = np.flatnonzero(floor < self._settings.all_wanted(seen)[reach.parts])
        after[near] = [self._see(pairs[p], body, p, chunk, frame + 1) - slack
                       for p, chunk in zip(reach.parts[near].tolist(), reach.chunks[near].tolist())]
        upper = np.full(len(pairs), np.inf)
        np.minimum.at(upper, reach.parts[near], after[near] + 2 * slack + way[near])
        floor[near] = np.maximum(floor[near], np.maximum(
            after[near] - way[near], (before[near] + after[near] - way[near]) / 2))
        reach.now = after
        seen = np.minimum(self._seen, [pair.upper for pair in pairs])
        is_open = floor < self._settings.all_wanted(seen)[reach.parts]
        lower = np.full(len(pairs), np.inf)
        np.minimum.at(lower, reach.parts[~is_open], floor[~is_open])
        self._count(pairs, lower)
        which = np.flatnonzero(is_open)
        which = which[np.argsort(floor[which], kind="stable")]
        return _Open(step, reach.parts[which].tolist(), reach.chunks[which].tolist(),
                     floor[which].tolist(),
                     [body.normal(p, chunk) for p, chunk in zip(reach.parts[which].tolist(),
                                                                reach.chunks[which].tolist())],
                     upper)

    def _ask(self, result: BodyResult, body: Body, left: _Open, frame: int) -> None:
        """What the distances at the ends of a step left open."""
        pairs, slack = result.pairs, self._slack(body)
        below = self._wholly_below(pairs, left.upper, frame)
        motions: Dict[int, Motion] = {}
        for p, chunk, floor, normal in zip(left.parts, left.chunks, left.floor, left.normals):
            pair = pairs[p]
            seen = min(float(self._seen[p]), pair.upper)
            wanted = self._settings.wanted(seen, below[p])
            if floor < wanted and not left.step.screw:
                gap = self._gap(left.step, body.chunks.vertices[chunk], p, normal)
                floor = max(floor, gap - slack)
            if floor < wanted:
                if chunk not in motions:
                    motions[chunk] = over(left.step, body.mesh(chunk), body.chunks.vertices[chunk])
                floor = follow(pair, motions[chunk], self.parts[p].mesh, frame, self._settings,
                               seen, slack, partial(body.triangle, chunk), below[p])
            pair.lower = min(pair.lower, max(floor, 0.0))

    def _gap(self, step: Step, rows: Ints, part: int, normal: Floats) -> float:
        """How far a chunk is from a part along a direction during a step of straight lines, at
        whose ends the gap is least."""
        ends = max((positions.take(rows, axis=0) @ normal).max()
                   for positions in (step.before, step.after))
        return float((self.parts[part].corners @ normal).min() - ends)
