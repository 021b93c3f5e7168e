#include "mesh/components.h"

#include <numeric>

#include "base/scratch.h"

namespace adaptive_bvh {
namespace {

/// Disjoint sets of connected vertices (union-find).
class JoinedVertices {
 public:
  explicit JoinedVertices(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  /// The representative of the set that contains v.
  unsigned rootOf(unsigned v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(unsigned a, unsigned b) { parent_[rootOf(a)] = rootOf(b); }

 private:
  Scratch<unsigned> parent_;
};

}  // namespace

void Components::assign(const MeshView<double>& mesh, std::size_t num_triangles,
                        std::size_t num_vertices) {
  JoinedVertices joined(num_vertices);
  const auto count = static_cast<unsigned>(num_triangles);
  for (unsigned t = 0; t < count; ++t) {
    const VertexIndices v = mesh.verticesOf(t);
    joined.join(v[1], v[0]);
    joined.join(v[2], v[0]);
  }
  Scratch<char> is_listed(num_vertices, 0);  // by the root of a component
  first_triangles_.clear();
  for (unsigned t = 0; t < count; ++t) {
    char& is_component_listed = is_listed[joined.rootOf(mesh.verticesOf(t)[0])];
    if (!is_component_listed) first_triangles_.push_back(t);
    is_component_listed = 1;
  }
  first_triangles_.shrink_to_fit();
}

}  // namespace adaptive_bvh
