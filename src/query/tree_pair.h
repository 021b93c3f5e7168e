#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "adaptive_bvh/self_collision.h"
#include "base/frame_change.h"
#include "base/leased.h"
#include "base/rigid.h"
#include "base/shortcut.h"
#include "boxes/wide_search.h"
#include "boxes/wide_tree.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// Upper bound of the differences of corners of two triangles next to each other. Coordinates in a
/// tree are below 2.
constexpr double kLongest = 12;

/// Placement of the second tree in the first one's coordinates, if both are the same tree or have
/// the same coordinates.
class SameFrame {
 public:
  static constexpr bool kIsIdentity = true;

  SameFrame() = default;
  /// `apart`: largest error of the second tree's coordinates and placement.
  explicit SameFrame(double apart) : apart_(static_cast<float>(apart)) {}

  float error() const { return WideTree::kPositionError + apart_; }
  /// Error of a position and its residual together.
  float preciseError() const { return 2 * WideTree::kResidualError + apart_; }
  static double longest() { return kLongest; }
  static const FrameChange* change() { return nullptr; }
  const Vector4x3& operator()(const Vector4x3& points) const { return points; }

 private:
  float apart_ = 0;
};

/// Maps the second tree's coordinates to the first's: y = M y2 + t. A box becomes its enclosing
/// box, enlarged by the errors of both trees and of this computation.
class RelativeFrame {
 public:
  static constexpr bool kIsIdentity = false;
  /// `to_first`: maps the second mesh's frame to the first's.
  RelativeFrame(const WideTree& first, const WideTree& second, const RelativePlacement& to_first)
      : RelativeFrame(first.coordinates(), second.coordinates(), to_first) {}
  RelativeFrame(const BodyCoordinates& first, const BodyCoordinates& second,
                const RelativePlacement& to_first) {
    const double ratio = first.scale / second.scale;
    m_ = first.to_body * to_first.R * (second.axes() / second.scale);
    t_ = first.to_body * (to_first.R * second.origin + to_first.T - first.origin);
    // Coordinates in either tree are below 2.
    in_double_ = 4 * first.scale *
                 (3 * (second.origin.template lpNorm<1>() + 6 / second.scale) +
                  to_first.T.template lpNorm<1>() + first.origin.template lpNorm<1>()) *
                 std::numeric_limits<double>::epsilon();
    const double t_sum = t_.template lpNorm<1>();
    error_ = kUnit * (6 * 4 * ratio + 4 * t_sum) +
             (1 + 2 * ratio) * static_cast<double>(WideTree::kPositionError) + in_double_;
    longest_ = std::max(1., ratio);
    // Sums of three coordinates are below 6.
    apart_ = 2 * (6 * (m_ - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff() +
                  t_.cwiseAbs().maxCoeff()) +
             in_double_;
    is_precise_ = error_ < 1e6 && ratio > 1e-6 && ratio < 1e6;
    is_in_range_ = ratio > kLeast && ratio < kMost && t_sum < kMost;
    change_ = FrameChange(m_, t_, 2 * error_ + 16 * kUnit * (4 * ratio + t_sum));
  }

  /// Whether single precision can express both trees.
  bool isPrecise() const { return is_precise_; }
  /// Whether squared gaps of boxes are within the range of single precision, and empty boxes stay
  /// far from all others.
  bool isInRange() const { return is_in_range_; }
  /// Whether both trees have the same coordinates, up to the margin of their boxes.
  bool isSame() const { return apart_ <= kUnit; }
  SameFrame same() const { return SameFrame(apart_); }
  /// Error of a component of a point of either mesh, in the first's body units.
  float error() const { return static_cast<float>(error_); }
  /// Error of values computed in double precision from the positions.
  float preciseError() const { return static_cast<float>(in_double_); }
  /// Upper bound of the differences of corners of two triangles next to each other, in the first's
  /// body units.
  double longest() const { return kLongest * longest_; }

  const FrameChange* change() const { return &change_; }
  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const { return change_(boxes); }
  ADAPTIVE_BVH_INLINE Vector4x3 operator()(const Vector4x3& points) const {
    return change_(points);
  }
  const fcl::Matrix3d& m() const { return m_; }
  const fcl::Vector3d& t() const { return t_; }

 private:
  static constexpr double kUnit = 1. / (1 << 24);
  static constexpr double kLeast = 1e-10, kMost = 1e15;

  FrameChange change_;
  fcl::Matrix3d m_;
  fcl::Vector3d t_;
  double error_, in_double_, longest_, apart_;
  bool is_precise_, is_in_range_;
};

/// The trees of two placed meshes of one query. Their coordinates differ in general, and boxes grow
/// when they are rotated from one to the other. If a search is large enough for it to pay, the
/// smaller tree is refitted in the other's coordinates; its nodes stay the same.
class TreePair {
 public:
  TreePair(const PlacedMesh& first, const PlacedMesh& second)
      : placed1_(first),
        placed2_(second),
        to_first_(first.tf, second.tf),
        first_(&first.tree()),
        second_(&second.tree()),
        frame_(*first_, *second_, to_first_) {}

  const WideTree& first() const { return *first_; }
  const WideTree& second() const { return *second_; }
  /// Maps the second tree's coordinates to the first's.
  const RelativeFrame& frame() const { return frame_; }
  const RelativePlacement& toFirst() const { return to_first_; }
  const PlacedMesh& firstMesh() const { return placed1_; }
  const PlacedMesh& secondMesh() const { return placed2_; }

  /// Cost of an alignment, in box tests.
  long costOfAlignment() const {
    return static_cast<long>(std::min(placed1_.mesh.numTriangles(), placed2_.mesh.numTriangles())) /
           2;
  }
  /// Gives both trees the same coordinates. Does nothing if they have them, or if the coordinates
  /// of the mesh with more triangles have no room for the other mesh, which is then much larger or
  /// far away.
  void align() {
    if (frame_.isSame() || !isTaken(Shortcut::Alignment)) return;
    const bool is_first_smaller = placed1_.mesh.numTriangles() < placed2_.mesh.numTriangles();
    const PlacedMesh &smaller = is_first_smaller ? placed1_ : placed2_,
                     &larger = is_first_smaller ? placed2_ : placed1_;
    const RelativePlacement to_larger(larger.tf, smaller.tf);
    const BodyCoordinates& common = larger.tree().coordinates();
    if (!holds(common, to_larger, smaller)) return;
    // The larger mesh's coordinates in the smaller one's frame.
    const fcl::Matrix3d axes = orthonormal(to_larger.R.transpose() * common.axes());
    const BodyCoordinates of_smaller(axes, to_larger.R.transpose() * (common.origin - to_larger.T),
                                     common.scale);
    WideTree& anew = *aligned_.emplace();
    anew.assignTopology(smaller.tree());
    anew.refit(smaller.mesh.vertices.data(), of_smaller, TaskPool(smaller.mesh.query_threads));
    (is_first_smaller ? first_ : second_) = &anew;
    frame_ = RelativeFrame(*first_, *second_, to_first_);
  }

 private:
  /// Whether a mesh fits into another's coordinates, which are below 2.
  static bool holds(const BodyCoordinates& common, const RelativePlacement& to_common,
                    const PlacedMesh& mesh) {
    constexpr double kLargest = 2 - 1. / (1 << 10);
    constexpr double kSlack = 1 + 1. / (1 << 16);  // for the rounding of the radius
    const fcl::Vector3d middle = common(to_common(mesh.bounds().aabb_center));
    const double radius = mesh.bounds().aabb_radius * kSlack;
    return middle.cwiseAbs().maxCoeff() + common.scale * radius < kLargest;
  }

  const PlacedMesh &placed1_, &placed2_;
  const RelativePlacement to_first_;
  const WideTree *first_, *second_;
  RelativeFrame frame_;
  std::optional<Leased<WideTree>> aligned_;
};

/// Two triangles, one of each mesh, by their indices.
struct TrianglePair {
  unsigned first, second;
};

/// Two placed meshes.
struct PairOfMeshes {
  template <typename S>
  PairOfMeshes(const DeformableMesh<S>& mesh1, const fcl::Transform3<S>& tf1,
               const DeformableMesh<S>& mesh2, const fcl::Transform3<S>& tf2)
      : PairOfMeshes(PlacedMesh(mesh1, tf1), PlacedMesh(mesh2, tf2)) {}
  PairOfMeshes(const PlacedMesh& mesh1, const PlacedMesh& mesh2)
      : first(mesh1), second(mesh2), to_first(mesh1.tf, mesh2.tf) {}

  /// Gap of two triangles; triangle 0 replaces indices that do not exist.
  TriangleGap gap(const TrianglePair& triangles) const {
    TrianglePoints<double> q = corners(second, triangles.second);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return gapOf(corners(first, triangles.first), q);
  }

  const PlacedMesh first, second;
  const RelativePlacement to_first;

 private:
  static TrianglePoints<double> corners(const PlacedMesh& mesh, unsigned triangle) {
    return mesh.pointsOf(triangle < unsigned(mesh.mesh.numTriangles()) ? triangle : 0u);
  }
};

/// The input of a search for pairs of triangles.
struct PairInput {
  /// Two meshes. Pairs farther apart than `largest_distance` do not count.
  explicit PairInput(const TreePair& trees, double largest_distance = 0)
      : first(trees.firstMesh()),
        second(trees.secondMesh()),
        tree1(trees.first()),
        tree2(trees.second()),
        to_first(trees.toFirst()),
        distance(largest_distance) {}
  /// One mesh with itself: each pair is found once.
  PairInput(const PlacedMesh& mesh, NeighbourFilter left_out, double largest_distance = 0)
      : first(mesh),
        second(mesh),
        tree1(mesh.tree()),
        tree2(mesh.tree()),
        filter(left_out),
        distance(largest_distance) {}

  const PlacedMesh &first, &second;
  const WideTree &tree1, &tree2;
  const RelativePlacement to_first;  ///< maps the second mesh's frame to the first's
  const NeighbourFilter filter = NeighbourFilter::None;
  const double distance;
  const FlatPatches* flat = nullptr;  ///< for one mesh: nodes to leave out

  /// The trees for WideSearch. `frame`: SameFrame or RelativeFrame.
  template <typename Frame>
  WideTrees trees(const Frame& frame) const {
    return {tree1.nodes(),
            tree2.nodes(),
            tree1.depth() + tree2.depth(),
            BoxFrame(frame.change(), distance * tree1.scale()),
            &first == &second,
            flat};
  }
  /// Corners of a triangle in the first mesh's frame, by its index in the order of the leaves.
  TrianglePoints<double> pointsOfFirst(unsigned leaf_index) const {
    return first.pointsAt(leaf_index);
  }
  TrianglePoints<double> pointsOfSecond(unsigned leaf_index) const {
    TrianglePoints<double> q = second.pointsAt(leaf_index);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return q;
  }
};

/// Aligns the trees if more than kPairsThatPay pairs of boxes are within `distance`, so that it
/// pays.
inline void alignIfNear(TreePair& trees, double distance) {
  constexpr int kPairsThatPay = 64;
  if (!trees.frame().isPrecise()) return;
  const PairInput input(trees, distance);
  if (WideSearch(input.trees(trees.frame())).hasMorePairs(kPairsThatPay)) trees.align();
}

/// Calls search(frame) with the placement of the second tree in the first, a SameFrame or
/// RelativeFrame. Calls testAll() instead if single precision cannot express it.
template <typename Search, typename TestAll>
void searchInFrame(const TreePair& trees, const Search& search, const TestAll& testAll) {
  if (!trees.frame().isPrecise())
    testAll();
  else if (trees.frame().isSame())
    search(trees.frame().same());
  else
    search(trees.frame());
}

/// Whether the bounding spheres of two meshes are farther apart than `distance`.
inline bool areBallsFarther(const PlacedMesh& first, const PlacedMesh& second,
                            const RelativePlacement& to_first, double distance) {
  constexpr double kSlack = 1 + 1e-6;
  const auto &a = first.bounds(), &b = second.bounds();
  const fcl::Vector3d middle = a.aabb_center;
  const double apart = (to_first(b.aabb_center) - middle).stableNorm();
  const double radii = double(a.aabb_radius) + double(b.aabb_radius);
  return apart > (distance + radii) * kSlack + 1e-12 * to_first.T.norm();
}

}  // namespace adaptive_bvh
