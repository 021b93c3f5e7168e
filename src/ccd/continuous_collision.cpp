// The functions of continuous_collision.h: check arguments.
#include "adaptive_bvh/continuous_collision.h"

#include <array>
#include <string>

#include "base/leased.h"
#include "base/rigid.h"
#include "ccd/placed_motion.h"

namespace adaptive_bvh {
namespace {

/// Throws std::invalid_argument if the motion is not that of a mesh on a straight path, if a
/// transform is not rigid, and like PlacedMotion.
PlacedMotion placedMotion(const Motion& motion, PlacedMotion::Memory& memory) {
  if (!motion.mesh)
    refuseMotion(
        "a motion of a shape, which has no features; leastDistance and intervalsBelow "
        "take it, and so does a mesh of the shape");
  if (motion.path != FramePath::Straight)
    refuseMotion(
        "the path of a motion is a screw; features move on straight lines: divide the "
        "screw into short straight motions, or use leastDistance");
  requireRigid(motion.start_tf);
  requireRigid(motion.end_tf);
  const MeshState& mesh = stateOf(*motion.mesh);
  const fcl::Vector3d* const present = motion.start ? nullptr : mesh.vertices.data();
  const fcl::Vector3d *start = present ? present : motion.start,
                      *end = present ? present : motion.end;
  return {mesh, start, end, motion.start_tf, motion.end_tf, memory};
}

/// Returns run(query) for two meshes, or for one mesh and itself if `second` is null.
template <typename Run>
auto withQuery(const Motion& first, const Motion* second, double distance, Run&& run) {
  const Leased<std::array<PlacedMotion::Memory, 2>> memory;
  requireSeparation(distance);
  const PlacedMotion a(placedMotion(first, (*memory)[0]));
  if (!second) return run(a.with(a, distance));
  const PlacedMotion b(placedMotion(*second, (*memory)[1]));
  return run(a.with(b, distance));
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
double timeOf(const Motion& first, const Motion* second, FeatureKind kind, const FeaturePair& pair,
              double distance) {
  return withQuery(first, second, distance, [&](const ContinuousQuery& query) {
    requirePair(query, kind, pair);
    return movingFeatures(query.first, query.second, kind, pair).timeOfImpact(distance);
  });
}

/// The times of impact of all pairs.
void timesOf(const Motion& first, const Motion* second, const FeaturePairs& pairs, double distance,
             ImpactTimes& times) {
  withQuery(first, second, distance, [&](const ContinuousQuery& query) {
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

Motion::Motion(const Mesh& moving, const Transform& from_tf, const Transform& to_tf,
               FramePath frame_path)
    : Motion(moving, &moving, from_tf, to_tf, frame_path) {
  start = moving.previousVertices().data();
  end = moving.vertices().data();
  if (moving.previousVertices().empty())
    refuseMotion(
        "the mesh has no positions of the step before: call updateTwoFrames, or give both "
        "positions");
}

Motion::Motion(const Mesh& moving, const Point* from, const Point* to, std::size_t count,
               const Transform& from_tf, const Transform& to_tf, FramePath frame_path)
    : Motion(moving, &moving, from_tf, to_tf, frame_path) {
  start = from;
  end = to;
  if (count != moving.vertices().size())
    refuseMotion(std::to_string(count) + " positions for " +
                 std::to_string(moving.vertices().size()) + " vertices");
  if (count > 0 && (!from || !to)) refuseMotion("a null pointer for positions");
}

Motion::Motion(const Mesh& moving, const std::vector<Point>& from, const std::vector<Point>& to,
               const Transform& from_tf, const Transform& to_tf, FramePath frame_path)
    : Motion(moving, from.data(), to.data(), from.size(), from_tf, to_tf, frame_path) {
  if (to.size() != from.size())
    refuseMotion(std::to_string(from.size()) + " positions at the start, " +
                 std::to_string(to.size()) + " at the end");
}

Motion::Motion(const Mesh& moving, std::shared_ptr<const Positions> from_and_to,
               const Transform& from_tf, const Transform& to_tf, FramePath frame_path)
    : Motion(moving, from_and_to->front(), from_and_to->back(), from_tf, to_tf, frame_path) {
  kept = std::move(from_and_to);
}

Motion Motion::rigid(const Geometry& body, const Transform& from_tf, const Transform& to_tf,
                     FramePath frame_path) {
  return {body, dynamic_cast<const Mesh*>(&body), from_tf, to_tf, frame_path};
}

void candidates(const Motion& first, const Motion& second, double distance, FeaturePairs& pairs) {
  withQuery(first, &second, distance,
            [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}
void selfCandidates(const Motion& mesh, double distance, FeaturePairs& pairs) {
  withQuery(mesh, nullptr, distance,
            [&](const ContinuousQuery& query) { findCandidates(query, pairs); });
}

double timeOfImpact(const Motion& first, const Motion& second, FeatureKind kind,
                    const FeaturePair& pair, double distance) {
  return timeOf(first, &second, kind, pair, distance);
}
double selfTimeOfImpact(const Motion& mesh, FeatureKind kind, const FeaturePair& pair,
                        double distance) {
  return timeOf(mesh, nullptr, kind, pair, distance);
}

void timesOfImpact(const Motion& first, const Motion& second, const FeaturePairs& pairs,
                   double distance, ImpactTimes& times) {
  timesOf(first, &second, pairs, distance, times);
}
void selfTimesOfImpact(const Motion& mesh, const FeaturePairs& pairs, double distance,
                       ImpactTimes& times) {
  timesOf(mesh, nullptr, pairs, distance, times);
}

Impact earliestImpact(const Motion& first, const Motion& second, double distance) {
  return withQuery(first, &second, distance,
                   [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}

Impact selfEarliestImpact(const Motion& mesh, double distance) {
  return withQuery(mesh, nullptr, distance,
                   [](const ContinuousQuery& query) { return findEarliestImpact(query); });
}

Impact earliestImpact(const Motion& first, const Motion& second, double distance,
                      FeaturePairs& pairs) {
  return withQuery(first, &second, distance,
                   [&](const ContinuousQuery& query) { return findEarliestImpact(query, pairs); });
}

Impact selfEarliestImpact(const Motion& mesh, double distance, FeaturePairs& pairs) {
  return withQuery(mesh, nullptr, distance,
                   [&](const ContinuousQuery& query) { return findEarliestImpact(query, pairs); });
}

void safeDisplacements(const Motion& first, const Motion& second, double distance,
                       std::vector<double>& of_first, std::vector<double>& of_second) {
  withQuery(first, &second, distance, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_first, of_second);
  });
}
void selfSafeDisplacements(const Motion& mesh, double distance, std::vector<double>& of_vertices) {
  withQuery(mesh, nullptr, distance, [&](const ContinuousQuery& query) {
    findSafeDisplacements(query, of_vertices, of_vertices);
  });
}

void truncateMotion(const Motion& first, const Motion& second, double distance,
                    std::vector<double>& shares_of_first, std::vector<double>& shares_of_second) {
  withQuery(first, &second, distance, [&](const ContinuousQuery& query) {
    findTruncation(query, shares_of_first, shares_of_second);
  });
}
void selfTruncateMotion(const Motion& mesh, double distance, std::vector<double>& shares) {
  withQuery(mesh, nullptr, distance,
            [&](const ContinuousQuery& query) { findTruncation(query, shares, shares); });
}

}  // namespace adaptive_bvh
