#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Penetration depth of a triangle or convex set A that touches another convex set B: B translated
/// by `depth` along the unit vector `normal` no longer overlaps A, and no shorter translation
/// separates them.
struct Penetration {
  fcl::Vector3d normal;
  double depth;
  /// The exact depth is at least `depth - error`, as points of both sets certify.
  double error;
};

/// A convex set given by its support function.
class ConvexSet {
 public:
  /// Returns a point of the set that is farthest along a direction of any length > 0.
  virtual fcl::Vector3d support(const fcl::Vector3d& direction) const = 0;
  /// Returns the penetration of a triangle that touches the set. The default calls penetrationOf; a
  /// set may override it with a closed form.
  virtual Penetration penetration(const TrianglePoints& triangle) const;

 protected:
  ~ConvexSet() = default;
};

/// The nearest points of two convex sets, or of a triangle and a convex set. If the two intersect,
/// both `points` are one common point, up to rounding, and the distance is 0.
struct ConvexGap {
  PointPair points;
  double distance;
  /// The exact distance is at least `distance - error`, as a plane between the two certifies.
  double error;
  /// Unit vector from the second to the first. The projections of the two on it are at least
  /// `distance - error` apart. Zero if no separating plane was found: the two touch, or nearly.
  fcl::Vector3d normal;
};

/// Termination criteria of convexGap.
struct GapSearch {
  double error = 0x1p-44;  ///< relative to the extent of both sets
  int most_steps = 1000;
  /// Whether to continue the search where rounding hides progress, that is between nearly parallel
  /// or nearly flat faces.
  bool finishes_flat = true;
  double least = 0;  ///< the search ends once the distance is certainly less than this
};

/// The gap by the algorithm of Gilbert, Johnson and Keerthi (1988). A distance below 2^-46 of the
/// extent of both counts as touching.
ConvexGap convexGap(const ConvexSet& first, const ConvexSet& second, const GapSearch& search = {});
ConvexGap convexGap(const TrianglePoints& triangle, const ConvexSet& set,
                    const GapSearch& search = {});

/// The penetration by expanding polytopes (van den Bergen 2001), with an error of at most 1e-10 of
/// the extent of both, unless both are round (Penetration::error).
Penetration penetrationOf(const ConvexSet& first, const ConvexSet& second);
Penetration penetrationOf(const TrianglePoints& triangle, const ConvexSet& set);

/// The edge vectors of a triangle; edge k begins at corner k.
inline std::array<fcl::Vector3d, 3> edgesOf(const TrianglePoints& t) {
  return {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
}

/// The cross product of two edges; zero if they are so nearly parallel that it would consist of
/// rounding errors.
inline fcl::Vector3d acrossEdges(const fcl::Vector3d& e, const fcl::Vector3d& f) {
  const fcl::Vector3d across = e.cross(f);
  const double least = 0x1p-40 * e.norm() * f.norm();
  return across.norm() > least ? across : fcl::Vector3d::Zero();
}

/// Finds the shortest translation that moves a convex set out of a triangle, among the directions
/// that are tried (docs/bounds.md, 17). `Extent` is a function that returns for a unit vector m the
/// maximum of -m x over all points x of the set.
template <typename Extent>
class ShortestTranslation {
 public:
  ShortestTranslation(const TrianglePoints& triangle, const Extent& extent)
      : triangle_(triangle), extent_(extent) {}

  /// Tries one direction of any length; ignores a zero vector.
  void tryDirection(const fcl::Vector3d& direction) {
    const double length = direction.norm();
    if (!(length > 0)) return;
    const fcl::Vector3d m = direction / length;
    const double distance =
        extent_(m) + std::max({m.dot(triangle_[0]), m.dot(triangle_[1]), m.dot(triangle_[2])});
    if (!(distance < depth_)) return;
    depth_ = distance;
    normal_ = m;
  }
  /// Tries a direction and its opposite.
  void tryBoth(const fcl::Vector3d& direction) {
    tryDirection(direction);
    tryDirection(-direction);
  }
  /// Tries both normals of the triangle, unless the triangle is too thin for a normal.
  void tryFaceNormal() {
    if (!isThin(triangle_))
      tryBoth((triangle_[1] - triangle_[0]).cross(triangle_[2] - triangle_[0]));
  }

  /// The direction with the shortest translation so far, and the length of this translation:
  /// negative if the two are apart along the normal.
  const fcl::Vector3d& normal() const { return normal_; }
  double signedDepth() const { return depth_; }
  Penetration penetration() const { return {normal_, std::max(depth_, 0.), 0}; }

 private:
  const TrianglePoints& triangle_;
  Extent extent_;
  double depth_ = std::numeric_limits<double>::infinity();
  fcl::Vector3d normal_ = fcl::Vector3d::UnitX();
};

}  // namespace adaptive_bvh
