"""Sequences of positions in one file: arrays of NumPy (.npz), point caches (.pc2)."""

import math
import os
import struct
import zipfile
from typing import List, Optional, Tuple

import numpy as np
import numpy.typing as npt

from .. import Mesh
from ._frames import Frame, FrameError, Ints, Sequence, SequenceError, Shape, checked
from ._lengths import factor

_POSITIONS = ("vertices", "positions", "frames", "points")
_FACES = ("faces", "triangles")
_MOST_RATIO = 64  # of the bytes in an archive to those of it, as for other archives
_MOST_ARRAYS = 1000


class ArraySequence(Sequence):
    """Frames × vertices × 3 numbers, and triangles that do not change."""

    def __init__(self, name: str, numbers: List[float], positions: npt.NDArray[np.floating],
                 triangles: Ints, scale: float):
        super().__init__(name, numbers)
        self._positions, self._scale = positions, scale
        for frame in range(len(self)):
            try:
                self._shape = Shape(self._of(frame), triangles)
                return
            except FrameError:
                pass
        raise SequenceError(f"no frame of {name} has finite numbers only; export it again")

    def _of(self, frame: int) -> npt.NDArray[np.float64]:
        positions = np.array(self._positions[frame], np.float64, order="C") * self._scale
        return checked(positions, f"{self.name}, {self.label(frame)},")

    @property
    def num_vertices(self) -> int:
        return self._shape.count

    def read(self, frame: int) -> Frame:
        return Frame(self._of(frame), self._shape)


def checked_triangles(triangles: npt.NDArray, vertices: int, path: str) -> Ints:
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
        raise SequenceError(f"the faces in {path} have the shape {triangles.shape}; "
                            f"(triangles, 3) is needed")
    if triangles.dtype.kind not in "iu":
        raise SequenceError(f"the faces in {path} are of {triangles.dtype}; integers are needed")
    if triangles.min() < 0 or triangles.max() >= vertices:
        worst = triangles.min() if triangles.min() < 0 else triangles.max()
        raise SequenceError(f"a face in {path} names vertex {worst} of {vertices} "
                            f"(counted from 0); export vertices and faces of the same mesh, the "
                            f"vertices as (frames, vertices, 3)")
    return triangles.astype(np.int64)


class _Archive:
    """The arrays of numbers in an .npz. ValueError, and what zipfile, zlib and NumPy raise, when it
    is damaged, or holds far more than it has bytes."""

    def __init__(self, path: str):
        if not os.path.isfile(path):
            raise ValueError("it is no regular file")
        self._archive = zipfile.ZipFile(path)
        entries = self._archive.infolist()
        if sum(entry.file_size for entry in entries) > _MOST_RATIO * os.path.getsize(path):
            raise ValueError(f"it holds more than {_MOST_RATIO} times its own bytes")
        if len(entries) > _MOST_ARRAYS:
            raise ValueError(f"it holds more than {_MOST_ARRAYS} arrays")
        self._entries = {entry.filename[:-len(".npy")]: entry for entry in entries}
        self._shapes = {}
        for name, entry in self._entries.items():
            shape = self._shape_of(entry)
            if shape is not None:
                self._shapes[name] = shape

    def _shape_of(self, entry: zipfile.ZipInfo) -> Optional[Tuple[int, ...]]:
        """None unless it is of numbers."""
        with self._archive.open(entry) as file:
            version = np.lib.format.read_magic(file)
            read_header = (np.lib.format.read_array_header_1_0 if version == (1, 0)
                           else np.lib.format.read_array_header_2_0)
            shape, _, dtype = read_header(file)
        if dtype.hasobject or min(shape, default=0) < 0 or (
                math.prod(shape) * dtype.itemsize > entry.file_size):
            raise ValueError(f"{entry.filename} announces more than it holds")
        return shape if dtype.kind in "fiu" else None

    def pick(self, names: Tuple[str, ...], dimensions: int) -> Optional[str]:
        """The array with one of these names, else the only one of this shape."""
        fitting = [key for key, shape in self._shapes.items()
                   if len(shape) == dimensions and shape[-1] == 3]
        named = [key for key in names if key in fitting]
        return named[0] if named else fitting[0] if len(fitting) == 1 else None

    def read(self, name: str) -> npt.NDArray:
        with self._archive.open(self._entries[name]) as file:
            return np.lib.format.read_array(file, allow_pickle=False)


def _arrays_in(path: str) -> Tuple[Optional[npt.NDArray], Optional[npt.NDArray]]:
    """Positions and faces. SequenceError when the archive is damaged."""
    try:
        archive = _Archive(path)
        names = archive.pick(_POSITIONS, 3), archive.pick(_FACES, 2)
        positions, faces = (None if name is None else archive.read(name) for name in names)
        return positions, faces
    except Exception as error:  # whatever zipfile, zlib and NumPy meet in damaged bytes
        raise SequenceError(f"{path} cannot be read as .npz ({error}); "
                            f"save it again with numpy.savez") from None


def read_npz(path: str, name: str, unit: str, file_unit: str,
             mesh: Optional[Mesh]) -> ArraySequence:
    """With the faces of a mesh, or of its own. SequenceError when it is no such file, or does not
    fit the mesh."""
    positions, faces = _arrays_in(path)
    if positions is None:
        raise SequenceError(f"{path} has no array of the shape (frames, vertices, 3); save it with "
                            f"numpy.savez('{name}.npz', vertices=..., faces=...)")
    if not positions.size:
        raise SequenceError(f"{path} has no positions: they have the shape {positions.shape}; "
                            f"export its frames again")
    if mesh is None:
        if faces is None:
            raise SequenceError(f"{path} has no array 'faces' of the shape (triangles, 3); add it, "
                                f"or name a mesh file beside it: --moving {path} mesh.obj")
        given = faces
    else:
        given = mesh.faces
        if positions.shape[1] != len(mesh.vertices):
            raise SequenceError(f"{path} has {positions.shape[1]} vertices in a frame, its mesh "
                                f"{len(mesh.vertices)}; name the mesh that it was made of")
    triangles = checked_triangles(given, positions.shape[1], path)
    numbers = [float(frame) for frame in range(len(positions))]
    return ArraySequence(name, numbers, positions, triangles, factor(file_unit, unit))


def read_pc2(path: str, name: str, unit: str, file_unit: str, vertices: int,
             triangles: Ints) -> ArraySequence:
    """A point cache, of a mesh with so many vertices. A file that ends early keeps its frames."""
    header = struct.Struct("<12siiffi")
    if not os.path.isfile(path):
        raise SequenceError(f"{path} is no regular file; name one")
    try:
        with open(path, "rb") as file:
            data = file.read()
        magic, _, count, start, rate, frames = header.unpack_from(data)
    except OSError as error:
        raise SequenceError(f"{path} cannot be read: {error.strerror}") from None
    except struct.error:
        raise SequenceError(f"{path} ends within its header; export it again") from None
    if not magic.startswith(b"POINTCACHE2") or count <= 0 or frames <= 0:
        raise SequenceError(f"{path} is no point cache (.pc2) with frames; export it again")
    if count != vertices:
        raise SequenceError(f"{path} has {count} vertices, and its mesh {vertices}; name the mesh "
                            f"that this cache was made of")
    there = min((len(data) - header.size) // (12 * count), frames)
    if there < 1:
        raise SequenceError(f"{path} ends within its first frame; export it again")
    positions = np.frombuffer(data, "<f4", 3 * count * there, header.size)
    numbered = np.isfinite(start) and np.isfinite(rate) and rate > 0
    numbers = [start + rate * i if numbered else float(i) for i in range(there)]
    sequence = ArraySequence(name, numbers, positions.reshape(there, count, 3), triangles,
                             factor(file_unit, unit))
    if there < frames:
        sequence.problems.append(f"{path} announces {frames} frames and ends after {there}; "
                                 f"only these were used; export it again")
    return sequence
