#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "query/points/boundary_cone.h"
#include "query/points/ray_search.h"

namespace adaptive_bvh {

/// How often a surface winds around a point. It is counted along a ray from the point: 1 more for
/// each triangle seen from behind, 1 less for each seen from its front. A ray that meets an edge or
/// a vertex decides nothing; then another ray is tried. For a closed surface the count is the
/// winding number, an integer without error. For another surface, or for separate triangles, the
/// solid angle of a cone over the boundary is added: BoundaryCone.
///
/// The trials end: from a point off the surface, the directions to edges and vertices have no area.
/// (An edge whose line contains the point does not count unless the point is on the edge.) The
/// number is 0 for a point on a triangle.
class WindingNumber {
 public:
  explicit WindingNumber(const MeshState& mesh)
      : middle_(mesh.tree.origin()), scale_(mesh.tree.scale()), rays_(mesh) {
    if (!mesh.topology->boundary.isEmpty()) cone_.emplace(mesh);
  }

  double of(const fcl::Vector3d& x) {
    if (cone_ && isFar(x)) return 0;
    double number = 0;
    bool is_certain = countAlong(x, outward(x), 0, number);
    for (int i = 0; !is_certain; ++i) is_certain = countAlong(x, direction(i), i, number);
    return number;
  }

 private:
  /// Whether less than 1e-17 of all directions from x lead to the mesh.
  bool isFar(const fcl::Vector3d& x) const {
    constexpr double kFar = 1e9;
    return !((x - middle_).lpNorm<Eigen::Infinity>() * scale_ < kFar);
  }
  /// The direction away from the mesh's centre, where a ray meets the fewest triangles; one
  /// direction in each octant.
  fcl::Vector3d outward(const fcl::Vector3d& x) const {
    const fcl::Vector3d y = x - middle_;
    if (cone_) return alongAxis(y);
    return {std::copysign(0.6214831, y[0]), std::copysign(0.5463127, y[1]),
            std::copysign(0.5614279, y[2])};
  }
  /// The nearest direction along an axis. For it, the cone's frame needs no rotation.
  static fcl::Vector3d alongAxis(const fcl::Vector3d& y) {
    int k;
    y.cwiseAbs().maxCoeff(&k);
    return std::copysign(1., y[k]) * fcl::Vector3d::Unit(k);
  }
  /// Directions spread evenly over the sphere; a mesh is unlikely to have an edge along one of
  /// them.
  static fcl::Vector3d direction(int i) {
    // Additive recurrences by powers of the inverse of the plastic number.
    const double turns = 0.43195 + 0.7548776662466927 * i, z = 1 - 2 * (turns - std::floor(turns)),
                 around = 0.4321 + 3.5804121438379077 * i, radius = std::sqrt(1 - z * z);
    return {radius * std::cos(around), radius * std::sin(around), z};
  }

  /// Counts along a ray. Returns false if the ray decides nothing. `tries`: number of rays tried
  /// before.
  bool countAlong(const fcl::Vector3d& x, const fcl::Vector3d& along, int tries, double& number) {
    bool is_certain = true, is_on_surface = false;
    number = 0;
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    rays_.search(x, along, 0, kEnd, [&](int, const RayTriangle::Hit& hit) {
      is_on_surface = is_on_surface || hit.t == 0;
      is_certain = is_certain && !hit.is_on_a_side;
      number += hit.is_front ? -1 : 1;
      return is_certain || is_on_surface ? kEnd : -1;
    });
    if (is_on_surface) number = 0;
    if (is_on_surface || !is_certain || !cone_) return is_on_surface || is_certain;
    return cone_->addTo(number, x, along, tries);
  }

  const fcl::Vector3d middle_;
  const double scale_;
  RayWalk rays_;
  std::optional<BoundaryCone> cone_;
};

}  // namespace adaptive_bvh
