#include <algorithm>
#include <stdexcept>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "query/closed_surface.h"
#include "query/depth/depth_meshes.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "query/within/collect_pairs.h"
#include "query/within/feature_tests.h"
#include "query/within/found_parts.h"
#include "query/within/near_pairs.h"
#include "query/within/near_search.h"
#include "query/within/within_tests.h"

// The queries of proximity.h for pairs: pairsWithin, featurePairsWithin and isNearer.
namespace adaptive_bvh {
namespace {

/// A sink of WithinTests that writes the near features of near triangles into a result.
class FeatureSink {
 public:
  using Result = FeaturePairs;
  static constexpr int kBatch = 256;
  static constexpr bool kStopsAtFirst = false, kTakesUndecided = false, kTakesOpen = true;

  /// `is_self`: one mesh with itself; features with a vertex in common are left out.
  FeatureSink(const PairInput& input, const FeatureProximityRequest& request, bool is_self,
              Result& result)
      : in_(input),
        request_(request),
        tests_(input.distance, radiusOf(input.first) + radiusOf(input.second), is_self),
        is_self_(is_self),
        result_(result) {}

  static bool needsGap() { return false; }
  static bool isDone() { return false; }
  void clear() { result_.clear(); }

  /// Adds the near pairs of features of two triangles.
  void add(const LeafIndexPair& pair, const TriangleGap*) {
    const FeatureTests::Triangle a{in_.tree1.corners(pair.first),
                                   in_.first.mesh.topology->owners[pair.first],
                                   in_.pointsOfFirst(pair.first)},
        b{in_.tree2.corners(pair.second), in_.second.mesh.topology->owners[pair.second],
          in_.pointsOfSecond(pair.second)};
    tests_.forEach(a, b, [&](unsigned number, double, bool is_near) {
      if (is_near) append(tests_.pair(number, a.owner, a.vertices, b.owner, b.vertices));
    });
  }

  /// Returns a sink for another thread, which writes to another result (searchAll).
  FeatureSink another(Result& result) const { return {in_, request_, is_self_, result}; }
  using Mark = FeatureMark;
  Mark mark() const { return markOf(result_); }
  /// Replaces the result by what other sinks received in tasks, in the order of the tasks.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinFeatures(
        tasks, pool, result_,
        [](const Found& task) -> auto& { return task.worker->sink().result_; });
  }

 private:
  void append(const FeatureTests::Pair& pair) {
    switch (pair.kind) {
      case FeatureKind::VertexFace:
        return append(pair.features, request_.ignored.vertex_face, result_.vertex_face);
      case FeatureKind::FaceVertex:
        return append(pair.features, request_.ignored.face_vertex, result_.face_vertex);
      case FeatureKind::EdgeEdge:
        return append(pair.features, request_.ignored.edge_edge, result_.edge_edge);
    }
  }
  static void append(const FeaturePair& pair, const IgnoredPairs& ignored,
                     std::vector<FeaturePair>& pairs) {
    if (!isIgnored(ignored, pair.first, pair.second)) appendPair(pair.first, pair.second, pairs);
  }
  static double radiusOf(const PlacedMesh& mesh) { return mesh.bounds().aabb_radius; }

  const PairInput& in_;
  const FeatureProximityRequest& request_;
  const FeatureTests tests_;
  const bool is_self_;
  Result& result_;
};

/// Returns a mesh whose own frame is the world.
PlacedMesh inItsFrame(const DeformableMesh& mesh) {
  return {stateOf(mesh), fcl::Transform3d(fcl::Transform3d::Identity())};
}

}  // namespace

void findPairsWithin(const PairOfMeshes& meshes, const ProximityRequest& request,
                     TrianglePairs& result) {
  requireSorted(request.ignored, false);
  collectPairs(meshes, request.distance,
               [&](const PairInput& input) { return PairSink(input, request, false, result); });
}
void findPairsWithin(const PlacedMesh& mesh, const ProximityRequest& request,
                     TrianglePairs& result) {
  const LeftOut left_out = {request.ignored.neighbours, surfaceOf(request.ignored, mesh.mesh)};
  if (left_out.filter == NeighbourFilter::BeyondShared)
    throw std::invalid_argument(
        "adaptive_bvh: pairsWithin has no filter BeyondShared: neighbours are at the distance 0");
  requireSorted(request.ignored, true);
  collectOwnPairs(mesh, request.distance, left_out,
                  left_out.filter == NeighbourFilter::SharedVertex,
                  [&](const PairInput& input) { return PairSink(input, request, true, result); });
}

void findFeaturePairsWithin(const PairOfMeshes& meshes, const FeatureProximityRequest& request,
                            FeaturePairs& result) {
  requireSorted(request.ignored, false);
  collectPairs(meshes, request.distance,
               [&](const PairInput& input) { return FeatureSink(input, request, false, result); });
}
void findFeaturePairsWithin(const PlacedMesh& mesh, const FeatureProximityRequest& request,
                            FeaturePairs& result) {
  requireSorted(request.ignored, true);
  const LeftOut left_out = {NeighbourFilter::None, surfaceOf(request.ignored, mesh.mesh)};
  collectOwnPairs(mesh, request.distance, left_out, true, [&](const PairInput& input) {
    return FeatureSink(input, request, true, result);
  });
}

bool isNearer(const PairOfMeshes& meshes, double distance) {
  if (areBallsFarther(meshes.first, meshes.second, meshes.to_first, distance)) return false;
  TrianglePair pair{0, 0};
  if (!isFewEdges(meshes, distance) && canCompare(meshes, distance)) {
    double lower_bound = distance;  // not used
    if (!compare(meshes, distance, pair, lower_bound)) return false;
    if (meshes.isNear(pair, distance)) return true;
  }
  return searchAny(meshes, distance, pair);
}

std::size_t pairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                        const DeformableMesh& second, const fcl::Transform3d& tf2,
                        const ProximityRequest& request, TrianglePairs& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  findPairsWithin(PairOfMeshes(first, tf1, second, tf2), request, result);
  return result.size();
}

std::size_t selfPairsWithin(const DeformableMesh& mesh, const ProximityRequest& request,
                            TrianglePairs& result) {
  requireDistance(request.distance);
  findPairsWithin(inItsFrame(mesh), request, result);
  return result.size();
}

std::size_t featurePairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                               const DeformableMesh& second, const fcl::Transform3d& tf2,
                               const FeatureProximityRequest& request, FeaturePairs& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  findFeaturePairsWithin(PairOfMeshes(first, tf1, second, tf2), request, result);
  return result.size();
}

std::size_t featurePairsWithin(const DeformableMesh& first, const fcl::Transform3d& tf1,
                               const DeformableMesh& second, const fcl::Transform3d& tf2,
                               double distance, FeaturePairs& result) {
  return featurePairsWithin(first, tf1, second, tf2, FeatureProximityRequest{distance}, result);
}

std::size_t selfFeaturePairsWithin(const DeformableMesh& mesh,
                                   const FeatureProximityRequest& request, FeaturePairs& result) {
  requireDistance(request.distance);
  findFeaturePairsWithin(inItsFrame(mesh), request, result);
  return result.size();
}

std::size_t selfFeaturePairsWithin(const DeformableMesh& mesh, double distance,
                                   FeaturePairs& result) {
  return selfFeaturePairsWithin(mesh, FeatureProximityRequest{distance}, result);
}

bool isNearer(const DeformableMesh& first, const fcl::Transform3d& tf1,
              const DeformableMesh& second, const fcl::Transform3d& tf2, double distance,
              bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid)
    for (const DeformableMesh* mesh : {&first, &second})
      requireClosed(stateOf(*mesh), "isNearer of solid bodies");
  const PairOfMeshes meshes(first, tf1, second, tf2);
  return isNearer(meshes, distance) || (solid && (isContained(meshes.first, meshes.second) ||
                                                  isContained(meshes.second, meshes.first)));
}

}  // namespace adaptive_bvh
