#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/frame_change.h"
#include "base/leased.h"
#include "base/rigid.h"
#include "base/shortcut.h"
#include "boxes/wide_search.h"
#include "boxes/wide_tree.h"
#include "query/pair_filter.h"
#include "query/placed_mesh.h"
#include "triangles/exact_nearness.h"
#include "triangles/triangle_gap.h"

// Two meshes, or one with itself, as the input of a query: the map between their trees' coordinates
// (SameFrame, RelativeFrame), aligned trees (TreePair), meshes and poses (PairOfMeshes, PairInput).
// Body units are those of a tree's coordinates, which are below 2. Errors: docs/bounds.md, 13.
namespace adaptive_bvh {

/// Upper bound of the distance of two corners of a tree, in body units: three differences below 4.
constexpr double kLongest = 12;

/// The map of the second tree's coordinates to the first's if both are the same: the identity.
class SameFrame {
 public:
  static constexpr bool kIsIdentity = true;

  SameFrame() = default;
  /// For two meshes. `deviation`: upper bound of |y - y2| in each component of the exact map.
  explicit SameFrame(double deviation) : deviation_(static_cast<float>(deviation)) {}

  /// Error of a component of a position.
  float error() const { return WideTree::kPositionError + deviation_; }
  /// Error of a component of a position with its residual.
  float preciseError() const { return 2 * WideTree::kResidualError + deviation_; }
  static double longest() { return kLongest; }
  static const FrameChange* change() { return nullptr; }
  const Vector4x3& operator()(const Vector4x3& points) const { return points; }

 private:
  float deviation_ = 0;
};

/// Maps the second tree's coordinates y2 to the first's, y = M y2 + t, in single precision. A box
/// is mapped to the bounding box of its image, enlarged by the errors of both trees and of the map.
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
    // The rounding error in double precision. Coordinates in either tree are below 2.
    precise_error_ = 4 * first.scale *
                     (3 * (second.origin.lpNorm<1>() + 6 / second.scale) + to_first.T.lpNorm<1>() +
                      first.origin.lpNorm<1>()) *
                     std::numeric_limits<double>::epsilon();
    const double t_sum = t_.lpNorm<1>();
    error_ = kUnit * (6 * 4 * ratio + 4 * t_sum) +
             (1 + 2 * ratio) * static_cast<double>(WideTree::kPositionError) + precise_error_;
    largest_ratio_ = std::max(1., ratio);
    // Upper bound of |y - y2| in each component, with slack. Sums of three coordinates are below 6.
    deviation_ = 2 * (6 * (m_ - fcl::Matrix3d::Identity()).cwiseAbs().maxCoeff() +
                      t_.cwiseAbs().maxCoeff()) +
                 precise_error_;
    is_precise_ = error_ < 1e6 && ratio > 1e-6 && ratio < 1e6;
    is_in_range_ = ratio > kLeast && ratio < kMost && t_sum < kMost;
    change_ = FrameChange(m_, t_, 2 * error_ + 16 * kUnit * (4 * ratio + t_sum));
  }

  /// Whether single precision suffices to compare boxes and points of both trees.
  bool isPrecise() const { return is_precise_; }
  /// Whether single precision has the range for squared gaps of boxes, also of empty ones.
  bool isInRange() const { return is_in_range_; }
  /// Whether the coordinates are the same up to a part of the boxes' margin. Then use same().
  bool isSame() const { return deviation_ <= kUnit; }
  SameFrame same() const { return SameFrame(deviation_); }
  /// Error of a component of a position of either tree, in the first's body units.
  float error() const { return static_cast<float>(error_); }
  /// Error of a component that is computed in double precision from the mesh's own positions.
  float preciseError() const { return static_cast<float>(precise_error_); }
  /// Upper bound of the distance of two corners if boxes overlap, in the first's body units.
  double longest() const { return kLongest * largest_ratio_; }

  const FrameChange* change() const { return &change_; }
  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const { return change_(boxes); }
  ADAPTIVE_BVH_INLINE Vector4x3 operator()(const Vector4x3& points) const {
    return change_(points);
  }
  const fcl::Matrix3d& m() const { return m_; }
  const fcl::Vector3d& t() const { return t_; }

 private:
  static constexpr double kUnit = 1. / (1 << 24);  // rounding error in single precision, relative
  static constexpr double kLeast = 1e-10, kMost = 1e15;  // limits of isInRange

  FrameChange change_;
  fcl::Matrix3d m_;  ///< a rotation times the ratio of the scales
  fcl::Vector3d t_;
  double error_, precise_error_, largest_ratio_, deviation_;
  bool is_precise_, is_in_range_;
};

/// The trees of two placed meshes. Their coordinates differ in general, and boxes grow when they
/// are rotated from one to the other. `align` therefore replaces one tree by a copy in the
/// coordinates of the other, with the same nodes and links. Only a large search is worth its cost.
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

  /// Cost of `align`, in tests of two boxes.
  long costOfAlignment() const {
    return std::min(placed1_.mesh.numTriangles(), placed2_.mesh.numTriangles()) / 2;
  }
  /// Refits a copy of the tree with fewer triangles in the coordinates of the other. Does nothing
  /// if both have the same coordinates already, or if its mesh is outside of the other's range.
  void align() {
    if (frame_.isSame() || !isTaken(Shortcut::Alignment)) return;
    const bool is_first_smaller = placed1_.mesh.numTriangles() < placed2_.mesh.numTriangles();
    const PlacedMesh &smaller = is_first_smaller ? placed1_ : placed2_,
                     &larger = is_first_smaller ? placed2_ : placed1_;
    const RelativePlacement to_larger(larger.tf, smaller.tf);
    const BodyCoordinates& common = larger.tree().coordinates();
    if (!fits(smaller, to_larger, common)) return;
    // The same coordinates, as seen in the smaller mesh's frame.
    const fcl::Matrix3d axes = orthonormal(to_larger.R.transpose() * common.axes());
    const BodyCoordinates in_smaller(axes, to_larger.R.transpose() * (common.origin - to_larger.T),
                                     common.scale);
    WideTree& copy = *aligned_.emplace();
    copy.assignTopology(smaller.tree());
    copy.refit(smaller.mesh.vertices.data(), in_smaller,
               TaskPool(queryThreads(smaller.mesh, larger.mesh)));
    (is_first_smaller ? first_ : second_) = &copy;
    frame_ = RelativeFrame(*first_, *second_, to_first_);
  }

 private:
  /// Whether the bounding sphere of a mesh has components below 2 in the coordinates `common` of
  /// another mesh. `to_common`: maps the mesh's frame to that of the other mesh.
  static bool fits(const PlacedMesh& mesh, const RelativePlacement& to_common,
                   const BodyCoordinates& common) {
    constexpr double kLargest = 2 - 1. / (1 << 10);
    constexpr double kSlack = 1 + 1. / (1 << 16);  // for the rounding of the radius
    const fcl::Vector3d middle = common(to_common(mesh.bounds().aabb_center));
    const double radius = mesh.bounds().aabb_radius * kSlack;
    return middle.cwiseAbs().maxCoeff() + common.scale * radius < kLargest;
  }

  const PlacedMesh &placed1_, &placed2_;
  const RelativePlacement to_first_;  ///< maps the second mesh's frame to the first's
  const WideTree *first_, *second_;   ///< the meshes' own trees, or one of them is in `aligned_`
  RelativeFrame frame_;
  std::optional<Leased<WideTree>> aligned_;  ///< the copy, in memory of the thread
};

/// Two triangles, one of each mesh, by their indices in the meshes.
struct TrianglePair {
  unsigned first, second;
};

/// Two placed meshes, and the placement of one relative to the other.
struct PairOfMeshes {
  PairOfMeshes(const DeformableMesh& mesh1, const fcl::Transform3d& tf1,
               const DeformableMesh& mesh2, const fcl::Transform3d& tf2)
      : PairOfMeshes(PlacedMesh(mesh1, tf1), PlacedMesh(mesh2, tf2)) {}
  PairOfMeshes(const PlacedMesh& mesh1, const PlacedMesh& mesh2)
      : first(mesh1), second(mesh2), to_first(mesh1.tf, mesh2.tf) {}

  /// Returns the nearest points and the distance of two triangles, in the first mesh's frame.
  /// Triangle 0 replaces an index that does not exist.
  TriangleGap gap(const TrianglePair& triangles) const {
    return gapOf(corners(first, triangles.first), inFirst(triangles.second));
  }
  /// Whether two triangles are at most `distance` apart.
  bool isNear(const TrianglePair& triangles, double distance) const {
    const TrianglePoints p = corners(first, triangles.first), q = inFirst(triangles.second);
    const ExactNearness nearness(distance,
                                 first.bounds().aabb_radius + second.bounds().aabb_radius);
    return nearness.areNear(gapOf(p, q).distance, p, q);
  }

  const PlacedMesh first, second;
  const RelativePlacement to_first;  ///< maps the second mesh's frame to the first's

 private:
  static TrianglePoints corners(const PlacedMesh& mesh, unsigned triangle) {
    return mesh.pointsOf(triangle < unsigned(mesh.mesh.numTriangles()) ? triangle : 0u);
  }
  TrianglePoints inFirst(unsigned triangle) const {
    TrianglePoints q = corners(second, triangle);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return q;
  }
};

/// The input of a search for pairs of triangles: two meshes, or one with itself. A view: the
/// arguments of the constructors must outlive it.
struct PairInput {
  /// Two meshes. Finds pairs within `largest_distance`. `trees` must not be aligned afterwards.
  explicit PairInput(const TreePair& trees, double largest_distance = 0)
      : first(trees.firstMesh()),
        second(trees.secondMesh()),
        tree1(trees.first()),
        tree2(trees.second()),
        to_first(trees.toFirst()),
        distance(largest_distance) {}
  /// One mesh with itself. Finds each pair once, without the neighbours `neighbours`.
  PairInput(const PlacedMesh& mesh, const LeftOut& neighbours, double largest_distance = 0)
      : first(mesh),
        second(mesh),
        tree1(mesh.tree()),
        tree2(mesh.tree()),
        left_out(neighbours),
        distance(largest_distance) {}

  const PlacedMesh &first, &second;
  const WideTree &tree1, &tree2;
  const RelativePlacement to_first;  ///< maps the second mesh's frame to the first's
  const LeftOut left_out = {};
  const double distance;              ///< in the meshes' unit
  const FlatPatches* flat = nullptr;  ///< for one mesh: nodes without pairs; or null
  MovedNodes moved = {};              ///< the pairs of nodes to search, if not all

  /// Returns the input of WideSearch. `frame`: SameFrame or RelativeFrame, which must outlive it.
  template <typename Frame>
  WideTrees trees(const Frame& frame) const {
    return {tree1.nodes(),
            tree2.nodes(),
            tree1.depth() + tree2.depth(),
            BoxFrame(frame.change(), distance * tree1.scale()),
            &first == &second,
            flat,
            moved};
  }
  /// Returns the corners, in the first mesh's frame, of a triangle of the first or of the second
  /// mesh. `leaf_index`: its index in the order of the leaves of its tree.
  TrianglePoints pointsOfFirst(unsigned leaf_index) const { return first.pointsAt(leaf_index); }
  TrianglePoints pointsOfSecond(unsigned leaf_index) const {
    TrianglePoints q = second.pointsAt(leaf_index);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return q;
  }
};

/// Aligns the trees if so many pairs of nodes are within `distance` that this saves time.
inline void alignIfNear(TreePair& trees, double distance) {
  constexpr int kPairsThatPay = 64;
  if (!trees.frame().isPrecise()) return;
  const PairInput input(trees, distance);
  if (WideSearch(input.trees(trees.frame())).hasMorePairs(kPairsThatPay)) trees.align();
}

/// Calls search(frame) with the map of the second tree's coordinates to the first's, a SameFrame or
/// RelativeFrame. Calls testAll() instead if single precision does not suffice (isPrecise).
template <typename Search, typename TestAll>
void searchInFrame(const TreePair& trees, const Search& search, const TestAll& testAll) {
  if (!trees.frame().isPrecise())
    testAll();
  else if (trees.frame().isSame())
    search(trees.frame().same());
  else
    search(trees.frame());
}

/// Whether the bounding spheres of two meshes are certainly farther apart than `distance`.
inline bool areBallsFarther(const PlacedMesh& first, const PlacedMesh& second,
                            const RelativePlacement& to_first, double distance) {
  constexpr double kSlack = 1 + 1e-6;
  const auto &a = first.bounds(), &b = second.bounds();
  const double apart = (to_first(b.aabb_center) - fcl::Vector3d(a.aabb_center)).stableNorm();
  const double radii = double(a.aabb_radius) + double(b.aabb_radius);
  return apart > (distance + radii) * kSlack + 1e-12 * to_first.T.norm();
}

}  // namespace adaptive_bvh
