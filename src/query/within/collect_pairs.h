#pragma once

#include <algorithm>

#include "base/shortcut.h"
#include "boxes/flat_patches.h"
#include "query/tree_pair.h"
#include "query/triangle_search.h"
#include "query/within/near_search.h"
#include "query/within/within_tests.h"

// Searches for all pairs of triangles within a distance, on several threads, with a sink of
// WithinTests.
namespace adaptive_bvh {

/// Passes all near pairs of triangles to the sink, on the meshes' query threads.
template <typename Frame, typename Sink>
void collect(const PairInput& input, const Frame& frame, Sink& sink) {
  searchAll<WithinTests<Frame, Sink>>(queryThreads(input.first.mesh, input.second.mesh),
                                      input.trees(frame), sink, input, frame);
}

/// Collects the near pairs of two meshes in the sink that makeSink(input) returns. `moved`: the
/// pairs of nodes to search, if not all.
template <typename MakeSink>
void collectPairs(const PairOfMeshes& meshes, double distance, const MakeSink& makeSink,
                  const MovedNodes& moved = {}) {
  TreePair trees(meshes.first, meshes.second);
  if (!moved.first) alignIfNear(trees, distance);
  PairInput input(trees, distance);
  input.moved = moved;
  auto sink = makeSink(input);
  searchInFrame(
      trees, [&](const auto& frame) { collect(input, frame, sink); },
      [&] { testAllPairs(input, sink); });
}

/// Collects the near pairs of one mesh with itself. `skips_flat`: whether pairs with a common
/// vertex do not count, so that nodes of FlatPatches need not be searched.
template <typename MakeSink>
void collectOwnPairs(const PlacedMesh& placed, double distance, const LeftOut& left_out,
                     bool skips_flat, const MakeSink& makeSink, const MovedNodes& moved = {}) {
  const FlatPatches flat(placed.tree(), placed.mesh.topology->contours, distance);
  PairInput input(placed, left_out, distance);
  // At larger distances hardly a node is flat: the heights of triangles must exceed the distance.
  if (skips_flat && isTaken(Shortcut::FlatPatches) && distance < 0.7 * meanEdge(placed.mesh))
    input.flat = &flat;
  input.moved = moved;
  auto sink = makeSink(input);
  collect(input, SameFrame(), sink);
}

}  // namespace adaptive_bvh
