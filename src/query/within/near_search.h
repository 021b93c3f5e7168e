#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "query/nearest/nearest_search.h"
#include "query/pair_filter.h"
#include "query/tree_pair.h"
#include "query/within/found_parts.h"
#include "query/within/within_tests.h"

// Searches for pairs of triangles within a distance: any pair (searchAny, compare), or all pairs
// (PairSink). "Near" means within that distance.
namespace adaptive_bvh {

/// A sink of WithinTests that keeps the first near pair.
struct AnyPair {
  static constexpr int kBatch = 128;
  static constexpr bool kStopsAtFirst = true, kTakesUndecided = false, kTakesOpen = false;

  bool found = false;
  LeafIndexPair pair{0, 0};

  static bool needsGap() { return false; }
  bool isDone() const { return found; }
  void clear() { found = false; }
  void add(const LeafIndexPair& near, const TriangleGap*) {
    found = true;
    pair = near;
  }
};

/// A sink of WithinTests that writes all near pairs into a result.
class PairSink {
 public:
  using Result = TrianglePairs;
  static constexpr int kBatch = 256;
  static constexpr bool kStopsAtFirst = false, kTakesUndecided = false, kTakesOpen = false;

  /// `is_self`: the pairs of one mesh; the smaller index comes first.
  PairSink(const PairInput& input, const ProximityRequest& request, bool is_self, Result& result)
      : in_(input), request_(request), is_self_(is_self), result_(result) {}

  void clear() { result_.clear(); }
  bool needsGap() const { return request_.enable_distances || request_.enable_nearest_points; }
  static bool isDone() { return false; }

  ADAPTIVE_BVH_INLINE void add(const LeafIndexPair& pair, const TriangleGap* gap) {
    const auto first = static_cast<unsigned>(in_.tree1.triangle(pair.first)),
               second = static_cast<unsigned>(in_.tree2.triangle(pair.second));
    const bool swaps = is_self_ && first > second;
    if (isIgnored(request_.ignored.triangles, swaps ? second : first, swaps ? first : second))
      return;
    appendPair(swaps ? second : first, swaps ? first : second, result_.triangles);
    if (!gap) return;  // neither distances nor points are requested
    if (request_.enable_distances) result_.distances.push_back(gap->distance);
    if (request_.enable_nearest_points) addPoints(gap->points, swaps);
  }

  /// Returns a sink for another thread, which writes to another result (searchAll).
  PairSink another(Result& result) const { return {in_, request_, is_self_, result}; }
  using Mark = std::size_t;
  Mark mark() const { return result_.size(); }
  /// Replaces the result by what other sinks received in tasks, in the order of the tasks.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    const auto joinArrays = [&](auto array, bool is_requested) {
      if (!is_requested) return (result_.*array).clear();
      joinParts(tasks, pool, result_.*array, [&](const Found& task) {
        return VectorPart(task.worker->sink().result_.*array, task.from, task.to);
      });
    };
    joinArrays(&Result::triangles, true);
    joinArrays(&Result::distances, request_.enable_distances);
    joinArrays(&Result::nearest_points, request_.enable_nearest_points);
  }

 private:
  void addPoints(const PointPair& points, bool swaps) {
    const auto inWorld = [&](const fcl::Vector3d& x) -> fcl::Vector3d {
      const auto& tf = in_.first.tf.matrix();
      return (tf.template topLeftCorner<3, 3>() * x + tf.template topRightCorner<3, 1>());
    };
    result_.nearest_points.push_back({inWorld(points.first), inWorld(points.second)});
    if (swaps) std::swap(result_.nearest_points.back()[0], result_.nearest_points.back()[1]);
  }

  const PairInput& in_;
  const ProximityRequest& request_;
  const bool is_self_;
  Result& result_;
};

/// Passes all near pairs to the sink by testing every pair; for placements for which single
/// precision does not suffice (RelativeFrame::isPrecise).
template <typename Sink>
void testAllPairs(const PairInput& input, Sink& sink) {
  const SameFrame frame;  // the exact tests do not use it
  WithinTests<SameFrame, Sink> tests(sink, input, frame);
  sink.clear();
  if (areBallsFarther(input.first, input.second, input.to_first, input.distance)) return;
  const auto size1 = static_cast<unsigned>(input.first.mesh.numTriangles()),
             size2 = static_cast<unsigned>(input.second.mesh.numTriangles());
  for (unsigned i = 0; i < size1; ++i)
    for (unsigned j = 0; j < size2 && !sink.isDone(); ++j) tests.testAlone({i, j});
}

/// Whether any pair of triangles is within `distance`, by a search with boxes grown by the
/// distance. Sets `found` to the first such pair.
inline bool searchAny(const PairOfMeshes& meshes, double distance, TrianglePair& found) {
  TreePair trees(meshes.first, meshes.second);
  alignIfNear(trees, distance);
  const PairInput input(trees, distance);
  AnyPair any;
  searchInFrame(
      trees,
      [&](const auto& frame) {
        WithinSearch<std::decay_t<decltype(frame)>, AnyPair>(input.trees(frame), any, input, frame)
            .runFromRoots();
      },
      [&] { testAllPairs(input, any); });
  if (any.found)
    found = {unsigned(input.tree1.triangle(any.pair.first)),
             unsigned(input.tree2.triangle(any.pair.second))};
  return any.found;
}

/// Returns the mean length of a sample of edges.
inline double meanEdge(const MeshState& mesh) {
  constexpr int kSample = 32;
  const int step = mesh.numTriangles() / kSample + 1;
  double sum = 0;
  int count = 0;
  for (int t = 0; t < mesh.numTriangles(); t += step, ++count) {
    const auto ends = edgeVertices(mesh.topology->triangles.data(), 3 * unsigned(t));
    sum += (mesh.vertices[ends[1]] - mesh.vertices[ends[0]]).norm();
  }
  return sum / count;
}

/// Whether the distance is so small, compared with the triangles, that searchAny is faster than
/// `compare`. Grown boxes exclude only pairs that are farther apart along one axis.
inline bool isFewEdges(const PairOfMeshes& meshes, double distance) {
  constexpr double kEdges = 3;
  return distance <= kEdges * std::min(meanEdge(meshes.first.mesh), meanEdge(meshes.second.mesh));
}

/// Whether `compare` suits this distance: not if it is nearly 0, compared with the meshes.
inline bool canCompare(const PairOfMeshes& meshes, double distance) {
  constexpr double kNearlyZero = 1e-9;
  const auto size = meshes.first.bounds().aabb_radius + meshes.second.bounds().aabb_radius;
  return distance > kNearlyZero * size;
}

/// Whether the distance of the meshes is at most `enough` or a little larger, by a NearestSearch
/// that ends as soon as this is known; false is certain. If not, lowers `lower_bound` to a lower
/// bound of the distance, if that is less. `witness`: a pair that may be near; becomes the nearest
/// pair found. `errors` exceed those of DistanceRounding, and of gapOf.
inline bool compare(const PairOfMeshes& meshes, double enough, TrianglePair& witness,
                    double& lower_bound) {
  const auto sizeOf = [](const PlacedMesh& mesh) -> double {
    return mesh.bounds().aabb_center.lpNorm<1>() + 2 * mesh.bounds().aabb_radius;
  };
  const double errors = 0x1p-45 * (meshes.to_first.T.lpNorm<1>() + sizeOf(meshes.first) +
                                   sizeOf(meshes.second) + enough);
  enough += errors;
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result(
      std::max(lower_bound, std::nextafter(enough, std::numeric_limits<double>::max())));
  NearestPair nearest(meshes.first, meshes.second, {request, result});
  nearest.stopAt(enough);
  nearest.addWitness(int(witness.first), int(witness.second));
  NearestSearch(meshes.first, meshes.second, nearest).run();
  if (nearest.isImproved()) witness = {unsigned(result.b1), unsigned(result.b2)};
  lower_bound = result.min_distance - errors;
  return result.min_distance <= enough;
}

}  // namespace adaptive_bvh
