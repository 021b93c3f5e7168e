"""A glTF 2 file: its JSON, and the numbers that accessors name. Nothing in it is believed."""

import base64
import binascii
import json
import os
import struct
from typing import Any, Dict, List, Optional
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from ._frames import Floats, SequenceError

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_REQUIRED = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform",
             "KHR_lights_punctual"}


class Document:
    def __init__(self, path: str):
        """SequenceError when the file cannot be read."""
        self.path = path
        self._binary = b""
        self._buffers: Dict[int, bytes] = {}
        self._numbers_read = 0
        try:
            with open(path, "rb") as file:
                data = file.read()
            self.json = json.loads(self._json_of(data).decode("utf-8-sig"))
        except (OSError, ValueError, RecursionError, struct.error) as error:
            raise self.error(f"it cannot be read: {error}") from None
        self.bytes = len(data)
        if not isinstance(self.json, dict):
            raise self.error("it is no glTF document")
        others = set(map(str, self.list("extensionsRequired"))) - _REQUIRED
        if others:
            raise self.error(f"it requires {min(others)}, which is not read")

    def error(self, reason: str) -> SequenceError:
        return SequenceError(f"{self.path}: {reason}; export it again as glTF 2")

    def _json_of(self, data: bytes) -> bytes:
        if data[:4] != b"glTF":
            return data
        at, text = 12, b"{}"
        while at + 8 <= len(data):
            size, kind = struct.unpack_from("<I4s", data, at)
            chunk = data[at + 8:at + 8 + size]
            if len(chunk) < size:
                raise ValueError("a chunk ends early")
            if kind == b"JSON":
                text = chunk
            elif kind == b"BIN\0":
                self._binary = chunk
            at += 8 + size
        return text

    def list(self, name: str, of: Optional[Dict[str, Any]] = None) -> List[Any]:
        """A list of the document or of one of its objects; empty if it has none."""
        found = (self.json if of is None else of).get(name, [])
        if not isinstance(found, list):
            raise self.error(f"its {name} are no list")
        return found

    def item(self, name: str, index: Any) -> Dict[str, Any]:
        """An object of a list of the document."""
        found = self.list(name)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(found):
            raise self.error(f"it names {name} {index!r} of {len(found)}")
        if not isinstance(found[index], dict):
            raise self.error(f"{name} {index} is no object")
        return found[index]

    def numbers(self, of: Dict[str, Any], name: str, count: int, otherwise: List[float]) -> Floats:
        """So many finite numbers of an object; `otherwise` if it has none."""
        try:
            found = np.array(of.get(name, otherwise), np.float64)
        except (TypeError, ValueError):
            found = np.empty(0)
        if found.shape != (count,) or not np.isfinite(found).all():
            raise self.error(f"a {name} is not of {count} finite numbers")
        return found

    def integer(self, of: Dict[str, Any], name: str, otherwise: Optional[int] = None) -> int:
        found = of.get(name, otherwise)
        if not isinstance(found, int) or isinstance(found, bool) or not 0 <= found < 2**40:
            raise self.error(f"a {name} is {found!r}")
        return found

    def _buffer(self, index: Any) -> bytes:
        buffer = self.item("buffers", index)
        if index not in self._buffers:
            uri = buffer.get("uri")
            if uri is None and index == 0:
                self._buffers[index] = self._binary
            elif isinstance(uri, str) and uri.startswith("data:"):
                try:
                    self._buffers[index] = base64.b64decode(uri.partition(",")[2], validate=True)
                except (ValueError, binascii.Error):
                    raise self.error("a buffer is no base64") from None
            elif isinstance(uri, str):
                self._buffers[index] = self._file(unquote(uri))
            else:
                raise self.error("a buffer has no data")
        return self._buffers[index]

    def _file(self, name: str) -> bytes:
        folder = os.path.realpath(os.path.dirname(os.path.abspath(self.path)))
        path = os.path.realpath(os.path.join(folder, name))
        if os.path.commonpath([folder, path]) != folder or not os.path.isfile(path):
            raise self.error(f"it names the file '{name}', which is not in its folder or below it")
        with open(path, "rb") as file:
            data = file.read()
        self.bytes += len(data)
        return data

    def _rows(self, view: Any, offset: int, count: int, dtype: npt.DTypeLike,
              width: int) -> npt.NDArray:
        """(count, width) numbers of a buffer view."""
        of = self.item("bufferViews", view)
        data = self._buffer(of.get("buffer"))
        begin, length = self.integer(of, "byteOffset", 0), self.integer(of, "byteLength")
        item = np.dtype(dtype).itemsize
        stride = self.integer(of, "byteStride", 0) or item * width
        size = (count - 1) * stride + item * width
        if stride < item * width or begin + length > len(data) or offset + size > length:
            raise self.error(f"buffer view {view} is shorter than it says")
        return np.ndarray((count, width), dtype, data, begin + offset, (stride, item))

    def accessor(self, index: Any, kind: str) -> npt.NDArray:
        """(count, width) numbers, of float64 unless they are integers that are not normalized."""
        of = self.item("accessors", index)
        dtype, width = _TYPES.get(of.get("componentType", 0)), _WIDTHS.get(str(of.get("type")))
        count = self.integer(of, "count")
        if dtype is None or width is None or width != _WIDTHS[kind] or count < 1:
            raise self.error(f"accessor {index} is not of {kind}")
        self._numbers_read += count * width
        if self._numbers_read > max(4_000_000, 4 * self.bytes):
            raise self.error("its meshes read the same data too often")
        if "bufferView" in of:
            offset = self.integer(of, "byteOffset", 0)
            rows = self._rows(of["bufferView"], offset, count, dtype, width)
        else:
            rows = np.zeros((count, width), dtype)
        if isinstance(of.get("sparse"), dict):
            rows = self._changed(rows, of["sparse"])
        if of.get("normalized") is True and dtype != "<f4":
            return np.maximum(rows / np.iinfo(dtype).max, -1.0)
        return rows.astype(np.float64) if dtype == "<f4" else rows

    def _changed(self, rows: npt.NDArray, sparse: Dict[str, Any]) -> npt.NDArray:
        count = self.integer(sparse, "count")
        at, values = sparse.get("indices"), sparse.get("values")
        if not isinstance(at, dict) or not isinstance(values, dict) or not 0 < count <= len(rows):
            raise self.error("a sparse accessor is incomplete")
        kind = _TYPES.get(at.get("componentType", 0), "<f4")
        if kind not in ("<u1", "<u2", "<u4"):
            raise self.error("indices of a sparse accessor are no integers")
        offset = self.integer(at, "byteOffset", 0)
        which = self._rows(at.get("bufferView"), offset, count, kind, 1)[:, 0]
        if which.max() >= len(rows):
            raise self.error("a sparse accessor changes an element that is not there")
        changed = rows.copy()
        changed[which] = self._rows(values.get("bufferView"),
                                    self.integer(values, "byteOffset", 0), count, rows.dtype,
                                    rows.shape[1])
        return changed
