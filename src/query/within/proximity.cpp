#include <algorithm>
#include <stdexcept>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "query/closed_surface.h"
#include "query/depth/depth_meshes.h"
#include "query/single_precision.h"
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
  FeatureSink(const PairInput& input, const FeatureProximityRequest<double>& request, bool is_self,
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
        return append(pair.features, request_.vertex_face, result_.vertex_face);
      case FeatureKind::FaceVertex:
        return append(pair.features, request_.face_vertex, result_.face_vertex);
      case FeatureKind::EdgeEdge:
        return append(pair.features, request_.edge_edge, result_.edge_edge);
    }
  }
  static void append(const FeaturePair& pair, const IgnoredPairs& ignored,
                     std::vector<FeaturePair>& pairs) {
    if (!isIgnored(ignored, pair.first, pair.second)) appendPair(pair.first, pair.second, pairs);
  }
  static double radiusOf(const PlacedMesh& mesh) { return mesh.bounds().aabb_radius; }

  const PairInput& in_;
  const FeatureProximityRequest<double>& request_;
  const FeatureTests tests_;
  const bool is_self_;
  Result& result_;
};

/// Returns a mesh whose own frame is the world.
template <typename S>
PlacedMesh inItsFrame(const DeformableMesh<S>& mesh) {
  return {stateOf(mesh), fcl::Transform3d(fcl::Transform3d::Identity())};
}

}  // namespace

void findPairsWithin(const PairOfMeshes& meshes, const ProximityRequest<double>& request,
                     TrianglePairs<double>& result) {
  requireSorted(request.ignored);
  collectPairs(meshes, request.distance,
               [&](const PairInput& input) { return PairSink(input, request, false, result); });
}
void findPairsWithin(const PlacedMesh& mesh, const ProximityRequest<double>& request,
                     NeighbourFilter filter, TrianglePairs<double>& result) {
  requireSortedOfSelf(request.ignored);
  collectOwnPairs(mesh, request.distance, filter, filter == NeighbourFilter::SharedVertex,
                  [&](const PairInput& input) { return PairSink(input, request, true, result); });
}

void findFeaturePairsWithin(const PairOfMeshes& meshes,
                            const FeatureProximityRequest<double>& request, FeaturePairs& result) {
  requireSorted(request.vertex_face);
  requireSorted(request.face_vertex);
  requireSorted(request.edge_edge);
  collectPairs(meshes, request.distance,
               [&](const PairInput& input) { return FeatureSink(input, request, false, result); });
}
void findFeaturePairsWithin(const PlacedMesh& mesh, const FeatureProximityRequest<double>& request,
                            FeaturePairs& result) {
  requireSorted(request.vertex_face);
  requireSorted(request.face_vertex);
  requireSortedOfSelf(request.edge_edge);
  collectOwnPairs(mesh, request.distance, NeighbourFilter::None, true, [&](const PairInput& input) {
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

template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                        const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                        const ProximityRequest<S>& request, TrianglePairs<S>& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  answerInDouble(result, [&](TrianglePairs<double>& pairs) {
    findPairsWithin(PairOfMeshes(first, tf1, second, tf2), inDouble(request), pairs);
  });
  return result.size();
}

template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& mesh, const ProximityRequest<S>& request,
                        TrianglePairs<S>& result, NeighbourFilter filter) {
  if (filter == NeighbourFilter::BeyondShared)
    throw std::invalid_argument(
        "adaptive_bvh: pairsWithin has no filter BeyondShared: neighbours are at the distance 0");
  requireDistance(request.distance);
  answerInDouble(result, [&](TrianglePairs<double>& pairs) {
    findPairsWithin(inItsFrame(mesh), inDouble(request), filter, pairs);
  });
  return result.size();
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  findFeaturePairsWithin(PairOfMeshes(first, tf1, second, tf2), inDouble(request), result);
  return result.size();
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               NonDeduced<S> distance, FeaturePairs& result) {
  return featurePairsWithin(first, tf1, second, tf2, FeatureProximityRequest<S>{distance}, result);
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh,
                               const FeatureProximityRequest<S>& request, FeaturePairs& result) {
  requireDistance(request.distance);
  findFeaturePairsWithin(inItsFrame(mesh), inDouble(request), result);
  return result.size();
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh, NonDeduced<S> distance,
                               FeaturePairs& result) {
  return featurePairsWithin(mesh, FeatureProximityRequest<S>{distance}, result);
}

template <typename S>
bool isNearer(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
              const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
              NonDeduced<S> distance, bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid)
    for (const DeformableMesh<S>* mesh : {&first, &second})
      requireClosed(stateOf(*mesh), "isNearer of solid bodies");
  const PairOfMeshes meshes(first, tf1, second, tf2);
  return isNearer(meshes, static_cast<double>(distance)) ||
         (solid &&
          (isContained(meshes.first, meshes.second) || isContained(meshes.second, meshes.first)));
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                               \
  template std::size_t pairsWithin(const DeformableMesh<S>&, const fcl::Transform3<S>&,           \
                                   const DeformableMesh<S>&, const fcl::Transform3<S>&,           \
                                   const ProximityRequest<S>&, TrianglePairs<S>&);                \
  template std::size_t pairsWithin(const DeformableMesh<S>&, const ProximityRequest<S>&,          \
                                   TrianglePairs<S>&, NeighbourFilter);                           \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                          const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                          const FeatureProximityRequest<S>&, FeaturePairs&);      \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                          const DeformableMesh<S>&, const fcl::Transform3<S>&, S, \
                                          FeaturePairs&);                                         \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&,                               \
                                          const FeatureProximityRequest<S>&, FeaturePairs&);      \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&, S, FeaturePairs&);            \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&,                     \
                         const DeformableMesh<S>&, const fcl::Transform3<S>&, S, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
