#include "adaptive_bvh/mesh.h"

#include <array>
#include <functional>
#include <unordered_map>

namespace adaptive_bvh {
namespace {

template <typename S>
struct PositionHash {
  std::size_t operator()(const std::array<S, 3>& p) const {
    std::size_t hash = 0;
    for (S x : p) hash = hash * 1000003u ^ std::hash<S>()(x);
    return hash;
  }
};

}  // namespace

template <typename S>
void weldVertices(TriangleMesh<S>& mesh) {
  std::unordered_map<std::array<S, 3>, std::size_t, PositionHash<S>> seen;
  std::vector<std::size_t> new_index(mesh.vertices.size());
  std::size_t kept = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const fcl::Vector3<S> p = mesh.vertices[v];
    // Equal as numbers: -0 hashes like 0.
    const auto found = seen.emplace(std::array<S, 3>{p[0] + S(0), p[1] + S(0), p[2] + S(0)}, kept);
    if (found.second) mesh.vertices[kept++] = p;
    new_index[v] = found.first->second;
  }
  mesh.vertices.resize(kept);
  for (fcl::Triangle& t : mesh.triangles) t.set(new_index[t[0]], new_index[t[1]], new_index[t[2]]);
}

template void weldVertices(TriangleMesh<float>&);
template void weldVertices(TriangleMesh<double>&);

}  // namespace adaptive_bvh
