"""Bodies that move rigidly: a mesh, and a table of its poses (.csv)."""

import math
from typing import Dict, List, Tuple

import numpy as np

from .. import Mesh
from ._frames import Frame, Sequence, SequenceError, Shape
from ._rotations import Pose

_COLUMNS = ("t", "x", "y", "z", "qw", "qx", "qy", "qz")
_OTHER_NAMES = {"time": "t", "timestamp": "t", "tx": "x", "ty": "y", "tz": "z"}
_ROUNDED = 1e-3  # of a quaternion's length: it may be written with few digits


def _columns(header: str, delimiter: str, path: str) -> Dict[str, int]:
    names = [name.strip(' "').lower() for name in header.lstrip("# ").split(delimiter or None)]
    names = [_OTHER_NAMES.get(name, name) for name in names]
    for column in _COLUMNS:
        if names.count(column) != 1:
            what = "two columns" if column in names else "no column"
            raise SequenceError(f"{path} has {what} {column} in its first line; write there, in the "
                                f"order of the columns: {','.join(_COLUMNS)}")
    return {name: i for i, name in enumerate(names)}


def _pose(cells: List[str], columns: Dict[str, int], where: str) -> List[float]:
    """The numbers of a line, in the order of _COLUMNS."""
    try:
        numbers = [float(cells[columns[name]]) for name in _COLUMNS]
    except (IndexError, ValueError):
        numbers = [math.nan]
    if not np.isfinite(numbers).all():
        raise SequenceError(f"{where} has no finite number in each of {','.join(_COLUMNS)}; export "
                            f"the poses again")
    length = float(np.linalg.norm(numbers[4:]))
    if abs(length - 1) > _ROUNDED:
        raise SequenceError(f"{where} has a quaternion of length {length:.6g}; write quaternions of "
                            f"length 1, in the order that the first line names")
    return numbers


def read_poses(path: str, scale: float) -> Tuple[List[float], List[Pose]]:
    """Times, and the pose at each. SequenceError when the file is no such table."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            lines = file.read().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not in UTF-8"
        raise SequenceError(f"{path} cannot be read ({reason}); name the table of the poses, a CSV "
                            f"file") from None
    header = lines[0] if lines else ""
    delimiter = next((mark for mark in ";,\t" if mark in header), "")  # else spaces
    columns = _columns(header, delimiter, path)
    times: List[float] = []
    poses: List[Pose] = []
    for i, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        if delimiter == ";":
            line = line.replace(",", ".")
        time, *numbers = _pose(line.split(delimiter or None), columns, f"line {i} of {path}")
        if times and not time > times[-1]:
            raise SequenceError(f"line {i} of {path} has the time {time:.15g} after "
                                f"{times[-1]:.15g}; sort the poses, so that times rise")
        times.append(time)
        quaternion = np.array(numbers[3:])
        poses.append(Pose(scale * np.array(numbers[:3]), quaternion / np.linalg.norm(quaternion)))
    if len(poses) < 2:
        raise SequenceError(f"{path} has {'one pose' if poses else 'no pose'}; a motion needs two or "
                            f"more")
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
        return Frame(pose.place(self._vertices), self._shape, pose)
