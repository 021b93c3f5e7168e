#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "base/leased.h"
#include "ccd/continuous_search.h"
#include "ccd/feature_search.h"

namespace adaptive_bvh {

/// The trees of swept boxes of a query, in memory of the calling thread.
class SweptBoxes {
 public:
  explicit SweptBoxes(const ContinuousQuery& query)
      : query_(query), frame_(query.first, query.second) {}

  /// Boxes around the motion in an interval, padded by half of the separation and by a radius.
  SweptPair overInterval(const TimeInterval& interval, double radius_of_first = 0,
                         double radius_of_second = 0) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh, bool is_first) {
      tree.refit(mesh, frame_, interval,
                 query_.separation / 2 + (is_first ? radius_of_first : radius_of_second));
    });
  }
  /// Boxes by refitAroundStarts or refitOverShares of SweptTree, padded by half of the separation.
  using Refit = void (SweptTree::*)(const MovingMesh&, const SweptFrame&, double,
                                    const std::vector<double>&, double);
  SweptPair by(Refit refit, const std::vector<double>& of_first,
               const std::vector<double>& of_second, double most) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh, bool is_first) {
      (tree.*refit)(mesh, frame_, query_.separation / 2, is_first ? of_first : of_second, most);
    });
  }
  const SweptFrame& frame() const { return frame_; }

 private:
  /// Refits the trees by refit(tree, mesh, is_first), and returns them.
  template <typename Refit>
  SweptPair pairAfter(Refit&& refit) {
    std::array<SweptTree, 2>& trees = *trees_;
    refit(trees[0], query_.first, true);
    if (!query_.isSelf()) refit(trees[1], query_.second, false);
    return {query_.first, trees[0], query_.second, trees[query_.isSelf() ? 0 : 1]};
  }

  const ContinuousQuery& query_;
  const SweptFrame frame_;
  const Leased<std::array<SweptTree, 2>> trees_;
};

/// Mean lengths of motions of vertices and of edges, from a sample of the triangles.
struct MeanLengths {
  double motion = 0, edge = 0;

  explicit MeanLengths(const MovingMesh& mesh) {
    constexpr unsigned kSamples = 1024;
    const unsigned step = mesh.num_triangles / kSamples + 1;
    unsigned count = 0;
    for (unsigned t = 0; t < mesh.num_triangles; t += step, ++count) {
      const auto ends = edgeVertices(mesh.triangles, 3 * t);
      motion += (mesh.end[ends[0]] - mesh.start[ends[0]]).norm();
      edge += (mesh.start[ends[1]] - mesh.start[ends[0]]).norm();
    }
    motion /= count;
    edge /= count;
  }
  /// The mean motion, relative to the mean edge.
  double motionInEdges() const { return motion / std::max(edge, 1e-300); }
};

/// Calls search(limit) with a length that grows from about an edge while it is less than longest(),
/// and then with infinity. Near pairs lower most lengths, so that the last search, without a limit,
/// finds few pairs.
template <typename Longest, typename Search>
void searchByGrowingLimits(const ContinuousQuery& query, const Longest& longest,
                           const Search& search) {
  constexpr double kGrowth = 4;
  double limit = std::max(MeanLengths(query.first).edge, MeanLengths(query.second).edge);
  for (; limit < longest() && limit > 0; limit *= kGrowth) search(limit);
  search(std::numeric_limits<double>::infinity());
}

}  // namespace adaptive_bvh
