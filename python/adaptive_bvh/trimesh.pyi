from typing import Any, Dict, Hashable, Iterable, Optional, Protocol, Set, Tuple, Union

import numpy as np
import numpy.typing as npt

from adaptive_bvh import Convex, DeformableMesh

class _Mesh(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class ContactData:
    names: Set[Hashable]
    normal: npt.NDArray[np.float64]
    point: npt.NDArray[np.float64]
    depth: float
    def __init__(
        self,
        names: Iterable[Hashable],
        triangles: Iterable[int],
        normal: npt.NDArray[np.float64],
        point: npt.NDArray[np.float64],
        depth: float,
    ) -> None: ...
    def index(self, name: Hashable) -> int: ...

class DistanceData:
    names: Set[Hashable]
    distance: float
    def __init__(
        self,
        names: Iterable[Hashable],
        triangles: Iterable[int],
        points: Iterable[npt.NDArray[np.float64]],
        distance: float,
    ) -> None: ...
    def index(self, name: Hashable) -> int: ...
    def point(self, name: Hashable) -> npt.NDArray[np.float64]: ...

class CollisionManager:
    def __init__(self) -> None: ...
    def add_object(
        self, name: Hashable, mesh: _Mesh, transform: Optional[npt.ArrayLike] = None
    ) -> Union[DeformableMesh, Convex]: ...
    def remove_object(self, name: Hashable) -> None: ...
    def set_transform(self, name: Hashable, transform: npt.ArrayLike) -> None: ...
    def update_object(self, name: Hashable, vertices: Any) -> None: ...
    # The result is a value, or with names and data a tuple, as in trimesh.
    def in_collision_single(
        self,
        mesh: _Mesh,
        transform: Optional[npt.ArrayLike] = None,
        return_names: bool = False,
        return_data: bool = False,
    ) -> Any: ...
    def in_collision_internal(
        self, return_names: bool = False, return_data: bool = False
    ) -> Any: ...
    def in_collision_other(
        self,
        other_manager: CollisionManager,
        return_names: bool = False,
        return_data: bool = False,
    ) -> Any: ...
    def min_distance_single(
        self,
        mesh: _Mesh,
        transform: Optional[npt.ArrayLike] = None,
        return_name: bool = False,
        return_data: bool = False,
    ) -> Any: ...
    def min_distance_internal(
        self,
        name: Optional[Hashable] = None,
        return_names: bool = False,
        return_data: bool = False,
    ) -> Any: ...
    def min_distance_other(
        self,
        other_manager: CollisionManager,
        return_names: bool = False,
        return_data: bool = False,
    ) -> Any: ...

def scene_to_collision(
    scene: Any,
) -> Tuple[CollisionManager, Dict[Any, Union[DeformableMesh, Convex]]]: ...

__all__ = ["CollisionManager", "ContactData", "DistanceData", "scene_to_collision"]
