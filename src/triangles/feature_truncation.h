#pragma once

#include <array>
#include <limits>

#include <Eigen/Core>

namespace adaptive_bvh {

/// Two features, a vertex and a face or two edges, whose four corners each go a share of their way:
/// start + share * (end - start). A plane between the features confines each corner to its side: so
/// the features stay apart, whatever the order and the speeds in which the corners move. Planes
/// divide the gap in proportion to how much either side wants of it. docs/bounds.md, 15.
class FeatureTruncation {
 public:
  using Point = Eigen::Vector3d;

  struct Corner {
    const Point *start, *end;
    double* share;  ///< at most 1; lowered
    double error;   ///< bound of the error of a component, anywhere on the way
    /// Unit roundoff with which the caller computes positions from the share.
    double unit = std::numeric_limits<double>::epsilon() / 2;
  };

  /// Corners: for a vertex and a face the vertex first, whichever mesh it belongs to; for two edges
  /// the corners of the first edge first. `firsts` is the number of corners of the first feature.
  FeatureTruncation(int firsts, const std::array<Corner, 4>& corners, double separation);

  /// Lowers the shares so that all corners keep to their sides of a plane, and the features stay
  /// farther apart than the separation. If they are not farther apart at the start, they come no
  /// nearer than kNearer allows. If no plane certainly separates them at the start, no corner
  /// moves.
  void lowerShares() const;

  /// The share of their distance by which features within the separation may come nearer: so that
  /// rounding does not keep them from sliding.
  static constexpr double kNearer = 1e-9;

 private:
  /// Heights of the corners over a plane through the first corner, upward for the first feature and
  /// downward for the second: so both want to go down.
  struct Heights {
    double start[4];  ///< less the error
    double rise[4];   ///< by the whole motion
    double gap;       ///< that certainly separates the features at the start; may be negative
    double support[2], wanted[2];  ///< the least of each feature: at the start, and on its way
  };
  /// Shares of the corners that keep to their sides of a plane, and what they lose of the motion.
  struct Cut {
    std::array<double, 4> shares = {{0, 0, 0, 0}};
    double loss = 0;
  };
  /// Heights along several directions: that between the nearest points, its part across the
  /// relative motion, and others.
  using Candidates = std::array<Heights, 6>;

  bool isAtRest() const;
  /// The mean motion of the first feature, relative to that of the second.
  Point relativeMotion() const;
  /// Along a unit direction from the second feature to the first; no gap along a zero vector.
  Heights heightsAlong(const Point& direction) const;
  /// Whether a plane leaves all corners their shares.
  bool isFree(const Heights& heights) const;
  /// The cut by the best plane that leaves a distance of `separation`.
  Cut cutAt(const Heights& heights, double separation) const;
  double separationToKeep(const Candidates& candidates) const;
  Cut bestCut() const;

  int firsts_;
  std::array<Corner, 4> corners_;
  std::array<Point, 4> start_, motion_;  ///< relative to the first corner's start; displacements
  std::array<Point, 4> error_;           ///< bounds of the errors of positions on the way
  std::array<double, 4> length_;         ///< of the motions
  double separation_;
  double slack_;  ///< bound of the rounding errors of a gap
};

}  // namespace adaptive_bvh
