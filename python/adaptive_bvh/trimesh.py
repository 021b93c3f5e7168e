"""trimesh's CollisionManager, on this library: `from adaptive_bvh.trimesh import CollisionManager`.

Methods, arguments and results are those of trimesh.collision.CollisionManager, and
`update_object` moves the vertices of an object in place. It does not import trimesh: a mesh is any
object with `vertices` and `faces`.

A mesh with a true attribute `is_convex` whose faces enclose it is a convex body, filled, as in
trimesh: two of them have one contact, and minus its depth is their distance where they overlap.
Other meshes are surfaces: a contact for each pair of triangles that meet, and the distance 0 where
they touch or meet a convex body (trimesh's may be negative there, which is no depth). Nothing is cut:
trimesh keeps 100,000 contacts of a pair. To know whether a mesh is convex, trimesh needs SciPy.

Poses are in double precision, and must be rigid. One thread at a time may use a manager.
"""

import numpy as np

from ._core import Convex, DeformableMesh, Scene, distance

__all__ = ["CollisionManager", "ContactData", "DistanceData", "scene_to_collision"]

_EXTERNAL = "__external"  # trimesh's name for the mesh of a call
_OURS, _OTHERS = 1, 2  # groups of bodies


class _Named:
    """Two objects by their names, and the face of each."""

    def __init__(self, names, triangles):
        self.names = set(names)
        self._triangles = dict(zip(names, triangles))

    def index(self, name):
        """The face of the object with this name; -1 for a convex body."""
        return self._triangles[name]


class ContactData(_Named):
    """One contact: names (a set of two), normal, point, depth, and the face of each object.

    The normal points from the object that was added first to the other; in in_collision_single and
    in_collision_other from the object of this manager to the other.
    """

    def __init__(self, names, triangles, normal, point, depth):
        super().__init__(names, triangles)
        self.normal, self.point, self.depth = normal, point, depth


class DistanceData(_Named):
    """The distance of two objects, and its nearest points and faces.

    Of convex bodies that overlap, the distance is minus the depth: the points are that far apart, and
    meet if one body moves by it, the shortest way out.
    """

    def __init__(self, names, triangles, points, distance):
        super().__init__(names, triangles)
        self._points = dict(zip(names, points))
        self.distance = distance

    def point(self, name):
        """The nearest point, (3,), on the object with this name."""
        return self._points[name]


def _geometry(vertices, faces, is_convex):
    if is_convex:
        try:
            return Convex(vertices, faces)
        except ValueError:  # an open one, for example
            pass
    return DeformableMesh(vertices, faces)


def _pose(transform):
    if transform is None:
        return np.eye(4)
    pose = np.array(transform, dtype=np.float64)
    if pose.shape != (4, 4):
        raise ValueError("transform must be (4,4)!")
    return pose


class _Object:
    def __init__(self, mesh, transform):
        if not hasattr(mesh, "vertices") or not hasattr(mesh, "faces"):
            raise TypeError(f"mesh is {type(mesh).__name__}; a Trimesh, or another object with "
                            "vertices and faces, is needed: trimesh.load_mesh reads a file, "
                            "trimesh.Trimesh(vertices, faces) makes one of arrays")
        self.geometry = _geometry(mesh.vertices, mesh.faces, getattr(mesh, "is_convex", False))
        self.transform = _pose(transform)


class _Bodies:
    """Objects as bodies of a scene, by group and name."""

    def __init__(self, mask):
        self.scene = Scene()
        self._mask = mask
        self._numbers = {}
        self._things = {}
        self._convex = set()
        self.names = {}

    def add(self, name, thing, group=_OURS):
        mask = self._mask if group == _OURS else _OURS
        number = self.scene.add(thing.geometry, thing.transform, group=group, mask=mask)
        self._numbers[group, name] = number
        self.names[number], self._things[number] = name, thing
        if isinstance(thing.geometry, Convex):
            self._convex.add(number)

    def remove(self, name, group=_OURS):
        number = self._numbers.pop((group, name))
        self.scene.remove(number)
        del self.names[number], self._things[number]
        self._convex.discard(number)

    def place(self, name, transform):
        self.scene.set_transform(self._numbers[_OURS, name], transform)

    def number(self, name, group=_OURS):
        return self._numbers[group, name]

    def named(self, pair):
        return tuple(self.names[number] for number in pair)

    # ---- queries, of a scene that is up to date

    def collide(self, return_names, return_data):
        """Whether any touch, pairs of names, contacts."""
        if not (return_names or return_data):
            found = self.scene.collide(
                contacts_per_pair=0, enable_contact=False, first_only=True
            )
            return len(found) > 0, [], []
        found = self.scene.collide(
            contacts_per_pair=None if return_data else 0, enable_contact=return_data
        )
        pairs = [self.named(pair) for pair in found.bodies.tolist()]
        return len(pairs) > 0, pairs, self._contacts(found, pairs) if return_data else []

    @staticmethod
    def _contacts(found, pairs):
        names = [pair for pair, n in zip(pairs, np.diff(found.begins)) for _ in range(n)]
        of = found.contacts
        rows = zip(names, of.pairs.tolist(), of.normals, of.points, of.depths.tolist())
        return [ContactData(*row) for row in rows]

    def distance(self, body=None):
        """DistanceData and the pair of names; None where there is no pair."""
        found = self.scene.distance() if body is None else self.scene.nearest(body)
        if not np.isfinite(found.distance):
            return None, None
        pair, triangles, points, least = found.bodies, found.elements, found.points, found.distance
        if least <= 0 and len(self._convex) > 1:
            deepest = self._deepest(body)
            if deepest is not None:
                pair, triangles, points, least = deepest
        names = self.named(pair)
        return DistanceData(names, np.asarray(triangles).tolist(), points, least), names

    def _deepest(self, body):
        """The deepest overlap of two convex bodies: their numbers, triangles, points, distance."""
        found = self.scene.collide(contacts_per_pair=1)
        contacts = found.contacts
        convex = (contacts.pairs == -1).all(axis=1)
        if body is not None:
            convex &= (found.bodies == body).any(axis=1)
        if not convex.any():
            return None
        i = int(np.argmax(np.where(convex, contacts.depths, -1.0)))
        bodies, depth = found.bodies[i].tolist(), float(contacts.depths[i])
        first, second = (self._things[number] for number in bodies)
        way = contacts.normals[i] * depth
        out = second.transform.copy()
        out[:3, 3] += way  # now they touch
        meet = distance(first.geometry, second.geometry, tf1=first.transform, tf2=out).points
        return bodies, (-1, -1), (meet[0], meet[1] - way), -depth


def _answer(value, names, data, return_names, return_data):
    if return_names and return_data:
        return value, names, data
    if return_names:
        return value, names
    return (value, data) if return_data else value


class CollisionManager:
    """Meshes with names and poses, and queries of all of them: see the module."""

    def __init__(self):
        self._objects = {}
        self._inside = _Bodies(mask=_OURS)  # pairs of these objects
        self._outside = None  # pairs with others, made when they are asked for

    def _scenes(self):
        return [self._inside] + ([self._outside] if self._outside else [])

    def _require(self, name):
        if name not in self._objects:
            raise ValueError(f"{name} not in collision manager!")
        return self._objects[name]

    def add_object(self, name, mesh, transform=None):
        """Adds a mesh, or replaces that of this name. Returns the DeformableMesh or Convex that is
        queried."""
        thing = _Object(mesh, transform)
        if name in self._objects:
            self.remove_object(name)
        for bodies in self._scenes():
            bodies.add(name, thing)
        self._objects[name] = thing
        return thing.geometry

    def remove_object(self, name):
        """Removes an object. ValueError for a name that is not there, here and below."""
        self._require(name)
        for bodies in self._scenes():
            bodies.remove(name)
        del self._objects[name]

    def set_transform(self, name, transform):
        """Replaces the pose of an object, (4, 4)."""
        thing = self._require(name)
        pose = _pose(transform)
        for bodies in self._scenes():
            bodies.place(name, pose)
        thing.transform = pose

    def update_object(self, name, vertices):
        """Moves the vertices of an object, (N, 3); faces stay. Not in trimesh.

        A convex body stays one as long as it is convex, then becomes a surface, and remains that.
        """
        thing = self._require(name)
        if isinstance(thing.geometry, DeformableMesh):
            thing.geometry.update(vertices)
            return
        faces = thing.geometry.faces
        if np.shape(vertices) != thing.geometry.vertices.shape:
            raise ValueError(f"vertices must be {thing.geometry.vertices.shape}!")
        geometry = _geometry(vertices, faces, is_convex=True)
        for bodies in self._scenes():
            bodies.remove(name)
        thing.geometry = geometry
        for bodies in self._scenes():
            bodies.add(name, thing)

    def _current(self):
        self._inside.scene.update()
        return self._inside

    def _beside(self, others, query):
        """query(bodies) of these objects with others, {name: _Object}, which are no pairs among
        themselves."""
        if self._outside is None:
            self._outside = _Bodies(mask=_OTHERS)
            for name, thing in self._objects.items():
                self._outside.add(name, thing)
        bodies, added = self._outside, []
        try:
            for name, thing in others.items():
                bodies.add(name, thing, group=_OTHERS)
                added.append(name)
            bodies.scene.update()
            return query(bodies)
        finally:
            for name in added:
                bodies.remove(name, group=_OTHERS)

    def in_collision_single(self, mesh, transform=None, return_names=False, return_data=False):
        """Whether a mesh meets any object; the set of their names; a list of ContactData, in which
        the mesh is "__external"."""
        hit, pairs, data = self._beside(
            {_EXTERNAL: _Object(mesh, transform)},
            lambda bodies: bodies.collide(return_names, return_data),
        )
        return _answer(hit, {ours for ours, _ in pairs}, data, return_names, return_data)

    def in_collision_internal(self, return_names=False, return_data=False):
        """Whether any two objects meet; the set of pairs of names, each in alphabetical order; a
        list of ContactData."""
        hit, pairs, data = self._current().collide(return_names, return_data)
        names = {tuple(sorted(pair)) for pair in pairs}
        return _answer(hit, names, data, return_names, return_data)

    def in_collision_other(self, other_manager, return_names=False, return_data=False):
        """Whether any object meets one of another manager; the set of pairs of names, this
        manager's first; a list of ContactData."""
        hit, pairs, data = self._beside(
            other_manager._objects, lambda bodies: bodies.collide(return_names, return_data)
        )
        return _answer(hit, set(pairs), data, return_names, return_data)

    def min_distance_single(self, mesh, transform=None, return_name=False, return_data=False):
        """The least distance of a mesh to any object; the name of that object; DistanceData, in
        which the mesh is "__external". Infinite without objects, here and below; names and data are
        then None."""
        data, names = self._beside(
            {_EXTERNAL: _Object(mesh, transform)},
            lambda bodies: bodies.distance(bodies.number(_EXTERNAL, _OTHERS)),
        )
        name = next(n for n in names if n != _EXTERNAL) if names else None
        return _answer(data.distance if data else np.inf, name, data, return_name, return_data)

    def min_distance_internal(self, name=None, return_names=False, return_data=False):
        """The least distance of any two objects, or of the one with this name to any other; their
        names in alphabetical order; DistanceData."""
        if name is not None:
            self._require(name)
        bodies = self._current()
        data, names = bodies.distance(None if name is None else bodies.number(name))
        names = tuple(sorted(names)) if names else None
        return _answer(data.distance if data else np.inf, names, data, return_names, return_data)

    def min_distance_other(self, other_manager, return_names=False, return_data=False):
        """The least distance of any object to one of another manager; their names, this manager's
        first; DistanceData."""
        data, names = self._beside(other_manager._objects, lambda bodies: bodies.distance())
        return _answer(data.distance if data else np.inf, names, data, return_names, return_data)


def scene_to_collision(scene):
    """A CollisionManager of a trimesh.Scene, and what add_object returned for each of its nodes."""
    manager, objects = CollisionManager(), {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        objects[node] = manager.add_object(node, scene.geometry[geometry], transform)
    return manager, objects
