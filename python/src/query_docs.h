#pragma once

// Docstrings of distance, collide and self_collide.
namespace adaptive_bvh::python::docs {

inline constexpr const char* kDistance =
    R"(The exact distance of two meshes, or of a mesh and a shape in either order.

tf1, tf2: poses that place them in the world.
nearest_points: False leaves out the points, which are then NaN.
Returns a DistanceResult.)";

inline constexpr const char* kDistanceValue =
    "A length. 0 where the two touch: also where one is a shape that has its surface inside.";

inline constexpr const char* kDistancePoints =
    "The nearest points, (2, 3) float64, in the world: of the first object and of the second. "
    "Where "
    "they touch both are a common point.";

inline constexpr const char* kCollide =
    R"(Where two meshes, or a mesh and a shape, touch.

tf1, tf2: poses that place them in the world.
max_contacts: stops when it has so many; None finds all.
enable_contact: False leaves out points, normals and depths, which are then NaN. Faster.
solid: meshes are filled, as shapes always are: a body inside of a closed mesh touches it. Where no
    triangle touches, there is one contact for each component inside of the other mesh, and one for a
    shape inside: its depth is how far a vertex of the component, or a point of the shape, is from the
    surface around it. ValueError when a mesh is open; the message names an edge.
Returns Contacts.)";

inline constexpr const char* kSelfCollide =
    R"(Where a mesh touches itself: one contact for each pair of triangles, the smaller index first.

tf: a pose that places the mesh in the world.
max_contacts, enable_contact: as of collide.
filter: which neighbours are left out: those with a 'shared vertex', those with a 'shared edge' (two
    vertices in common), or 'none'. With 'beyond shared', neighbours count where they have points in
    common beside the shared vertex or edge: where they are folded over each other or cross, which is
    decided exactly. Vertices are compared by index: see weld_vertices.
ignored: pairs of triangles to leave out, (K, 2) integers in any order, either triangle first, or None.
labels: (num_faces,) integers, a label for each triangle, or None. Then only pairs count whose labels
    differ (label_rule 'between') or are equal ('within'): of components in one mesh.)";

inline constexpr const char* kContacts =
    "Contacts in arrays side by side: contact i is row i of each. len() counts them.";

inline constexpr const char* kContactPairs =
    "(K, 2) int32: the triangle of the first object and of the second, -1 for a shape. Two meshes "
    "can have two contacts for one pair.";

}  // namespace adaptive_bvh::python::docs
