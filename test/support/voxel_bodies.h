#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <vector>

#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {

/// A body of cubes of a grid of kSide^3.
class VoxelBody {
 public:
  static constexpr int kSide = 4;

  bool has(int x, int y, int z) const {
    if (x < 0 || y < 0 || z < 0 || x >= kSide || y >= kSide || z >= kSide) return false;
    return cubes_[std::size_t((x * kSide + y) * kSide + z)];
  }
  void set(int x, int y, int z, bool value) {
    cubes_[std::size_t((x * kSide + y) * kSide + z)] = value;
  }
  /// Any body whose surface is a manifold.
  static VoxelBody random(RandomGeometry& random) {
    VoxelBody body;
    const int tries = 5 + random.below(120);
    for (int i = 0; i < tries; ++i) {
      const int x = random.below(kSide), y = random.below(kSide), z = random.below(kSide);
      const bool before = body.has(x, y, z);
      body.set(x, y, z, !random.oneIn(5));
      if (!body.isManifoldAround(x, y, z)) body.set(x, y, z, before);
    }
    if (body.isEmpty()) body.set(0, 0, 0, true);
    return body;
  }
  bool isEmpty() const {
    return std::none_of(cubes_.begin(), cubes_.end(), [](bool b) { return b; });
  }

  /// Its surface, cubes of a size.
  TriangleMesh surface(double size) const {
    TriangleMesh mesh;
    std::map<std::array<int, 3>, std::size_t> numbers;
    const auto vertex = [&](std::array<int, 3> x) {
      const auto found = numbers.emplace(x, mesh.vertices.size());
      if (found.second)
        mesh.vertices.emplace_back(size * double(x[0]), size * double(x[1]), size * double(x[2]));
      return found.first->second;
    };
    forEachCube([&](std::array<int, 3> at) {
      for (std::size_t k = 0; k < 3; ++k)
        for (const int end : {0, 1}) {
          std::array<int, 3> next = at;
          next[k] += end ? 1 : -1;
          if (has(next[0], next[1], next[2])) continue;
          const auto corner = [&](int u, int v) {
            std::array<int, 3> x = at;
            x[k] += end;
            x[(k + 1) % 3] += u;
            x[(k + 2) % 3] += v;
            return vertex(x);
          };
          const std::size_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          mesh.triangles.emplace_back(a, end ? b : c, end ? c : b);
          mesh.triangles.emplace_back(a, end ? c : d, end ? d : c);
        }
    });
    return mesh;
  }

 private:
  template <typename Visit>
  void forEachCube(const Visit& visit) const {
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        for (int z = 0; z < kSide; ++z)
          if (has(x, y, z)) visit(std::array<int, 3>{x, y, z});
  }
  /// At the eight corners of a cube: whether cubes that are there are connected by faces, and those
  /// that are not, too.
  bool isManifoldAround(int x, int y, int z) const {
    for (int i = 0; i < 8; ++i)
      if (!isManifoldAt(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2))) return false;
    return true;
  }
  bool isManifoldAt(int x, int y, int z) const {
    std::array<bool, 8> full;
    for (int i = 0; i < 8; ++i)
      full[std::size_t(i)] = has(x - (i & 1), y - (i >> 1 & 1), z - (i >> 2));
    return countParts(full, true) <= 1 && countParts(full, false) <= 1;
  }
  static int countParts(const std::array<bool, 8>& full, bool value) {
    std::array<bool, 8> seen{};
    int parts = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      if (full[i] != value || seen[i]) continue;
      ++parts;
      std::vector<std::size_t> open{i};
      seen[i] = true;
      while (!open.empty()) {
        const std::size_t at = open.back();
        open.pop_back();
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t next = at ^ (std::size_t(1) << k);
          if (full[next] != value || seen[next]) continue;
          seen[next] = true;
          open.push_back(next);
        }
      }
    }
    return parts;
  }

  std::array<bool, std::size_t(kSide* kSide* kSide)> cubes_{};
};

/// What two voxel bodies have in common, the first moved by an infinitely small step along x, y and
/// z: cells between all planes of both, some of them infinitely thin.
class VoxelOverlap {
 public:
  struct Region {
    double volume = 0, first_area = 0, second_area = 0;

    bool operator<(const Region& other) const {
      return std::tie(volume, first_area, second_area) <
             std::tie(other.volume, other.first_area, other.second_area);
    }
  };

  /// The first's cubes have the size 1; the second's another one, and an origin.
  VoxelOverlap(const VoxelBody& first, const VoxelBody& second, double size,
               const std::array<double, 3>& origin)
      : first_(first), second_(second) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (int i = 0; i <= VoxelBody::kSide; ++i) {
        planes_[k].push_back({double(i), true});
        planes_[k].push_back({origin[k] + size * i, false});
      }
      std::sort(planes_[k].begin(), planes_[k].end());
    }
    count_ = int(planes_[0].size()) - 1;
    for (int c = 0; c < count_ * count_ * count_; ++c) label_.push_back(-1);
    for (int c = 0; c < count_ * count_ * count_; ++c)
      if (label_[std::size_t(c)] < 0 && isCommon(c)) flood(c);
    std::sort(regions_.begin(), regions_.end());
  }
  const std::vector<Region>& regions() const { return regions_; }

 private:
  /// A plane of the first comes after one of the second at the same place.
  struct Plane {
    double at;
    bool is_first;
    bool operator<(const Plane& other) const {
      return std::tie(at, is_first) < std::tie(other.at, other.is_first);
    }
  };

  std::array<int, 3> placeOf(int cell) const {
    return {cell / (count_ * count_), cell / count_ % count_, cell % count_};
  }
  double length(std::size_t k, int i) const {
    return planes_[k][std::size_t(i + 1)].at - planes_[k][std::size_t(i)].at;
  }
  /// The cube of a body that has the cell: by the number of its planes below.
  bool isIn(bool is_first, const std::array<int, 3>& place) const {
    std::array<int, 3> cube;
    for (std::size_t k = 0; k < 3; ++k) {
      cube[k] = -1;
      for (int i = 0; i <= place[k]; ++i)
        cube[k] += planes_[k][std::size_t(i)].is_first == is_first;
    }
    return (is_first ? first_ : second_).has(cube[0], cube[1], cube[2]);
  }
  bool isCommon(int cell) const { return isIn(true, placeOf(cell)) && isIn(false, placeOf(cell)); }
  void flood(int from) {
    Region region;
    std::vector<int> open{from};
    label_[std::size_t(from)] = int(regions_.size());
    while (!open.empty()) {
      const std::array<int, 3> at = placeOf(open.back());
      open.pop_back();
      region.volume += length(0, at[0]) * length(1, at[1]) * length(2, at[2]);
      for (std::size_t k = 0; k < 3; ++k)
        for (const int step : {-1, 1}) {
          std::array<int, 3> next = at;
          next[k] += step;
          const double area =
              length((k + 1) % 3, at[(k + 1) % 3]) * length((k + 2) % 3, at[(k + 2) % 3]);
          const bool is_outside = next[k] < 0 || next[k] >= count_;
          // Which body ends here: two planes are never the same.
          if (is_outside || !isIn(true, next) || !isIn(false, next)) {
            const Plane& plane = planes_[k][std::size_t(at[k] + (step > 0))];
            (plane.is_first ? region.first_area : region.second_area) += area;
            continue;
          }
          const int cell = (next[0] * count_ + next[1]) * count_ + next[2];
          if (label_[std::size_t(cell)] >= 0) continue;
          label_[std::size_t(cell)] = int(regions_.size());
          open.push_back(cell);
        }
    }
    regions_.push_back(region);
  }

  const VoxelBody &first_, &second_;
  std::array<std::vector<Plane>, 3> planes_;
  int count_ = 0;
  std::vector<int> label_;
  std::vector<Region> regions_;
};

}  // namespace adaptive_bvh_test
