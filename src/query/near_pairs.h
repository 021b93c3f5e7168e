#pragma once

#include "adaptive_bvh/proximity.h"
#include "query/append_pair.h"
#include "query/found_parts.h"
#include "query/within_tests.h"

namespace adaptive_bvh {

/// Whether there is a near pair at all, and which.
struct AnyPair {
  static constexpr int kBatch = 128;
  static constexpr bool kFewAreNear = true;

  bool found = false;
  LeafPair pair{0, 0};

  static bool needsGap() { return false; }
  bool isDone() const { return found; }
  void clear() { found = false; }
  void add(const LeafPair& near, const TriangleGap*) {
    found = true;
    pair = near;
  }
};

/// Writes near pairs into a result.
template <typename S>
class PairSink {
 public:
  using Result = TrianglePairs<S>;
  static constexpr int kBatch = 256;
  static constexpr bool kFewAreNear = false;

  /// `is_self`: the smaller index comes first.
  PairSink(const WithinInput<S>& input, const ProximityRequest<S>& request, bool is_self,
           Result& result)
      : in_(input), request_(request), is_self_(is_self), result_(result) {}

  void clear() { result_.clear(); }
  bool needsGap() const { return request_.enable_distances || request_.enable_nearest_points; }
  static bool isDone() { return false; }

  ADAPTIVE_BVH_INLINE void add(const LeafPair& pair, const TriangleGap* gap) {
    const auto first = static_cast<unsigned>(in_.tree1.triangle(pair.first)),
               second = static_cast<unsigned>(in_.tree2.triangle(pair.second));
    const bool swaps = is_self_ && first > second;
    appendPair(swaps ? second : first, swaps ? first : second, result_.triangles);
    if (!gap) return;  // neither is asked for
    if (request_.enable_distances) result_.distances.push_back(distanceAs<S>(gap->distance));
    if (request_.enable_nearest_points) addPoints(gap->points, swaps);
  }

  /// For another thread.
  PairSink another(Result& result) const { return {in_, request_, is_self_, result}; }
  using Mark = std::size_t;
  Mark mark() const { return result_.size(); }
  /// In place of what the result held: what other sinks were given in tasks, in their order.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    const auto takeAll = [&](auto array, bool is_wanted) {
      if (!is_wanted) return (result_.*array).clear();
      joinParts(tasks, pool, result_.*array, [&](const Found& task) {
        return VectorPart(task.worker->sink().result_.*array, task.from, task.to);
      });
    };
    takeAll(&Result::triangles, true);
    takeAll(&Result::distances, request_.enable_distances);
    takeAll(&Result::nearest_points, request_.enable_nearest_points);
  }

 private:
  void addPoints(const PointPair<double>& points, bool swaps) {
    const auto placed = [&](const fcl::Vector3d& x) -> fcl::Vector3<S> {
      const auto& tf = in_.first.tf.matrix();
      return (tf.template topLeftCorner<3, 3>().template cast<double>() * x +
              tf.template topRightCorner<3, 1>().template cast<double>())
          .template cast<S>();
    };
    result_.nearest_points.push_back({placed(points.first), placed(points.second)});
    if (swaps) std::swap(result_.nearest_points.back()[0], result_.nearest_points.back()[1]);
  }

  const WithinInput<S>& in_;
  const ProximityRequest<S>& request_;
  const bool is_self_;
  Result& result_;
};

}  // namespace adaptive_bvh
