#pragma once

#include <algorithm>
#include <limits>

#include "query/nearest/local_boxes.h"
#include "query/nearest/triangle_separation.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_block.h"

namespace adaptive_bvh {

/// The nearest pair of triangles that a distance query has found so far, and its tests of others:
/// cheap lower bounds, four pairs at a time, before each distance. Fills the result as FCL's query
/// does, but by our own distance of two triangles (gapOf).
class NearestPair {
 public:
  NearestPair(const PlacedMesh& first, const PlacedMesh& second,
              const DistanceQuery<double>& query);
  NearestPair(const NearestPair&) = delete;
  NearestPair& operator=(const NearestPair&) = delete;

  /// Ends the search with the first pair whose distance is at most `enough`. Call it before the
  /// search if only that matters.
  void stopAt(double enough) { enough_ = enough; }
  /// The distance of two triangles as a first upper bound. Nothing when one of them does not exist.
  void addWitness(int triangle1, int triangle2);

  /// The distance is 0, so nothing can be nearer; or small enough; or no pair is nearer.
  bool isDone() const { return result_.min_distance <= enough_ || least_ >= least_enough_; }
  /// The distance of the meshes is not less than that, but for rounding.
  void raiseLeast(double bound) { least_ = std::max(least_, bound); }
  const LocalBoxes& boxes() const { return boxes_; }
  /// Whether `refineLine` has nothing to do.
  bool isRefined() const { return is_refined_; }
  /// Improves the line between the nearest points, which rounding turns where they are near each
  /// other or very far apart: where a normal of the two triangles separates these as well, that is
  /// taken, which is exact for all of a flat face. Then measures the bodies as a whole.
  void refineLine();
  /// Whether all vertices are at least the limit apart along the line: then the search is over.
  bool areSeparated();
  /// Looks along the line between the convex hulls of the meshes, if these are nearly as far apart
  /// as the nearest pair.
  bool lookAlongHulls();
  /// Distances from here on do not matter.
  double limit() const { return limit_; }
  /// What is nearer than the limit by no more than distances of triangles are rounded is as near:
  /// so parallel faces prune. Not where that would hide a touch.
  double limitWithinRounding() const { return isClear() ? rounding_.below(limit_) : limit_; }
  /// For bounds that may be off by as much as distances are.
  double limitOfBounds() const {
    return isClear() ? rounding_.below(limit_) : limit_ + rounding_.ofSeparations();
  }
  /// Whether what is as near as the limit, up to rounding, surely does not touch.
  bool isClear() const { return rounding_.isClear(limit_); }
  /// The line between the nearest points.
  const TriangleSeparation<double>& triangles() const { return triangles_; }

  /// Tests pairs: bit 4 j + i of `open` for triangle i of a leaf of the first tree and j of one of
  /// the second, which are in `block` in single precision, `unit` in the first mesh's numbers, off
  /// by `error` beyond what TriangleBlock allows.
  void test(unsigned open, const TriangleBlock& block, double unit, double error,
            const WideNode& leaf1, const WideNode& leaf2);

  /// Whether the result has changed.
  bool isImproved() const { return improved_; }
  /// How many pairs of triangles were tested in double precision.
  long triangleTests() const { return triangle_tests_; }

 private:
  void setLimit();
  void raiseLeast();
  void lookAlong(const TriangleGap& gap, const VertexIndices& a, const VertexIndices& b);
  void improve(const TriangleGap& gap, int triangle1, int triangle2);
  void testPair(const Int4& first, const Int4& second, double bound, double slack);

  const PlacedMesh &first_, &second_;
  const fcl::DistanceRequestd& request_;
  fcl::DistanceResultd& result_;
  const RelativePlacement to_first_;
  const LocalBoxes boxes_;
  TriangleSeparation<double> triangles_;
  const DistanceRounding rounding_;
  double limit_ = 0;
  double least_ = 0;  ///< a lower bound of the distance
  double least_enough_ = std::numeric_limits<double>::infinity();  ///< that ends the search
  /// What the line belongs to.
  VertexIndices near1_{}, near2_{};
  double near_distance_ = 0;
  bool is_refined_ = true;
  double enough_ = 0;  ///< a distance that ends the search
  bool improved_ = false;
  long triangle_tests_ = 0;
};

}  // namespace adaptive_bvh
