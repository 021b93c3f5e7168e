#include "adaptive_bvh/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <unordered_map>

namespace adaptive_bvh {
namespace {

template <typename S>
using Key = std::array<S, 3>;

template <typename S>
struct KeyHash {
  std::size_t operator()(const Key<S>& key) const {
    std::size_t hash = 0;
    for (S x : key) hash = hash * 1000003u ^ std::hash<S>()(x);
    return hash;
  }
};

/// Positions by cells of a grid; by themselves where the tolerance is 0.
template <typename S>
class KeptVertices {
 public:
  explicit KeptVertices(S tolerance) : tolerance_(tolerance) {}

  /// The first vertex that was added and is not farther than the tolerance; `otherwise` where there
  /// is none.
  std::size_t find(const fcl::Vector3<S>& p, const std::vector<fcl::Vector3<S>>& vertices,
                   std::size_t otherwise) const {
    const Key<S> centre = keyOf(p);
    if (tolerance_ == 0) {
      const auto found = cells_.find(centre);
      return found == cells_.end() ? otherwise : found->second;
    }
    std::size_t first = otherwise;
    for (int cell = 0; cell < 27; ++cell) {
      const int x = cell % 3 - 1, y = cell / 3 % 3 - 1, z = cell / 9 - 1;
      const Key<S> key = {centre[0] + S(x), centre[1] + S(y), centre[2] + S(z)};
      const auto [begin, end] = cells_.equal_range(key);
      for (auto kept = begin; kept != end; ++kept)
        if ((vertices[kept->second] - p).norm() <= tolerance_)
          first = std::min(first, kept->second);
    }
    return first;
  }

  void add(const fcl::Vector3<S>& p, std::size_t vertex) { cells_.emplace(keyOf(p), vertex); }

 private:
  /// Equal as numbers: -0 becomes 0. Cells as wide as twice the tolerance, so that rounding does
  /// not put two vertices within the tolerance more than one cell apart.
  Key<S> keyOf(const fcl::Vector3<S>& p) const {
    Key<S> key;
    for (int k = 0; k < 3; ++k)
      key[std::size_t(k)] = (tolerance_ == 0 ? p[k] : std::floor(p[k] / (2 * tolerance_))) + S(0);
    return key;
  }

  S tolerance_;
  std::unordered_multimap<Key<S>, std::size_t, KeyHash<S>> cells_;
};

}  // namespace

template <typename S>
void weldVertices(TriangleMesh<S>& mesh, S tolerance) {
  if (!(tolerance >= 0) || !std::isfinite(tolerance))
    throw std::invalid_argument("weldVertices: the tolerance must be finite, and not negative");
  KeptVertices<S> seen(tolerance);
  std::vector<std::size_t> new_index(mesh.vertices.size());
  std::size_t kept = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const fcl::Vector3<S> p = mesh.vertices[v];
    new_index[v] = seen.find(p, mesh.vertices, kept);
    if (new_index[v] != kept) continue;
    seen.add(p, kept);
    mesh.vertices[kept++] = p;
  }
  mesh.vertices.resize(kept);
  for (fcl::Triangle& t : mesh.triangles) t.set(new_index[t[0]], new_index[t[1]], new_index[t[2]]);
  if (tolerance > 0)
    mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(),
                                        [](const fcl::Triangle& t) {
                                          return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
                                        }),
                         mesh.triangles.end());
}

template void weldVertices(TriangleMesh<float>&, float);
template void weldVertices(TriangleMesh<double>&, double);

}  // namespace adaptive_bvh
