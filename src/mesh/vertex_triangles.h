#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// The triangles at each vertex, by increasing index. A triangle that repeats a vertex is there
/// once. About 14 bytes a triangle of a closed mesh.
class VertexTriangles {
 public:
  /// The triangles of one vertex.
  struct Range {
    const unsigned *first, *last;

    const unsigned* begin() const { return first; }
    const unsigned* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };

  template <typename S>
  void adopt(const MeshView<S>& mesh, std::size_t num_triangles, std::size_t num_vertices) {
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
  template <typename S, typename Visit>
  static void forEachCorner(const MeshView<S>& mesh, std::size_t triangles, const Visit& visit) {
    for (unsigned t = 0; t < triangles; ++t) {
      const VertexIndices v = mesh.verticesOf(t);
      visit(v[0], t);
      if (v[1] != v[0]) visit(v[1], t);
      if (v[2] != v[0] && v[2] != v[1]) visit(v[2], t);
    }
  }

  std::vector<unsigned> begin_, triangles_;
};

}  // namespace adaptive_bvh
