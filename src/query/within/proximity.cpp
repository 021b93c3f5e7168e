#include <algorithm>
#include <stdexcept>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "base/shortcut.h"
#include "boxes/flat_patches.h"
#include "mesh/feature_owners.h"
#include "query/closed_surface.h"
#include "query/depth/depth_meshes.h"
#include "query/single_precision.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "query/within/found_parts.h"
#include "query/within/near_pairs.h"
#include "query/within/near_search.h"
#include "query/within/within_tests.h"
#include "triangles/feature_distance.h"
#include "triangles/triangle_intersection.h"

// The queries of proximity.h for pairs: pairsWithin, featurePairsWithin and isNearer.
namespace adaptive_bvh {
namespace {

/// A sink of WithinTests that writes the near features of near triangles into a result: those that
/// the triangles own (FeatureOwners), so each pair of features occurs once.
class FeatureSink {
 public:
  using Result = FeaturePairs;
  static constexpr int kBatch = 256;
  static constexpr bool kStopsAtFirst = false;

  /// `is_self`: one mesh with itself; features with a vertex in common are left out.
  FeatureSink(const PairInput& input, const FeatureProximityRequest<double>& request, bool is_self,
              Result& result)
      : in_(input),
        request_(request),
        owners1_(input.first.mesh.topology->owners),
        owners2_(input.second.mesh.topology->owners),
        is_self_(is_self),
        rounding_(kRounding * (sizeOf(input.first) + sizeOf(input.second))),
        result_(result) {}

  static bool needsGap() { return false; }
  static bool isDone() { return false; }
  void clear() { result_.clear(); }

  /// Adds the near pairs of features of two near triangles.
  void add(const LeafIndexPair& pair, const TriangleGap*) {
    const Triangle a{in_.tree1.corners(pair.first), owners1_[pair.first],
                     in_.pointsOfFirst(pair.first)};
    const Triangle b{in_.tree2.corners(pair.second), owners2_[pair.second],
                     in_.pointsOfSecond(pair.second)};
    const auto addVertexFace = [&](unsigned v, unsigned t) {
      append(v, t, request_.vertex_face, result_.vertex_face);
    };
    addVertices(a, b, addVertexFace);
    addVertices(b, a, [&](unsigned v, unsigned t) {
      if (is_self_)
        addVertexFace(v, t);
      else
        append(t, v, request_.face_vertex, result_.face_vertex);
    });
    addEdges(a, b);
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
  /// A triangle of a near pair.
  struct Triangle {
    const Int4& vertices;           ///< the indices of its vertices
    const FeatureOwner& owner;      ///< its own index, and the features that it owns
    TrianglePoints<double> points;  ///< its corners in the first mesh's frame
  };

  static void append(unsigned first, unsigned second, const IgnoredPairs& ignored,
                     std::vector<FeaturePair>& pairs) {
    if (!isIgnored(ignored, first, second)) appendPair(first, second, pairs);
  }
  static double sizeOf(const PlacedMesh& mesh) { return mesh.bounds().aabb_radius; }
  /// Whether two features are near, given their computed distance. touches(): exact test whether
  /// they have a common point, called if rounding could hide that.
  template <typename Touches>
  bool isNear(double distance, const Touches& touches) const {
    if (distance > rounding_) return distance <= in_.distance;
    return (in_.distance > 0 && distance <= in_.distance) || touches();
  }
  bool areSame(int vertex1, int vertex2) const { return is_self_ && vertex1 == vertex2; }

  /// Calls add(vertex, triangle) for the vertices that `owner` owns and that are near the face.
  template <typename Add>
  void addVertices(const Triangle& owner, const Triangle& face, const Add& add) const {
    for (unsigned k = 0; k < 3; ++k) {
      const int v = owner.vertices[k];
      if (!owner.owner.ownsVertex(k) || areSame(v, face.vertices[0]) ||
          areSame(v, face.vertices[1]) || areSame(v, face.vertices[2]))
        continue;
      const fcl::Vector3d& x = owner.points[k];
      const auto touches = [&] { return touch({x, x, x}, face.points); };
      if (isNear(vertexFaceDistance<double>(x, face.points).distance, touches))
        add(static_cast<unsigned>(v), face.owner.triangle);
    }
  }
  /// Adds the near pairs of edges that the two triangles own.
  void addEdges(const Triangle& a, const Triangle& b) const {
    for (unsigned i = 0; i < 3; ++i)
      for (unsigned j = 0; j < 3; ++j)
        if (a.owner.ownsEdge(i) && b.owner.ownsEdge(j)) addEdge(a, i, b, j);
  }
  /// Adds edge i of triangle a and edge j of b, if these are near.
  void addEdge(const Triangle& a, unsigned i, const Triangle& b, unsigned j) const {
    const unsigned i1 = (i + 1) % 3, j1 = (j + 1) % 3;
    for (const unsigned end : {i, i1})
      if (areSame(a.vertices[end], b.vertices[j]) || areSame(a.vertices[end], b.vertices[j1]))
        return;
    const fcl::Vector3d &p = a.points[i], &p1 = a.points[i1], &q = b.points[j], &q1 = b.points[j1];
    const auto touches = [&] { return touch({p, p1, p1}, {q, q1, q1}); };
    if (!isNear(edgeEdgeDistance<double>({p, p1}, {q, q1}).distance, touches)) return;
    const unsigned first = 3 * a.owner.triangle + i, second = 3 * b.owner.triangle + j;
    const bool swaps = is_self_ && first > second;
    append(swaps ? second : first, swaps ? first : second, request_.edge_edge, result_.edge_edge);
  }

  const PairInput& in_;
  const FeatureProximityRequest<double>& request_;
  const FeatureOwners &owners1_, &owners2_;
  const bool is_self_;
  static constexpr double kRounding = 0x1p-44;  // relative to the bodies' sizes
  const double rounding_;  ///< upper bound of the computed distance of features that touch
  Result& result_;
};

/// Passes all near pairs of triangles to the sink, on the meshes' query threads.
template <typename Frame, typename Sink>
void collect(const PairInput& input, const Frame& frame, Sink& sink) {
  searchAll<WithinTests<Frame, Sink>>(
      std::max(input.first.mesh.query_threads, input.second.mesh.query_threads), input.trees(frame),
      sink, input, frame);
}

/// Collects the near pairs of two meshes in the sink that makeSink(input) returns.
template <typename MakeSink>
void collectPairs(const PairOfMeshes& meshes, double distance, const MakeSink& makeSink) {
  TreePair trees(meshes.first, meshes.second);
  alignIfNear(trees, distance);
  const PairInput input(trees, distance);
  auto sink = makeSink(input);
  searchInFrame(
      trees, [&](const auto& frame) { collect(input, frame, sink); },
      [&] { testAllPairs(input, sink); });
}

/// Collects the near pairs of one mesh with itself. `skips_flat`: whether pairs with a common
/// vertex do not count, so that nodes of FlatPatches need not be searched.
template <typename MakeSink>
void collectOwnPairs(const PlacedMesh& placed, double distance, NeighbourFilter filter,
                     bool skips_flat, const MakeSink& makeSink) {
  const FlatPatches flat(placed.tree(), placed.mesh.topology->contours, distance);
  PairInput input(placed, filter, distance);
  // At larger distances hardly a node is flat: the heights of triangles must exceed the distance.
  if (skips_flat && isTaken(Shortcut::FlatPatches) && distance < 0.7 * meanEdge(placed.mesh))
    input.flat = &flat;
  auto sink = makeSink(input);
  collect(input, SameFrame(), sink);
}

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
    return compare(meshes, distance, pair, lower_bound);
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
                               S distance, FeaturePairs& result) {
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
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh, S distance, FeaturePairs& result) {
  return featurePairsWithin(mesh, FeatureProximityRequest<S>{distance}, result);
}

template <typename S>
bool isNearer(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
              const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2, S distance,
              bool solid) {
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
