#include "query/regions/coinciding.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// A convex polygon. A corner's fourth coordinate is its height above another triangle.
struct Polygon {
  static constexpr std::size_t kMost = 8;  // a triangle, cut by four lines

  std::array<Eigen::Vector4d, kMost> corners;
  std::size_t count = 0;

  /// Returns the part where a linear function of the corners is not negative.
  template <typename Function>
  Polygon clipped(const Function& function) const {
    Polygon kept;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector4d &a = corners[i], &b = corners[(i + 1) % count];
      const double at_a = function(a), at_b = function(b);
      if (at_a >= 0) kept.add(a);
      if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0))
        kept.add(a + (b - a) * (at_a / (at_a - at_b)));
    }
    return kept;
  }
  /// The area times the normal.
  fcl::Vector3d areaVector() const {
    fcl::Vector3d sum = fcl::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < count; ++i)
      sum +=
          0.5 *
          (corners[i] - corners[0]).head<3>().cross((corners[i + 1] - corners[0]).head<3>().eval());
    return sum;
  }
  /// The mean of the corners, a point inside.
  fcl::Vector3d middle() const {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < count; ++i) sum += corners[i];
    return sum.head<3>() / static_cast<double>(count);
  }

 private:
  void add(const Eigen::Vector4d& corner) {
    if (count < kMost) corners[count++] = corner;  // rounding may make a polygon that is not convex
  }
};

/// Returns the first triangle of a pair, with heights above the front of the second, relative to
/// the largest one. If all heights are 0, they are 1 or -1 as the tie is broken (FaceSide::sign).
Polygon withHeights(const TrianglePoints& first, const CoplanarPair& pair) {
  double largest = 0;
  for (const FaceSide& side : pair.sides) largest = std::max(largest, std::fabs(side.value));
  Polygon polygon;
  polygon.count = 3;
  for (std::size_t k = 0; k < 3; ++k)
    polygon.corners[k] << first[k],
        -(largest > 0 ? pair.sides[k].value / largest : double(pair.sides[k].sign));
  return polygon;
}

/// Returns the direction across side k of a triangle, toward its inside.
fcl::Vector3d inwardOf(const TrianglePoints& triangle, const fcl::Vector3d& normal, std::size_t k) {
  return normal.cross(triangle[(k + 1) % 3] - triangle[k]);
}

/// Whether the first triangle is outside of a side of the second, up to rounding, so that they have
/// no common area. `normal`: of the second.
bool hasOutside(const TrianglePoints& first, const TrianglePoints& second,
                const fcl::Vector3d& normal, double rounding) {
  for (std::size_t k = 0; k < 3; ++k) {
    const fcl::Vector3d inward = inwardOf(second, normal, k);
    const double least = rounding * inward.lpNorm<1>();  // its square may overflow
    if (std::all_of(first.begin(), first.end(),
                    [&](const fcl::Vector3d& x) { return !(inward.dot(x - second[k]) > least); }))
      return true;
  }
  return false;
}

/// Returns the part of a polygon inside a triangle in the same plane. `normal`: of the triangle.
Polygon clipped(Polygon polygon, const TrianglePoints& triangle, const fcl::Vector3d& normal) {
  for (std::size_t k = 0; k < 3 && polygon.count > 2; ++k) {
    const fcl::Vector3d inward = inwardOf(triangle, normal, k);
    polygon = polygon.clipped(
        [&](const Eigen::Vector4d& x) -> double { return inward.dot(x.head<3>() - triangle[k]); });
  }
  return polygon;
}

}  // namespace

void findCoincidingFaces(const ClosedSurfaces& bodies, const SurfaceCrossings& crossings,
                         SurfacePatches& patches, std::vector<CoincidingFaces>& found) {
  found.clear();
  for (const CoplanarPair& pair : crossings.coplanar()) {
    const TrianglePoints p = bodies[0].triangle(pair.first), q = bodies[1].triangle(pair.second);
    const fcl::Vector3d p_normal = (p[1] - p[0]).cross(p[2] - p[0]),
                        q_normal = (q[1] - q[0]).cross(q[2] - q[0]);
    if (hasOutside(p, q, q_normal, crossings.rounding()) ||
        hasOutside(q, p, p_normal, crossings.rounding()))
      continue;
    const fcl::Vector3d normal = p_normal.stableNormalized();
    const bool are_alike = normal.dot(q_normal) > 0;
    const Polygon common = clipped(withHeights(p, pair), q, q_normal);
    if (common.count < 3) continue;
    for (const double side : {1., -1.}) {  // where p is in front of q, then behind it
      const Polygon part =
          common.clipped([&](const Eigen::Vector4d& x) -> double { return side * x[3]; });
      const double area = part.count < 3 ? 0 : part.areaVector().norm();
      if (area == 0) continue;
      const fcl::Vector3d middle = part.middle();
      unsigned region = patches.regionAt(WhichBody::First, pair.first, middle);
      if (region == SurfacePatches::kNoRegion)
        region = patches.regionAt(WhichBody::Second, pair.second, middle);
      if (region == SurfacePatches::kNoRegion) continue;
      found.push_back({region, area, normal, are_alike, (side > 0) == are_alike});
    }
  }
}

}  // namespace adaptive_bvh
