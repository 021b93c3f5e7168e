#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <vector>

#include <Eigen/Geometry>

#include "support/meshes.h"
#include "support/separated_hulls.h"

namespace adaptive_bvh_test {

/// The distance of a vertex and a face (firsts = 1), or of two edges (2).
inline quad::Real distance(int firsts, const std::array<quad::Point, 4>& x) {
  if (firsts == 1) return quad::distance(x[0], {x[1], x[2], x[3]});
  const quad::Real inside = quad::squaredDistanceInside(x[0], x[1], x[2], x[3]);
  const quad::Real ends =
      std::min({quad::squaredDistance(x[0], x[2], x[3]), quad::squaredDistance(x[1], x[2], x[3]),
                quad::squaredDistance(x[2], x[0], x[1]), quad::squaredDistance(x[3], x[0], x[1])});
  return quad::root(inside >= 0 ? std::min(ends, inside) : ends);
}

/// All features of a surface whose vertices go straight ways, for judges that know no tree. The
/// surface may be several meshes, one after the other.
class SweptFeatures {
 public:
  using P = Eigen::Vector3d;
  /// A vertex and a face (firsts = 1), or two edges (2).
  struct Pair {
    int firsts;
    std::array<std::size_t, 4> corners;
  };

  SweptFeatures(const std::vector<P>& start, const std::vector<P>& end,
                const std::vector<fcl::Triangle>& triangles)
      : start_(start), end_(end) {
    std::set<std::vector<std::size_t>> vertices, edges, faces;
    for (const fcl::Triangle& t : triangles) {
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      faces.insert({t[0], t[1], t[2]});
      for (int k = 0; k < 3; ++k) {
        vertices.insert({t[k]});
        edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
      }
    }
    for (const auto* of : {&vertices, &faces, &edges}) kinds_.push_back(boxed(*of));
  }

  /// Calls act(pair) for each pair without a common vertex whose swept boxes are at most `within`
  /// apart.
  template <typename Act>
  void forEachPair(double within, const Act& act) const {
    overlapping(kinds_[0], kinds_[1], within, [&](const Feature& v, const Feature& f) {
      if (std::count(f.vertices.begin(), f.vertices.end(), v.vertices[0]) == 0)
        act(Pair{1, {v.vertices[0], f.vertices[0], f.vertices[1], f.vertices[2]}});
    });
    overlapping(kinds_[2], kinds_[2], within, [&](const Feature& e, const Feature& f) {
      const auto &a = e.vertices, &b = f.vertices;
      if (a < b && a[0] != b[0] && a[0] != b[1] && a[1] != b[0] && a[1] != b[1])
        act(Pair{2, {a[0], a[1], b[0], b[1]}});
    });
  }
  /// The corners of a pair at the start, with shares 0, or the end, with 1.
  std::array<quad::Point, 4> corners(const Pair& pair, int share) const {
    std::array<quad::Point, 4> corners;
    for (std::size_t i = 0; i < 4; ++i)
      corners[i] = quad::of((share ? end_ : start_)[pair.corners[i]]);
    return corners;
  }
  bool areApartAllTheWay(const Pair& pair) const {
    return adaptive_bvh_test::areApartAllTheWay(pair.firsts, corners(pair, 0), corners(pair, 1));
  }
  bool areApartAtStart(const Pair& pair) const {
    return adaptive_bvh_test::areApartAllTheWay(pair.firsts, corners(pair, 0), corners(pair, 0));
  }

 private:
  struct Feature {
    std::vector<std::size_t> vertices;
    Eigen::AlignedBox3d box;
  };
  using Features = std::vector<Feature>;

  Features boxed(const std::set<std::vector<std::size_t>>& all) const {
    Features features;
    for (const auto& vertices : all) {
      Feature feature{vertices, {}};
      for (const std::size_t v : vertices) {
        feature.box.extend(start_[v]);
        feature.box.extend(end_[v]);
      }
      features.push_back(feature);
    }
    std::sort(features.begin(), features.end(),
              [](const Feature& a, const Feature& b) { return a.box.min()[0] < b.box.min()[0]; });
    return features;
  }
  /// By the order of the boxes along x.
  template <typename Act>
  static void overlapping(const Features& first, const Features& second, double within,
                          const Act& act) {
    double widest = 0;
    for (const Feature& feature : second) widest = std::max(widest, feature.box.sizes()[0]);
    for (const Feature& a : first) {
      const double from = a.box.min()[0] - within - widest;
      auto b = std::lower_bound(
          second.begin(), second.end(), from,
          [](const Feature& feature, double x) { return feature.box.min()[0] < x; });
      for (; b != second.end() && b->box.min()[0] <= a.box.max()[0] + within; ++b)
        if ((a.box.min() - b->box.max()).cwiseMax(b->box.min() - a.box.max()).maxCoeff() <= within)
          act(a, *b);
    }
  }

  const std::vector<P>&start_, &end_;
  std::vector<Features> kinds_;  ///< vertices, faces, edges
};

}  // namespace adaptive_bvh_test
