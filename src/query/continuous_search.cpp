#include "query/continuous_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "query/earliest_impact.h"
#include "query/feature_lists.h"
#include "query/safe_displacements.h"

namespace adaptive_bvh {
namespace {

/// The swept boxes of a query, in memory that the thread keeps.
class SweptBoxes {
 public:
  explicit SweptBoxes(const ContinuousQuery& query)
      : query_(query), frame_(query.first, query.second) {}

  /// Each grown by half of the separation.
  SweptPair sweep(const TimeInterval& interval) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh) {
      tree.refit(mesh, frame_, interval, query_.separation / 2);
    });
  }
  /// Vertices as far from their starts as `of_first` and `of_second` say, or `most`.
  SweptPair reach(const std::vector<double>& of_first, const std::vector<double>& of_second,
                  double most) {
    return pairAfter([&](SweptTree& tree, const MovingMesh& mesh) {
      const std::vector<double>& reaches = &mesh == &query_.first ? of_first : of_second;
      tree.refitToReach(mesh, frame_, reaches, most, query_.separation / 2);
    });
  }
  const SweptFrame& frame() const { return frame_; }

 private:
  template <typename Refit>
  SweptPair pairAfter(Refit&& refit) {
    static thread_local SweptTree trees[2];
    refit(trees[0], query_.first);
    if (!query_.isSelf()) refit(trees[1], query_.second);
    return {query_.first, trees[0], query_.second, trees[query_.isSelf() ? 0 : 1]};
  }

  const ContinuousQuery& query_;
  const SweptFrame frame_;
};

/// Means of some triangles.
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
  double motionInEdges() const { return motion / std::max(edge, 1e-300); }
};

/// The first part of the motion that is searched: so short that vertices move by less than an
/// edge's length. Swept boxes are small then; and once an impact is found nothing later is looked
/// for.
double firstPart(const ContinuousQuery& query) {
  const double motion =
      std::max(MeanLengths(query.first).motionInEdges(), MeanLengths(query.second).motionInEdges());
  return motion < 1 ? 1 : std::max(1 / (2 * motion), 1. / 64);
}

template <bool kIsSelf>
Impact earliestImpact(const ContinuousQuery& query) {
  SweptBoxes boxes(query);
  std::atomic<double> best{1};
  TimeInterval part{0, firstPart(query)};
  for (;;) {
    const SweptPair pair = boxes.sweep(part);
    EarliestImpact<kIsSelf> visitor(pair, boxes.frame(), part, query.separation, best);
    searchFeatures<kIsSelf>(pair, visitor, query.threads);
    if (visitor.impact().happens() || part.end == 1) return visitor.impact();
    part = {part.end, part.end > 0.2 ? 1 : 4 * part.end};
  }
}

/// All candidates and, where the whole motion is searched at once, the earliest impact.
template <bool kIsSelf>
Impact listAll(const ContinuousQuery& query, FeaturePairs& pairs) {
  if (firstPart(query) < 1) {
    findCandidates(query, pairs);
    return earliestImpact<kIsSelf>(query);
  }
  SweptBoxes boxes(query);
  std::atomic<double> best{1};
  const SweptPair pair = boxes.sweep({});
  const FeatureLists<kIsSelf> lists(query.first, query.second, pairs);
  ListsAndImpact<kIsSelf> visitor(lists, {pair, boxes.frame(), {}, query.separation, best});
  searchFeatures<kIsSelf>(pair, visitor, query.threads);
  return visitor.impact();
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
  const SweptPair pair = boxes.sweep({});
  const auto search = [&](auto is_self) {
    constexpr bool kIsSelf = decltype(is_self)::value;
    FeatureLists<kIsSelf> lists(query.first, query.second, pairs);
    searchFeatures<kIsSelf>(pair, lists, query.threads);
  };
  query.isSelf() ? search(std::true_type()) : search(std::false_type());
}

void findTimes(const ContinuousQuery& query, const FeaturePairs& pairs, ImpactTimes& times) {
  const TaskPool pool(query.threads);
  const auto find = [&](FeatureKind kind, const std::vector<FeaturePair>& of,
                        std::vector<double>& to) {
    constexpr int kPart = 256;
    const int size = static_cast<int>(of.size());
    to.resize(of.size());
    pool.forEach((size + kPart - 1) / kPart, [&](int part, int) {
      for (int i = part * kPart; i < std::min(size, (part + 1) * kPart); ++i) {
        const auto at = static_cast<std::size_t>(i);
        to[at] =
            movingFeatures(query.first, query.second, kind, of[at]).timeOfImpact(query.separation);
      }
    });
  };
  find(FeatureKind::VertexFace, pairs.vertex_face, times.vertex_face);
  find(FeatureKind::FaceVertex, pairs.face_vertex, times.face_vertex);
  find(FeatureKind::EdgeEdge, pairs.edge_edge, times.edge_edge);
}

Impact findEarliestImpact(const ContinuousQuery& query) {
  return query.isSelf() ? earliestImpact<true>(query) : earliestImpact<false>(query);
}

Impact findEarliestImpact(const ContinuousQuery& query, FeaturePairs& pairs) {
  return query.isSelf() ? listAll<true>(query, pairs) : listAll<false>(query, pairs);
}

/// First of what is near: that leaves little to the vertices of most meshes, so that few pairs are
/// within reach of each other in the end.
void findSafeDisplacements(const ContinuousQuery& query, std::vector<double>& of_first,
                           std::vector<double>& of_second) {
  SafeDisplacements<false>::setToMotion(query.first, of_first);
  if (!query.isSelf()) SafeDisplacements<false>::setToMotion(query.second, of_second);
  SweptBoxes boxes(query);
  const auto search = [&](auto is_self, const SweptPair& pair) {
    constexpr bool kIsSelf = decltype(is_self)::value;
    SafeDisplacements<kIsSelf> displacements(pair, query.separation, of_first, of_second);
    searchFeatures<kIsSelf>(pair, displacements, 1);
  };
  const auto largest = [](const std::vector<double>& lengths) {
    return lengths.empty() ? 0. : *std::max_element(lengths.begin(), lengths.end());
  };
  constexpr double kFarther = 4;
  double reach = std::max(MeanLengths(query.first).edge, MeanLengths(query.second).edge);
  for (bool is_last = false; !is_last; reach *= kFarther) {
    is_last = !(reach < std::max(largest(of_first), largest(of_second)) && reach > 0);
    const SweptPair pair =
        boxes.reach(of_first, of_second, is_last ? std::numeric_limits<double>::infinity() : reach);
    query.isSelf() ? search(std::true_type(), pair) : search(std::false_type(), pair);
  }
}

}  // namespace adaptive_bvh
