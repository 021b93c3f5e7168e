import os
from typing import Any, Dict, Optional, Protocol, Tuple, Union, overload

import numpy as np
import numpy.typing as npt
from typing_extensions import Literal, TypeAlias

__version__: str

_Floats: TypeAlias = npt.NDArray[np.float64]
_Ints: TypeAlias = npt.NDArray[np.int32]
_Longs: TypeAlias = npt.NDArray[np.int64]
_Bools: TypeAlias = npt.NDArray[np.bool_]
_Pose: TypeAlias = Union[None, npt.ArrayLike, Tuple[npt.ArrayLike, npt.ArrayLike]]
_Object: TypeAlias = Union[DeformableMesh, Shape]
_Filter: TypeAlias = Literal["shared vertex", "shared edge", "beyond shared", "none"]
_Kind: TypeAlias = Literal["vertex-face", "face-vertex", "edge-edge"]

class _HasMesh(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class MeshLoadError(ValueError): ...

class Mesh:
    @property
    def vertices(self) -> _Floats: ...
    @property
    def faces(self) -> npt.NDArray[np.int64]: ...

def load_mesh(
    path: Union[str, bytes, os.PathLike[str], os.PathLike[bytes]],
    *,
    weld: bool = True,
    weld_tolerance: float = 0.0,
    up: Optional[Literal["x", "y", "z"]] = None,
    metres: bool = True,
    scale: float = 1.0,
) -> Mesh: ...
def weld_vertices(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, tolerance: float = 0.0
) -> Mesh: ...

class MeshUpdate:
    @property
    def vertices(self) -> int: ...
    @property
    def largest_displacement(self) -> float: ...
    @property
    def turned(self) -> bool: ...
    @property
    def seconds(self) -> float: ...

class DeformableMesh:
    @overload
    def __init__(
        self, vertices: npt.ArrayLike, faces: npt.ArrayLike, dtype: npt.DTypeLike = "float64"
    ) -> None: ...
    @overload
    def __init__(
        self, vertices: _HasMesh, faces: None = None, dtype: npt.DTypeLike = "float64"
    ) -> None: ...
    @overload
    def update(self, vertices: npt.ArrayLike) -> MeshUpdate: ...
    @overload
    def update(self, indices: npt.ArrayLike, vertices: npt.ArrayLike) -> MeshUpdate: ...
    def update_two_frames(self, vertices: npt.ArrayLike) -> MeshUpdate: ...
    def copy(self) -> DeformableMesh: ...
    def __copy__(self) -> DeformableMesh: ...
    def __deepcopy__(self, memo: Dict[Any, Any]) -> DeformableMesh: ...
    def validate(self) -> bool: ...
    def set_update_threads(self, threads: int) -> None: ...
    def set_query_threads(self, threads: int) -> None: ...
    @property
    def last_update(self) -> MeshUpdate: ...
    @property
    def vertices(self) -> npt.NDArray[Any]: ...
    @property
    def previous_vertices(self) -> npt.NDArray[Any]: ...
    @property
    def faces(self) -> npt.NDArray[np.int64]: ...
    @property
    def num_vertices(self) -> int: ...
    @property
    def num_faces(self) -> int: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...

class Shape: ...

class Box(Shape):
    def __init__(self, x: float, y: float, z: float) -> None: ...
    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def z(self) -> float: ...

class Sphere(Shape):
    def __init__(self, radius: float) -> None: ...
    @property
    def radius(self) -> float: ...

class Ellipsoid(Shape):
    def __init__(self, a: float, b: float, c: float) -> None: ...
    @property
    def a(self) -> float: ...
    @property
    def b(self) -> float: ...
    @property
    def c(self) -> float: ...

class Capsule(Shape):
    def __init__(self, radius: float, lz: float) -> None: ...
    @property
    def radius(self) -> float: ...
    @property
    def lz(self) -> float: ...

class Cylinder(Shape):
    def __init__(self, radius: float, lz: float) -> None: ...
    @property
    def radius(self) -> float: ...
    @property
    def lz(self) -> float: ...

class Cone(Shape):
    def __init__(self, radius: float, lz: float) -> None: ...
    @property
    def radius(self) -> float: ...
    @property
    def lz(self) -> float: ...

class Plane(Shape):
    def __init__(self, normal: npt.ArrayLike, offset: float = 0.0) -> None: ...
    @property
    def normal(self) -> _Floats: ...
    @property
    def offset(self) -> float: ...

class Halfspace(Shape):
    def __init__(self, normal: npt.ArrayLike, offset: float = 0.0) -> None: ...
    @property
    def normal(self) -> _Floats: ...
    @property
    def offset(self) -> float: ...

class DistanceResult:
    @property
    def distance(self) -> float: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def triangles(self) -> _Ints: ...

class Contacts:
    @property
    def pairs(self) -> _Ints: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def depths(self) -> _Floats: ...
    def __len__(self) -> int: ...

def distance(
    o1: _Object,
    o2: _Object,
    tf1: _Pose = None,
    tf2: _Pose = None,
    *,
    nearest_points: bool = True,
) -> DistanceResult: ...
def collide(
    o1: _Object,
    o2: _Object,
    tf1: _Pose = None,
    tf2: _Pose = None,
    *,
    max_contacts: Union[int, None] = None,
    enable_contact: bool = True,
) -> Contacts: ...
def self_collide(
    mesh: DeformableMesh,
    tf: _Pose = None,
    *,
    max_contacts: Union[int, None] = None,
    enable_contact: bool = True,
    filter: _Filter = "shared vertex",
    ignored: Union[npt.ArrayLike, None] = None,
) -> Contacts: ...

class CoherentDistance:
    def __init__(self, first: DeformableMesh, second: DeformableMesh) -> None: ...
    def distance(
        self, tf1: _Pose = None, tf2: _Pose = None, *, nearest_points: bool = True
    ) -> DistanceResult: ...

class CoherentProximity:
    def __init__(self, first: DeformableMesh, second: DeformableMesh) -> None: ...
    def is_nearer(self, distance: float, tf1: _Pose = None, tf2: _Pose = None) -> bool: ...
    @property
    def searches(self) -> int: ...

class TrianglePairs:
    @property
    def triangles(self) -> _Ints: ...
    @property
    def distances(self) -> _Floats: ...
    @property
    def nearest_points(self) -> _Floats: ...
    def __len__(self) -> int: ...

class FeaturePairs:
    def __init__(
        self,
        vertex_face: Union[npt.ArrayLike, None] = None,
        face_vertex: Union[npt.ArrayLike, None] = None,
        edge_edge: Union[npt.ArrayLike, None] = None,
    ) -> None: ...
    @property
    def vertex_face(self) -> _Ints: ...
    @property
    def face_vertex(self) -> _Ints: ...
    @property
    def edge_edge(self) -> _Ints: ...
    def __len__(self) -> int: ...

def is_nearer(
    first: DeformableMesh,
    second: DeformableMesh,
    distance: float,
    tf1: _Pose = None,
    tf2: _Pose = None,
) -> bool: ...
@overload
def pairs_within(
    first: DeformableMesh,
    second: DeformableMesh,
    distance: float,
    tf1: _Pose = None,
    tf2: _Pose = None,
    *,
    enable_distances: bool = False,
    enable_nearest_points: bool = False,
    ignored: Union[npt.ArrayLike, None] = None,
) -> TrianglePairs: ...
@overload
def pairs_within(
    mesh: DeformableMesh,
    distance: float,
    *,
    enable_distances: bool = False,
    enable_nearest_points: bool = False,
    filter: _Filter = "shared vertex",
    ignored: Union[npt.ArrayLike, None] = None,
) -> TrianglePairs: ...
@overload
def feature_pairs_within(
    first: DeformableMesh,
    second: DeformableMesh,
    distance: float,
    tf1: _Pose = None,
    tf2: _Pose = None,
    *,
    ignored: Union[FeaturePairs, None] = None,
) -> FeaturePairs: ...
@overload
def feature_pairs_within(
    mesh: DeformableMesh, distance: float, *, ignored: Union[FeaturePairs, None] = None
) -> FeaturePairs: ...

class FeatureDetails:
    @property
    def distances(self) -> _Floats: ...
    @property
    def nearest_points(self) -> _Floats: ...
    @property
    def coordinates(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    def __len__(self) -> int: ...

class FeaturePairDetails:
    @property
    def vertex_face(self) -> FeatureDetails: ...
    @property
    def face_vertex(self) -> FeatureDetails: ...
    @property
    def edge_edge(self) -> FeatureDetails: ...

@overload
def feature_pair_details(
    first: DeformableMesh,
    second: DeformableMesh,
    pairs: FeaturePairs,
    tf1: _Pose = None,
    tf2: _Pose = None,
) -> FeaturePairDetails: ...
@overload
def feature_pair_details(mesh: DeformableMesh, pairs: FeaturePairs) -> FeaturePairDetails: ...
def clearance(
    mesh: DeformableMesh,
    other: DeformableMesh,
    limit: float = ...,
    tf: _Pose = None,
    other_tf: _Pose = None,
) -> _Floats: ...
def signed_clearance(
    mesh: DeformableMesh,
    other: DeformableMesh,
    limit: float = ...,
    tf: _Pose = None,
    other_tf: _Pose = None,
) -> _Floats: ...

class ClosestPoint:
    @property
    def point(self) -> _Floats: ...
    @property
    def distance(self) -> float: ...
    @property
    def triangle(self) -> int: ...

class ClosestPoints:
    @property
    def points(self) -> _Floats: ...
    @property
    def distances(self) -> _Floats: ...
    @property
    def triangles(self) -> _Ints: ...
    def __len__(self) -> int: ...

class RayHit:
    @property
    def t(self) -> float: ...
    @property
    def triangle(self) -> int: ...
    @property
    def u(self) -> float: ...
    @property
    def v(self) -> float: ...

class RayHits:
    @property
    def rays(self) -> _Ints: ...
    @property
    def triangles(self) -> _Ints: ...
    @property
    def t(self) -> _Floats: ...
    @property
    def u(self) -> _Floats: ...
    @property
    def v(self) -> _Floats: ...
    def __len__(self) -> int: ...

def closest_point(mesh: DeformableMesh, point: npt.ArrayLike) -> ClosestPoint: ...
def closest_points(mesh: DeformableMesh, points: npt.ArrayLike) -> ClosestPoints: ...
def first_hit(
    mesh: DeformableMesh,
    origin: npt.ArrayLike,
    direction: npt.ArrayLike,
    *,
    begin: float = 0.0,
    end: float = ...,
) -> RayHit: ...
def first_hits(
    mesh: DeformableMesh,
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    *,
    begin: float = 0.0,
    end: float = ...,
) -> RayHits: ...
def any_hit(
    mesh: DeformableMesh,
    origin: npt.ArrayLike,
    direction: npt.ArrayLike,
    *,
    begin: float = 0.0,
    end: float = ...,
) -> bool: ...
def any_hits(
    mesh: DeformableMesh,
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    *,
    begin: float = 0.0,
    end: float = ...,
) -> _Bools: ...
def ray_hits(
    mesh: DeformableMesh,
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    *,
    begin: float = 0.0,
    end: float = ...,
) -> RayHits: ...

class VertexContacts:
    @property
    def vertices(self) -> _Ints: ...
    @property
    def distances(self) -> _Floats: ...
    @property
    def positions(self) -> _Floats: ...
    @property
    def nearest_points(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def triangles(self) -> _Ints: ...
    @property
    def barycentric(self) -> _Floats: ...
    @property
    def areas(self) -> _Floats: ...
    def __len__(self) -> int: ...

class SignedDistance:
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def deep_body(self) -> str: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def normal(self) -> _Floats: ...

def signed_distance(
    first: DeformableMesh,
    second: _Object,
    tolerance: float,
    tf1: _Pose = None,
    tf2: _Pose = None,
) -> SignedDistance: ...
def vertex_contacts(
    mesh: DeformableMesh,
    other: _Object,
    margin: float = 0.0,
    tf: _Pose = None,
    other_tf: _Pose = None,
) -> VertexContacts: ...
def signed_distances(mesh: DeformableMesh, points: npt.ArrayLike) -> _Floats: ...
def winding_numbers(
    mesh: DeformableMesh, points: npt.ArrayLike, tolerance: float = 0.1
) -> _Floats: ...
def is_watertight(mesh: DeformableMesh) -> bool: ...

class SceneCollisions:
    @property
    def bodies(self) -> _Longs: ...
    @property
    def offsets(self) -> _Longs: ...
    @property
    def pairs(self) -> _Ints: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def depths(self) -> _Floats: ...
    def __len__(self) -> int: ...

class SceneTrianglePairs:
    @property
    def bodies(self) -> _Longs: ...
    @property
    def offsets(self) -> _Longs: ...
    @property
    def triangles(self) -> _Ints: ...
    @property
    def distances(self) -> _Floats: ...
    def __len__(self) -> int: ...

class SceneDistance:
    @property
    def bodies(self) -> Tuple[int, int]: ...
    @property
    def distance(self) -> float: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def triangles(self) -> Tuple[int, int]: ...

class Scene:
    def __init__(self, dtype: npt.DTypeLike = "float64") -> None: ...
    def add(
        self,
        body: _Object,
        tf: _Pose = None,
        *,
        group: int = 1,
        mask: int = 4294967295,
        self_collision: bool = False,
    ) -> int: ...
    def remove(self, body: int) -> None: ...
    def set_transform(self, body: int, tf: _Pose) -> None: ...
    def ignore(self, first: int, second: int) -> None: ...
    def unignore(self, first: int, second: int) -> None: ...
    def set_threads(self, threads: int) -> None: ...
    def update(self) -> None: ...
    def begin_step(self) -> None: ...
    def __len__(self) -> int: ...
    def collisions(
        self, *, contacts_per_pair: Union[int, None] = None, enable_contact: bool = True
    ) -> SceneCollisions: ...
    def pairs_within(
        self, distance: float, *, enable_distances: bool = False
    ) -> SceneTrianglePairs: ...
    def is_nearer(self, distance: float) -> bool: ...
    def nearest(self, body: int) -> SceneDistance: ...
    def distance(self) -> SceneDistance: ...
    def nearest_point(self, point: npt.ArrayLike) -> Tuple[int, float, _Floats, int]: ...
    def first_hits(
        self, origins: npt.ArrayLike, directions: npt.ArrayLike
    ) -> Tuple[_Floats, _Longs, _Longs]: ...
    def largest_safe_step(self, separation: float = 0.0) -> float: ...

class Motion:
    def __init__(
        self,
        mesh: DeformableMesh,
        start: Union[npt.ArrayLike, None] = None,
        end: Union[npt.ArrayLike, None] = None,
        start_tf: _Pose = None,
        end_tf: _Pose = None,
    ) -> None: ...

class Impact:
    @property
    def time(self) -> float: ...
    @property
    def kind(self) -> _Kind: ...
    @property
    def pair(self) -> Tuple[int, int]: ...
    @property
    def happens(self) -> bool: ...

class ImpactTimes:
    @property
    def vertex_face(self) -> _Floats: ...
    @property
    def face_vertex(self) -> _Floats: ...
    @property
    def edge_edge(self) -> _Floats: ...

@overload
def candidates(first: Motion, second: Motion, separation: float = 0.0) -> FeaturePairs: ...
@overload
def candidates(motion: Motion, separation: float = 0.0) -> FeaturePairs: ...
@overload
def time_of_impact(
    first: Motion, second: Motion, kind: _Kind, pair: npt.ArrayLike, separation: float = 0.0
) -> float: ...
@overload
def time_of_impact(
    motion: Motion, kind: _Kind, pair: npt.ArrayLike, separation: float = 0.0
) -> float: ...
@overload
def times_of_impact(
    first: Motion, second: Motion, pairs: FeaturePairs, separation: float = 0.0
) -> ImpactTimes: ...
@overload
def times_of_impact(
    motion: Motion, pairs: FeaturePairs, separation: float = 0.0
) -> ImpactTimes: ...
@overload
def earliest_impact(first: Motion, second: Motion, separation: float = 0.0) -> Impact: ...
@overload
def earliest_impact(motion: Motion, separation: float = 0.0) -> Impact: ...
@overload
def largest_safe_step(first: Motion, second: Motion, separation: float = 0.0) -> float: ...
@overload
def largest_safe_step(motion: Motion, separation: float = 0.0) -> float: ...
@overload
def safe_displacements(
    first: Motion, second: Motion, separation: float = 0.0
) -> Tuple[_Floats, _Floats]: ...
@overload
def safe_displacements(motion: Motion, separation: float = 0.0) -> _Floats: ...

class Recording:
    def __init__(
        self,
        *,
        title: str = "A run",
        unit: str = "",
        frames_per_second: float = 25.0,
        up: npt.ArrayLike = (0, 0, 1),
    ) -> None: ...
    def add(
        self, body: Union[DeformableMesh, _HasMesh], tf: _Pose = None, *, name: str = ""
    ) -> int: ...
    def place(self, body: int, tf: _Pose) -> None: ...
    def frame(
        self,
        distance: Union[DistanceResult, None] = None,
        contacts: Union[Contacts, None] = None,
        *,
        update_ms: Union[float, None] = None,
        query_ms: Union[float, None] = None,
        clearance: Union[Dict[int, npt.ArrayLike], None] = None,
        note: str = "",
    ) -> None: ...
    def write(
        self, path: Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]
    ) -> None: ...
    @property
    def num_bodies(self) -> int: ...
    @property
    def num_frames(self) -> int: ...
    @property
    def num_bytes(self) -> int: ...

__all__ = [
    "Box",
    "Capsule",
    "ClosestPoint",
    "ClosestPoints",
    "CoherentDistance",
    "CoherentProximity",
    "Cone",
    "Contacts",
    "Cylinder",
    "DeformableMesh",
    "DistanceResult",
    "Ellipsoid",
    "FeatureDetails",
    "FeaturePairDetails",
    "FeaturePairs",
    "Halfspace",
    "Impact",
    "ImpactTimes",
    "Mesh",
    "MeshLoadError",
    "MeshUpdate",
    "Motion",
    "Plane",
    "RayHit",
    "RayHits",
    "Recording",
    "Scene",
    "SceneCollisions",
    "SceneDistance",
    "SceneTrianglePairs",
    "Shape",
    "SignedDistance",
    "Sphere",
    "TrianglePairs",
    "VertexContacts",
    "any_hit",
    "any_hits",
    "candidates",
    "clearance",
    "closest_point",
    "closest_points",
    "collide",
    "distance",
    "earliest_impact",
    "feature_pair_details",
    "feature_pairs_within",
    "first_hit",
    "first_hits",
    "is_nearer",
    "is_watertight",
    "largest_safe_step",
    "load_mesh",
    "pairs_within",
    "ray_hits",
    "safe_displacements",
    "self_collide",
    "signed_clearance",
    "signed_distance",
    "signed_distances",
    "time_of_impact",
    "times_of_impact",
    "vertex_contacts",
    "weld_vertices",
    "winding_numbers",
]
