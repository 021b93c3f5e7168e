"""Which files are a moving body or a part: names, patterns, and the readers of their formats."""

import glob
import os
from collections import Counter
from typing import List, NamedTuple, Optional, Sequence as Many

from .. import DeformableMesh, MeshLoadError, _core
from ._arrays import read_npz, read_pc2
from ._files import NumberedFiles, Reading, by_number, name_of
from ._frames import Floats, Sequence, SequenceError
from ._gltf import gltf_sequence
from ._poses import PosedBody


class Part(NamedTuple):
    """A body that stands still."""

    name: str
    path: str
    mesh: DeformableMesh
    corners: Floats
    low: Floats  # of its box
    high: Floats


def extent_of(part: Part) -> float:
    """The largest coordinate, without its sign."""
    return float(max(abs(part.low).max(), abs(part.high).max()))


def expanded(names: Many[str]) -> List[str]:
    """The files of names and of patterns with * and ?, which a shell may have left alone."""
    paths: List[str] = []
    for name in names:
        if os.path.isdir(name):
            raise SequenceError(f"{name} is a folder; name its files, such as "
                                f"{os.path.join(name, '*' + _usual_suffix(name))}")
        found = [name] if os.path.exists(name) else sorted(glob.glob(name, recursive=True))
        if not found:
            what = "no file fits the pattern" if glob.has_magic(name) else "there is no file"
            raise SequenceError(f"{what} {name}; check the folder and the name")
        paths.extend(path for path in found if path not in paths)
    return paths


def _usual_suffix(folder: str) -> str:
    """The most frequent suffix in a folder; .stl for none."""
    suffixes = (os.path.splitext(path)[1] for path in glob.glob(os.path.join(glob.escape(folder), "*")))
    return max(Counter(filter(None, suffixes)).items(), key=lambda of: of[1], default=(".stl", 0))[0]


def _suffix(path: str) -> str:
    return os.path.splitext(path)[1].lower()


def _stem(path: str) -> str:
    return os.path.splitext(os.path.basename(path))[0]


def is_cache(path: str) -> bool:
    """Whether a file holds the positions of all frames."""
    return _suffix(path) in (".npz", ".pc2")


def is_table(path: str) -> bool:
    """Whether a file holds the poses of a body."""
    return _suffix(path) == ".csv"


def open_moving(names: Many[str], reading: Reading, rate: float) -> List[Sequence]:
    """The sequences of one --moving: mostly one; several if numbered files have different names."""
    paths = expanded(names)
    caches = [path for path in paths if is_cache(path) or is_table(path)]
    if caches:
        return [_open_cache(paths, caches, reading)]
    if len(paths) == 1:
        animation = gltf_sequence(paths[0], _stem(paths[0]), rate, reading.unit, reading.up)
        if animation is not None:
            return [animation]
    return [NumberedFiles(name_of(key), files, reading)
            for key, files in by_number(paths).items()]


def _open_cache(paths: List[str], caches: List[str], reading: Reading) -> Sequence:
    meshes = [path for path in paths if path not in caches]
    cache = caches[0]
    if len(caches) > 1 or len(meshes) > 1:
        raise SequenceError(f"{cache} stands with other files; give --moving once for each body: "
                            f"the file, and at most one mesh beside it")
    mesh = None
    if meshes:
        try:
            mesh = reading.mesh(meshes[0], weld=False)
        except (MeshLoadError, MemoryError) as error:
            raise SequenceError(str(error)) from None
    if _suffix(cache) == ".npz":
        return read_npz(cache, _stem(cache), reading.unit, reading.file_unit, mesh)
    if mesh is None:
        raise SequenceError(f"{cache} holds positions only; name its mesh beside it: "
                            f"--moving {cache} mesh.obj")
    if is_table(cache):
        return PosedBody(_stem(meshes[0]), cache, mesh, reading.scale(meshes[0]))
    return read_pc2(cache, _stem(cache), reading.unit, reading.file_unit, len(mesh.vertices),
                    mesh.faces)


def open_part(path: str, reading: Reading) -> Part:
    """SequenceError when the file cannot be used."""
    try:
        mesh = DeformableMesh(reading.mesh(path, weld=True))
        corners = mesh.vertices
        return Part(_stem(path), path, mesh, corners, corners.min(axis=0), corners.max(axis=0))
    except MeshLoadError as error:
        raise SequenceError(f"{error}; this part is left out, export it again") from None
    except (ValueError, MemoryError) as error:
        raise SequenceError(f"{path}: {error}; this part is left out, export it again") from None


def distinct(names: Many[str], otherwise: Optional[Many[str]] = None) -> List[str]:
    """Names that tell bodies apart, and can be printed: those that come twice are numbered, or get
    another name."""
    result: List[str] = []
    for i, name in enumerate(names):
        if names.count(name) > 1:
            name = otherwise[i] if otherwise else f"{name} ({names[:i].count(name) + 1})"
        result.append(_core._printable(name))
    return result
