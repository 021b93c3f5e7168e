#pragma once

#include <array>
#include <vector>

#include "base/points.h"
#include "solids/solid.h"

namespace adaptive_bvh {

/// The convex hull of points, by its support function; results have the errors of
/// convex_distance.h. Does not copy the points and the faces. Faces are stored as in fcl::Convex:
/// for each face the number of its corners, then their indices. Only `addPatches` and FacedHull use
/// them.
class HullSolid : public Solid {
 public:
  HullSolid(const Points& points, std::size_t count, const std::vector<int>& faces,
            const fcl::Vector3d& inner)
      : points_(points), count_(count), faces_(faces), inner_(inner) {}

  fcl::Vector3d support(const fcl::Vector3d& direction) const override;
  TriangleGap gap(const TrianglePoints<double>& triangle) const override;
  /// Outside the hull by convexGap, inside by penetrationOf.
  ShapeSurface surface(const fcl::Vector3d& x) const override;
  /// By planes through support points, up to the errors of convexGap.
  LineInterval along(const Line& line) const override;
  void addPatches(std::vector<SurfacePatch>& patches) const override;
  fcl::Vector3d inner() const override { return inner_; }
  const HullSolid* hull() const override { return this; }
  fcl::Vector3d point(int i) const { return points_[static_cast<std::size_t>(i)]; }

 protected:
  /// Calls visit(corners, count) for each face. If the list ends within a face, calls
  /// visit(nullptr, 0) for this face.
  template <typename Visit>
  void forEachFace(const Visit& visit) const {
    for (std::size_t at = 0; at < faces_.size();) {
      const auto count = static_cast<std::size_t>(std::max(faces_[at++], 0));
      if (faces_.size() - at < count) return visit(nullptr, 0);
      visit(&faces_[at], count);
      at += count;
    }
  }
  std::size_t count() const { return count_; }

 private:
  const Points points_;
  const std::size_t count_;
  const std::vector<int>& faces_;
  const fcl::Vector3d inner_;
};

/// A convex hull given by the planes of its faces.
class FacedHull final : public HullSolid {
 public:
  /// Throws std::invalid_argument if the faces do not enclose the hull.
  explicit FacedHull(const HullSolid& hull);

  /// By the nearest plane: outside the hull, the distance may be too small, and the nearest point
  /// is on the plane but possibly not on the hull.
  ShapeSurface surface(const fcl::Vector3d& x) const override;

 private:
  struct Plane {
    fcl::Vector3d n;
    double d;
  };
  void addPlane(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c);

  std::vector<Plane> planes_;
};

}  // namespace adaptive_bvh
