#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// How deep a triangle or a convex set is in another convex set that it touches: the latter moved
/// by `depth` along `normal`, of length 1, is apart from the former, and no shorter motion would
/// do.
struct Penetration {
  fcl::Vector3d normal;
  double depth;
  /// The shortest motion is at most so much shorter: certified by points of both.
  double error;
};

/// A convex set, by its farthest points.
class ConvexSet {
 public:
  /// A point of the set that is farthest along a direction, of any length > 0.
  virtual fcl::Vector3d support(const fcl::Vector3d& direction) const = 0;
  /// How deep a triangle is in the set, which it touches: by penetrationOf, or a form of its own.
  virtual Penetration penetration(const TrianglePoints<double>& triangle) const;

 protected:
  ~ConvexSet() = default;
};

/// The nearest points of two convex sets, or of a triangle and one. Where they have a common point,
/// `points` are one, up to rounding, and the distance is 0.
struct ConvexGap {
  PointPair<double> points;
  double distance;
  /// The exact distance is at most so much less: certified by a plane between the two.
  double error;
  /// Of length 1, from the second to the first: the extents of both along it are `distance` less
  /// `error` apart. Zero where no plane was found: they touch, or nearly.
  fcl::Vector3d normal;
};

/// When a search for a gap ends.
struct GapSearch {
  double error = 0x1p-44;  ///< at most so much of the extent of both sets
  int most_steps = 1000;
  /// Whether to go on where rounding hides progress: between faces that are nearly parallel or
  /// flat.
  bool finishes_flat = true;
  double least = 0;  ///< ends where the distance is surely less
};

/// By the algorithm of Gilbert, Johnson and Keerthi (1988). Nearer than 2^-46 of the extent of both
/// counts as touching.
ConvexGap convexGap(const ConvexSet& first, const ConvexSet& second, const GapSearch& search = {});
ConvexGap convexGap(const TrianglePoints<double>& triangle, const ConvexSet& set,
                    const GapSearch& search = {});

/// By expanding polytopes (van den Bergen 2001), until the error is at most 1e-10 of the extent of
/// both.
Penetration penetrationOf(const ConvexSet& first, const ConvexSet& second);
Penetration penetrationOf(const TrianglePoints<double>& triangle, const ConvexSet& set);

inline std::array<fcl::Vector3d, 3> edgesOf(const TrianglePoints<double>& t) {
  return {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
}

/// At right angles to both; zero where they are so nearly parallel that this would be rounding.
inline fcl::Vector3d acrossEdges(const fcl::Vector3d& e, const fcl::Vector3d& f) {
  const fcl::Vector3d across = e.cross(f);
  const double least = 0x1p-40 * e.norm() * f.norm();
  return across.norm() > least ? across : fcl::Vector3d::Zero();
}

/// The shortest of the motions along some directions that take a convex set out of a triangle
/// (docs/bounds.md, 17).
/// `Reach` says how far the set reaches against a direction of length 1.
template <typename Reach>
class ShortestWay {
 public:
  ShortestWay(const TrianglePoints<double>& triangle, const Reach& reach)
      : triangle_(triangle), reach_(reach) {}

  /// Along a direction of any length; nothing where it is 0.
  void tryDirection(const fcl::Vector3d& direction) {
    const double length = direction.norm();
    if (!(length > 0)) return;
    const fcl::Vector3d m = direction / length;
    const double way =
        reach_(m) + std::max({m.dot(triangle_[0]), m.dot(triangle_[1]), m.dot(triangle_[2])});
    if (!(way < depth_)) return;
    depth_ = way;
    normal_ = m;
  }
  void tryBoth(const fcl::Vector3d& direction) {
    tryDirection(direction);
    tryDirection(-direction);
  }
  void tryFaceNormal() {
    if (!isThin(triangle_))
      tryBoth((triangle_[1] - triangle_[0]).cross(triangle_[2] - triangle_[0]));
  }

  const fcl::Vector3d& normal() const { return normal_; }
  /// Less than 0 where they are apart along the normal.
  double signedDepth() const { return depth_; }
  Penetration penetration() const { return {normal_, std::max(depth_, 0.), 0}; }

 private:
  const TrianglePoints<double>& triangle_;
  Reach reach_;
  double depth_ = std::numeric_limits<double>::infinity();
  fcl::Vector3d normal_ = fcl::Vector3d::UnitX();
};

}  // namespace adaptive_bvh
