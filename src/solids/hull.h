#pragma once

#include <array>
#include <vector>

#include "solids/solid.h"

namespace adaptive_bvh {

/// The convex hull of points, by its support function; results have the errors of
/// convex_distance.h. Does not copy the points and the faces. Faces are stored as in fcl::Convex:
/// for each face the number of its corners, then their indices. Only `addPatches` and FacedHull use
/// them.
class HullSolid : public Solid {
 public:
  HullSolid(const fcl::Vector3d* points, std::size_t count, const std::vector<int>& faces,
            const fcl::Vector3d& inner_point)
      : points_(points), count_(count), faces_(faces), inner_point_(inner_point) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override;
  TriangleGap gap(const TrianglePoints& triangle) const override;
  /// Computed by convexGap for x outside the hull, by penetrationOf inside.
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  /// Computed by separating planes, up to the errors of convexGap.
  LineInterval lineInside(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;
  fcl::Vector3d innerPoint() const override { return inner_point_; }
  const HullSolid* hull() const override { return this; }
  const fcl::Vector3d& point(int i) const { return points_[static_cast<std::size_t>(i)]; }

 protected:
  /// Calls visit(corners, count) for each face. If the list ends within a face, calls
  /// visit(nullptr, 0) for this face.
  template <typename Visit>
  void forEachFace(const Visit& visit) const {
    for (std::size_t next = 0; next < faces_.size();) {
      const auto count = static_cast<std::size_t>(std::max(faces_[next++], 0));
      if (faces_.size() - next < count) return visit(nullptr, 0);
      visit(&faces_[next], count);
      next += count;
    }
  }
  std::size_t count() const { return count_; }

 private:
  const fcl::Vector3d* const points_;
  const std::size_t count_;  ///< number of points
  const std::vector<int>& faces_;
  const fcl::Vector3d inner_point_;
};

/// A convex hull given by the planes of its faces.
class FacedHull final : public HullSolid {
 public:
  /// Throws std::invalid_argument if the faces do not enclose the hull.
  explicit FacedHull(const HullSolid& hull);

  /// Computed by the plane that x is farthest above or least below: outside the hull, the distance
  /// may be too small, and the nearest point is on the plane but possibly not on the hull.
  ShapeSurface surface(const fcl::Vector3d& x) const override;

 private:
  /// The plane n x = d; n is a unit vector that points outward.
  struct Plane {
    fcl::Vector3d n;
    double d;
  };
  void addPlane(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c);

  std::vector<Plane> planes_;
};

}  // namespace adaptive_bvh
