#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// The triangles at each vertex, by increasing index. A triangle that repeats a vertex is listed
/// there once. Takes about 14 bytes for each triangle of a closed mesh.
class VertexTriangles {
 public:
  /// The indices of the triangles at one vertex.
  struct Range {
    const unsigned *first, *last;

    const unsigned* begin() const { return first; }
    const unsigned* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };

  void assign(const MeshView<double>& mesh, std::size_t num_triangles, std::size_t num_vertices) {
    begin_.assign(num_vertices + 2, 0);  // shifted by one while the triangles are filled in
    forEachCorner(mesh, num_triangles, [&](unsigned v, unsigned) { ++begin_[v + 2]; });
    for (std::size_t i = 2; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
    triangles_.resize(begin_.back());
    forEachCorner(mesh, num_triangles,
                  [&](unsigned v, unsigned t) { triangles_[begin_[v + 1]++] = t; });
  }

  Range operator[](std::size_t vertex) const {
    return {triangles_.data() + begin_[vertex], triangles_.data() + begin_[vertex + 1]};
  }
  std::size_t bytes() const {
    return (begin_.capacity() + triangles_.capacity()) * sizeof(unsigned);
  }

 private:
  /// Calls visit(vertex, triangle) for each different vertex of each triangle.
  template <typename Visit>
  static void forEachCorner(const MeshView<double>& mesh, std::size_t triangles,
                            const Visit& visit) {
    for (unsigned t = 0; t < triangles; ++t) {
      const VertexIndices v = mesh.verticesOf(t);
      visit(v[0], t);
      if (v[1] != v[0]) visit(v[1], t);
      if (v[2] != v[0] && v[2] != v[1]) visit(v[2], t);
    }
  }

  /// The triangles of vertex v are triangles_[begin_[v]] to triangles_[begin_[v + 1] - 1].
  std::vector<unsigned> begin_, triangles_;
};

/// How often the triangles that share an edge traverse it in each direction.
struct EdgeUse {
  unsigned triangle;  ///< the first of these triangles
  int forward = 0, back = 0;
};

/// Counts how often triangles traverse the edge between two different vertices; forward is `from`
/// to `to`. `first` is a triangle with this edge. If it is not the first one, the count stops early
/// and is incomplete, so that a vertex with many triangles takes linear time.
inline EdgeUse useOfEdge(const MeshView<double>& mesh, const VertexTriangles& triangles,
                         unsigned from, unsigned to, unsigned first) {
  EdgeUse use{~0u};
  const bool from_has_fewer = triangles[from].size() < triangles[to].size();
  for (const unsigned t : triangles[from_has_fewer ? from : to]) {
    const VertexIndices v = mesh.verticesOf(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned a = v[k], b = v[(k + 1) % 3];
      if (a == from && b == to) ++use.forward;
      if (a == to && b == from) ++use.back;
      if (use.triangle == ~0u && use.forward + use.back > 0) use.triangle = t;
    }
    if (use.triangle != ~0u && use.triangle != first) return use;
  }
  return use;
}

/// Calls visit(from, to, use) once for each edge that is not traversed equally often in both
/// directions, in the direction of the majority, until visit returns false. The order is by
/// increasing triangle index, then by corner.
template <typename Visit>
void forEachOpenEdge(const MeshView<double>& mesh, unsigned num_triangles,
                     const VertexTriangles& triangles, const Visit& visit) {
  for (unsigned t = 0; t < num_triangles; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const unsigned from = v[k], to = v[(k + 1) % 3];
      // A triangle with corners a, b, a has the edge between a and b twice.
      const bool is_repeated = k > 0 && (v[k - 1] == to || (k == 2 && v[1] == from));
      if (from == to || is_repeated) continue;
      const EdgeUse use = useOfEdge(mesh, triangles, from, to, t);
      if (use.triangle != t || use.forward == use.back) continue;
      const bool is_reversed = use.back > use.forward;
      if (!visit(is_reversed ? to : from, is_reversed ? from : to, use)) return;
    }
  }
}

}  // namespace adaptive_bvh
