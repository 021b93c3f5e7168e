#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/leased.h"
#include "base/shortcut.h"
#include "base/task_pool.h"
#include "boxes/tree_walk.h"
#include "boxes/wide_tree.h"
#include "query/nearest/line_to_core.h"
#include "query/pair_corners.h"
#include "query/placed_mesh.h"
#include "triangles/feature_distance.h"
#include "triangles/nearness_order.h"
#include "triangles/point_gaps4.h"

namespace adaptive_bvh {

/// Cuts [0, count) into parts and calls run(begin, end) for each, on up to `threads` threads.
/// `run`: see TaskPool::forEach.
template <typename Run>
void forEachBatch(int threads, std::size_t count, Run&& run) {
  constexpr std::size_t kBatch = 512;
  const TaskPool pool(count > 2 * kBatch ? threads : 1);
  if (pool.size() == 1) return run(std::size_t(0), count);
  pool.forEach(static_cast<int>((count + kBatch - 1) / kBatch), [&](int task, int) {
    const std::size_t begin = static_cast<std::size_t>(task) * kBatch;
    run(begin, std::min(begin + kBatch, count));
  });
}

/// Finds the triangle nearest to a point, by a mesh's four-wide tree: depth first, nearest box
/// first, without boxes farther than the nearest triangle so far. Boxes and the triangles of a leaf
/// are tested in single precision, which excludes triangles that are certainly farther; the others
/// are tested in double: docs/bounds.md, 16. For a point far away, single precision excludes too
/// few triangles; then the search continues with bounds along the line from the point to the body.
///
/// Points, and the results, are in the mesh's frame.
class PointSearch {
 public:
  struct Nearest {
    fcl::Vector3d point = fcl::Vector3d::Zero();
    double distance = std::numeric_limits<double>::infinity();
    int triangle = -1;           ///< its index; -1 if none is within the initial distance
    VertexIndices corners = {};  ///< of the triangle
    feature_distance::FacePlace place = {};                  ///< of the point in the triangle
    double limit = std::numeric_limits<double>::infinity();  ///< farther triangles are ignored
  };

  explicit PointSearch(const MeshState& mesh) : mesh_(mesh), tree_(mesh.tree), walk_(tree_) {}

  /// Replaces `nearest` by the triangle nearest to x, if that is nearer, or equally near with a
  /// smaller index. So the result is independent of the initial triangle. May stop at a triangle
  /// within `enough`.
  void search(const fcl::Vector3d& x, Nearest& nearest, double enough = -1) {
    if (nearest.distance <= enough) return;
    setPoint(x, nearest.distance);
    const auto isOver = [&] { return nearest.distance <= enough; };
    const bool is_stopped =
        walk_.nearestFirst([&](const WideNode& node) -> Float4 { return squaredGaps(node.boxes); },
                           [&] { return limit_; },
                           [&](const WideNode& leaf, unsigned lanes, const Float4&) {
                             visitLeaf(leaf, lanes, x, nearest);
                             return isOver() || tests_ >= most_tests_;
                           });
    if (is_stopped && !isOver()) searchAlong(x, nearest, isOver);
  }
  /// How many triangles the last search tested in double precision.
  std::size_t triangleTests() const { return tests_; }
  /// Replaces `nearest` by this triangle if it is nearer: an upper bound for `search`.
  void tryTriangle(const fcl::Vector3d& x, int triangle, Nearest& nearest) const {
    tryFace(x, mesh_.view().verticesOf(static_cast<unsigned>(triangle)), triangle, nearest);
  }

 private:
  using Corners = std::array<fcl::Vector3d, 3>;
  using Place = feature_distance::FacePlace;

  template <typename Index>
  fcl::Vector3d point(Index vertex) const {
    return mesh_.vertices[static_cast<std::size_t>(vertex)];
  }
  Corners pointsOf(const VertexIndices& v) const { return {point(v[0]), point(v[1]), point(v[2])}; }

  /// Replaces `nearest` if the triangle is nearer. Ties within rounding are decided by isBefore.
  void tryFace(const fcl::Vector3d& x, const VertexIndices& corners, int triangle,
               Nearest& nearest) const {
    if (triangle == nearest.triangle) return;
    fcl::Vector3d on_face;
    Place place;
    const double distance = feature_distance::Face(pointsOf(corners)).distance(x, on_face, place);
    const double excess = distance - nearest.distance;
    if (excess > rounding_ || distance > nearest.limit) return;
    const Nearest found = {on_face, distance, triangle, corners, place, nearest.limit};
    const bool is_tie = excess >= -rounding_ && nearest.triangle >= 0;
    if (!is_tie ? excess <= 0 : isBefore(x, found, nearest)) nearest = found;
  }
  /// Orders two triangles that are equally near up to rounding: whether the first is nearer or, if
  /// both are exactly as near, has the smaller index. So the order of the tests does not matter.
  bool isBefore(const fcl::Vector3d& x, const Nearest& one, const Nearest& other) const {
    const bool is_smaller = one.triangle < other.triangle;
    if (areOnSameFeature(one, other)) return is_smaller;
    const double scale = scaleOf(std::max(one.distance, other.distance));
    const PreciseSquare square(x, pointsOf(one.corners), one.place, scale),
        other_square(x, pointsOf(other.corners), other.place, scale);
    return square.isLess(other_square) || (is_smaller && !other_square.isLess(square));
  }
  /// Returns a power of two that brings a distance to about 1, but the body to at most 2^300.
  double scaleOf(double distance) const {
    const int least = std::ilogb(tree_.scale()), most = std::min(least + 300, 1000);
    const bool is_known = distance > 0 && distance < std::numeric_limits<double>::infinity();
    return std::ldexp(1., is_known ? std::min(-std::ilogb(distance), most) : most);
  }
  /// Whether both nearest points are the same vertex, or lie on the same edge.
  static bool areOnSameFeature(const Nearest& one, const Nearest& other) {
    const Place &place = one.place, &other_place = other.place;
    if (place.is_inside || other_place.is_inside) return false;
    const bool is_vertex = place.along == 0;
    if (is_vertex != (other_place.along == 0)) return false;
    const unsigned from = one.corners[place.edge], other_from = other.corners[other_place.edge];
    if (is_vertex) return from == other_from;
    const unsigned to = one.corners[(place.edge + 1) % 3],
                   other_to = other.corners[(other_place.edge + 1) % 3];
    return (from == other_to && to == other_from) || (from == other_from && to == other_to);
  }

  /// Sets the point in the tree's coordinates, the error bounds, and the limit. A coordinate in
  /// single precision has a relative error of 2^-24 plus the rounding in double precision, and so
  /// has a gap; kError covers both. The boxes' own margin covers the error of coordinates below 2.
  void setPoint(const fcl::Vector3d& x, double distance) {
    const fcl::Vector3d y = tree_.toBody() * (x - tree_.origin());
    const double size = y.lpNorm<Eigen::Infinity>();
    rounding_ = kRounding * (size + 2) / tree_.scale();
    error_ = float4::all(size > 2 ? static_cast<float>(std::min(size, kFar) * kError) : 0.f);
    for (int k = 0; k < 3; ++k)
      point_[k] = float4::all(static_cast<float>(std::max(-kFar, std::min(y[k], kFar))));
    if (!(size < kFar)) error_ = float4::all(std::numeric_limits<float>::max());
    setLimit(distance);
    tests_ = 0;
    most_tests_ = size < kFarPoint ? std::numeric_limits<std::size_t>::max()
                                   : kManyTests + tree_.slots().used() / kPerTest;
  }
  void setLimit(double distance) { limit_ = squaredGapOf(distance * tree_.scale()); }

  /// Returns lower bounds of the squared distances of four boxes, in the tree's units.
  ADAPTIVE_BVH_INLINE Float4 squaredGaps(const Boxes4& boxes) const {
    using float4::upper;
    Float4 sum = float4::all(0);
    for (int k = 0; k < 3; ++k) {
      const Float4 gap =
          upper<Float4>(upper<Float4>(boxes.low[k] - point_[k], point_[k] - boxes.high[k]) - error_,
                        float4::all(0));
      sum += gap * gap;
    }
    return sum;
  }

  /// Tests the leaf's triangles in `lanes`: first by gaps in single precision.
  void visitLeaf(const WideNode& leaf, unsigned lanes, const fcl::Vector3d& x, Nearest& nearest) {
    Vector4x3 corners[3];
    gatherLeaf(tree_.slots(), tree_.positions(), leaf, corners);
    for (Vector4x3& corner : corners)
      corner = vectors::difference(corner, {point_[0], point_[1], point_[2]});
    const PointGaps4 bounds(corners, error_ + float4::all(2 * WideTree::kPositionError));
    lanes &= nearLanes(bounds.byMiddles());
    if (!lanes) return;
    const Float4 gaps = bounds.byNearest();
    for (lanes &= nearLanes(gaps); lanes; lanes &= nearLanes(gaps)) {
      testTriangle(static_cast<unsigned>(leaf.first + __builtin_ctz(lanes)), x, nearest);
      lanes &= lanes - 1;
    }
  }
  /// Lanes whose lower bound is within the limit.
  ADAPTIVE_BVH_INLINE unsigned nearLanes(const Float4& bound) const {
    if (!isTaken(Shortcut::SinglePrecision)) return 15;
    return 15 & ~float4::bits((bound > float4::all(0)) & (bound * bound > float4::all(limit_)));
  }
  /// Starts again from the root after many tests, with bounds along the line to the body.
  template <typename IsOver>
  void searchAlong(const fcl::Vector3d& x, Nearest& nearest, const IsOver& isOver) {
    const Leased<LineToCore> line;
    const auto near = [&](int node) -> unsigned {
      return float4::bits(squaredGaps(tree_.nodes()[node].boxes) <= float4::all(limit_));
    };
    line->look(mesh_, near, {x}, (x - tree_.origin()).stableNormalized());
    const auto limitOf = [&]() -> float {
      return nearest.triangle < 0 ? std::numeric_limits<float>::max()
                                  : line->limitOf(nearest.point);
    };
    float limit = limitOf();
    walk_.nearestFirst(
        [&](const WideNode& node) -> Float4 { return line->keys(node); }, [&] { return limit; },
        [&](const WideNode& leaf, unsigned lanes, const Float4&) {
          for (; lanes; lanes &= lanes - 1)
            testTriangle(static_cast<unsigned>(leaf.first + __builtin_ctz(lanes)), x, nearest);
          limit = limitOf();
          return isOver();
        });
  }
  void testTriangle(unsigned leaf_index, const fcl::Vector3d& x, Nearest& nearest) {
    ++tests_;
    const Int4& v = tree_.corners(leaf_index);
    const double before = nearest.distance;
    tryFace(x, {unsigned(v[0]), unsigned(v[1]), unsigned(v[2])}, v[3], nearest);
    if (nearest.distance < before) setLimit(nearest.distance);
  }

  static constexpr double kFar = 1e15;  // its square is within single precision
  static constexpr double kError = 1. / (1 << 22);
  static constexpr double kFarPoint = 32;         // times the size of the body
  static constexpr std::size_t kManyTests = 256;  // of triangles
  static constexpr std::size_t kPerTest = 32;     // positions read in the time of a test
  /// Upper bound of the summed errors of the distances of two triangles, in the tree's units.
  static constexpr double kRounding = 0x1p-45;

  const MeshState& mesh_;
  const WideTree& tree_;
  TreeWalk walk_;
  Float4 point_[3], error_;     ///< the point, and its error, in the tree's coordinates
  float limit_ = 0;             ///< boxes with larger squaredGaps are skipped
  std::size_t tests_ = 0;       ///< of triangles in double precision
  std::size_t most_tests_ = 0;  ///< after this number, searchAlong replaces the walk by boxes
  double rounding_ = 0;         ///< error of the difference of two distances, in the mesh's units
};

/// Finds the nearest triangles of a sequence of points. The triangle of each point is an upper
/// bound for the next one, so sequences of near points are fast.
class NearestInTurn {
 public:
  using Nearest = PointSearch::Nearest;

  explicit NearestInTurn(const MeshState& mesh) : search_(mesh) {}

  /// Returns the nearest triangle within `limit`, or none: the index -1.
  Nearest operator()(const fcl::Vector3d& x,
                     double limit = std::numeric_limits<double>::infinity()) {
    Nearest nearest;
    nearest.distance = nearest.limit = limit;
    if (last_ >= 0) search_.tryTriangle(x, last_, nearest);
    search_.search(x, nearest);
    if (nearest.triangle >= 0) last_ = nearest.triangle;
    return nearest;
  }

 private:
  PointSearch search_;
  int last_ = -1;  ///< the last point's nearest triangle; -1: none
};

}  // namespace adaptive_bvh
