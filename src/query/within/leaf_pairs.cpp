#include "query/within/leaf_pairs.h"

#include "query/within/collect_pairs.h"
#include "query/within/found_parts.h"

namespace adaptive_bvh {
namespace {

/// A sink of WithinTests: pairs of leaf indices. `kTakesAll`: also pairs that corners alone do not
/// prove to be apart.
template <bool kTakesAll>
class LeafPairSink {
 public:
  using Result = std::vector<FeaturePair>;
  static constexpr int kBatch = 256;
  static constexpr bool kStopsAtFirst = false, kTakesUndecided = kTakesAll, kTakesOpen = false;

  LeafPairSink(bool is_self, Result& result) : is_self_(is_self), result_(result) {}

  void clear() { result_.clear(); }
  static bool needsGap() { return false; }
  static bool isDone() { return false; }
  ADAPTIVE_BVH_INLINE void add(const LeafIndexPair& pair, const TriangleGap*) {
    const bool swaps = is_self_ && pair.first > pair.second;
    appendPair(swaps ? pair.second : pair.first, swaps ? pair.first : pair.second, result_);
  }

  LeafPairSink another(Result& result) const { return {is_self_, result}; }
  using Mark = std::size_t;
  Mark mark() const { return result_.size(); }
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinParts(tasks, pool, result_, [](const Found& task) {
      return VectorPart(task.worker->sink().result_, task.from, task.to);
    });
  }

 private:
  const bool is_self_;
  Result& result_;
};

template <bool kTakesAll>
void findPairsOfLeaves(const KeptMeshes& meshes, const KeptRequest& request,
                       const LeafPairRange& range, std::vector<FeaturePair>& found) {
  const auto makeSink = [&](const PairInput&) -> LeafPairSink<kTakesAll> {
    return {meshes.is_self, found};
  };
  if (!meshes.is_self)
    return collectPairs({meshes.first, meshes.second}, range.distance, makeSink, range.moved);
  const Ignored& ignored = request.ignored;
  const LeftOut left_out = {request.has_features ? NeighbourFilter::None : ignored.neighbours,
                            surfaceOf(ignored, meshes.first.mesh)};
  const bool skips_flat = request.has_features || left_out.filter == NeighbourFilter::SharedVertex;
  collectOwnPairs(meshes.first, range.distance, left_out, skips_flat, makeSink, range.moved);
}

}  // namespace

void findLeafPairs(const KeptMeshes& meshes, const KeptRequest& request, const LeafPairRange& range,
                   std::vector<FeaturePair>& found) {
  range.is_exact ? findPairsOfLeaves<false>(meshes, request, range, found)
                 : findPairsOfLeaves<true>(meshes, request, range, found);
}

}  // namespace adaptive_bvh
