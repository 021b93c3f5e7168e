#pragma once

#include <algorithm>
#include <limits>

#include "geometry/triangle_block.h"
#include "geometry/triangle_separation.h"
#include "query/placed_mesh.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// A triangle of a mesh: its corners and its index.
struct MeshTriangle {
  VertexIndices corners;
  int index;
};

/// The nearest pair of triangles that a distance query has found so far, and its tests of others:
/// cheap lower bounds, four pairs at a time, before each distance. Fills the result as FCL's query
/// does, but by our own distance of two triangles (gapOf).
template <typename BV>
class NearestPair {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  /// Both meshes must have boxes.
  NearestPair(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
              const DistanceQuery<S>& query);

  /// To be called first, when it only matters whether the distance is at most `enough`: the search
  /// ends with the first such pair.
  void stopAt(S enough) { enough_ = enough; }
  /// The distance of two triangles as a first upper bound. Nothing when one of them does not exist.
  void addWitness(int triangle1, int triangle2);

  /// The distance is 0, so nothing can be nearer; or small enough.
  bool isDone() const { return result_.min_distance <= enough_; }
  /// Distances from here on do not matter.
  S limit() const { return limit_; }
  /// What is nearer than the limit by no more than distances of triangles are rounded is as near:
  /// so parallel faces prune. Not where that would hide a touch.
  S limitWithinRounding() const { return limit_ > 4 * rounding_ ? limit_ - rounding_ : limit_; }
  /// The relative placement, and the line between the nearest points.
  const TriangleSeparation<S>& triangles() const { return triangles_; }

  /// Tests pairs: bit 4 j + i of `open` for triangle i of the first mesh and j of the second, which
  /// are in `block` in single precision, `unit` in the first model's numbers, off by `error` beyond
  /// what TriangleBlock allows. `first(i)` and `second(j)` return a MeshTriangle. `least[j]`
  /// becomes a lower bound of the distances of j that were tested, and of those in `kept`: then as
  /// large as triangles allow, or as boxes do, distanceOfBoxes(i, j), where these left a pair out.
  template <typename First, typename Second, typename DistanceOfBoxes>
  void test(unsigned open, const TriangleBlock& block, double unit, double error,
            const First& first, const Second& second, unsigned kept,
            const DistanceOfBoxes& distanceOfBoxes, double (&least)[4]) {
    const double off = double(rounding_) + error, limit = double(limit_);
    const Float4x4 bounds = boundsOf(open, kept, block, unit, off);
    const double slack = double(block.slack()) * unit + 2 * off;
    for (double& bound : least) bound = std::numeric_limits<double>::max();
    for (unsigned rest = open | kept; rest && !isDone(); rest &= rest - 1) {
      const int bit = __builtin_ctz(rest), i = bit & 3, j = bit >> 2;
      double bound = double(bounds.row[j][i]) * unit - off;
      if (open >> bit & 1) {
        if (bound < double(limit_)) bound = testPair(first(i), second(j), bound, slack);
      } else if (bound < limit) {
        bound = distanceOfBoxes(i, j);
      }
      least[j] = std::min(least[j], bound);
    }
  }

  /// Distances of triangles so far.
  long tests() const { return tests_; }
  /// To be called after the search. Returns whether it found a smaller distance than the result
  /// came with.
  bool finish();

  /// Of pairs of lanes, bit 4 j + i for i of the first: the lanes of either side.
  static unsigned firstLanes(unsigned pairs) {
    return (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  }
  static unsigned secondLanes(unsigned pairs) {
    return unsigned((pairs & 0x000f) != 0) | unsigned((pairs & 0x00f0) != 0) << 1 |
           unsigned((pairs & 0x0f00) != 0) << 2 | unsigned((pairs & 0xf000) != 0) << 3;
  }

 private:
  void setLimit();
  void improve(S distance, int triangle1, int triangle2, const Point& on1, const Point& on2);
  struct Float4x4 {
    Float4 row[4];
  };
  Float4x4 boundsOf(unsigned open, unsigned kept, const TriangleBlock& block, double unit,
                    double off) const;
  double testPair(const MeshTriangle& first, const MeshTriangle& second, double bound,
                  double slack);

  const PlacedMesh<BV>&first_, &second_;
  const fcl::DistanceRequest<S>& request_;
  fcl::DistanceResult<S>& result_;
  TriangleSeparation<S> triangles_;
  const S rounding_;  ///< of the distance of two triangles
  S limit_;
  S enough_ = 0;  ///< a distance that ends the search
  bool improved_ = false;
  long tests_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class NearestPair<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
