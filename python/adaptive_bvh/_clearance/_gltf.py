"""Sequences of a glTF animation: nodes that move, morph targets and skins, sampled at a rate."""

from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from ._frames import Floats, Frame, Ints, Sequence, Shape, checked
from ._gltf_document import Document

_MOST_FRAMES = 100_000
_WIDTHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}


class _Channel:
    """How one property of a node changes with time."""

    def __init__(self, document: Document, channel: Dict[str, Any], sampler: Dict[str, Any]):
        target = channel["target"]
        self.node, self.path = target["node"], target["path"]
        self._kind = sampler.get("interpolation", "LINEAR")
        self.times = document.accessor(sampler.get("input"), "SCALAR")[:, 0].astype(float)
        values = document.accessor(sampler.get("output"), _WIDTHS[self.path]).astype(float)
        parts = 3 if self._kind == "CUBICSPLINE" else 1
        if self.path == "weights" and len(values) % (parts * len(self.times)) == 0:
            values = values.reshape(parts * len(self.times), -1)
        if len(values) != parts * len(self.times) or not (
                np.isfinite(values).all() and np.isfinite(self.times).all()
                and (np.diff(self.times) > 0).all() and self.times[0] >= 0):
            raise document.error("an animation has times or values that do not fit")
        self._values = values.reshape(len(self.times), parts, -1)

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
        return value / np.linalg.norm(value) if self.path == "rotation" else value


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
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class _Skin(NamedTuple):
    joints: List[int]
    to_joint: Floats  # (joints, 4, 4), the inverse bind matrices
    which: Ints  # (vertices, k), of the skin's joints
    weights: Floats  # (vertices, k)


class _Placed(NamedTuple):
    """A primitive of a mesh, as a node places it."""

    node: int
    positions: Floats
    targets: List[Floats]
    weights: Floats
    skin: Optional[_Skin]


class GltfSequence(Sequence):
    """The first animation of a document, `rate` frames a second, and one at its end."""

    def __init__(self, path: str, name: str, rate: float, scale: float, up: Optional[str]):
        self._document = document = Document(path)
        self._scale, self._up = scale, up
        try:
            self._open(path, name, rate)
        except (TypeError, KeyError, IndexError, OverflowError, AttributeError) as error:
            raise document.error(f"it is broken ({error})") from None

    def _open(self, path: str, name: str, rate: float) -> None:
        document = self._document
        self._channels = self._read_channels()
        length = max((float(c.times[-1]) for c in self._channels), default=0.0)
        if length * rate >= _MOST_FRAMES:
            raise document.error(f"its animation takes {length:g} s, more than {_MOST_FRAMES} "
                                 f"frames; give a lower --rate")
        count = int(np.floor(length * rate * (1 + 1e-9))) + 1
        self._times = [i / rate for i in range(count)]
        if length > self._times[-1] * (1 + 1e-9):
            self._times.append(length)
        super().__init__(name, [float(i) for i in range(len(self._times))])
        animations = document.list("animations")
        if len(animations) > 1:
            self.warnings.append(f"{path} has {len(animations)} animations, and the first one was "
                                 f"used; export the others one by one to check them, too")
        self._order = self._ordered_nodes()
        self._placed: List[_Placed] = []
        triangles: List[Ints] = []
        for node, _ in self._order:
            self._place(node, triangles)
        if not triangles:
            raise document.error("it has no triangles")
        self._triangles = np.concatenate(triangles)
        self._shape = Shape(self._positions(0), self._triangles)

    @property
    def num_vertices(self) -> int:
        return self._shape.count

    def read(self, frame: int) -> Frame:
        positions = self._positions(self._times[frame])
        return Frame(checked(positions, f"{self.name}, {self.label(frame)},"), self._shape)

    # ---- what is there -----------------------------------------------------------------------

    def _read_channels(self) -> List[_Channel]:
        document, channels = self._document, []
        for animation in document.list("animations")[:1]:
            if not isinstance(animation, dict):
                raise document.error("an animation is no object")
            samplers = document.list("samplers", animation)
            for channel in document.list("channels", animation):
                target = channel.get("target") if isinstance(channel, dict) else None
                if not isinstance(target, dict) or target.get("path") not in _WIDTHS:
                    continue  # of an extension
                if "node" not in target:
                    continue
                document.item("nodes", target["node"])
                sampler = channel.get("sampler")
                if (not isinstance(sampler, int) or not 0 <= sampler < len(samplers)
                        or not isinstance(samplers[sampler], dict)):
                    raise document.error("an animation names a sampler that is not there")
                channels.append(_Channel(document, channel, samplers[sampler]))
        return channels

    def _ordered_nodes(self) -> List[Tuple[int, int]]:
        """The nodes of the scene and the parent of each (-1: none), parents first."""
        document = self._document
        scenes = document.list("scenes")
        nodes = document.list("nodes")
        if scenes:
            roots = document.list("nodes", document.item("scenes", document.json.get("scene", 0)))
        else:
            inner = {c for i in range(len(nodes))
                     for c in document.list("children", document.item("nodes", i))
                     if isinstance(c, int)}
            roots = [i for i in range(len(nodes)) if i not in inner]
        order: List[Tuple[int, int]] = [(root, -1) for root in roots]
        seen = set()
        for node, _ in order:
            children = document.list("children", document.item("nodes", node))
            if node in seen:
                raise document.error(f"node {node} has two parents, or is its own descendant")
            seen.add(node)
            order.extend((child, node) for child in children)
        return order

    def _place(self, node: int, triangles: List[Ints]) -> None:
        document = self._document
        of = document.item("nodes", node)
        if "mesh" not in of:
            return
        mesh = document.item("meshes", of["mesh"])
        for primitive in document.list("primitives", mesh):
            if not isinstance(primitive, dict) or not isinstance(primitive.get("attributes"), dict):
                raise document.error("a primitive has no attributes")
            if primitive.get("mode", 4) not in (4, 5, 6):
                continue  # points, lines
            attributes = primitive["attributes"]
            positions = document.accessor(attributes.get("POSITION"), "VEC3").astype(float)
            first = sum(len(placed.positions) for placed in self._placed)
            if first + len(positions) > max(500_000, document.bytes // 2):
                raise document.error("its nodes place meshes too often")
            targets = [document.accessor(target["POSITION"], "VEC3").astype(float)
                       if isinstance(target, dict) and "POSITION" in target
                       else np.zeros_like(positions)
                       for target in document.list("targets", primitive)]
            if any(len(target) != len(positions) for target in targets):
                raise document.error("a morph target has another number of vertices")
            weights = of.get("weights", mesh.get("weights"))
            start = document.numbers({"weights": weights} if weights else {}, "weights",
                                     len(targets), [0.0] * len(targets))
            self._placed.append(_Placed(node, positions, targets, start,
                                        self._skin(of, attributes, len(positions))))
            triangles.append(first + self._corners(primitive, len(positions)))

    def _corners(self, primitive: Dict[str, Any], count: int) -> Ints:
        if "indices" in primitive:
            numbers = self._document.accessor(primitive["indices"], "SCALAR")[:, 0]
            if numbers.dtype.kind != "u" or numbers.max() >= count:
                raise self._document.error(f"a triangle names vertex {numbers.max()} of {count}")
            numbers = numbers.astype(np.int64)
        else:
            numbers = np.arange(count)
        mode = primitive.get("mode", 4)
        if mode == 4:
            return numbers[:len(numbers) // 3 * 3].reshape(-1, 3)
        i = np.arange(len(numbers) - 2) if len(numbers) > 2 else np.arange(0)
        if mode == 6:
            return np.stack([numbers[i + 1], numbers[i + 2], np.full(len(i), numbers[0])], axis=1)
        return np.stack([numbers[i], numbers[i + 1 + i % 2], numbers[i + 2 - i % 2]], axis=1)

    def _skin(self, node: Dict[str, Any], attributes: Dict[str, Any],
              count: int) -> Optional[_Skin]:
        document = self._document
        if "skin" not in node or "JOINTS_0" not in attributes:
            return None
        skin = document.item("skins", node["skin"])
        joints = document.list("joints", skin)
        for joint in joints:
            document.item("nodes", joint)
        to_joint = np.tile(np.eye(4), (len(joints), 1, 1))
        if "inverseBindMatrices" in skin:
            columns = document.accessor(skin["inverseBindMatrices"], "MAT4")
            if len(columns) < len(joints):
                raise document.error("a skin has too few inverse bind matrices")
            to_joint = columns[:len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        which, weights = [], []
        for i in range(len(attributes)):
            if f"JOINTS_{i}" not in attributes or f"WEIGHTS_{i}" not in attributes:
                break
            which.append(document.accessor(attributes[f"JOINTS_{i}"], "VEC4").astype(np.int64))
            weights.append(document.accessor(attributes[f"WEIGHTS_{i}"], "VEC4").astype(float))
        if not which or any(len(rows) != count for rows in which + weights):
            raise document.error("a skin has joints or weights for other vertices")
        all_joints, all_weights = np.hstack(which), np.hstack(weights)
        all_joints = np.where(all_weights == 0, 0, all_joints)
        if not joints or all_joints.max() >= len(joints) or all_joints.min() < 0:
            raise document.error(f"a vertex names joint {all_joints.max()} of {len(joints)}")
        return _Skin(joints, to_joint, all_joints, all_weights)

    # ---- at a time ---------------------------------------------------------------------------

    def _worlds(self, time: float) -> Tuple[Dict[int, Floats], Dict[int, Floats]]:
        """Where each node is, (4, 4), and the weights of those that are animated."""
        document = self._document
        animated: Dict[Tuple[int, str], Floats] = {
            (channel.node, channel.path): channel.at(time) for channel in self._channels}
        worlds: Dict[int, Floats] = {-1: np.eye(4)}
        for node, parent in self._order:
            of = document.item("nodes", node)
            if "matrix" in of:
                local = document.numbers(of, "matrix", 16, []).reshape(4, 4).T
            else:
                def part(name: str, otherwise: List[float]) -> Floats:
                    found = animated.get((node, name))
                    if found is None:
                        return document.numbers(of, name, len(otherwise), otherwise)
                    return found
                local = np.eye(4)
                local[:3, :3] = _rotation(part("rotation", [0, 0, 0, 1])) * part("scale", [1, 1, 1])
                local[:3, 3] = part("translation", [0, 0, 0])
            worlds[node] = worlds[parent] @ local
        return worlds, {node: w for (node, path), w in animated.items() if path == "weights"}

    def _positions(self, time: float) -> Floats:
        worlds, weights = self._worlds(time)
        parts = []
        for placed in self._placed:
            points = placed.positions
            now = weights.get(placed.node, placed.weights)
            if len(now) != len(placed.targets):
                raise self._document.error("an animation has other weights than morph targets")
            for weight, target in zip(now, placed.targets):
                points = points + weight * target
            if placed.skin is None:
                matrix = worlds[placed.node]
                parts.append(points @ matrix[:3, :3].T + matrix[:3, 3])
                continue
            skin = placed.skin
            if any(joint not in worlds for joint in skin.joints):
                raise self._document.error("a joint is not in the scene")
            matrices = np.stack([worlds[joint] for joint in skin.joints]) @ skin.to_joint
            moved = np.zeros_like(points)
            for k in range(skin.which.shape[1]):
                m = matrices[skin.which[:, k]]
                moved += skin.weights[:, k, None] * (
                    np.einsum("nij,nj->ni", m[:, :3, :3], points) + m[:, :3, 3])
            parts.append(moved)
        x, y, z = np.concatenate(parts).T * self._scale
        if self._up == "z":
            x, y, z = x, -z, y
        elif self._up == "x":
            x, y, z = y, -x, z
        return np.stack([x, y, z], axis=1)
