#include "adaptive_bvh/proximity.h"

#include <algorithm>

#include "query/near_features.h"
#include "query/near_pairs.h"
#include "query/pair_of_meshes.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// What all tasks find, in their order, becomes what the query's sink has.
template <bool kIsSelf, typename BV, typename Frame, typename Sink>
void runTasks(const WithinInput<BV>& input, const Frame& frame, Sink& sink, const WalkTasks& walks,
              const TaskPool& pool, WithinSearch<kIsSelf, BV, Frame, Sink>& search) {
  using Worker = WithinWorker<kIsSelf, BV, Frame, Sink>;
  auto& memory = workersMemory<typename Worker::Memory>(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, walks, [&](std::size_t slot) {
    return std::make_unique<Worker>(input, frame, sink, memory[slot]);
  });
  sink.take(tasks.found(), pool);
  tasks.forEachWorker([&](const Worker& worker) { search.add(worker.search()); });
}

template <bool kIsSelf, typename BV, typename Frame, typename Sink>
void collect(const WithinInput<BV>& input, const Frame& frame, Sink& sink) {
  using Search = WithinSearch<kIsSelf, BV, Frame, Sink>;
  static thread_local typename Search::Memory memory;
  Search search(input, frame, sink, memory);
  const TaskPool pool(std::max(input.first.tree->query_threads, input.second.tree->query_threads));
  runFromRoots(search, pool, [&](const WalkTasks& walks) {
    runTasks<kIsSelf>(input, frame, sink, walks, pool, search);
  });
  search.record(pool);
}

/// Of two models.
template <typename BV, typename MakeSink>
void collectPairs(const PairOfMeshes<BV>& meshes, double distance, const MakeSink& makeSink) {
  const WithinInput<BV> input = meshes.within(distance);
  auto sink = makeSink(input);
  const auto frame = meshes.frame();
  if (!frame.isPrecise())
    testAllPairs(input, sink);
  else if (frame.isSame())
    collect<false>(input, frame.same(), sink);
  else
    collect<false>(input, frame, sink);
}

/// Of one with itself.
template <typename BV, typename MakeSink>
void collectOwnPairs(const AdaptiveBVHModel<BV>& model, double distance, NeighbourFilter filter,
                     const MakeSink& makeSink) {
  using S = typename BV::S;
  const fcl::Transform3<S> identity = fcl::Transform3<S>::Identity();
  const PairOfMeshes<BV> meshes(model, identity, model, identity);
  const WithinInput<BV> input = meshes.within(distance, filter);
  auto sink = makeSink(input);
  collect<true>(input, SameFrame<S>(), sink);
}

}  // namespace

template <typename BV>
std::size_t pairsWithin(const AdaptiveBVHModel<BV>& first,
                        const fcl::Transform3<typename BV::S>& tf1,
                        const AdaptiveBVHModel<BV>& second,
                        const fcl::Transform3<typename BV::S>& tf2,
                        const ProximityRequest<typename BV::S>& request,
                        TrianglePairs<typename BV::S>& result) {
  requireDistance(request.distance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireQueryable(first);
  requireQueryable(second);
  collectPairs(
      PairOfMeshes<BV>(first, tf1, second, tf2), double(request.distance),
      [&](const WithinInput<BV>& input) { return PairSink<BV>(input, request, false, result); });
  return result.size();
}

template <typename BV>
std::size_t pairsWithin(const AdaptiveBVHModel<BV>& model,
                        const ProximityRequest<typename BV::S>& request,
                        TrianglePairs<typename BV::S>& result, NeighbourFilter filter) {
  requireDistance(request.distance);
  requireQueryable(model);
  collectOwnPairs(model, double(request.distance), filter, [&](const WithinInput<BV>& input) {
    return PairSink<BV>(input, request, true, result);
  });
  return result.size();
}

template <typename BV>
std::size_t featurePairsWithin(const AdaptiveBVHModel<BV>& first,
                               const fcl::Transform3<typename BV::S>& tf1,
                               const AdaptiveBVHModel<BV>& second,
                               const fcl::Transform3<typename BV::S>& tf2, typename BV::S distance,
                               FeaturePairs& result) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireQueryable(first);
  requireQueryable(second);
  collectPairs(PairOfMeshes<BV>(first, tf1, second, tf2), double(distance),
               [&](const WithinInput<BV>& input) { return FeatureSink<BV>(input, false, result); });
  return result.size();
}

template <typename BV>
std::size_t featurePairsWithin(const AdaptiveBVHModel<BV>& model, typename BV::S distance,
                               FeaturePairs& result) {
  requireDistance(distance);
  requireQueryable(model);
  collectOwnPairs(
      model, double(distance), NeighbourFilter::None,
      [&](const WithinInput<BV>& input) { return FeatureSink<BV>(input, true, result); });
  return result.size();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                            \
  template std::size_t pairsWithin(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,  \
                                   const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,  \
                                   const ProximityRequest<BV::S>&, TrianglePairs<BV::S>&);      \
  template std::size_t pairsWithin(const AdaptiveBVHModel<BV>&, const ProximityRequest<BV::S>&, \
                                   TrianglePairs<BV::S>&, NeighbourFilter);                     \
  template std::size_t featurePairsWithin(                                                      \
      const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, const AdaptiveBVHModel<BV>&,  \
      const fcl::Transform3<BV::S>&, BV::S, FeaturePairs&);                                     \
  template std::size_t featurePairsWithin(const AdaptiveBVHModel<BV>&, BV::S, FeaturePairs&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
