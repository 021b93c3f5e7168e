#include "adaptive_bvh/proximity.h"

#include <algorithm>
#include <type_traits>

#include "model_state.h"
#include "query/near_features.h"
#include "query/near_pairs.h"
#include "query/pair_cache.h"
#include "query/proximity_arguments.h"
#include "query/rigid_motion.h"
#include "query/wide_trees.h"
#include "query/within_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
PlacedMesh<BV> placed(const AdaptiveBVHModel<BV>& model,
                      const fcl::Transform3<typename BV::S>& tf) {
  return {&model, &treeOf(model), tf};
}

/// Two models, placed, or one with itself.
template <typename BV>
struct PairOfMeshes {
  using S = typename BV::S;

  PairOfMeshes(const AdaptiveBVHModel<BV>& model1, const fcl::Transform3<S>& tf1,
               const AdaptiveBVHModel<BV>& model2, const fcl::Transform3<S>& tf2)
      : first(placed(model1, tf1)), second(placed(model2, tf2)) {
    const fcl::Matrix3d R1 = tf1.linear().template cast<double>(),
                        R2 = tf2.linear().template cast<double>();
    R = R1.transpose() * R2;
    T = R1.transpose() *
        (tf2.translation().template cast<double>() - tf1.translation().template cast<double>());
  }
  WithinInput<BV> within(double distance, NeighbourFilter filter = NeighbourFilter::None) const {
    const WideTrees<S> trees = wideTreesOf(first, second);
    return {first, second, trees.first, trees.second, R, T, filter, distance};
  }
  RelativeFrame<S> frame() const {
    const WideTrees<S> trees = wideTreesOf(first, second);
    return RelativeFrame<S>(trees.first, trees.second, R.template cast<S>(), T.template cast<S>());
  }
  /// Of two triangles by their indices; of 0 where there are no such.
  TriangleGap gap(unsigned triangle1, unsigned triangle2) const {
    TrianglePoints<double> q = corners(*second.model, triangle2);
    for (fcl::Vector3d& x : q) x = R * x + T;
    return gapOf(corners(*first.model, triangle1), q);
  }

  const PlacedMesh<BV> first, second;
  fcl::Matrix3d R;
  fcl::Vector3d T;

 private:
  static TrianglePoints<double> corners(const fcl::BVHModel<BV>& model, unsigned triangle) {
    const fcl::Triangle& t = model.tri_indices[triangle < unsigned(model.num_tris) ? triangle : 0u];
    return {model.vertices[t[0]].template cast<double>(),
            model.vertices[t[1]].template cast<double>(),
            model.vertices[t[2]].template cast<double>()};
  }
};

/// Every pair, where single precision cannot express how the models lie.
template <typename BV, typename Sink>
void testAllPairs(const WithinInput<BV>& input, Sink& sink) {
  const SameFrame<typename BV::S> frame;  // of no use here
  const WithinTests<BV, SameFrame<typename BV::S>, Sink> tests(input, frame, sink);
  const auto size1 = static_cast<unsigned>(input.first.model->num_tris),
             size2 = static_cast<unsigned>(input.second.model->num_tris);
  for (unsigned i = 0; i < size1; ++i)
    for (unsigned j = 0; j < size2 && !sink.isDone(); ++j) {
      const TriangleGap gap = tests.gap({i, j});
      if (tests.isNear(gap)) sink.add({i, j}, &gap);
    }
}

template <bool kIsSelf, typename BV, typename Frame, typename Sink>
void searchOnThreads(const WithinInput<BV>& input, const Frame& frame, const TaskPool& pool,
                     Sink& sink, WithinSearch<kIsSelf, BV, Frame, Sink>& search) {
  using Tasks = WithinTasks<kIsSelf, BV, Frame, Sink>;
  std::vector<NodePair> pairs{{0, 0}};
  search.split(pairs, Tasks::kLeastTasks, pool);
  if (pairs.size() < Tasks::kLeastTasks) {
    for (const NodePair& pair : pairs) search.run(pair);
    return;
  }
  Tasks tasks(input, frame, sink);
  tasks.run(pool, pairs);
  tasks.collect(sink, search);
}

template <bool kIsSelf, typename BV, typename Frame, typename Sink>
void collect(const WithinInput<BV>& input, const Frame& frame, Sink& sink) {
  using Search = WithinSearch<kIsSelf, BV, Frame, Sink>;
  static thread_local typename Search::Memory memory;
  Search search(input, frame, sink, memory);
  const TaskPool pool(std::max(input.first.tree->query_threads, input.second.tree->query_threads));
  if (pool.size() > 1)
    searchOnThreads(input, frame, pool, sink, search);
  else
    search.run({0, 0});
  search.record(pool);
}

/// Whether there is a pair at most so far apart; `any` is the first that was found.
template <typename BV>
bool search(const PairOfMeshes<BV>& meshes, double distance, AnyPair& any) {
  any = AnyPair();
  const WithinInput<BV> input = meshes.within(distance);
  const auto frame = meshes.frame();
  if (!frame.isPrecise()) {
    testAllPairs(input, any);
    return any.found;
  }
  using Search = WithinSearch<false, BV, RelativeFrame<typename BV::S>, AnyPair>;
  static thread_local typename Search::Memory memory;
  Search search(input, frame, any, memory);
  search.run({0, 0});
  search.record(TaskPool(1));
  return any.found;
}

/// As compareByBoxes, which is the faster way for distances that are not next to nothing. Its
/// bounds are rounded as the models' own numbers, so they must be double.
template <typename BV>
bool canCompareByBoxes(const PairOfMeshes<BV>& meshes, double distance) {
  constexpr double kNothing = 1e-9;
  const auto size = double(meshes.first.model->aabb_radius + meshes.second.model->aabb_radius);
  return std::is_same<typename BV::S, double>::value && meshes.first.hasBoxes() &&
         meshes.second.hasBoxes() && distance > kNothing * size;
}

/// The last pair that was near, and a search only where it is not any more.
template <typename BV>
class NearestKnown {
 public:
  explicit NearestKnown(const PairOfMeshes<BV>& meshes)
      : meshes_(meshes),
        witnesses_(meshes.first.tree->witnesses),
        pair_(witnesses_.recall(meshes.second.model)) {}

  double distance() const { return meshes_.gap(pair_.first, pair_.second).distance; }
  bool isNearer(double limit) const { return distance() <= limit; }
  PairCache<BV> cache() const { return {int(pair_.first), int(pair_.second), pair_.are_near, {}}; }
  void keep(const PairCache<BV>& cache) {
    pair_ = {unsigned(cache.witness1), unsigned(cache.witness2), cache.are_near};
    witnesses_.keep(meshes_.second.model, pair_);
  }
  bool searchNearer(double limit) {
    AnyPair any;
    if (!search(meshes_, limit, any)) return false;
    pair_ = {static_cast<unsigned>(wideTreeOf(meshes_.first).triangle(any.pair.first)),
             static_cast<unsigned>(wideTreeOf(meshes_.second).triangle(any.pair.second)),
             pair_.are_near};
    witnesses_.keep(meshes_.second.model, pair_);
    return true;
  }

 private:
  const PairOfMeshes<BV>& meshes_;
  WitnessCache& witnesses_;
  WitnessCache::Pair pair_;
};

}  // namespace

template <typename BV>
bool isNearer(const AdaptiveBVHModel<BV>& first, const fcl::Transform3<typename BV::S>& tf1,
              const AdaptiveBVHModel<BV>& second, const fcl::Transform3<typename BV::S>& tf2,
              typename BV::S distance) {
  requireDistance(distance);
  requireQueryable(first);
  requireQueryable(second);
  const PairOfMeshes<BV> meshes(first, tf1, second, tf2);
  NearestKnown<BV> known(meshes);
  const auto limit = static_cast<double>(distance);
  if (known.isNearer(limit)) return true;
  if (canCompareByBoxes(meshes, limit)) {
    PairCache<BV> cache = known.cache();
    bool is_nearer = false;
    typename BV::S farther = distance;
    if (compareByBoxes(meshes.first, meshes.second, distance, cache, is_nearer, farther)) {
      known.keep(cache);
      return is_nearer;
    }
  }
  return known.searchNearer(limit);
}

template <typename BV>
struct CoherentProximity<BV>::State {
  const AdaptiveBVHModel<BV>&first, &second;
  RigidMotion<S> rigid = {};
  std::uint64_t generations[2] = {0, 0};
  /// How far the models have moved, in all, when the bound was found; and at the last call.
  double moved_then = 0, moved = 0;
  double bound = -1;  ///< of their distance then; negative where there is none
  std::size_t searches = 0;
  PairCache<BV> cache = {0, 0, false, Front<BV>()};

  /// Brings `moved` up to date. Returns by how much it grew.
  double move(const PairOfMeshes<BV>& meshes) {
    for (const PlacedMesh<BV>* mesh : {&meshes.first, &meshes.second})
      if (mesh->hasBoxes()) updateBoxes(*mesh);
    const std::uint64_t now[2] = {meshes.first.tree->generation, meshes.second.tree->generation};
    const bool same_trees = std::equal(now, now + 2, generations);
    std::copy(now, now + 2, generations);
    const bool goes_on =
        rigid.moveTo(meshes.first.tf, first, meshes.second.tf, second) && same_trees;
    if (!goes_on || !meshes.first.hasBoxes() || !meshes.second.hasBoxes()) bound = -1;
    const double before = moved;
    moved = rigid.sum() + motionOf(meshes.first) + motionOf(meshes.second);
    return std::max(moved - before, 0.);
  }
  /// Whether what is known says that nothing is as near as that. The sums of motion are rounded up;
  /// their sum and difference by less than the last term.
  bool isSurelyFarther(double distance) const {
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return bound >= 0 && bound > distance + (moved - moved_then) + kRounding * (moved + bound);
  }
  double witnessDistance(const PairOfMeshes<BV>& meshes) const {
    return meshes.gap(unsigned(cache.witness1), unsigned(cache.witness2)).distance;
  }
  void setBound(double farther_than) {
    bound = farther_than;
    moved_then = moved;
  }

 private:
  static double motionOf(const PlacedMesh<BV>& mesh) {
    if (!mesh.hasBoxes()) return 0;
    return double(mesh.tree->motion.accumulatedMotion(0)) * double(mesh.tree->boxes->frame.unit());
  }
};

template <typename BV>
CoherentProximity<BV>::CoherentProximity(const AdaptiveBVHModel<BV>& first,
                                         const AdaptiveBVHModel<BV>& second)
    : state_(new State{first, second}) {}
template <typename BV>
CoherentProximity<BV>::~CoherentProximity() = default;
template <typename BV>
CoherentProximity<BV>::CoherentProximity(CoherentProximity&&) noexcept = default;
template <typename BV>
std::size_t CoherentProximity<BV>::searches() const {
  return state_->searches;
}

template <typename BV>
bool CoherentProximity<BV>::isNearer(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2,
                                     S distance) {
  State& state = *state_;
  requireDistance(distance);
  requireQueryable(state.first);
  requireQueryable(state.second);
  const PairOfMeshes<BV> meshes(state.first, tf1, state.second, tf2);
  const double step = state.move(meshes);
  const auto limit = static_cast<double>(distance);
  if (state.isSurelyFarther(limit)) return false;
  // The search looks as far as sixteen steps like the last one could use up; no farther than asked
  // where one step will.
  constexpr double kSteps = 16;
  if (canCompareByBoxes(meshes, limit + kSteps * step)) {
    const double known = state.witnessDistance(meshes);
    if (known <= limit) return true;
    ++state.searches;
    bool is_nearer = false;
    const double reach = known - limit > step ? kSteps * step : 0;
    S farther = static_cast<S>(limit + reach);
    if (compareByBoxes(meshes.first, meshes.second, distance, state.cache, is_nearer, farther)) {
      if (!is_nearer) state.setBound(static_cast<double>(farther));
      return is_nearer;
    }
  }
  NearestKnown<BV> known(meshes);
  if (known.isNearer(limit)) return true;
  ++state.searches;
  double farther = std::min(limit + kSteps * step, (limit + known.distance()) / 2);
  if (known.searchNearer(farther)) {
    if (known.isNearer(limit) || known.searchNearer(limit)) return true;
    farther = limit;
  }
  state.setBound(farther);
  return false;
}

namespace {

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
  requireQueryable(first);
  requireQueryable(second);
  result.clear();
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
  result.clear();
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
  requireQueryable(first);
  requireQueryable(second);
  result.clear();
  collectPairs(PairOfMeshes<BV>(first, tf1, second, tf2), double(distance),
               [&](const WithinInput<BV>& input) { return FeatureSink<BV>(input, false, result); });
  return result.size();
}

template <typename BV>
std::size_t featurePairsWithin(const AdaptiveBVHModel<BV>& model, typename BV::S distance,
                               FeaturePairs& result) {
  requireDistance(distance);
  requireQueryable(model);
  result.clear();
  collectOwnPairs(
      model, double(distance), NeighbourFilter::None,
      [&](const WithinInput<BV>& input) { return FeatureSink<BV>(input, true, result); });
  return result.size();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                            \
  template bool isNearer(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,            \
                         const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, BV::S);    \
  template std::size_t pairsWithin(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,  \
                                   const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,  \
                                   const ProximityRequest<BV::S>&, TrianglePairs<BV::S>&);      \
  template std::size_t pairsWithin(const AdaptiveBVHModel<BV>&, const ProximityRequest<BV::S>&, \
                                   TrianglePairs<BV::S>&, NeighbourFilter);                     \
  template std::size_t featurePairsWithin(                                                      \
      const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, const AdaptiveBVHModel<BV>&,  \
      const fcl::Transform3<BV::S>&, BV::S, FeaturePairs&);                                     \
  template std::size_t featurePairsWithin(const AdaptiveBVHModel<BV>&, BV::S, FeaturePairs&);   \
  template class CoherentProximity<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
