"""Sequences of a glTF animation: nodes that move, morph targets and skins, sampled at a rate."""

import json
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from .. import MeshLoadError, _core
from ._frames import Floats, Frame, Ints, Sequence, SequenceError, Shape, checked
from ._lengths import factor

_MOST_FRAMES = 100_000
_FORMS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}


def item(values: Any, index: Any) -> Any:
    """An element of a list of a document. IndexError when it has none."""
    if not isinstance(values, list) or type(index) is not int or not 0 <= index < len(values):
        raise IndexError(f"there is no element {index!r}")
    return values[index]


class _Channel:
    """How one property of a node changes with time."""

    def __init__(self, file: Any, channel: Dict[str, Any], samplers: Any):
        """ValueError when its times or values do not fit."""
        sampler = item(samplers, channel["sampler"])
        self.node, self.path = channel["target"]["node"], channel["target"]["path"]
        self._kind = sampler.get("interpolation", "LINEAR")
        self.times = file.numbers(sampler["input"], "SCALAR")[:, 0]
        values = file.numbers(sampler["output"], _FORMS[self.path])
        parts = 3 if self._kind == "CUBICSPLINE" else 1
        rows = parts * len(self.times)
        if not rows or values.size % rows or (self.path != "weights" and len(values) != rows) or not (
                np.isfinite(values).all() and np.isfinite(self.times).all()
                and (np.diff(self.times) > 0).all() and self.times[0] >= 0):
            raise ValueError("an animation has times or values that do not fit")
        self._values = values.reshape(len(self.times), parts, -1)
        if self.path == "rotation" and not self._values[:, parts // 2].any(axis=1).all():
            raise ValueError("an animation has a rotation of length 0")

    def at(self, time: float) -> Floats:
        after = int(np.searchsorted(self.times, time, side="right"))
        if after in (0, len(self.times)):
            ends = self._values[min(after, len(self.times) - 1)]
            return self._normal(ends[len(ends) // 2])  # of a spline: tangent, value, tangent
        begin, end = self._values[after - 1], self._values[after]
        step = self.times[after] - self.times[after - 1]
        t = (time - self.times[after - 1]) / step
        if self._kind == "STEP":
            return begin[0]
        if self._kind == "CUBICSPLINE":
            return self._normal((2 * t**3 - 3 * t**2 + 1) * begin[1]
                                + step * (t**3 - 2 * t**2 + t) * begin[2]
                                + (3 * t**2 - 2 * t**3) * end[1]
                                + step * (t**3 - t**2) * end[0])
        if self.path == "rotation":
            return _slerp(begin[0], end[0], t)
        return (1 - t) * begin[0] + t * end[0]

    def _normal(self, value: Floats) -> Floats:
        return value / (np.linalg.norm(value) or 1.0) if self.path == "rotation" else value


def _slerp(a: Floats, b: Floats, t: float) -> Floats:
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    cosine = float(a @ b)
    if cosine < 0:
        b, cosine = -b, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        mixed = (1 - t) * a + t * b
    else:
        mixed = (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)
    return mixed / np.linalg.norm(mixed)


def _rotation(q: Floats) -> Floats:
    x, y, z, w = q / (np.linalg.norm(q) or 1.0)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class _Rest:
    """Translation, rotation and scale of a node, where they are not animated."""

    def __init__(self, node: Dict[str, Any]):
        self._parts = {name: np.array(node.get(name, otherwise), float) for name, otherwise in (
            ("translation", [0, 0, 0]), ("rotation", [0, 0, 0, 1]), ("scale", [1, 1, 1]))}

    def moved(self, animated: Dict[str, Floats]) -> Floats:
        """(4, 4), to the frame of the parent."""
        parts = {**self._parts, **animated}
        local = np.eye(4)
        local[:3, :3] = _rotation(parts["rotation"]) * parts["scale"]
        local[:3, 3] = parts["translation"]
        return local


class _Mesh(NamedTuple):
    """The positions of a mesh, and what moves its vertices."""

    positions: Floats
    triangles: Ints
    targets: List[List[Tuple[int, Floats]]]  # of each: first vertex and displacements of its parts
    weights: List[float]  # of the targets
    joints: Optional[Tuple[Ints, Floats]]  # (vertices, k), of the skin's joints; how much each counts


class _Placed(NamedTuple):
    """A mesh, as a node places it."""

    placement: int
    node: int  # of the document; -1: none
    mesh: _Mesh
    weights: List[float]  # of the morph targets, if they are not animated
    skin: Optional[int]


def gltf_sequence(path: str, name: str, rate: float, unit: str,
                  up: Optional[str]) -> Optional["GltfSequence"]:
    """None unless the file is a glTF document with an animation. SequenceError when it cannot be
    used."""
    try:
        file = _core._open_gltf(path)
    except (MeshLoadError, MemoryError):
        return None  # the reader of numbered files says why
    document = json.loads(file.json) if file is not None else {}
    if not isinstance(document.get("animations"), list) or not document["animations"]:
        return None  # glTF 1 has an object there
    return GltfSequence(file, document, path, name, rate, factor("m", unit), up)


class GltfSequence(Sequence):
    """The first animation of a document, `rate` frames a second, and one at its end."""

    def __init__(self, file: Any, document: Any, path: str, name: str, rate: float, scale: float,
                 up: Optional[str]):
        self._file, self._json, self._scale, self._up = file, document, scale, up
        try:
            self._open(path, name, rate)
        except MeshLoadError as error:
            raise SequenceError(f"{error}; export it again as glTF 2") from None
        except (TypeError, KeyError, ValueError, IndexError, OverflowError, AttributeError) as error:
            raise SequenceError(f"{path}: it is broken ({error}); "
                                f"export it again as glTF 2") from None
        del self._file, self._json

    def _open(self, path: str, name: str, rate: float) -> None:
        animations = self._json["animations"]
        self._channels = self._read_channels(animations[0])
        length = max((float(c.times[-1]) for c in self._channels), default=0.0)
        if length * rate >= _MOST_FRAMES:
            raise ValueError(f"its animation takes {length:g} s, more than {_MOST_FRAMES} frames; "
                             f"give a lower --rate")
        count = int(np.floor(length * rate * (1 + 1e-9))) + 1
        self._times = [i / rate for i in range(count)]
        if length > self._times[-1] * (1 + 1e-9):
            self._times.append(length)
        super().__init__(name, [float(i) for i in range(len(self._times))])
        if len(animations) > 1:
            self.warnings.append(f"{path} has {len(animations)} animations, and the first one was "
                                 f"used; export the others one by one to check them, too")
        self._nodes = self._file.nodes
        self._placements = self._file.placements.tolist()
        self._rest = {c.node: _Rest(item(self._json["nodes"], c.node)) for c in self._channels}
        self._where = {self._nodes[node][0]: placement  # of nodes of the document
                       for placement, (node, _) in enumerate(self._placements)}
        self._skins: Dict[int, Tuple[Ints, Floats]] = {}  # placements of joints, inverse matrices
        self._placed = self._place([self._mesh(*of) for of in self._file.meshes])
        if not any(len(placed.mesh.triangles) for placed in self._placed):
            raise ValueError("it has no triangles")
        self._shape = Shape(self._positions(0), self._placed_triangles())

    @property
    def num_vertices(self) -> int:
        return self._shape.count

    def read(self, frame: int) -> Frame:
        positions = self._positions(self._times[frame])
        return Frame(checked(positions, f"{self.name}, {self.label(frame)},"), self._shape)

    # ---- what is there -----------------------------------------------------------------------

    def _read_channels(self, animation: Dict[str, Any]) -> List[_Channel]:
        """Those of nodes; an extension may move other things."""
        channels = []
        for channel in animation["channels"]:
            target = channel["target"]
            if "node" in target and target.get("path") in _FORMS:
                if "matrix" in item(self._json["nodes"], target["node"]):
                    raise ValueError(f"node {target['node']} has a matrix, and is animated")
                channels.append(_Channel(self._file, channel, animation["samplers"]))
        return channels

    def _mesh(self, number: int, mesh: Any, parts: List[Tuple[int, int]]) -> _Mesh:
        of = item(self._json["meshes"], number)
        primitives = [of["primitives"][primitive] for _, primitive in parts]
        lists = [primitive.get("targets", []) for primitive in primitives]
        if any(len(targets) != len(lists[0]) for targets in lists):
            raise ValueError(f"primitives of mesh {number} have different numbers of morph targets")
        ends = [first for first, _ in parts[1:]] + [len(mesh.vertices)]
        counts = [end - first for (first, _), end in zip(parts, ends)]
        targets = [[(first, self._numbers(of_part[k]["POSITION"], "VEC3", count))
                    for of_part, (first, _), count in zip(lists, parts, counts)
                    if "POSITION" in of_part[k]] for k in range(len(lists[0]) if lists else 0)]
        return _Mesh(mesh.vertices, mesh.faces, targets, of.get("weights", [0.0] * len(targets)),
                     self._joints(primitives, counts))

    def _numbers(self, accessor: Any, form: str, count: int) -> Floats:
        numbers = self._file.numbers(accessor, form)
        if len(numbers) != count:
            raise ValueError("a morph target or joints are of another number of vertices")
        return numbers

    def _joints(self, primitives: List[Dict[str, Any]],
                counts: List[int]) -> Optional[Tuple[Ints, Floats]]:
        """None unless joints move all vertices."""
        sets = 0
        while primitives and all(f"JOINTS_{sets}" in p["attributes"] and
                                 f"WEIGHTS_{sets}" in p["attributes"] for p in primitives):
            sets += 1
        if not sets:
            return None
        joints, weights = (np.vstack([np.hstack([
            self._numbers(p["attributes"][f"{name}_{k}"], "VEC4", count) for k in range(sets)])
            for p, count in zip(primitives, counts)]) for name in ("JOINTS", "WEIGHTS"))
        if not np.isfinite(weights).all():
            raise ValueError("a weight of a joint is not finite")
        joints = np.where(weights == 0, 0, joints)
        if not ((joints >= 0) & (joints < 2**16)).all():
            raise ValueError("a vertex names a joint that is not there")
        return joints.astype(np.int64), weights

    def _place(self, meshes: List[_Mesh]) -> List[_Placed]:
        found: List[_Placed] = []
        animated = {c.node: len(c.at(0.0)) for c in self._channels if c.path == "weights"}
        for placement, (node, _) in enumerate(self._placements):
            number, _, of_node, is_skinned = self._nodes[node]
            of = item(self._json["nodes"], number) if number >= 0 else {}
            for mesh in (meshes[m] for m in of_node):
                weights = of.get("weights", mesh.weights)
                count = len(mesh.targets)
                if len(weights) != count or animated.get(number, count) != count:
                    raise ValueError(f"node {number} has other weights than morph targets")
                skin = self._skin(of["skin"], mesh) if is_skinned else None
                found.append(_Placed(placement, number, mesh, weights, skin))
        return found

    def _skin(self, number: int, mesh: _Mesh) -> int:
        if number not in self._skins:
            self._skins[number] = self._read_skin(item(self._json["skins"], number))
        joints = len(self._skins[number][0])
        if mesh.joints is None or mesh.joints[0].max(initial=-1) >= joints:
            raise ValueError(f"a vertex has no joint of the {joints} of skin {number}")
        return number

    def _read_skin(self, skin: Dict[str, Any]) -> Tuple[Ints, Floats]:
        if len(self._where) < len(self._placements):
            raise ValueError("a node has two parents, and there are skins")
        joints = np.array([self._where[joint] for joint in skin["joints"]], np.int64)
        inverse = np.tile(np.eye(4), (len(joints), 1, 1))
        if "inverseBindMatrices" in skin:
            columns = self._file.numbers(skin["inverseBindMatrices"], "MAT4")
            inverse = columns[:len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        if len(inverse) < len(joints):
            raise ValueError("a skin has too few inverse bind matrices")
        return joints, inverse

    def _placed_triangles(self) -> Ints:
        """Those of nodes that are mirrored in the first frame are reversed, to face outside."""
        worlds, first, triangles = self._worlds(0)[0], 0, []
        for placed in self._placed:
            mirrored = placed.skin is None and np.linalg.det(worlds[placed.placement][:3, :3]) < 0
            corners = placed.mesh.triangles
            triangles.append(first + (corners[:, [0, 2, 1]] if mirrored else corners))
            first += len(placed.mesh.positions)
        return np.concatenate(triangles)

    # ---- at a time ---------------------------------------------------------------------------

    def _worlds(self, time: float) -> Tuple[Floats, Dict[int, Floats]]:
        """Where each placement is, (4, 4), and the weights of nodes that are animated."""
        animated: Dict[int, Dict[str, Floats]] = {}
        for channel in self._channels:
            animated.setdefault(channel.node, {})[channel.path] = channel.at(time)
        worlds = np.empty((len(self._placements), 4, 4))
        above: List[Floats] = [np.eye(4)]
        for placement, (node, level) in enumerate(self._placements):
            number, local, _, _ = self._nodes[node]
            if number in animated:
                local = self._rest[number].moved(animated[number])
            worlds[placement] = above[level] @ local
            above[level + 1:] = [worlds[placement]]
        return worlds, {node: of["weights"] for node, of in animated.items() if "weights" in of}

    @np.errstate(over="ignore", invalid="ignore")  # what is not finite is refused
    def _positions(self, time: float) -> Floats:
        worlds, weights = self._worlds(time)
        skins = {number: worlds[joints] @ inverse
                 for number, (joints, inverse) in self._skins.items()}
        parts = []
        for placed in self._placed:
            points = placed.mesh.positions
            if placed.mesh.targets:
                points = points.copy()
                for weight, target in zip(weights.get(placed.node, placed.weights),
                                          placed.mesh.targets):
                    for first, displacements in target:
                        points[first:first + len(displacements)] += weight * displacements
            if placed.skin is None:
                matrix = worlds[placed.placement]
                parts.append(points @ matrix[:3, :3].T + matrix[:3, 3])
                continue
            assert placed.mesh.joints is not None
            joints, shares = placed.mesh.joints
            moved = np.zeros_like(points)
            for k in range(joints.shape[1]):
                m = skins[placed.skin][joints[:, k]]
                moved += shares[:, k, None] * (
                    np.einsum("nij,nj->ni", m[:, :3, :3], points) + m[:, :3, 3])
            parts.append(moved)
        x, y, z = np.concatenate(parts).T * self._scale
        if self._up == "z":
            x, y, z = x, -z, y
        elif self._up == "x":
            x, y, z = y, -x, z
        return np.stack([x, y, z], axis=1)
