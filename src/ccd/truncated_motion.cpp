// Shares of the vertices' ways that planes between near features allow.
#include <algorithm>
#include <array>

#include "ccd/continuous_search.h"
#include "ccd/pair_batches.h"
#include "ccd/swept_boxes.h"
#include "triangles/feature_truncation.h"

namespace adaptive_bvh {
namespace {

/// A visitor of FeatureFinder that lowers the shares of the vertices of each pair of features. It
/// leaves out pairs that a plane separates all the way: four at a time, in single precision.
class MotionTruncation : public PairBatches<MotionTruncation> {
 public:
  /// `separation`: in the unit of the world.
  MotionTruncation(const SweptPair& pair, const SweptFrame& frame, double separation,
                   std::vector<double>& of_first, std::vector<double>& of_second)
      : PairBatches<MotionTruncation>(pair),
        separation_(separation),
        limits_{frame.lengthUp(separation),
                std::max(pair.tree1.positionError(), pair.tree2.positionError()), 1},
        first_(of_first),
        second_(pair.isSelf() ? of_first : of_second) {}

 private:
  friend PairBatches<MotionTruncation>;
  using Corner = FeatureTruncation::Corner;

  template <int kNumFirst>
  ADAPTIVE_BVH_INLINE unsigned decided(const MovingPairs4& four) const {
    return haveFixedPlane<kNumFirst>(four, limits_);
  }
  template <int kNumFirst>
  void test(const PairRef& ref, unsigned) {
    const auto of = verticesOf<kNumFirst>(ref);
    std::array<Corner, 4> corners;
    for (int i = 0; i < 4; ++i)
      corners[std::size_t(i)] = (i < kNumFirst) == of.swapped
                                    ? corner(pair_.second, second_, of.vertices[i])
                                    : corner(pair_.first, first_, of.vertices[i]);
    FeatureTruncation(kNumFirst, corners, separation_).lowerShares();
  }
  static Corner corner(const MovingMesh& mesh, std::vector<double>& shares, unsigned v) {
    return {&mesh.start[v], &mesh.end[v], &shares[v], mesh.between_error};
  }

  const double separation_;
  const MovingPairs4Limits limits_;
  std::vector<double>&first_, &second_;  ///< shares by vertex, of each mesh
};

/// The longest way of a vertex within its share.
double longestWay(const MovingMesh& mesh, const std::vector<double>& shares) {
  double longest = 0;
  for (unsigned v = 0; v < mesh.num_vertices; ++v)
    longest = std::max(longest, shares[v] * (mesh.end[v] - mesh.start[v]).norm());
  return longest;
}

}  // namespace

/// Searches several times, with boxes around ways no longer than a limit.
void findTruncation(const ContinuousQuery& query, std::vector<double>& of_first,
                    std::vector<double>& of_second) {
  of_first.assign(query.first.num_vertices, 1);
  if (!query.isSelf()) of_second.assign(query.second.num_vertices, 1);
  SweptBoxes boxes(query);
  const auto longest = [&] {
    const double first = longestWay(query.first, of_first);
    return query.isSelf() ? first : std::max(first, longestWay(query.second, of_second));
  };
  searchByGrowingLimits(query, longest, [&](double limit) {
    const SweptPair pair = boxes.by(&SweptTree::refitOverShares, of_first, of_second, limit);
    MotionTruncation truncation(pair, boxes.frame(), query.separation, of_first, of_second);
    // On one thread, because the result depends on the order of the pairs.
    TriangleSearch<FeatureFinder<MotionTruncation>>(pair.trees(), truncation, pair).runFromRoots();
  });
}

}  // namespace adaptive_bvh
