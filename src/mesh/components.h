#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// The connected components of a mesh: triangles that share a vertex belong to the same one.
class Components {
 public:
  void assign(const MeshView<double>& mesh, std::size_t num_triangles, std::size_t num_vertices);

  /// The smallest triangle index of each component, in increasing order.
  const std::vector<unsigned>& firstTriangles() const { return first_triangles_; }
  std::size_t bytes() const { return first_triangles_.capacity() * sizeof(unsigned); }

 private:
  std::vector<unsigned> first_triangles_;
};

}  // namespace adaptive_bvh
