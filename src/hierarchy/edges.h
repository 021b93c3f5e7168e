#pragma once

#include "hierarchy/group_graph.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// Which triangles share an edge, with the length of what they share. An edge that more than two
/// triangles share links all pairs of them.
///
/// Edges are the same when they have the same two vertices. Those that only one triangle has are
/// compared once more by the positions of their ends: so triangles given one by one, each with
/// vertices of its own (FCL's addTriangle, STL files), and meshes cut along texture seams are
/// connected too.
///
/// Linear in `count`. An edge of more than 32 triangles, which no surface has, would make the pairs
/// quadratic; there each triangle is linked to the next 16 around it only.
template <typename S>
Scratch<Link> sharedEdges(const MeshView<S>& mesh, unsigned count);

}  // namespace adaptive_bvh
