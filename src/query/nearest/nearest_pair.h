#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "base/leased.h"
#include "query/nearest/local_boxes.h"
#include "query/nearest/tied_triangles.h"
#include "query/nearest/triangle_separation.h"
#include "query/placed_mesh.h"
#include "triangles/triangle_block.h"

namespace adaptive_bvh {

/// The nearest pair of triangles that a distance query has found so far, and the tests of further
/// pairs: cheap lower bounds first, four pairs at a time, then the distance. Fills the result as
/// FCL's query does, but with the library's own distance of two triangles (gapOf). "The line" runs
/// between the nearest points so far; bounds along it are tight. Distances are in the meshes' unit.
class NearestPair {
 public:
  NearestPair(const PlacedMesh& first, const PlacedMesh& second, const DistanceQuery& query);
  NearestPair(const NearestPair&) = delete;
  NearestPair& operator=(const NearestPair&) = delete;

  /// Ends the search at the first pair whose distance is at most `enough`. For callers that only
  /// compare the distance with it. Call this before the search.
  void stopAt(double enough) { enough_ = enough; }
  /// Uses the distance of two triangles as a first upper bound, if both indices exist.
  void addWitness(int triangle1, int triangle2);

  /// Whether the search is over: no pair can be nearer, or one is near enough (stopAt).
  bool isDone() const { return result_.min_distance <= enough_ || lower_bound_ >= final_bound_; }
  /// Raises the lower bound of the distance. Its error is DistanceRounding::ofSeparations.
  void raiseLowerBound(double bound) { lower_bound_ = std::max(lower_bound_, bound); }
  const LocalBoxes& boxes() const { return boxes_; }
  /// Whether the line has been refined since it was set.
  bool isRefined() const { return is_refined_; }
  /// Improves the line, because rounding turns it if its points are near each other or very far
  /// apart. If the normal of one of the nearest triangles separates them equally well, the line
  /// takes its direction, which is accurate for all of a flat face. Then raises the lower bound by
  /// the extents of the local boxes along the line.
  void refineLine();
  /// Whether all vertices of the two meshes are at least the limit apart along the line. If so,
  /// raises the lower bound, which ends the search.
  bool areSeparated();
  /// Turns the line to the direction between the convex hulls of the meshes, if these are nearly as
  /// far apart as the nearest pair. Returns whether it did so.
  bool lookAlongHulls();
  /// Pairs at this distance or farther do not matter: the distance so far, less tolerances.
  double limit() const { return limit_; }
  /// The limit for separations, which may be too large by DistanceRounding::ofSeparations: less the
  /// errors of distances, so that pairs nearer by less count as equally near and parallel faces are
  /// pruned; but more by that error if the pair is so near that this could miss a contact.
  double limitWithinRounding() const {
    return isClear() ? rounding_.below(limit_) : limit_ + rounding_.ofSeparations();
  }
  /// Whether triangles at the distance of the limit, up to rounding, certainly do not touch.
  bool isClear() const { return rounding_.isClear(limit_); }
  /// The line, and separations along it.
  const TriangleSeparation& triangles() const { return triangles_; }

  /// Tests pairs of triangles of two leaves: bit 4 j + i of `pairs` for triangle i of the first
  /// mesh's leaf and j of the second's. `block`: these triangles in single precision, in the unit
  /// `unit`, with the `error` beyond what TriangleBlock allows for; both in the meshes' unit.
  void test(unsigned pairs, const TriangleBlock& block, double unit, double error,
            const WideNode& leaf1, const WideNode& leaf2);

  /// Whether most pairs of the two leaves tested last needed separations along normals in double
  /// precision. Then calling `withoutTied`, which begins with these, before `test` saves time.
  bool areMostlyTied() const { return mostly_tied_; }
  /// Returns the pairs that are not found separated by the limit in double precision.
  unsigned withoutTied(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2);

  /// Whether the result has changed.
  bool isImproved() const { return improved_; }
  /// How many pairs of triangles were tested in double precision.
  long triangleTests() const { return triangle_tests_; }

 private:
  void setLimit();
  void raiseByBoxes();
  void lookAlong(const TriangleGap& gap, const VertexIndices& a, const VertexIndices& b);
  void improve(const TriangleGap& gap, int triangle1, int triangle2);
  template <typename NotApart>
  void separate(unsigned pairs, const WideNode& leaf1, const WideNode& leaf2,
                const NotApart& notApart);
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
  double lower_bound_ = 0;                                        ///< of the distance of the meshes
  double final_bound_ = std::numeric_limits<double>::infinity();  ///< a bound that ends the search
  /// Vertices of the two triangles whose nearest points the line was set to, and their distance.
  VertexIndices line_vertices1_{}, line_vertices2_{};
  double line_distance_ = 0;
  bool is_refined_ = true;
  double enough_ = 0;  ///< a distance that ends the search
  bool improved_ = false, mostly_tied_ = false;
  std::optional<Leased<std::array<TiedLeaves, 2>>> tied_leaves_;           ///< of both meshes
  TiedTriangles::Along preferred_direction_ = TiedTriangles::Along::Line;  ///< of tied pairs
  long triangle_tests_ = 0;
};

}  // namespace adaptive_bvh
