"""A whole run: all moving bodies against all parts, on several threads, until Ctrl-C."""

import threading
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Callable, List, Sequence as Many, Tuple

import numpy as np

from ._couples import Couple, common_frames
from ._frames import Sequence
from ._opening import Part
from ._results import BodyResult, PairResult
from ._search import Search
from ._settings import Settings

_PIECES = 8  # of a sequence at least; threads take one after the other
_MOST_VERTICES = 1_000_000  # of all frames of a piece, which are in memory together
_LEAST_STEPS = 8  # of a piece
_SIZES_APART = 50  # from here on, units of moving bodies and parts may differ

KEPT, VIOLATED, WRONG_INPUT, INTERRUPTED, INTERNAL = 0, 1, 2, 3, 4


@dataclass
class Outcome:
    """What a run has found."""

    limit: float
    unit: str
    bodies: List[BodyResult] = field(default_factory=list)
    problems: List[str] = field(default_factory=list)  # what keeps the answer from being complete
    warnings: List[str] = field(default_factory=list)
    interrupted: bool = False

    @property
    def pairs(self) -> List[PairResult]:
        """All pairs, the nearest first."""
        return sorted((pair for body in self.bodies for pair in body.pairs),
                      key=lambda pair: (pair.upper, pair.lower, pair.moving, pair.part))

    @property
    def all_problems(self) -> List[str]:
        return self.problems + [text for body in self.bodies for text in body.problems]

    @property
    def status(self) -> int:
        if any(pair.is_violated(self.limit) for pair in self.pairs):
            return VIOLATED
        if self.interrupted:
            return INTERRUPTED
        if self.all_problems or not self.pairs:
            return WRONG_INPUT
        return KEPT if all(pair.is_kept(self.limit) for pair in self.pairs) else VIOLATED


def is_ignored(moving: str, part: str, patterns: Many[str]) -> bool:
    """Whether a pattern names the pair: 'part' or 'moving:part', with * and ?."""
    for pattern in patterns:
        first, colon, second = pattern.partition(":")
        if fnmatchcase(part, second if colon else first) and (
                not colon or fnmatchcase(moving, first)):
            return True
    return False


def couples(sequences: Many[Sequence],
            ignored: Many[str] = ()) -> List[Tuple[Sequence, Sequence]]:
    """The moving bodies that are checked against each other."""
    return [(first, second) for i, first in enumerate(sequences) for second in sequences[i + 1:]
            if not is_ignored(first.name, second.name, ignored)
            and not is_ignored(second.name, first.name, ignored)]


def num_steps(sequences: Many[Sequence], ignored: Many[str] = ()) -> int:
    """The steps of a run, for its progress."""
    return sum(max(len(sequence) - 1, 1) for sequence in sequences) + sum(
        len(common_frames(first.numbers, second.numbers))
        for first, second in couples(sequences, ignored))


def _pieces(frames: int, vertices: int) -> List[Tuple[int, int]]:
    steps = frames - 1
    size = max(min(-(-steps // _PIECES), _MOST_VERTICES // max(vertices, 1)), _LEAST_STEPS)
    return [(begin, min(begin + size, steps)) for begin in range(0, max(steps, 1), size)]


def _finish(futures: List["Future"], stop: threading.Event, on_stop: Callable[[], None]) -> None:
    """Waits. The first Ctrl-C ends the work after the present steps."""
    while True:
        try:
            wait(futures)
            break
        except KeyboardInterrupt:
            if stop.is_set():
                raise
            stop.set()
            on_stop()
    for future in futures:
        future.result()  # raises what it raised


def check(sequences: Many[Sequence], parts: Many[Part], settings: Settings, outcome: Outcome, *,
          ignored: Many[str] = (), threads: int = 1,
          advance: Callable[[int], None] = lambda steps: None,
          on_stop: Callable[[], None] = lambda: None) -> None:
    """Adds a result for each moving body to the outcome."""
    stop = threading.Event()
    searches = [Search(sequence, [part for part in parts
                                  if not is_ignored(sequence.name, part.name, ignored)],
                       settings, advance, stop) for sequence in sequences]
    pairs = [Couple(first, second, settings, advance, stop)
             for first, second in couples(sequences, ignored)]
    pieces = [_pieces(len(sequence), sequence.num_vertices) for sequence in sequences]
    with ThreadPoolExecutor(threads) as pool:
        looks = [[pool.submit(search.look, begin) for begin, _ in of]
                 for search, of in zip(searches, pieces)]
        _finish([look for of in looks for look in of], stop, on_stop)
        found = [[look.result() for look in of] for of in looks]
        for search, first in zip(searches, found):
            search.start(first)
        runs = [[pool.submit(search.run, begin, end, look)
                 for (begin, end), look in zip(of, first)]
                for search, of, first in zip(searches, pieces, found)]
        together = [pool.submit(pair.run) for pair in pairs]
        _finish([run for of in runs for run in of] + together, stop, on_stop)
    for search, of, first in zip(searches, runs, found):
        body = search.joined(first, [run.result() for run in of])
        body.problems = search.problems()
        outcome.bodies.append(body)
        outcome.warnings.extend(search.sequence.warnings + search.warnings())
        outcome.warnings.extend(overlaps(search.sequence.name, first[0].pairs))
    for future in together:
        body = future.result()
        outcome.bodies.append(body)
        outcome.warnings.extend(overlaps(body.name, body.pairs, at_start=True))
    outcome.interrupted = outcome.interrupted or stop.is_set()
    if sequences and not outcome.pairs:
        outcome.problems.append("no pair is left to check; --ignore leaves all of them out")
    outcome.warnings.extend(_unusual(sequences, parts, ignored))
    _compare_sizes(sequences, parts, searches, outcome)


def _unusual(sequences: Many[Sequence], parts: Many[Part], ignored: Many[str]) -> List[str]:
    """About input that may be a mistake."""
    said = [f"{sequence.name} has one frame, so it does not move; name the files of all its frames"
            for sequence in sequences if len(sequence) == 1]
    names = [sequence.name for sequence in sequences]
    pairs = [(name, other) for name in names
             for other in [part.name for part in parts] + names if name != other]
    return said + [f"--ignore {pattern} fits no pair; write the names as the table has them"
                   for pattern in ignored
                   if not any(is_ignored(*pair, [pattern]) for pair in pairs)]


def overlaps(name: str, pairs: Many[PairResult], at_start: bool = False) -> List[str]:
    """About what a body touches at the first frame. `at_start`: pairs of the whole motion."""
    return [f"{name} touches {pair.part} in its first frame already; if they belong together, leave "
            f"the pair out by --ignore '{name}:{pair.part}'"
            for pair in pairs if pair.upper == 0 and pair.nearest is not None
            and (not at_start or pair.nearest.at == 0)]


def _compare_sizes(sequences: Many[Sequence], parts: Many[Part], searches: Many[Search],
                   outcome: Outcome) -> None:
    """Warns of moving bodies that are much larger or smaller than all parts together."""
    if not parts:
        return
    low = np.min([part.low for part in parts], axis=0)
    high = np.max([part.high for part in parts], axis=0)
    of_parts = float((high - low).max())
    for sequence, search in zip(sequences, searches):
        size = search.size
        if size is None or min(size, of_parts) <= 0:
            continue
        for more, less, ratio in ((sequence.name, "the parts", size / of_parts),
                                  ("the parts", sequence.name, of_parts / size)):
            if ratio > _SIZES_APART:
                outcome.warnings.append(
                    f"{more} and {less} differ in size by a factor of {ratio:.0f} ({more}: "
                    f"{max(size, of_parts):.4g} {outcome.unit}, {less}: "
                    f"{min(size, of_parts):.4g} {outcome.unit}); if their files are in different "
                    f"units, name both with --unit and --parts-unit")
