#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "query/points/boundary_cone.h"
#include "query/points/ray_search.h"

namespace adaptive_bvh {

/// The winding number of a mesh at a point: how often the surface winds around the point. It is
/// counted along a ray from the point: 1 more for each triangle seen from behind, 1 less for each
/// seen from its front. If the ray meets an edge or a vertex, another ray is tried. For a closed
/// surface the count is the winding number, an integer without error. For another surface, or for
/// separate triangles, BoundaryCone adds the solid angle of a cone over the boundary.
///
/// The trials end, because the directions from a point off the surface to edges and vertices have
/// measure zero. (An edge whose line contains the point counts only if the point is on it.)
class WindingNumber {
 public:
  explicit WindingNumber(const MeshState& mesh)
      : middle_(mesh.tree.origin()), scale_(mesh.tree.scale()), rays_(mesh) {
    if (!mesh.topology->boundary.isEmpty()) cone_.emplace(mesh);
  }

  /// Returns the winding number at x, in the mesh's frame; 0 if x is on a triangle.
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
  /// A direction away from the mesh's centre, in which a ray meets few triangles: along an axis if
  /// there is a cone, else one direction for each octant.
  fcl::Vector3d outward(const fcl::Vector3d& x) const {
    const fcl::Vector3d y = x - middle_;
    if (cone_) return alongAxis(y);
    return {std::copysign(0.6214831, y[0]), std::copysign(0.5463127, y[1]),
            std::copysign(0.5614279, y[2])};
  }
  /// The axis direction nearest to y. For it, the cone's frame needs no rotation.
  static fcl::Vector3d alongAxis(const fcl::Vector3d& y) {
    int k;
    y.cwiseAbs().maxCoeff(&k);
    return std::copysign(1., y[k]) * fcl::Vector3d::Unit(k);
  }
  /// The direction of trial i. The directions are spread evenly over the sphere; a mesh is unlikely
  /// to have an edge along one of them.
  static fcl::Vector3d direction(int i) {
    // Additive recurrences by powers of the inverse of the plastic number.
    const double turns = 0.43195 + 0.7548776662466927 * i, z = 1 - 2 * (turns - std::floor(turns)),
                 around = 0.4321 + 3.5804121438379077 * i, radius = std::sqrt(1 - z * z);
    return {radius * std::cos(around), radius * std::sin(around), z};
  }

  /// Sets `number` to the winding number at x, counted along a ray. Returns false if the ray meets
  /// an edge, or passes too near the boundary. `tries`: number of rays tried before.
  bool countAlong(const fcl::Vector3d& x, const fcl::Vector3d& direction, int tries,
                  double& number) {
    bool is_certain = true, is_on_surface = false;
    number = 0;
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    rays_.search(x, direction, 0, kEnd, [&](int, const RayTriangle::Hit& hit) {
      is_on_surface = is_on_surface || hit.t == 0;
      is_certain = is_certain && !hit.is_on_a_side;
      number += hit.is_front ? -1 : 1;
      return is_certain || is_on_surface ? kEnd : -1;
    });
    if (is_on_surface) number = 0;
    if (is_on_surface || !is_certain || !cone_) return is_on_surface || is_certain;
    return cone_->addTo(number, x, direction, tries);
  }

  const fcl::Vector3d middle_;
  const double scale_;
  RayWalk rays_;
  std::optional<BoundaryCone> cone_;  ///< none for a closed mesh
};

}  // namespace adaptive_bvh
