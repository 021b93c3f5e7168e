#include "adaptive_bvh/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>

namespace adaptive_bvh {
namespace {

/// The key of a position in a hash table: its grid cell, or the position itself.
using Key = std::array<double, 3>;

/// A polynomial hash of a key's 32-bit halves at a random point, modulo the prime 2^61 - 1: two
/// different keys collide with a probability below 2^-58, whatever the keys are.
class KeyHash {
 public:
  KeyHash() {
    std::random_device random;
    point_ = (std::uint64_t{random()} << 32 | random()) % kPrime;
  }

  std::size_t operator()(const Key& key) const {
    std::uint64_t hash = 1;
    for (const double x : key) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &x, sizeof(x));
      hash = timesPoint(timesPoint(hash) + (bits & 0xFFFFFFFFu)) + (bits >> 32);
    }
    return static_cast<std::size_t>(timesPoint(hash));
  }

 private:
  /// number * point_ modulo the prime. As 2^61 is 1 modulo the prime, the high part of the product
  /// is added to the low one.
  std::uint64_t timesPoint(std::uint64_t number) const {
    __extension__ typedef unsigned __int128 Wide;
    const Wide product = Wide(number) * point_;
    const std::uint64_t sum =
        static_cast<std::uint64_t>(product & kPrime) + static_cast<std::uint64_t>(product >> 61);
    return sum >= kPrime ? sum - kPrime : sum;
  }

  static constexpr std::uint64_t kPrime = (std::uint64_t{1} << 61) - 1;
  std::uint64_t point_ = 0;
};

/// An open-addressing hash table of vertices by grid cell, or by position if the tolerance is 0.
class KeptVertices {
 public:
  KeptVertices(double tolerance, std::size_t most_vertices) : tolerance_(tolerance) {
    std::size_t slots = 1;
    while (slots <= 2 * most_vertices) slots *= 2;
    slots_.assign(slots, kEmpty);
  }

  /// The smallest index of an added vertex within the tolerance of p, or `otherwise` if smaller.
  std::size_t find(const fcl::Vector3d& p, const std::vector<fcl::Vector3d>& vertices,
                   std::size_t otherwise) const {
    const Key cell = keyOf(p);
    const int radius = tolerance_ == 0 ? 0 : 1;  // search radius in cells
    std::size_t first = otherwise;
    for (int x = -radius; x <= radius; ++x)
      for (int y = -radius; y <= radius; ++y)
        for (int z = -radius; z <= radius; ++z) {
          std::size_t slot =
              slotOf({cell[0] + double(x), cell[1] + double(y), cell[2] + double(z)});
          for (; slots_[slot] != kEmpty; slot = slotAfter(slot))
            if (isNear(vertices[slots_[slot]], p)) first = std::min(first, slots_[slot]);
        }
    return first;
  }

  void add(const fcl::Vector3d& p, std::size_t vertex) {
    if (p.hasNaN()) return;  // NaN is never equal to a position
    std::size_t slot = slotOf(keyOf(p));
    while (slots_[slot] != kEmpty) slot = slotAfter(slot);
    slots_[slot] = vertex;
  }

 private:
  /// The cell of a position; for tolerance 0 the position itself, with -0 as 0. Cells are twice as
  /// wide as the tolerance, so that despite rounding two vertices within the tolerance are at most
  /// one cell apart. Where neighbouring numbers are farther apart than the tolerance, each number
  /// is a cell.
  Key keyOf(const fcl::Vector3d& p) const {
    constexpr double kWide = 4. / std::numeric_limits<double>::epsilon();
    Key key;
    for (int k = 0; k < 3; ++k) {
      const double cell = tolerance_ == 0 ? kWide : p[k] / (2 * tolerance_);
      key[std::size_t(k)] = (std::fabs(cell) < kWide ? std::floor(cell) : p[k]) + 0.;
    }
    return key;
  }

  bool isNear(const fcl::Vector3d& a, const fcl::Vector3d& b) const {
    return tolerance_ == 0 ? a == b : (a - b).norm() <= tolerance_;
  }

  std::size_t slotOf(const Key& key) const { return hash_(key) & (slots_.size() - 1); }
  std::size_t slotAfter(std::size_t slot) const { return (slot + 1) & (slots_.size() - 1); }

  static constexpr std::size_t kEmpty = std::numeric_limits<std::size_t>::max();
  double tolerance_;
  KeyHash hash_;
  std::vector<std::size_t> slots_;  ///< vertices or kEmpty; 2^n slots, at least half of them empty
};

}  // namespace

/// Goes through the vertices in order, and moves those that are kept to the front of the array.
void weldVertices(TriangleMesh& mesh, double tolerance) {
  if (!(tolerance >= 0) || !std::isfinite(tolerance))
    throw std::invalid_argument("weldVertices: the tolerance must be finite, and not negative");
  KeptVertices kept_vertices(tolerance, mesh.vertices.size());
  std::vector<std::size_t> new_index(mesh.vertices.size());
  std::size_t kept = 0;  // number of vertices kept
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const fcl::Vector3d p = mesh.vertices[v];
    new_index[v] = kept_vertices.find(p, mesh.vertices, kept);
    if (new_index[v] != kept) continue;
    kept_vertices.add(p, kept);
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

}  // namespace adaptive_bvh
