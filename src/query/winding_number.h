#pragma once

#include <cmath>
#include <limits>

#include "query/ray_search.h"
#include "triangles/solid_angle.h"

namespace adaptive_bvh {

/// How often a closed surface winds around a point, by what a ray from there meets: 1 more for each
/// triangle that is seen from behind, 1 less for each seen from its front. A ray that meets a side or a
/// corner says nothing; then another one is tried. Where many say nothing, solid angles are summed.
/// Of a point on the surface it is the number on one of its sides.
template <typename S>
class WindingNumber {
 public:
  explicit WindingNumber(const MeshState<S>& mesh) : mesh_(mesh), rays_(mesh) {}

  int of(const fcl::Vector3d& x) {
    constexpr int kTries = 16;
    for (int i = 0, number = 0; i < kTries; ++i)
      if (countAlong(x, direction(i), number)) return number;
    return bySolidAngles(x);
  }

 private:
  /// Directions spread over the sphere that no edge of a mesh is likely to have.
  static fcl::Vector3d direction(int i) {
    const double z = 0.87390 - 0.109134 * i, around = 0.4321 + 2.399963229728653 * i,
                 radius = std::sqrt(1 - z * z);
    return {radius * std::cos(around), radius * std::sin(around), z};
  }

  bool countAlong(const fcl::Vector3d& x, const fcl::Vector3d& along, int& number) {
    bool is_certain = true;
    number = 0;
    rays_.search(x, along, [&](int, const RayTriangle::Hit& hit) {
      is_certain = is_certain && !hit.is_on_a_side;
      number += hit.is_front ? -1 : 1;
      return is_certain ? std::numeric_limits<double>::infinity() : -1;
    });
    return is_certain;
  }

  int bySolidAngles(const fcl::Vector3d& x) const {
    long double sum = 0;
    for (int i = 0; i < mesh_.numTriangles(); ++i) {
      const VertexIndices v = mesh_.view().verticesOf(static_cast<unsigned>(i));
      sum += solidAngle<long double>(mesh_.vertices[v[0]], mesh_.vertices[v[1]],
                                     mesh_.vertices[v[2]], x);
    }
    return static_cast<int>(std::lround(sum / (4 * std::acos(-1.L))));
  }

  const MeshState<S>& mesh_;
  RaySearch<S> rays_;
};

}  // namespace adaptive_bvh
