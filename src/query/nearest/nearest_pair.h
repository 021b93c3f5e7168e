#pragma once

#include <algorithm>
#include <limits>

#include "query/nearest/local_boxes.h"
#include "query/nearest/triangle_separation.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_block.h"

namespace adaptive_bvh {

/// The nearest pair of triangles that a distance query has found so far, and the tests of further
/// pairs: cheap lower bounds, four pairs at a time, before each distance. Fills the result as FCL's
/// query does, but with the library's own distance of two triangles (gapOf).
class NearestPair {
 public:
  NearestPair(const PlacedMesh& first, const PlacedMesh& second,
              const DistanceQuery<double>& query);
  NearestPair(const NearestPair&) = delete;
  NearestPair& operator=(const NearestPair&) = delete;

  /// Ends the search at the first pair whose distance is at most `enough`. Call it before the
  /// search, if only that comparison matters.
  void stopAt(double enough) { enough_ = enough; }
  /// Uses the distance of two triangles as a first upper bound. Does nothing if one of them does
  /// not exist.
  void addWitness(int triangle1, int triangle2);

  /// Whether the search is over: the distance is at most `enough` (0 by default), or no pair can be
  /// nearer.
  bool isDone() const { return result_.min_distance <= enough_ || least_ >= least_enough_; }
  /// Raises the known lower bound of the meshes' distance, which may be off by rounding.
  void raiseLeast(double bound) { least_ = std::max(least_, bound); }
  const LocalBoxes& boxes() const { return boxes_; }
  /// Whether `refineLine` has nothing to do.
  bool isRefined() const { return is_refined_; }
  /// Improves the line between the nearest points. Rounding turns it if the points are near each
  /// other or very far apart. If a normal of the two triangles separates them equally well, the
  /// line takes its direction, which is exact for all of a flat face. Then bounds the bodies as a
  /// whole along the line.
  void refineLine();
  /// Whether all vertices are at least the limit apart along the line. Then the search is over.
  bool areSeparated();
  /// Turns the line to that between the convex hulls of the meshes, if these are nearly as far
  /// apart as the nearest pair. Returns whether it did.
  bool lookAlongHulls();
  /// Pairs at this distance or farther do not matter.
  double limit() const { return limit_; }
  /// The limit minus the rounding error of distances of triangles: pairs nearer by less than that
  /// count as equally near, so that parallel faces are pruned. The limit itself if that would
  /// hide a touch.
  double limitWithinRounding() const { return isClear() ? rounding_.below(limit_) : limit_; }
  /// The limit for bounds whose rounding error is that of distances.
  double limitOfBounds() const {
    return isClear() ? rounding_.below(limit_) : limit_ + rounding_.ofSeparations();
  }
  /// Whether pairs at the limit, up to rounding, certainly do not touch.
  bool isClear() const { return rounding_.isClear(limit_); }
  /// Separations along the line between the nearest points.
  const TriangleSeparation& triangles() const { return triangles_; }

  /// Tests the pairs of two leaves in `open`: bit 4 j + i for triangle i of the first tree's leaf
  /// and j of the second's. `block`: the triangles in single precision; `unit`: its unit in the
  /// first mesh's numbers; `error`: its error beyond what TriangleBlock allows for.
  void test(unsigned open, const TriangleBlock& block, double unit, double error,
            const WideNode& leaf1, const WideNode& leaf2);

  /// Whether most pairs of the two leaves that were tested last needed normals. Then `withoutTied`
  /// takes less time than `test` for the next two.
  bool areMostlyTied() const { return mostly_tied_; }
  /// Returns the pairs of `open` that no normal separates by the limit, for `test`.
  unsigned withoutTied(unsigned open, const WideNode& leaf1, const WideNode& leaf2);

  /// Whether the result has changed.
  bool isImproved() const { return improved_; }
  /// How many pairs of triangles were tested in double precision.
  long triangleTests() const { return triangle_tests_; }

 private:
  void setLimit();
  void raiseLeast();
  void lookAlong(const TriangleGap& gap, const VertexIndices& a, const VertexIndices& b);
  void improve(const TriangleGap& gap, int triangle1, int triangle2);
  template <typename NotApart>
  void separate(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2,
                const NotApart& notApart) const;
  void testTied(unsigned pairs, int tested, const WideNode& leaf1, const WideNode& leaf2);
  void testPair(int bit, const WideNode& leaf1, const WideNode& leaf2);

  const PlacedMesh &first_, &second_;
  const fcl::DistanceRequestd& request_;
  fcl::DistanceResultd& result_;
  const RelativePlacement to_first_;
  const LocalBoxes boxes_;
  TriangleSeparation triangles_;
  const DistanceRounding rounding_;
  double limit_ = 0;
  double least_ = 0;  ///< a lower bound of the distance
  double least_enough_ = std::numeric_limits<double>::infinity();  ///< a bound that ends the search
  /// The triangles that define the line, and their distance.
  VertexIndices near1_{}, near2_{};
  double near_distance_ = 0;
  bool is_refined_ = true;
  double enough_ = 0;  ///< a distance that ends the search
  bool improved_ = false;
  bool mostly_tied_ = false;
  long triangle_tests_ = 0;
};

}  // namespace adaptive_bvh
