#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {

/// Boxes of a lattice with large faces: some are solid, some are cavities in these, and so on. No
/// two boxes of a body touch.
class BoxBody {
 public:
  static constexpr int kSide = 8;
  using Corner = std::array<int, 3>;

  struct Box {
    Corner low, high;
    int sign;  ///< 1 of a solid, -1 of a cavity
  };

  static BoxBody random(RandomGeometry& random) {
    BoxBody body;
    const int solids = 1 + random.below(4);
    for (int i = 0; i < solids; ++i) body.addWithin({0, 0, 0}, {kSide, kSide, kSide}, 1, random);
    return body;
  }
  /// A box in a cavity in a box and so on, `depth` of them, in a lattice of this side.
  static BoxBody nest(int depth, int side, RandomGeometry& random) {
    BoxBody body;
    Box box{{0, 0, 0}, {side, side, side}, 1};
    for (int left = depth; left > 0; --left, box.sign = -box.sign) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int room = box.high[k] - box.low[k] - (2 * left - 1), before = random.below(room + 1);
        box.low[k] += before;
        box.high[k] -= random.below(room - before + 1);
      }
      body.boxes_.push_back(box);
      for (std::size_t k = 0; k < 3; ++k) {
        ++box.low[k];
        --box.high[k];
      }
    }
    return body;
  }
  void add(const Corner& low, const Corner& high, int sign = 1) {
    boxes_.push_back({low, high, sign});
  }
  bool isEmpty() const { return boxes_.empty(); }

  /// How often the body winds around the cube [at, at + 1].
  int numberAt(const Corner& at) const {
    int number = 0;
    for (const Box& box : boxes_) {
      bool is_in = true;
      for (std::size_t k = 0; k < 3; ++k)
        is_in = is_in && box.low[k] <= at[k] && at[k] < box.high[k];
      number += is_in ? box.sign : 0;
    }
    return number;
  }

  /// Twelve triangles a box. `turns`: those of the whole body inside out.
  TriangleMesh surface(double size, bool turns = false) const {
    TriangleMesh mesh;
    for (const Box& box : boxes_) addBox(box, size, (box.sign < 0) != turns, mesh);
    return mesh;
  }

 private:
  static bool areApart(const Box& a, const Box& b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return true;
    return false;
  }
  /// A box in the closed range, with boxes of the other sign in it.
  void addWithin(const Corner& low, const Corner& high, int sign, RandomGeometry& random) {
    Box box{low, high, sign};
    for (std::size_t k = 0; k < 3; ++k) {
      if (high[k] <= low[k]) return;
      box.low[k] = low[k] + random.below(high[k] - low[k]);
      box.high[k] = box.low[k] + 1 + random.below(high[k] - box.low[k]);
      if (random.oneIn(2)) std::tie(box.low[k], box.high[k]) = std::make_pair(low[k], high[k]);
    }
    for (const Box& other : boxes_)
      if (!isInside(box, other) && !areApart(box, other)) return;
    if (numberAt(box.low) != (sign > 0 ? 0 : 1)) return;
    boxes_.push_back(box);
    const Corner first = {box.low[0] + 1, box.low[1] + 1, box.low[2] + 1},
                 last = {box.high[0] - 1, box.high[1] - 1, box.high[2] - 1};
    for (int tries = random.below(4); tries > 0; --tries) addWithin(first, last, -sign, random);
  }
  static bool isInside(const Box& a, const Box& b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (a.low[k] <= b.low[k] || a.high[k] >= b.high[k]) return false;
    return true;
  }
  static void addBox(const Box& box, double size, bool turns, TriangleMesh& mesh) {
    const std::size_t first = mesh.vertices.size();
    for (std::size_t i = 0; i < 8; ++i) {
      const auto x = [&](std::size_t k) {
        return size * double((i >> k & 1) != 0 ? box.high[k] : box.low[k]);
      };
      mesh.vertices.emplace_back(x(0), x(1), x(2));
    }
    for (std::size_t k = 0; k < 3; ++k)
      for (const bool end : {false, true}) {
        const std::size_t u = std::size_t(1) << (k + 1) % 3, v = std::size_t(1) << (k + 2) % 3,
                          a = first + (end ? std::size_t(1) << k : 0);
        const bool flips = end == turns;
        const auto add = [&](std::size_t p, std::size_t q, std::size_t r) {
          mesh.triangles.emplace_back(p, flips ? r : q, flips ? q : r);
        };
        add(a, a + u, a + u + v);
        add(a, a + u + v, a + v);
      }
  }

  std::vector<Box> boxes_;
};

/// What two bodies of boxes have in common, the first moved by an infinitely small step along x, y
/// and z, counted in cells: 2 i from i to i + step, 2 i + 1 from there to i + 1.
class BoxOverlap {
 public:
  struct Region {
    long volume = 0, first_area = 0, second_area = 0;
    /// The outward normals of the first's faces inside the second, times area, less those of the
    /// second's, without faces that both have.
    std::array<long, 3> normal{};

    bool operator<(const Region& other) const {
      return std::tie(volume, first_area, second_area, normal) <
             std::tie(other.volume, other.first_area, other.second_area, other.normal);
    }
    bool operator==(const Region& other) const { return !(*this < other) && !(other < *this); }
  };

  /// `offset`: of the second. `side`: of the lattice.
  BoxOverlap(const BoxBody& first, const BoxBody& second, const BoxBody::Corner& offset,
             int side = BoxBody::kSide)
      : cubes_aside_(side + 2 * kBorder), cells_aside_(2 * cubes_aside_) {
    const BoxBody::Corner none{};
    for (int x = 0; x < cubes_aside_; ++x)
      for (int y = 0; y < cubes_aside_; ++y)
        for (int z = 0; z < cubes_aside_; ++z) {
          const BoxBody::Corner at{x - kBorder, y - kBorder, z - kBorder};
          cubes_[0].push_back(first.numberAt(shifted(at, none)) != 0);
          cubes_[1].push_back(second.numberAt(shifted(at, offset)) != 0);
        }
    seen_.assign(std::size_t(cells_aside_ * cells_aside_ * cells_aside_), 0);
    for (int x = 0; x < cells_aside_; ++x)
      for (int y = 0; y < cells_aside_; ++y)
        for (int z = 0; z < cells_aside_; ++z)
          if (isIn({x, y, z}) && !seen_[numberOf({x, y, z})]) flood({x, y, z});
    std::sort(regions_.begin(), regions_.end());
  }
  /// Sorted.
  const std::vector<Region>& regions() const { return regions_; }

 private:
  static constexpr int kBorder = 2;
  using Cell = std::array<int, 3>;

  static BoxBody::Corner shifted(const BoxBody::Corner& at, const BoxBody::Corner& by) {
    return {at[0] - by[0], at[1] - by[1], at[2] - by[2]};
  }
  std::size_t numberOf(const Cell& c) const {
    return std::size_t((c[0] * cells_aside_ + c[1]) * cells_aside_ + c[2]);
  }
  bool hasCube(std::size_t body, const Cell& cube) const {
    for (const int x : cube)
      if (x < 0 || x >= cubes_aside_) return false;
    return cubes_[body][std::size_t((cube[0] * cubes_aside_ + cube[1]) * cubes_aside_ + cube[2])] !=
           0;
  }
  bool isIn(std::size_t body, const Cell& c) const {
    Cell cube;
    for (std::size_t k = 0; k < 3; ++k) cube[k] = (body == 0 ? c[k] - 1 : c[k]) >> 1;
    return hasCube(body, cube);
  }
  bool isIn(const Cell& c) const { return isIn(0, c) && isIn(1, c); }

  void flood(const Cell& from) {
    Region region;
    std::vector<Cell> open{from};
    seen_[numberOf(from)] = 1;
    while (!open.empty()) {
      const Cell at = open.back();
      open.pop_back();
      region.volume += (at[0] & 1) * (at[1] & 1) * (at[2] & 1);
      for (std::size_t k = 0; k < 3; ++k)
        for (const int step : {-1, 1}) {
          const long area = (at[(k + 1) % 3] & 1) * (at[(k + 2) % 3] & 1);
          Cell next = at;
          next[k] += step;
          if (isIn(next)) {
            if (!seen_[numberOf(next)]) open.push_back(next);
            seen_[numberOf(next)] = 1;
          } else {
            (isIn(0, next) ? region.second_area : region.first_area) += area;
          }
          if (at[k] & 1) addNormal(at, k, step, area, region);
        }
    }
    regions_.push_back(region);
  }
  /// Of the side of a cell that is not thin: whether one of the bodies ends there.
  void addNormal(const Cell& at, std::size_t k, int step, long area, Region& region) const {
    Cell cube{at[0] >> 1, at[1] >> 1, at[2] >> 1};
    cube[k] += step;
    const bool in_first = hasCube(0, cube), in_second = hasCube(1, cube);
    if (in_first != in_second) region.normal[k] += in_second ? step * area : -step * area;
  }

  const int cubes_aside_, cells_aside_;  ///< along each side
  std::array<std::vector<char>, 2> cubes_;
  std::vector<char> seen_;
  std::vector<Region> regions_;
};

}  // namespace adaptive_bvh_test
