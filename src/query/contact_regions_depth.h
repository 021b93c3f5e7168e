#pragma once

#include "query/contact_regions_patches.h"
#include "query/point_search.h"
#include "query/winding_number.h"

namespace adaptive_bvh {

/// What is added up of a region. Points are in the frame of the first mesh.
struct RegionSums {
  double volume = 0;
  fcl::Vector3d origin = fcl::Vector3d::Zero();  ///< a point of it, for volume and moments
  bool has_origin = false;
  std::array<double, 2> areas{}, sizes{};
  std::array<fcl::Vector3d, 2> moments{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<fcl::Vector3d, 2> points{fcl::Vector3d::Zero(), fcl::Vector3d::Zero()};
  std::array<std::size_t, 2> num_parts{};
  fcl::Vector3d normal = fcl::Vector3d::Zero();  ///< of the first, times its area
  double depth = -1;
  fcl::Vector3d deepest = fcl::Vector3d::Zero();

  void add(const SurfacePart& part) {
    const std::size_t side = indexOf(part.body);
    if (!has_origin) origin = part.origin;
    has_origin = true;
    if (num_parts[side]++ == 0) points[side] = part.origin;
    const fcl::Vector3d from = part.origin - origin;
    volume += from.dot(part.normal) * part.area / 3;
    areas[side] += part.area;
    sizes[side] += part.size;
    moments[side] += from * part.area + part.moment;
    if (part.body == Operand::First) normal += part.area * part.normal;
  }
  /// The deepest point where a side has no part; where a part has no area, a point of it.
  fcl::Vector3d centroid(std::size_t side) const {
    if (num_parts[side] == 0) return deepest;
    if (!(std::fabs(areas[side]) > 1e-9 * sizes[side])) return points[side];
    return origin + moments[side] / areas[side];
  }
  /// Zero where normals cancel each other, up to rounding.
  fcl::Vector3d meanNormal() const {
    if (!(normal.norm() > 1e-9 * sizes[0])) return fcl::Vector3d::Zero();
    return normal.stableNormalized();
  }
};

/// Finds the deepest of points that lie on one surface inside the other body.
template <typename S>
class RegionDepth {
 public:
  /// `to_other`: takes points to the other mesh's frame.
  RegionDepth(const MeshState<S>& other, const RelativePlacement& to_other)
      : to_other_(to_other), search_(other), winding_(other) {}

  /// `is_inside`: whether the point is known to be inside.
  void take(const fcl::Vector3d& point, bool is_inside, RegionSums& region) {
    const fcl::Vector3d x = to_other_(point);
    // A distance changes by no more than the point moves.
    if (last_.triangle >= 0 && last_.distance + (x - last_point_).norm() <= region.depth) return;
    typename PointSearch<S>::Nearest nearest;
    if (last_.triangle >= 0) search_.tryTriangle(x, last_.triangle, nearest);
    // No point is farther from the surface than from one of its triangles.
    search_.search(x, nearest, region.depth);
    last_ = nearest;
    last_point_ = x;
    if (!(nearest.distance > region.depth)) return;
    if (!is_inside && winding_.of(x) == 0) return;
    region.depth = nearest.distance;
    region.deepest = point;
  }

 private:
  const RelativePlacement to_other_;
  PointSearch<S> search_;
  WindingNumber<S> winding_;
  typename PointSearch<S>::Nearest last_;
  fcl::Vector3d last_point_ = fcl::Vector3d::Zero();
};

}  // namespace adaptive_bvh
