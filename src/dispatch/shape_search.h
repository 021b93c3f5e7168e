#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "adaptive_bvh/penetration.h"
#include "base/frame_change.h"
#include "base/leased.h"
#include "base/rigid.h"
#include "boxes/tree_walk.h"
#include "dispatch/shape_triangles.h"
#include "query/nearest/line_to_core.h"
#include "query/placed_mesh.h"
#include "query/points/point_search.h"

namespace adaptive_bvh {

/// Lower bounds of the distances of a four-wide tree's boxes from a shape's core (ShapeCore): the
/// larger of the gaps in the core's axes and in the tree's axes. docs/bounds.md, 13.
class ShapeInTree {
 public:
  ShapeInTree(const ShapeCore& core, const fcl::Transform3d& shape_tf, const WideTree& tree,
              const fcl::Transform3d& mesh_tf) {
    const double scale = tree.scale();
    const fcl::Matrix3d to_core = core.axes.transpose() * shape_tf.linear().transpose();
    const fcl::Matrix3d rotation =  // from the tree's axes to the core's
        to_core * mesh_tf.linear() * tree.toBody().transpose() / scale;
    const fcl::Vector3d origin = mesh_tf.linear() * tree.origin() + mesh_tf.translation();
    const fcl::Vector3d in_core = to_core * (origin - shape_tf.translation());  // the tree's origin
    // The origin is the core's point nearest to the tree: there single precision is most accurate.
    const fcl::Vector3d nearest = in_core.cwiseMax(core.low).cwiseMin(core.high);
    const fcl::Vector3d translation = scale * (in_core - nearest);
    const double coordinates =
        tree.origin().lpNorm<1>() + 6 / scale + mesh_tf.translation().lpNorm<1>() +
        shape_tf.translation().lpNorm<1>() + nearest.lpNorm<1>() + core.radius;
    const double double_error = 16 * scale * coordinates * std::numeric_limits<double>::epsilon();
    const double margin = kUnit * (160 + 32 * translation.lpNorm<1>()) + double_error;
    is_precise_ = margin < 1e6 && !core.low.hasNaN() && !core.high.hasNaN();
    if (!is_precise_) return;
    change_ = FrameChange(rotation, translation, margin);
    const fcl::Vector3d low = scale * (core.low - nearest), high = scale * (core.high - nearest);
    setBox(low, high, in_core_);
    if (low.allFinite() && high.allFinite()) {
      const fcl::Vector3d center = rotation.transpose() * ((low + high) / 2 - translation);
      const fcl::Vector3d half =
          rotation.transpose().cwiseAbs() * (high - low) / 2 + fcl::Vector3d::Constant(margin);
      setBox(center - half, center + half, in_tree_);
    } else {
      setBox(fcl::Vector3d::Constant(-kMost), fcl::Vector3d::Constant(kMost), in_tree_);
    }
    scale_ = scale;
    radius_ = core.radius;
  }

  /// Whether single precision can represent the relative placement. If not, there are no bounds.
  bool isPrecise() const { return is_precise_; }

  /// Lower bounds of the squared distances of four boxes to the core.
  ADAPTIVE_BVH_INLINE Float4 squaredGaps(const Boxes4& boxes) const {
    return float4::upper<Float4>(adaptive_bvh::squaredGaps<0>(boxes, in_tree_),
                                 adaptive_bvh::squaredGaps<0>(change_(boxes), in_core_));
  }
  /// Upper bound of `squaredGaps` for boxes of triangles at most `distance` from the shape.
  float squaredLimit(double distance) const {
    const double limit = (distance + radius_) * scale_;
    return limit < 0 ? -1 : squaredGapOf(limit);
  }

 private:
  static constexpr double kUnit = 1. / (1 << 24);
  /// Larger than all coordinates; single precision can represent its square.
  static constexpr double kMost = 1e18;

  /// Sets all lanes to one box, rounded outward.
  static void setBox(const fcl::Vector3d& low, const fcl::Vector3d& high, Boxes4& boxes) {
    const auto end = [](double x, double outward) -> Float4 {
      x += outward * 2 * kUnit * std::abs(x);
      return float4::all(static_cast<float>(std::max(-kMost, std::min(x, kMost))));
    };
    for (int k = 0; k < 3; ++k) {
      boxes.low[k] = end(low[k], -1);
      boxes.high[k] = end(high[k], 1);
    }
  }

  FrameChange change_;        ///< from the tree's coordinates to the core's
  Boxes4 in_core_, in_tree_;  ///< the core's box in all lanes, in its own and in the tree's axes
  double scale_ = 1, radius_ = 0;  ///< of the tree's coordinates; of the shape around its core
  bool is_precise_;
};

/// Finds triangles near a shape by the mesh's four-wide tree. If single precision cannot represent
/// the relative placement, every triangle is tested.
class MeshShapeSearch final : public ShapeSearch {
 public:
  /// `core`: that of the shape.
  MeshShapeSearch(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core)
      : ShapeSearch(QueryTriangles(mesh), shape),
        mesh_(mesh),
        core_(core),
        to_mesh_(mesh.tf, shape.tf),
        in_tree_(core, shape.tf, mesh.tree(), mesh.tf) {}

  /// Visits triangles in the order of the leaves.
  void touching(const Test& test) const override {
    if (!in_tree_.isPrecise()) return testAll(test);
    const Float4 limit = float4::all(in_tree_.squaredLimit(0));
    TreeWalk(mesh_.tree())
        .visit(
            [&](const Boxes4& boxes) { return float4::bits(in_tree_.squaredGaps(boxes) <= limit); },
            [&](unsigned leaf_index) -> bool { return test(mesh_.tree().triangle(leaf_index)); });
  }

  /// Visits nearest boxes first; after many tests, by bounds along the line between nearest points.
  void nearest(const DistanceQuery& query, const PointPair& points,
               const Test& test) const override {
    if (!in_tree_.isPrecise()) return testAll(test);
    const auto keysOf = [&](const WideNode& node) -> Float4 {
      return in_tree_.squaredGaps(node.boxes);
    };
    const auto limit = [&]() -> float { return in_tree_.squaredLimit(limitOf(query)); };
    int tests = 0, max_tests = maxBoxTests();
    bool is_over = false;
    const auto testSome = [&](int triangle) {
      is_over = test(triangle);
      return is_over || ++tests >= max_tests;
    };
    if (!walk(keysOf, limit, testSome) || is_over) return;
    const bool is_known = points.first != points.second;  // false: no triangle within the limit
    if (!is_known || !core_.isBounded() || !triangles.rounding(points).isClear(limitOf(query)))
      return (void)walk(keysOf, limit, test);
    if (improve(query, points, test)) return;
    const Leased<LineToCore> line;
    const auto isNear = [&, most = float4::all(limit())](int node) -> unsigned {
      return float4::bits(keysOf(mesh_.tree().nodes()[node]) <= most);
    };
    const Float4 farther = float4::all(std::numeric_limits<float>::max());
    const auto keysAlong = [&](const WideNode& node) -> Float4 {
      return keysOf(node) <= float4::all(limit()) ? line->keys(node) : farther;
    };
    const auto limitAlong = [&]() -> float {
      return line->limitOf(triangles.rounding(points).below(limitOf(query)) + core_.radius);
    };
    do {
      max_tests *= 4;
      prepareLine(isNear, points, *line);
    } while (walk(keysAlong, limitAlong, testSome) && !is_over);
  }

  void boxAround(fcl::Boxd& box, fcl::Transform3d& box_tf) const override {
    const fcl::AABBd& local = mesh_.bounds().aabb_local;
    box = fcl::Boxd(fcl::Vector3d(local.max_ - local.min_));
    box_tf = mesh_.tf;
    box_tf.translation() = mesh_.tf * local.center();
  }

 private:
  void testAll(const Test& test) const {
    for (int i = 0; i < mesh_.mesh.numTriangles(); ++i)
      if (test(i)) return;
  }
  /// Visits triangles by increasing keys, up to limitOfKeys(). Returns whether a test was true.
  template <typename Keys, typename Limit, typename TestOfKeys>
  bool walk(const Keys& keysOf, const Limit& limitOfKeys, const TestOfKeys& test) const {
    float limit = limitOfKeys();
    return TreeWalk(mesh_.tree())
        .nearestFirst(
            keysOf, [&] { return limit; },
            [&](const WideNode& leaf, unsigned lanes, const Float4& keys) {
              for (; lanes; lanes &= float4::bits(keys <= float4::all(limit))) {
                const int lane = leastLane(keys, lanes);
                lanes &= ~(1u << lane);
                if (test(triangleOf(leaf, lane))) return true;
                limit = limitOfKeys();
              }
              return false;
            });
  }
  /// Number of tests which shows that boxes do not separate the triangles; fewer from far away.
  int maxBoxTests() const {
    constexpr double kFar = 32;  // radii of the mesh
    constexpr int kTests = 1024, kTestsFromFar = 192;
    const double distance = (nearestOfCore() - mesh_.tree().origin()).stableNorm();
    const bool is_far = distance > kFar * mesh_.bounds().aabb_radius;
    const auto positions = static_cast<int>(mesh_.tree().slots().used());  // LineToCore reads these
    return is_far ? kTestsFromFar + positions / 128 : kTests + positions / 32;
  }
  /// Lowers the distance in a few steps: tests the mesh's triangle nearest to the shape's nearest
  /// point, or to its farthest point towards the mesh. Returns whether a test was true.
  bool improve(const DistanceQuery& query, const PointPair& points, const Test& test) const {
    constexpr int kMostSteps = 4;
    PointSearch search(mesh_.mesh);
    bool is_over = false;
    const auto isNearer = [&](const fcl::Vector3d& x) {
      const double before = limitOf(query);
      PointSearch::Nearest nearest;
      search.search(to_mesh_(x), nearest);
      is_over = test(nearest.triangle);
      return !is_over && limitOf(query) < before;
    };
    for (int step = 0; step < kMostSteps; ++step)
      if (!isNearer(points.second) &&
          (is_over || !isNearer(triangles.shape().support(points.first - points.second))))
        break;
    return is_over;
  }
  /// Prepares bounds along the line between the nearest points so far.
  void prepareLine(const NearLanes& near, const PointPair& points, LineToCore& line) const {
    const fcl::Matrix3d to_mesh = to_mesh_.R * core_.axes;
    const fcl::Vector3d half = (core_.high - core_.low) / 2,
                        middle = core_.axes * fcl::Vector3d((core_.low + core_.high) / 2);
    line.look(mesh_.mesh, near, {to_mesh_(middle), to_mesh * fcl::Matrix3d(half.asDiagonal())},
              (to_mesh_.R * (points.second - points.first)).stableNormalized());
  }
  /// The core's point that is nearest to the tree's origin, in the mesh's frame.
  fcl::Vector3d nearestOfCore() const {
    const fcl::Vector3d in_core =
        core_.axes.transpose() * to_mesh_.R.transpose() * (mesh_.tree().origin() - to_mesh_.T);
    return to_mesh_(fcl::Vector3d(core_.axes * in_core.cwiseMax(core_.low).cwiseMin(core_.high)));
  }
  /// The lane in `lanes` with the least gap.
  static int leastLane(const Float4& gaps, unsigned lanes) {
    int least = __builtin_ctz(lanes);
    for (; lanes; lanes &= lanes - 1)
      if (gaps[__builtin_ctz(lanes)] < gaps[least]) least = __builtin_ctz(lanes);
    return least;
  }
  int triangleOf(const WideNode& leaf, int lane) const {
    return mesh_.tree().triangle(static_cast<unsigned>(leaf.first + lane));
  }

  const PlacedMesh& mesh_;
  const ShapeCore core_;
  const RelativePlacement to_mesh_;  ///< from the shape's frame to the mesh's
  const ShapeInTree in_tree_;
};

/// Overwrites the result with a mesh's vertices at most `margin` from a shape, or inside it.
void findVertexContacts(const PlacedMesh& mesh, const ShapeSolid& shape,
                        const fcl::Transform3d& shape_tf, double margin, VertexContacts& result);

/// Whether a mesh is at most `distance` from a shape. `core`: that of the shape.
bool isNearer(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core,
              double distance);

}  // namespace adaptive_bvh
