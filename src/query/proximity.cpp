#include "adaptive_bvh/proximity.h"

#include <algorithm>

#include "query/near_features.h"
#include "query/near_pairs.h"
#include "query/pair_of_meshes.h"
#include "query/search_tasks.h"

namespace adaptive_bvh {
namespace {

/// One thread's worker of a query for near pairs (SearchTasks), with a result of its own.
template <typename S, typename Frame, typename Sink>
class WithinWorker {
 public:
  using Search = WithinSearch<S, Frame, Sink>;
  using Mark = typename Sink::Mark;
  using Memory = typename Sink::Result;  ///< that is kept from query to query

  /// `sink`: of the query.
  WithinWorker(const WithinInput<S>& input, const Frame& frame, const Sink& sink, Memory& memory)
      : sink_(sink.another(memory)), search_(input, frame, sink_) {
    memory.clear();
  }

  Mark mark() const { return sink_.mark(); }
  void run(const NodePairs& pairs, std::size_t) { search_.run(pairs); }

  const Sink& sink() const { return sink_; }

 private:
  Sink sink_;
  Search search_;
};

/// What all tasks find, in their order, becomes what the query's sink has.
template <typename S, typename Frame, typename Sink>
void runTasks(const WithinInput<S>& input, const Frame& frame, Sink& sink, const WalkTasks& walks,
              const TaskPool& pool) {
  using Worker = WithinWorker<S, Frame, Sink>;
  auto& memory = workersMemory<typename Worker::Memory>(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, walks, [&](std::size_t slot) {
    return std::make_unique<Worker>(input, frame, sink, memory[slot]);
  });
  sink.take(tasks.found(), pool);
}

template <typename S, typename Frame, typename Sink>
void collect(const WithinInput<S>& input, const Frame& frame, Sink& sink) {
  WithinSearch<S, Frame, Sink> search(input, frame, sink);
  const TaskPool pool(std::max(input.first.mesh.query_threads, input.second.mesh.query_threads));
  runFromRoots(search, pool,
               [&](const WalkTasks& walks) { runTasks(input, frame, sink, walks, pool); });
}

/// Of two meshes.
template <typename S, typename MakeSink>
void collectPairs(const PairOfMeshes<S>& meshes, double distance, const MakeSink& makeSink) {
  TreePair<S> trees(meshes.first, meshes.second);
  alignIfNear(trees, distance);
  const WithinInput<S> input(meshes.first, meshes.second, trees, distance);
  auto sink = makeSink(input);
  searchInFrame(
      trees, [&](const auto& frame) { collect(input, frame, sink); },
      [&] { testAllPairs(input, sink); });
}

/// Of one with itself.
template <typename S, typename MakeSink>
void collectOwnPairs(const DeformableMesh<S>& mesh, double distance, NeighbourFilter filter,
                     const MakeSink& makeSink) {
  const PlacedMesh<S> placed(mesh, fcl::Transform3<S>::Identity());
  const WithinInput<S> input(placed, placed, TreePair<S>(placed, placed), distance, filter);
  auto sink = makeSink(input);
  collect(input, SameFrame(), sink);
}

}  // namespace

template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                        const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                        const ProximityRequest<S>& request, TrianglePairs<S>& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  collectPairs(
      PairOfMeshes<S>(first, tf1, second, tf2), double(request.distance),
      [&](const WithinInput<S>& input) { return PairSink<S>(input, request, false, result); });
  return result.size();
}

template <typename S>
std::size_t pairsWithin(const DeformableMesh<S>& mesh, const ProximityRequest<S>& request,
                        TrianglePairs<S>& result, NeighbourFilter filter) {
  requireDistance(request.distance);
  collectOwnPairs(mesh, double(request.distance), filter, [&](const WithinInput<S>& input) {
    return PairSink<S>(input, request, true, result);
  });
  return result.size();
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
                               const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2,
                               S distance, FeaturePairs& result) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  collectPairs(PairOfMeshes<S>(first, tf1, second, tf2), double(distance),
               [&](const WithinInput<S>& input) { return FeatureSink<S>(input, false, result); });
  return result.size();
}

template <typename S>
std::size_t featurePairsWithin(const DeformableMesh<S>& mesh, S distance, FeaturePairs& result) {
  requireDistance(distance);
  collectOwnPairs(mesh, double(distance), NeighbourFilter::None,
                  [&](const WithinInput<S>& input) { return FeatureSink<S>(input, true, result); });
  return result.size();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                               \
  template std::size_t pairsWithin(const DeformableMesh<S>&, const fcl::Transform3<S>&,           \
                                   const DeformableMesh<S>&, const fcl::Transform3<S>&,           \
                                   const ProximityRequest<S>&, TrianglePairs<S>&);                \
  template std::size_t pairsWithin(const DeformableMesh<S>&, const ProximityRequest<S>&,          \
                                   TrianglePairs<S>&, NeighbourFilter);                           \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&, const fcl::Transform3<S>&,    \
                                          const DeformableMesh<S>&, const fcl::Transform3<S>&, S, \
                                          FeaturePairs&);                                         \
  template std::size_t featurePairsWithin(const DeformableMesh<S>&, S, FeaturePairs&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
