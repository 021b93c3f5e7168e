#pragma once

#include <algorithm>
#include <type_traits>

#include "query/near_pairs.h"
#include "query/pair_cache.h"
#include "query/pair_of_meshes.h"

namespace adaptive_bvh {

template <typename BV, typename Frame>
void searchAny(const WithinInput<BV>& input, const Frame& frame, AnyPair& any) {
  using Search = WithinSearch<false, BV, Frame, AnyPair>;
  static thread_local typename Search::Memory memory;
  Search search(input, frame, any, memory);
  runFromRoots(search);
  search.record(TaskPool(1));
  any.box_tests = search.boxTests();
}

/// Whether there is a pair at most so far apart, by the four-wide trees; `any` is the first that
/// was found.
template <typename BV>
void searchAny(const PairOfMeshes<BV>& meshes, double distance, AnyPair& any) {
  const WithinInput<BV> input = meshes.within(distance);
  const auto frame = meshes.frame();
  if (!frame.isPrecise())
    testAllPairs(input, any);
  else if (frame.isSame())
    searchAny(input, frame.same(), any);
  else
    searchAny(input, frame, any);
}

/// The mean length of edges, of a sample.
template <typename BV>
double meanEdge(const fcl::BVHModel<BV>& model) {
  constexpr int kSample = 32;
  const int step = model.num_tris / kSample + 1;
  double sum = 0;
  int count = 0;
  for (int t = 0; t < model.num_tris; t += step, ++count) {
    const auto ends = edgeVertices(model.tri_indices, 3 * unsigned(t));
    sum += double((model.vertices[ends[1]] - model.vertices[ends[0]]).norm());
  }
  return sum / count;
}

/// Whether the distance is so small, for the triangles, that to search the four-wide trees with
/// grown boxes is the faster way: these let everything pass that is as near along each axis.
template <typename BV>
bool isFewEdges(const PairOfMeshes<BV>& meshes, double distance) {
  constexpr double kFew = 3;
  return distance <= kFew * std::min(meanEdge(*meshes.first.model), meanEdge(*meshes.second.model));
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

  TrianglePair triangles() const { return {pair_.first, pair_.second}; }
  double distance() const { return meshes_.gap(triangles()).distance; }
  bool isNearer(double limit) const { return distance() <= limit; }
  PairCache<BV> cache() const { return {int(pair_.first), int(pair_.second), pair_.are_near, {}}; }
  void keep(const PairCache<BV>& cache) {
    pair_ = {unsigned(cache.witness1), unsigned(cache.witness2), cache.are_near};
    witnesses_.keep(meshes_.second.model, pair_);
  }
  bool searchNearer(double limit) {
    AnyPair any;
    searchAny(meshes_, limit, any);
    pair_.are_near = any.box_tests > PairSearch<BV>::kFew;
    if (any.found) {
      pair_.first = unsigned(wideTreeOf(meshes_.first).triangle(any.pair.first));
      pair_.second = unsigned(wideTreeOf(meshes_.second).triangle(any.pair.second));
    }
    witnesses_.keep(meshes_.second.model, pair_);
    return any.found;
  }

 private:
  const PairOfMeshes<BV>& meshes_;
  WitnessCache& witnesses_;
  WitnessCache::Pair pair_;
};

}  // namespace adaptive_bvh
