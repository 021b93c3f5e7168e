"""Sequences of numbered files: hose_0001.ply, hose_0002.ply, ..."""

import os
import re
import threading
from collections import Counter
from typing import Dict, List, Literal, Optional, Sequence as Many, Tuple

from .. import Mesh, MeshLoadError, _core, load_mesh
from ._frames import Floats, Frame, FrameError, Ints, Sequence, SequenceError, Shape, checked
from ._lengths import METRES, factor
from ._ply import layout_of

_NUMBER = re.compile(r"(.*?)(\d+)(\D*)$")


class Reading:
    """How files are read: the unit of the run, the unit of files that declare none, and the axis
    that points up where a file declares one."""

    def __init__(self, unit: str, file_unit: str, up: Optional[Literal["x", "y", "z"]] = None):
        self.unit, self.file_unit, self.up = unit, file_unit, up

    @property
    def undeclared_scale(self) -> float:
        """By which the numbers of files that declare no unit are multiplied."""
        return factor(self.file_unit, self.unit)

    def scale(self, path: str) -> float:
        """By which lengths that belong to a mesh file are multiplied: metres if it declares a unit.
        MeshLoadError when it cannot be read."""
        return factor("m", self.unit) if _core._declares_unit(path) else self.undeclared_scale

    def mesh(self, path: str, weld: bool) -> Mesh:
        """MeshLoadError when the file cannot be used."""
        return load_mesh(path, weld=weld, up=self.up, unit=METRES[self.unit],
                         undeclared_unit=METRES[self.file_unit])


def by_number(paths: Many[str]) -> Dict[Tuple[str, str], List[Tuple[int, str]]]:
    """Sequences: those files whose names differ in their last number alone, in its order."""
    sequences: Dict[Tuple[str, str], List[Tuple[int, str]]] = {}
    for path in paths:
        stem, suffix = os.path.splitext(path)
        match = _NUMBER.match(os.path.basename(stem))
        if match is None:
            if len(paths) > 1:
                raise SequenceError(
                    f"{path} has no number in its name, so its place among the {len(paths)} files "
                    f"is unknown; name frames like hose_0001{suffix or '.ply'}, and give --moving "
                    f"once for each body")
            sequences[path, suffix] = [(0, path)]
            continue
        key = (os.path.join(os.path.dirname(path), match.group(1) + "#" + match.group(3)), suffix)
        sequences.setdefault(key, []).append((int(match.group(2)), path))
    for files in sequences.values():
        files.sort()
        for (a, first), (b, second) in zip(files, files[1:]):
            if a == b:
                raise SequenceError(f"{first} and {second} are both frame {a}; remove one of them")
    return sequences


def name_of(key: Tuple[str, str]) -> str:
    """The body's name: that of its files, without the number."""
    base = os.path.basename(key[0])
    if "#" not in base:
        return os.path.splitext(base)[0]
    folder = os.path.basename(os.path.dirname(os.path.abspath(key[0])))
    return base.replace("#", "").strip("_-. ") or folder or "moving body"


class NumberedFiles(Sequence):
    def __init__(self, name: str, files: List[Tuple[int, str]], reading: Reading):
        super().__init__(name, [float(number) for number, _ in files])
        self.paths = [path for _, path in files]
        self._reading = reading
        self._lock = threading.Lock()
        self._mark_gaps()
        self._open_first()

    def label(self, frame: int) -> str:
        return self.paths[frame]

    def _mark_gaps(self) -> None:
        numbers = [int(n) for n in self.numbers]
        steps = Counter(b - a for a, b in zip(numbers, numbers[1:]))
        if len(steps) < 2:
            return
        usual = min(steps, key=lambda step: (-steps[step], step))
        self.gaps = [i for i, (a, b) in enumerate(zip(numbers, numbers[1:])) if b - a > usual]
        missing = [f"{a + usual}" if b - a == 2 * usual else f"{a + usual} to {b - usual}"
                   for a, b in zip(numbers, numbers[1:]) if b - a > usual]
        if missing:
            text = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
            one = len(missing) == 1 and missing[0].isdigit()
            self.problems.append(
                f"{self.name}: {f'frame {text} is' if one else f'frames {text} are'} missing, so "
                f"nothing is known about the motion there; add {'its file' if one else 'these files'}")

    def _open_first(self) -> None:
        """The first file that can be read says which triangles there are."""
        first_error = ""
        for path in self.paths:
            try:
                mesh = self._reading.mesh(path, weld=False)
                checked(mesh.vertices, path)
            except (MeshLoadError, FrameError, MemoryError) as error:
                first_error = first_error or str(error)
                continue
            self._shapes = [Shape(mesh.vertices, mesh.faces)]
            self._layout = layout_of(path, mesh.vertices, self._reading.undeclared_scale)
            return
        raise SequenceError(f"no file of {self.name} can be read: {first_error}; export "
                            f"them again, as PLY, OBJ or STL")

    @property
    def num_vertices(self) -> int:
        return self._shapes[0].count

    def read(self, frame: int) -> Frame:
        path, scale = self.paths[frame], self._reading.undeclared_scale
        try:
            if self._layout is not None:
                positions = self._layout.read(path)
                if positions is not None:
                    return Frame(checked(positions * scale, path), self._shapes[0])
            mesh = self._reading.mesh(path, weld=False)
        except (MeshLoadError, MemoryError) as error:
            raise FrameError(f"{error}; export this frame again") from None
        return Frame(checked(mesh.vertices, path), self._shape_of(mesh.vertices, mesh.faces))

    def _shape_of(self, positions: Floats, triangles: Ints) -> Shape:
        """One of the shapes that the sequence had, or a new one."""
        with self._lock:
            for shape in self._shapes:
                if shape.is_of(positions, triangles):
                    return shape
            self._shapes.append(Shape(positions, triangles))
            return self._shapes[-1]
