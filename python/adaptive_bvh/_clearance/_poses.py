"""Bodies that move rigidly: a mesh, and a table of its poses (.csv)."""

from typing import List, Tuple

import numpy as np

from .. import Mesh
from ._frames import Floats, Frame, Sequence, SequenceError, Shape, checked, read_text
from ._rotations import Pose

_COLUMNS = ("t", "x", "y", "z", "qw", "qx", "qy", "qz")
_OTHER_NAMES = {"time": "t", "timestamp": "t", "tx": "x", "ty": "y", "tz": "z"}
_ROUNDED = 1e-3  # of a quaternion's length: it may be written with few digits


def _columns(header: List[str], path: str) -> List[int]:
    """The places of _COLUMNS in a line."""
    names = [name.strip(' "').lower() for name in header]
    names = [_OTHER_NAMES.get(name, name) for name in names]
    for column in _COLUMNS:
        if names.count(column) != 1:
            what = "two columns" if column in names else "no column"
            raise SequenceError(f"{path} has {what} {column} in its first line; write there, in "
                                f"the order of the columns: {','.join(_COLUMNS)}")
    return [names.index(column) for column in _COLUMNS]


def _numbers(cells: List[str], columns: List[int], where: str) -> Floats:
    """Those of a line, in the order of _COLUMNS."""
    try:
        numbers = np.array([float(cells[column]) for column in columns])
    except (IndexError, ValueError):
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all():
        raise SequenceError(f"{where} has no finite number in each of {','.join(_COLUMNS)}; export "
                            f"the poses again")
    length = float(np.linalg.norm(numbers[4:]))
    if abs(length - 1) > _ROUNDED:
        raise SequenceError(f"{where} has a quaternion of length {length:.6g}; write quaternions "
                            f"of length 1, in the order that the first line names")
    return numbers


def read_poses(path: str, scale: float) -> Tuple[List[float], List[Pose]]:
    """Times, and the pose at each. SequenceError when the file is no such table."""
    lines = read_text(path, "the table of the poses").splitlines() or [""]
    delimiter = next((mark for mark in ";,\t" if mark in lines[0]), None)  # else spaces
    columns = _columns(lines[0].lstrip("# ").split(delimiter), path)
    times: List[float] = []
    poses: List[Pose] = []
    for i, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = (line.replace(",", ".") if delimiter == ";" else line).split(delimiter)
        numbers = _numbers(cells, columns, f"line {i} of {path}")
        if times and not numbers[0] > times[-1]:
            raise SequenceError(f"line {i} of {path} has the time {numbers[0]:.15g} after "
                                f"{times[-1]:.15g}; sort the poses, so that times rise")
        times.append(float(numbers[0]))
        poses.append(Pose(scale * numbers[1:4], numbers[4:] / np.linalg.norm(numbers[4:])))
    if len(poses) < 2:
        raise SequenceError(f"{path} has {'one pose' if poses else 'no pose'}; a motion needs two "
                            f"or more")
    return times, poses


class PosedBody(Sequence):
    """Frames are the poses; a screw leads from each to the next."""

    def __init__(self, name: str, path: str, mesh: Mesh, scale: float):
        times, self._poses = read_poses(path, scale)
        super().__init__(name, times)
        # Equal vertices become one: after a rotation they may differ by rounding.
        self._vertices, joined = np.unique(mesh.vertices, axis=0, return_inverse=True)
        self._shape = Shape(self._vertices, joined.reshape(-1)[mesh.faces])

    def label(self, frame: int) -> str:
        return f"time {self.numbers[frame]:.15g}"

    @property
    def num_vertices(self) -> int:
        return len(self._vertices)

    def read(self, frame: int) -> Frame:
        pose = self._poses[frame]
        positions = checked(pose.place(self._vertices), f"{self.name}, {self.label(frame)},")
        return Frame(positions, self._shape, pose)
