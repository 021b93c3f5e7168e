"""Frames in binary PLY that differ from the first one in their positions alone."""

import os
from typing import Optional, Tuple

import numpy as np

from ._frames import Floats

_TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
          "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
          "float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


def _header(data: bytes) -> Tuple[Tuple[bytes, ...], int]:
    """The lines that say something, and where the header ends. ValueError when there is no end."""
    end = data.index(b"\n", data.index(b"\nend_header") + 1) + 1
    lines = data[:end].replace(b"\r", b"").split(b"\n")
    return tuple(line for line in lines if not line.startswith((b"comment", b"obj_info"))), end


def _layout(lines: Tuple[bytes, ...]) -> Tuple[np.dtype, int]:
    """The type of a vertex, and how many there are. ValueError or KeyError when the vertices do not
    come first, or are not of numbers at fixed places."""
    words = [line.decode("ascii").split() for line in lines if line]
    order = _ORDERS[words[1][1]]
    if words[2][:2] != ["element", "vertex"]:
        raise ValueError("no vertices")
    fields = []
    for line in words[3:]:
        if line[0] != "property":
            break
        fields.append((line[2], order + _TYPES[line[1]]))
    return np.dtype(fields), int(words[2][2])


class PlyLayout:
    """Where the positions are in a file whose mesh is known, and what is around them.

    A frame whose other bytes are equal has the same triangles, so only its positions are read. All
    other files go through the library's reader.
    """

    def __init__(self, path: str):
        """ValueError or KeyError when this file is not such a one."""
        with open(path, "rb") as file:
            data = file.read()
        self._lines, begin = _header(data)
        self._type, self._count = _layout(self._lines)
        self._bytes = self._count * self._type.itemsize
        self._rest = data[begin + self._bytes:]
        if self._type.names is None or not {"x", "y", "z"} <= set(self._type.names):
            raise ValueError("no positions")

    def read(self, path: str) -> Optional[Floats]:
        """The positions of a frame; None when its other bytes differ, or it is no regular file."""
        if not os.path.isfile(path):
            return None
        try:
            with open(path, "rb") as file:
                data = file.read()
            lines, begin = _header(data)
        except (ValueError, OSError):
            return None
        if lines != self._lines or len(data) != begin + self._bytes + len(self._rest):
            return None
        if data[begin + self._bytes:] != self._rest:
            return None
        vertices = np.frombuffer(data, self._type, self._count, begin)
        positions = np.empty((self._count, 3))
        for axis, name in enumerate("xyz"):
            positions[:, axis] = vertices[name]
        return positions


def layout_of(path: str, positions: Floats, scale: float) -> Optional[PlyLayout]:
    """None unless the file is a binary PLY in which these positions are found, before scaling."""
    try:
        layout = PlyLayout(path)
        found = layout.read(path)
    except (ValueError, KeyError, IndexError, TypeError, OSError):
        return None
    return layout if found is not None and np.array_equal(found * scale, positions) else None
