// The functions of continuous_collision.h: check arguments and convert motions to double precision.
#include "adaptive_bvh/continuous_collision.h"

#include <array>
#include <string>

#include "base/leased.h"
#include "base/rigid.h"
#include "ccd/placed_motion.h"

namespace adaptive_bvh {
namespace {

/// Throws std::invalid_argument if a transform is not rigid, and like PlacedMotion.
template <typename S>
PlacedMotion placedMotion(const Motion<S>& motion, PlacedMotion::Memory& memory) {
  requireRigid(motion.start_tf);
  requireRigid(motion.end_tf);
  return {stateOf(*motion.mesh),
          motion.start,
          motion.end,
          fcl::Transform3d(motion.start_tf.template cast<double>()),
          fcl::Transform3d(motion.end_tf.template cast<double>()),
          memory};
}

/// Returns run(query) for two meshes, or for one mesh and itself if `second` is null.
template <typename S, typename Run>
auto withQuery(const Motion<S>& first, const Motion<S>* second, double separation, Run&& run) {
  const Leased<std::array<PlacedMotion::Memory, 2>> memory;
  requireSeparation(separation);
  const PlacedMotion a(placedMotion(first, (*memory)[0]));
  if (!second) return run(a.with(a, separation));
  const PlacedMotion b(placedMotion(*second, (*memory)[1]));
  return run(a.with(b, separation));
}

/// Throws std::invalid_argument if a pair of features does not exist in the query's meshes.
void requirePair(const ContinuousQuery& query, FeatureKind kind, const FeaturePair& pair) {
  const auto count = [](const MovingMesh& mesh, FeatureKind k, FeatureKind vertex) {
    return k == vertex                  ? mesh.num_vertices
           : k == FeatureKind::EdgeEdge ? 3 * mesh.num_triangles
                                        : mesh.num_triangles;
  };
  if (query.isSelf() && kind == FeatureKind::FaceVertex)
    refuseMotion("within one mesh a pair of a vertex and a face is a VertexFace");
  if (pair.first >= count(query.first, kind, FeatureKind::VertexFace) ||
      pair.second >= count(query.second, kind, FeatureKind::FaceVertex))
    refuseMotion("a pair names a feature that is not there");
}

/// The time of impact of one pair. `second` is null for one mesh and itself.
template <typename S>
double timeOf(const Motion<S>& first, const Motion<S>* second, FeatureKind kind,
              const FeaturePair& pair, double separation) {
  return withQuery(first, second, separation, [&](const ContinuousQuery& query) {
    requirePair(query, kind, pair);
    return movingFeatures(query.first, query.second, kind, pair).timeOfImpact(separation);
  });
}

/// The times of impact of all pairs.
template <typename S>
void timesOf(const Motion<S>& first, const Motion<S>* second, const FeaturePairs& pairs,
             double separation, ImpactTimes& times) {
  withQuery(first, second, separation, [&](const ContinuousQuery& query) {
    const auto require = [&](FeatureKind kind, const std::vector<FeaturePair>& list) {
      for (const FeaturePair& pair : list) requirePair(query, kind, pair);
    };
    require(FeatureKind::VertexFace, pairs.vertex_face);
    require(FeatureKind::FaceVertex, pairs.face_vertex);
    require(FeatureKind::EdgeEdge, pairs.edge_edge);
    findTimes(query, pairs, times);
  });
}

}  // namespace

template <typename S>
Motion<S>::Motion(const Mesh& moving, const Transform& from_tf, const Transform& to_tf)
    : mesh(&moving),
      start(moving.previousVertices().data()),
      end(moving.vertices().data()),
      start_tf(from_tf),
      end_tf(to_tf) {
  if (moving.previousVertices().empty())
    refuseMotion(
        "the mesh has no positions of the step before: call updateTwoFrames, or give both "
        "positions");
}

template <typename S>
Motion<S>::Motion(const Mesh& moving, const Point* from, const Point* to, std::size_t count,
                  const Transform& from_tf, const Transform& to_tf)
    : mesh(&moving), start(from), end(to), start_tf(from_tf), end_tf(to_tf) {
  if (count != moving.vertices().size())
    refuseMotion(std::to_string(count) + " positions for " +
                 std::to_string(moving.vertices().size()) + " vertices");
  if (count > 0 && (!from || !to)) refuseMotion("a null pointer for positions");
}

template <typename S>
Motion<S>::Motion(const Mesh& moving, const std::vector<Point>& from, const std::vector<Point>& to,
                  const Transform& from_tf, const Transform& to_tf)
    : Motion(moving, from.data(), to.data(), from.size(), from_tf, to_tf) {
  if (to.size() != from.size())
    refuseMotion(std::to_string(from.size()) + " positions at the start, " +
                 std::to_string(to.size()) + " at the end");
}

template <typename S>
Motion<S>::Motion(const Mesh& moving, std::shared_ptr<const Positions> from_and_to,
                  const Transform& from_tf, const Transform& to_tf)
    : Motion(moving, from_and_to->front(), from_and_to->back(), from_tf, to_tf) {
  kept = std::move(from_and_to);
}

template <typename S>
void candidates(const Motion<S>& first, const Motion<S>& second, double separation,
                FeaturePairs& pairs) {
  withQuery(first, &second, separation,
            [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}
template <typename S>
void candidates(const Motion<S>& mesh, double separation, FeaturePairs& pairs) {
  withQuery<S>(mesh, nullptr, separation,
               [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}

template <typename S>
double timeOfImpact(const Motion<S>& first, const Motion<S>& second, FeatureKind kind,
                    const FeaturePair& pair, double separation) {
  return timeOf(first, &second, kind, pair, separation);
}
template <typename S>
double timeOfImpact(const Motion<S>& mesh, FeatureKind kind, const FeaturePair& pair,
                    double separation) {
  return timeOf<S>(mesh, nullptr, kind, pair, separation);
}

template <typename S>
void timesOfImpact(const Motion<S>& first, const Motion<S>& second, const FeaturePairs& pairs,
                   double separation, ImpactTimes& times) {
  timesOf(first, &second, pairs, separation, times);
}
template <typename S>
void timesOfImpact(const Motion<S>& mesh, const FeaturePairs& pairs, double separation,
                   ImpactTimes& times) {
  timesOf<S>(mesh, nullptr, pairs, separation, times);
}

template <typename S>
Impact earliestImpact(const Motion<S>& first, const Motion<S>& second, double separation) {
  return withQuery(first, &second, separation,
                   [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}
template <typename S>
Impact earliestImpact(const Motion<S>& mesh, double separation) {
  return withQuery<S>(mesh, nullptr, separation,
                      [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}

template <typename S>
Impact earliestImpact(const Motion<S>& first, const Motion<S>& second, double separation,
                      FeaturePairs& pairs) {
  return withQuery(first, &second, separation,
                   [&](const ContinuousQuery& query) { return findEarliestImpact(query, pairs); });
}
template <typename S>
Impact earliestImpact(const Motion<S>& mesh, double separation, FeaturePairs& pairs) {
  return withQuery<S>(mesh, nullptr, separation, [&](const ContinuousQuery& query) {
    return findEarliestImpact(query, pairs);
  });
}

template <typename S>
void safeDisplacements(const Motion<S>& first, const Motion<S>& second, double separation,
                       std::vector<double>& of_first, std::vector<double>& of_second) {
  withQuery(first, &second, separation, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_first, of_second);
  });
}
template <typename S>
void safeDisplacements(const Motion<S>& mesh, double separation, std::vector<double>& of_vertices) {
  withQuery<S>(mesh, nullptr, separation, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_vertices, of_vertices);
  });
}

template <typename S>
void truncateMotion(const Motion<S>& first, const Motion<S>& second, double separation,
                    std::vector<double>& shares_of_first, std::vector<double>& shares_of_second) {
  withQuery(first, &second, separation, [&](const ContinuousQuery& query) {
    findTruncation(query, shares_of_first, shares_of_second);
  });
}
template <typename S>
void truncateMotion(const Motion<S>& mesh, double separation, std::vector<double>& shares) {
  withQuery<S>(mesh, nullptr, separation,
               [&](const ContinuousQuery& query) { findTruncation(query, shares, shares); });
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template struct Motion<S>;                                                                     \
  template void candidates(const Motion<S>&, const Motion<S>&, double, FeaturePairs&);           \
  template void candidates(const Motion<S>&, double, FeaturePairs&);                             \
  template double timeOfImpact(const Motion<S>&, const Motion<S>&, FeatureKind,                  \
                               const FeaturePair&, double);                                      \
  template double timeOfImpact(const Motion<S>&, FeatureKind, const FeaturePair&, double);       \
  template void timesOfImpact(const Motion<S>&, const Motion<S>&, const FeaturePairs&, double,   \
                              ImpactTimes&);                                                     \
  template void timesOfImpact(const Motion<S>&, const FeaturePairs&, double, ImpactTimes&);      \
  template Impact earliestImpact(const Motion<S>&, const Motion<S>&, double);                    \
  template Impact earliestImpact(const Motion<S>&, double);                                      \
  template Impact earliestImpact(const Motion<S>&, const Motion<S>&, double, FeaturePairs&);     \
  template Impact earliestImpact(const Motion<S>&, double, FeaturePairs&);                       \
  template void safeDisplacements(const Motion<S>&, const Motion<S>&, double,                    \
                                  std::vector<double>&, std::vector<double>&);                   \
  template void safeDisplacements(const Motion<S>&, double, std::vector<double>&);               \
  template void truncateMotion(const Motion<S>&, const Motion<S>&, double, std::vector<double>&, \
                               std::vector<double>&);                                            \
  template void truncateMotion(const Motion<S>&, double, std::vector<double>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
