#pragma once

#include <string>

#include "mesh/vertex_triangles.h"

namespace adaptive_bvh {

/// How often the triangles that share an edge run through it: from one vertex to the other, and
/// back.
struct EdgeUse {
  unsigned triangle;  ///< the first of them
  int forward = 0, back = 0;
};

/// Counts the uses of the edge between two different vertices.
template <typename S>
EdgeUse useOfEdge(const MeshView<S>& mesh, const VertexTriangles& triangles, unsigned from,
                  unsigned to) {
  EdgeUse use{~0u};
  const bool has_less = triangles[from].size() < triangles[to].size();
  for (const unsigned t : triangles[has_less ? from : to]) {
    const VertexIndices v = mesh.verticesOf(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned a = v[k], b = v[(k + 1) % 3];
      if (a == from && b == to) ++use.forward;
      if (a == to && b == from) ++use.back;
      if (use.triangle == ~0u && use.forward + use.back > 0) use.triangle = t;
    }
  }
  return use;
}

/// Calls visit(from, to, use) for each edge that is not run through as often in one direction as in
/// the other, once and in the direction of the majority, until it returns false. By increasing
/// triangle, then by corner.
template <typename S, typename Visit>
void forEachOpenEdge(const MeshView<S>& mesh, unsigned num_triangles,
                     const VertexTriangles& triangles, const Visit& visit) {
  for (unsigned t = 0; t < num_triangles; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned from = v[k], to = v[(k + 1) % 3];
      // A triangle a, b, a has the edge from a to b twice.
      const bool is_repeated = k > 0 && (v[k - 1] == to || (k == 2 && v[1] == from));
      if (from == to || is_repeated) continue;
      const EdgeUse use = useOfEdge(mesh, triangles, from, to);
      if (use.triangle != t || use.forward == use.back) continue;
      const bool turns = use.back > use.forward;
      if (!visit(turns ? to : from, turns ? from : to, use)) return;
    }
  }
}

}  // namespace adaptive_bvh
