#pragma once

#include <vector>

#include "base/leased.h"
#include "query/nearest/line_view.h"
#include "query/nearest/nearest_pair.h"
#include "query/nearest/node_slabs.h"
#include "query/nearest/supports.h"
#include "query/pair_corners.h"
#include "query/tree_pair.h"
#include "triangles/triangle_block.h"

namespace adaptive_bvh {

/// The triangles of two leaves, one of each tree, for TriangleBlock: in the first tree's
/// coordinates and unit, relative to the first corner of the second leaf, which keeps single
/// precision accurate. The first tree's positions are used with their residuals; the second's are
/// transformed in double precision. docs/bounds.md, 5.
class LeafBlocks {
 public:
  LeafBlocks(const PlacedMesh& second, const TreePair& trees) : placed2_(second), trees_(trees) {}
  LeafBlocks(const LeafBlocks&) = delete;
  LeafBlocks& operator=(const LeafBlocks&) = delete;

  /// Sets a direction from the first to the second mesh, of length 1 or zero, in the first tree's
  /// coordinates, for further bounds. Call this before the search, and after trees were aligned.
  void lookAlong(const Vector4x3& direction) {
    direction_ = direction;
    side2_leaf_ = slab_leaf_ = -1;
    const BodyCoordinates& first = trees_.first().coordinates();
    from_second_ = first.to_body * trees_.toFirst().R;
    origin_of_second_ = first(trees_.toFirst().T);
  }
  /// Returns the pairs of triangles in `pairs` that may be within `limit`, in the first tree's
  /// unit: those whose first triangle is within `limit` of a slab around the second leaf. On
  /// surfaces that lie along each other these are few, and a slab takes as long as testing two
  /// pairs. Bit 4 j + i is triangle i of the leaf `first` and j of the leaf `second`.
  unsigned near(int first, int second, unsigned pairs, double limit) {
    const RelativeFrame& frame = trees_.frame();
    if (!frame.isPrecise()) return pairs;
    Vector4x3 corners[3];
    if (slab_leaf_ != second || slab_limit_ != limit) {
      const WideTree& tree = trees_.second();
      slab_leaf_ = second;
      slab_limit_ = limit;
      gatherLeaf(tree.slots(), tree.positions(), tree.nodes()[second], corners);
      if (!frame.isSame())
        for (Vector4x3& corner : corners) corner = frame(corner);
      slab_ = LeafSlab(corners, static_cast<float>(limit),
                       frame.isSame() ? frame.same().error() : frame.error());
    }
    const WideTree& tree = trees_.first();
    gatherLeaf(tree.slots(), tree.positions(), tree.nodes()[first], corners);
    return pairs & ~(0x1111 * slab_.apart(corners));
  }
  /// Returns the block of two leaves. Valid until the next call.
  TriangleBlock operator()(int first, int second) {
    if (side2_leaf_ != second) readSecond(second);  // consecutive calls often share it
    readFirst(trees_.first().nodes()[first]);
    return {side1_, side2_};
  }
  /// Error of a bound, in the first tree's unit, beyond what TriangleBlock subtracts.
  double error() const {
    return 4 * (double(trees_.frame().preciseError()) + 4 * double(WideTree::kResidualError));
  }

 private:
  /// Sets the origin, rounded, and its rounding error. Does not use cast<float>() and back, because
  /// GCC 12 with -O3 removes both casts of a pair of numbers.
  void setOrigin(const fcl::Vector3d& origin) {
    const Pack<double> xy{origin[0], origin[1]}, z{origin[2], 0};
    const Float4 rounded = float4::narrowed(xy, z);
    origin_ = vectors::all(rounded);
    origin_rest_ = vectors::all(
        float4::narrowed(xy - float4::widenedXy(rounded), z - float4::widenedZw(rounded)));
  }
  void readFirst(const WideNode& leaf) {
    const WideTree& tree = trees_.first();
    Vector4x3 positions[3], residuals[3];
    gatherLeaf(tree.slots(), tree.positions(), leaf, positions);
    gatherLeaf(tree.slots(), tree.residuals(), leaf, residuals);
    for (int c = 0; c < 3; ++c)
      block1_.corner[c] = vectors::sum(vectors::difference(positions[c], origin_),
                                       vectors::difference(residuals[c], origin_rest_));
    side1_ = TriangleSides(block1_, direction_);
  }
  void readSecond(int number) {
    side2_leaf_ = number;
    const WideNode& leaf = trees_.second().nodes()[number];
    fcl::Vector3d corners[4][3];
    for (int i = 0; i < 4; ++i) {
      const TrianglePoints points =
          placed2_.pointsAt(static_cast<unsigned>(leaf.first + (i < int(leaf.count) ? i : 0)));
      for (std::size_t k = 0; k < 3; ++k)
        corners[i][k] = from_second_ * points[k] + origin_of_second_;
    }
    const fcl::Vector3d origin = corners[0][0];
    setOrigin(origin);
    for (int k = 0; k < 3; ++k) {
      Float4 relative[4];
      for (int i = 0; i < 4; ++i) {
        const fcl::Vector3d x = corners[i][k] - origin;
        relative[i] =
            Float4{static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2]), 0};
      }
      block2_.corner[k] = float4::columns(relative[0], relative[1], relative[2], relative[3]);
    }
    side2_ = TriangleSides(block2_, direction_);
  }

  const PlacedMesh& placed2_;
  const TreePair& trees_;
  Vector4x3 direction_;
  fcl::Matrix3d from_second_;  ///< these two map the second mesh's frame to the first tree
  fcl::Vector3d origin_of_second_;
  Triangles4 block1_, block2_;
  TriangleSides side1_, side2_;           ///< of block1_ and block2_
  Vector4x3 origin_, origin_rest_;        ///< their sum is the origin of the blocks
  int side2_leaf_ = -1, slab_leaf_ = -1;  ///< the leaves of block2_ and of slab_; -1 if unset
  double slab_limit_ = 0;
  LeafSlab slab_;  ///< around a leaf of the second tree, for slab_limit_
};

/// Converts distances to limits for squared gaps of boxes in the first tree's coordinates. Boxes
/// are larger than their triangles by more than the rounding errors of both boxes and of their
/// differences; only the errors of squares are added here: docs/bounds.md, 13.
class BoxGaps {
 public:
  /// `scale`: WideTree::scale.
  explicit BoxGaps(double scale) : scale_(scale) {}

  /// Returns the limit for `distance`, in the meshes' unit: two nodes whose squared gap is at least
  /// this limit are at least `distance` apart.
  float squaredGapFor(double distance) const {
    const double gap = distance * scale_;
    constexpr double kLeast = 1e-30;  // squares of smaller gaps underflow
    return static_cast<float>(std::clamp(gap * gap * (1 + kSquares), kLeast, 1e38));
  }

 private:
  static constexpr double kSquares = 1. / (1 << 20);
  double scale_;
};

/// The exact distance of two meshes: branch and bound on pairs of nodes of their four-wide trees,
/// depth first and the nearest child pair first. At first, pairs of nodes are bounded by the gaps
/// of their boxes. A search that takes long buys tighter bounds, each after a number of box tests
/// that is in proportion to its cost (runDueSteps): a better line between the nearest points,
/// aligned trees, supports (extents of nodes along that line), slabs (extents of small nodes along
/// normals), for bodies far apart a LineView. Slabs that separate little are not used any more.
class NearestSearch {
 public:
  /// Lowers the distance in `nearest`. `supports_first`: computes supports at once.
  NearestSearch(const PlacedMesh& first, const PlacedMesh& second, NearestPair& nearest,
                bool supports_first = false);

  /// Searches until `nearest` has the nearest pair, or a pair near enough (NearestPair::stopAt).
  void run();
  /// Whether supports separated many pairs of nodes, as they then will in a similar search.
  bool supportsPaid() const { return has_supports_ && by_supports_.pays(); }
  /// How many pairs of boxes were tested.
  long boxTests() const { return box_tests_; }

 private:
  /// A pair of nodes still to be searched, by their numbers.
  struct Pair {
    int first, second;
    float key;  ///< grows with the distance: the squared gap of the boxes, or the key of the view
  };
  struct Memory {
    std::vector<Pair> open;
    LineSeparation supports;
    SlabSeparation slabs;
  };
  /// Counts what a bound was tested for, and what it separated.
  struct Payoff {
    long tested = 0, apart = 0;

    /// Whether it separates at least one of eight.
    bool pays() const { return 8 * apart >= tested; }
    /// Whether it pays, or may yet do so.
    bool mayPay() const { return tested < 256 || pays(); }
  };

  void setLimit();
  bool runDueSteps();
  bool trySteps();
  [[gnu::noinline]] void moveNearestToEnd();
  ADAPTIVE_BVH_INLINE Pair takeNext();
  void align();
  void setView(const TriangleSeparation::Line& line, double extent1, double extent2);
  bool refineLine();
  bool areSeparated();
  void tryLineOfBoxes();
  bool isFartherThan(double radii) const;
  bool areFarApart() const;
  void trySupports();
  bool tryLineOfHulls();
  void computeSlabs();
  long setSupportParts();
  // The boxes i of node `first` and j of node `second` that may be nearer than the limit, as bits
  // 4 j + i, and the keys of all pairs of boxes (Pair::key).
  [[gnu::noinline]] unsigned nearInView(int first, int second, const LineSeparation* supports,
                                        Gaps4x4& keys);
  ADAPTIVE_BVH_INLINE unsigned nearByBoxes(int first, int second, Gaps4x4& keys);
  ADAPTIVE_BVH_INLINE unsigned nearByAll(int first, int second, Gaps4x4& keys);
  unsigned nearBySlabs(int first, int second, unsigned pairs);
  void visit(const Pair& pair);
  void push(const Pair& pair, const Gaps4x4& keys, unsigned pairs);
  void testLeaves(const Pair& pair, unsigned pairs);
  const Boxes4& secondBoxes(int node);

  NearestPair& nearest_;
  TreePair trees_;
  const WideNode *nodes1_, *nodes2_;
  const bool supports_first_;
  bool is_same_;  ///< whether both trees have the same coordinates
  const Leased<Memory> memory_;
  std::vector<Pair>& open_;  ///< a stack of the pairs still to be searched
  LineSeparation& supports_;
  SlabSeparation& slabs_;
  LeafBlocks blocks_;
  double limit_ = -1;    ///< nearest_.limit() when bounds were last set by it; -1 to set them again
  float key_limit_ = 0;  ///< pairs with this key, or a larger one, are not nearer than the limit
  fcl::Vector3d direction_ = fcl::Vector3d::Zero();  ///< of the line, in the first tree
  LineView view_;
  /// Whether view_, supports_ and slabs_ are in use.
  bool has_view_ = false, has_supports_ = false, has_slabs_ = false;
  /// Whether the last visit added pairs. The nearest of them is the last of `open_`.
  bool has_next_ = false;
  std::size_t heap_size_ = 0;  ///< the first pairs of `open_` that form a heap (moveNearestToEnd)
  /// For each step, the number of box tests after which it is due.
  long next_line_, next_view_, next_check_, next_hulls_, next_supports_, next_alignment_,
      next_slabs_;
  long next_step_ = 0;  ///< the smallest of these
  /// For pairs of nodes with near boxes since supports were computed, for pairs of boxes by slabs,
  /// and for pairs of leaves by LeafBlocks::near.
  Payoff by_supports_, by_slabs_, by_leaf_slabs_;
  int turned_node_ = -1;  ///< a node of the second tree
  Boxes4 turned_;         ///< its boxes in the first tree's coordinates
  long box_tests_ = 0;
};

}  // namespace adaptive_bvh
