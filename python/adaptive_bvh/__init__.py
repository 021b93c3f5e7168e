"""Exact distance and collision queries on deforming triangle meshes.

A DeformableMesh is built once and follows the deformation: update(vertices) in every step, then
query it. Its tree of boxes is not built anew, and every answer is exact in every step.

Arrays of vertices are (N, 3). Those of float64 are read in place: by update in C and in Fortran
order, by others in C order (NumPy's default); update also reads those of float32 without a copy.
Anything else is converted once. Tensors of PyTorch, arrays of Warp and others in the CPU's memory
are read in place, too: by the buffer protocol, NumPy's interface or DLPack. Those on a device are a
TypeError. Lengths are in the unit of the mesh.

All computations are in float64, also of meshes whose dtype is float32, and meshes of both dtypes
may meet in a query. Results are float64; numbers of triangles and vertices are int32. The arrays of
a result share its memory, and keep it alive.

A pose places a mesh or a shape in the world: None (the identity), a (4, 4) array, or a pair
(R, t) of shapes (3, 3) and (3,). R must be a rotation to 1e-6.

Errors: TypeError for other kinds of objects and numbers that are not real, ValueError for wrong
shapes and for numbers that are not finite or out of range, IndexError for indices of what is not
there. A refused update leaves the mesh as it was.

Threads: updates and queries release the GIL. Every DeformableMesh has a lock: any number of threads
may query it at once; an update waits until they are done, and queries wait for it. A copy() is a
snapshot that has a lock of its own. Do not write into an array while a call reads it.
"""

from . import _core
from ._core import (
    BodyOptions,
    Box,
    Capsule,
    ClosestFeatures,
    ClosestPoint,
    ClosestPoints,
    CoherentDistance,
    CoherentProximity,
    Cone,
    ContactPatches,
    ContactRegions,
    Contacts,
    ContactTracker,
    Cylinder,
    DeformableMesh,
    DistanceResult,
    Ellipsoid,
    FeatureDetails,
    FeaturePairDetails,
    FeaturePairs,
    Halfspace,
    Impact,
    ImpactTimes,
    Mesh,
    MeshLoadError,
    MeshUpdate,
    Motion,
    Plane,
    RayHits,
    Scene,
    SceneCollisions,
    SceneDistance,
    SceneFeaturePairs,
    SceneImpact,
    ScenePoint,
    SceneRayHits,
    SceneTrianglePairs,
    SceneVertexContacts,
    Shape,
    SignedDistance,
    Sphere,
    TrianglePairs,
    VertexContacts,
    __version__,
    any_hit,
    candidates,
    clearance,
    closest_features,
    closest_point,
    closest_points,
    collide,
    contact_regions,
    distance,
    earliest_impact,
    feature_pair_details,
    feature_pairs_within,
    first_hit,
    is_nearer,
    is_watertight,
    largest_safe_step,
    load_mesh,
    open_edges,
    pairs_within,
    ray_hits,
    safe_displacements,
    self_collide,
    shape_mesh,
    signed_clearance,
    signed_distance,
    signed_distances,
    time_of_impact,
    times_of_impact,
    vertex_contacts,
    vertex_contacts_of_both,
    weld_vertices,
    winding_numbers,
)

_core._require_main_interpreter()
from . import _classes  # noqa: E402
from ._recording import Recording  # noqa: E402

_classes.complete()

__all__ = [
    "BodyOptions",
    "Box",
    "Capsule",
    "ClosestFeatures",
    "ClosestPoint",
    "ClosestPoints",
    "CoherentDistance",
    "CoherentProximity",
    "Cone",
    "ContactPatches",
    "ContactRegions",
    "ContactTracker",
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
    "RayHits",
    "Recording",
    "Scene",
    "SceneCollisions",
    "SceneDistance",
    "SceneFeaturePairs",
    "SceneImpact",
    "ScenePoint",
    "SceneRayHits",
    "SceneTrianglePairs",
    "SceneVertexContacts",
    "Shape",
    "SignedDistance",
    "Sphere",
    "TrianglePairs",
    "VertexContacts",
    "any_hit",
    "candidates",
    "clearance",
    "closest_features",
    "closest_point",
    "closest_points",
    "collide",
    "contact_regions",
    "distance",
    "earliest_impact",
    "feature_pair_details",
    "feature_pairs_within",
    "first_hit",
    "is_nearer",
    "is_watertight",
    "largest_safe_step",
    "load_mesh",
    "open_edges",
    "pairs_within",
    "ray_hits",
    "safe_displacements",
    "self_collide",
    "shape_mesh",
    "signed_clearance",
    "signed_distance",
    "signed_distances",
    "time_of_impact",
    "times_of_impact",
    "vertex_contacts",
    "vertex_contacts_of_both",
    "weld_vertices",
    "winding_numbers",
]
