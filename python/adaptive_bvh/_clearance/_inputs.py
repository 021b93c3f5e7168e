"""What the arguments of a run name, opened: moving bodies, parts, settings."""

import argparse
import os
from typing import List, Sequence as Many

from .. import MeshLoadError, _core
from ._files import Reading
from ._frames import Sequence, SequenceError
from ._lengths import length_from, unit_from
from ._opening import Part, distinct, expanded, extent_of, is_cache, is_table, open_moving, open_part
from ._run import Outcome
from ._settings import Settings


class InputError(ValueError):
    """Nothing can be computed. Says what to do."""


def _declares_unit(name: str) -> bool:
    """Whether a file, or each file of a pattern, does. True for what cannot be read."""
    try:
        return all(not is_cache(path) and _core._declares_unit(path) for path in expanded([name]))
    except (SequenceError, MeshLoadError, MemoryError):
        return True


class Inputs:
    """What the arguments name, opened: moving bodies, parts, settings."""

    def __init__(self, arguments: argparse.Namespace, moving: Many[Many[str]]):
        if not hasattr(_core, "_open_gltf"):
            raise InputError("this adaptive_bvh was built without assimp and zlib, so it reads no "
                             "mesh files; install one that was built with them")
        self.arguments = arguments
        self.unit = self._unit([path for names in moving for path in names])
        self.limit = length_from(arguments.clearance, self.unit)
        if not arguments.rate > 0 or arguments.rate == float("inf"):
            raise InputError("--rate is a number above 0, such as 30")
        if arguments.threads < 1:
            raise InputError("--threads is 1 or more")
        self.outcome = Outcome(self.limit, self.unit)
        self._moving = moving

    def _unit(self, paths: List[str]) -> str:
        """That of --unit; else metres if all files declare their unit, else millimetres."""
        if self.arguments.unit:
            return unit_from(self.arguments.unit)
        names = [name for name in paths + self.arguments.parts if not is_table(name)]
        return "m" if names and all(_declares_unit(name) for name in names) else "mm"

    def open_parts(self) -> List[Part]:
        arguments = self.arguments
        file_unit = unit_from(arguments.parts_unit) if arguments.parts_unit else self.unit
        reading = Reading(self.unit, file_unit, arguments.up)
        parts: List[Part] = []
        for name in dict.fromkeys(arguments.parts):
            try:
                for path in expanded([name]):
                    parts.append(open_part(path, reading))
            except SequenceError as error:
                self.outcome.problems.append(str(error))
        if not parts:
            raise InputError("\n".join(self.outcome.problems) or
                             "no part is given; name the files of the parts after --parts (all "
                             "options: adaptive_bvh clearance --help)")
        names = distinct([part.name for part in parts],
                         [os.path.splitext(part.path)[0] for part in parts])
        return [part._replace(name=name) for part, name in zip(parts, names)]

    def open_moving(self) -> List[Sequence]:
        reading = Reading(self.unit, self.unit, self.arguments.up)
        sequences: List[Sequence] = []
        for names in self._moving:
            try:
                sequences += open_moving(names, reading, self.arguments.rate)
            except (SequenceError, OSError) as error:
                self.outcome.problems.append(str(error))
        if not sequences:
            raise InputError("\n".join(self.outcome.problems) or
                             "no moving body is given; name the files of its frames after --moving")
        for sequence, name in zip(sequences, distinct([s.name for s in sequences])):
            sequence.name = name
        return sequences

    def settings(self, parts: List[Part]) -> Settings:
        """The tolerance is a thousandth of the clearance, or of the size of a small part."""
        if self.arguments.tolerance:
            tolerance = length_from(self.arguments.tolerance, self.unit)
        else:
            sizes = [float((part.high - part.low).max()) for part in parts]
            tolerance = 1e-3 * (self.limit or 0.1 * min(sizes))
        largest = max(extent_of(part) for part in parts)
        return Settings(self.limit, max(tolerance, 1e-9 * largest))
