#pragma once

#include <vector>

#include "query/leaf_blocks.h"
#include "query/nearest_pair.h"
#include "query/supports.h"

namespace adaptive_bvh {

/// What gaps of boxes say, of two four-wide trees seen in the coordinates of the first. Boxes reach
/// farther than their triangles by more than all that is rounded in both and in their differences,
/// but for the squares': docs/bounds.md, 13.
class BoxGaps {
 public:
  /// `scale`: WideTree::scale.
  explicit BoxGaps(double scale) : scale_(scale) {}

  /// Two nodes whose squared gap is at least this are at least `distance` apart.
  float squaredGapFor(double distance) const {
    const double gap = distance * scale_;
    constexpr double kLeast = 1e-30;  // squares of smaller gaps underflow
    return static_cast<float>(std::clamp(gap * gap * (1 + kSquares), kLeast, 1e38));
  }

 private:
  static constexpr double kSquares = 1. / (1 << 20);
  double scale_;
};

/// The exact distance of two meshes: branch and bound on their four-wide trees, the nearest pair of
/// nodes first.
template <typename S>
class NearestSearch {
 public:
  NearestSearch(const PlacedMesh<S>& first, const PlacedMesh<S>& second, NearestPair<S>& nearest);

  /// All pairs of triangles, until the nearest pair is enough.
  void run();

 private:
  /// Two nodes that are still to be searched, with the squared gap of their boxes.
  struct Pair {
    int first, second;
    float gap;
  };
  struct Memory;

  void setLimit();
  void align();
  void computeSupports();
  void visit(const Pair& pair);
  void push(const Pair& pair, const Gaps4x4& gaps, unsigned pairs);
  void testLeaves(const Pair& pair, unsigned open);
  const Boxes4& secondBoxes(int node);

  NearestPair<S>& nearest_;
  TreePair<S> trees_;
  const WideNode *nodes1_, *nodes2_;
  bool is_same_;  ///< whether both trees have the same coordinates
  Memory& memory_;
  std::vector<Pair>& open_;
  LineSeparation& line_;
  LeafBlocks<S> blocks_;
  double limit_ = -1;  ///< as `nearest_` has it
  float limit2_ = 0;   ///< as a squared gap
  /// Between the nearest points, in the first tree's coordinates.
  fcl::Vector3d direction_ = fcl::Vector3d::Zero();
  bool has_supports_ = false;
  long next_supports_, next_alignment_;
  int turned_node_ = -1;  ///< whose boxes these are
  Boxes4 turned_;
  long box_tests_ = 0;
};

extern template class NearestSearch<float>;
extern template class NearestSearch<double>;

}  // namespace adaptive_bvh
