// Continuous collision queries: trees of swept boxes, and a visitor of the pairs of features found.
#include "ccd/continuous_search.h"

#include <algorithm>
#include <array>

#include "ccd/earliest_impact.h"
#include "ccd/feature_search.h"
#include "ccd/swept_boxes.h"

namespace adaptive_bvh {
namespace {

/// The end of the interval that is searched first: vertices move by about half an edge in it, so
/// that swept boxes are small.
double firstPart(const ContinuousQuery& query) {
  const double motion =
      std::max(MeanLengths(query.first).motionInEdges(), MeanLengths(query.second).motionInEdges());
  return motion < 1 ? 1 : std::max(1 / (2 * motion), 1. / 64);
}

/// Finds the earliest impact: searches intervals in turn, up to the first one with an impact. With
/// kLists it also lists all candidates: by the same traversal if motions are short.
template <bool kLists>
Impact earliestImpact(const ContinuousQuery& query, FeaturePairs& pairs) {
  TimeInterval part{0, firstPart(query)};
  if (kLists && part.end < 1) {
    findCandidates(query, pairs);
    return earliestImpact<false>(query, pairs);
  }
  SweptBoxes boxes(query);
  std::atomic<double> best{1};
  for (;;) {
    const SweptPair pair = boxes.overInterval(part);
    EarliestImpact<kLists> visitor(pair, boxes.frame(), part, query.separation, best, pairs);
    searchFeatures(pair, visitor, query.threads);
    if (visitor.impact().exists() || part.end == 1) return visitor.impact();
    part = {part.end, part.end > 0.2 ? 1 : 4 * part.end};
  }
}

}  // namespace

MovingFeatures movingFeatures(const MovingMesh& first, const MovingMesh& second, FeatureKind kind,
                              const FeaturePair& pair) {
  using Corners = std::array<fcl::Vector3d, 4>;
  const double error = std::max(first.error, second.error);
  if (kind == FeatureKind::EdgeEdge) {
    const auto a = edgeVertices(first.triangles, pair.first);
    const auto b = edgeVertices(second.triangles, pair.second);
    const auto corners = [&](const fcl::Vector3d* x, const fcl::Vector3d* y) -> Corners {
      return {x[a[0]], x[a[1]], y[b[0]], y[b[1]]};
    };
    return {kind, corners(first.start, second.start), corners(first.end, second.end), error};
  }
  const bool swapped = kind == FeatureKind::FaceVertex;
  const MovingMesh &points = swapped ? second : first, &faces = swapped ? first : second;
  const unsigned vertex = swapped ? pair.second : pair.first;
  const fcl::Triangle& t = faces.triangles[swapped ? pair.first : pair.second];
  const auto corners = [&](const fcl::Vector3d* x, const fcl::Vector3d* y) -> Corners {
    return {x[vertex], y[t[0]], y[t[1]], y[t[2]]};
  };
  return {kind, corners(points.start, faces.start), corners(points.end, faces.end), error};
}

void findCandidates(const ContinuousQuery& query, FeaturePairs& pairs) {
  SweptBoxes boxes(query);
  const SweptPair pair = boxes.overInterval({});
  FeatureLists lists(pair, pairs);
  searchFeatures(pair, lists, query.threads);
}

void findTimes(const ContinuousQuery& query, const FeaturePairs& pairs, ImpactTimes& times) {
  const TaskPool pool(query.threads);
  const auto find = [&](FeatureKind kind, const std::vector<FeaturePair>& list,
                        std::vector<double>& list_times) {
    constexpr int kPart = 256;  // pairs of a task
    const int size = static_cast<int>(list.size());
    list_times.resize(list.size());
    pool.forEach((size + kPart - 1) / kPart, [&](int part, int) {
      for (int i = part * kPart; i < std::min(size, (part + 1) * kPart); ++i) {
        const auto k = static_cast<std::size_t>(i);
        list_times[k] =
            movingFeatures(query.first, query.second, kind, list[k]).timeOfImpact(query.separation);
      }
    });
  };
  find(FeatureKind::VertexFace, pairs.vertex_face, times.vertex_face);
  find(FeatureKind::FaceVertex, pairs.face_vertex, times.face_vertex);
  find(FeatureKind::EdgeEdge, pairs.edge_edge, times.edge_edge);
}

Impact findEarliestImpact(const ContinuousQuery& query) {
  FeaturePairs none;
  return earliestImpact<false>(query, none);
}

Impact findEarliestImpact(const ContinuousQuery& query, FeaturePairs& pairs) {
  return earliestImpact<true>(query, pairs);
}

}  // namespace adaptive_bvh
