#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "adaptive_bvh/feature_pairs.h"
#include "query/near_pairs.h"
#include "query/nearest_search.h"
#include "query/pair_of_meshes.h"

namespace adaptive_bvh {

/// Whether there is a pair at most so far apart, by boxes grown by that distance; `found` is the
/// first.
template <typename S>
bool searchAny(const PairOfMeshes<S>& meshes, double distance, TrianglePair& found) {
  TreePair<S> trees(meshes.first, meshes.second);
  alignIfNear(trees, distance);
  const WithinInput<S> input(meshes.first, meshes.second, trees, distance);
  AnyPair any;
  searchInFrame(
      trees,
      [&](const auto& frame) {
        WithinSearch<S, std::decay_t<decltype(frame)>, AnyPair> search(input, frame, any);
        const NodePair roots{0, 0};
        search.run({&roots, &roots + 1});
      },
      [&] { testAllPairs(input, any); });
  if (any.found)
    found = {unsigned(input.tree1.triangle(any.pair.first)),
             unsigned(input.tree2.triangle(any.pair.second))};
  return any.found;
}

/// The mean length of edges, of a sample.
template <typename S>
double meanEdge(const MeshState<S>& mesh) {
  constexpr int kSample = 32;
  const int step = mesh.numTriangles() / kSample + 1;
  double sum = 0;
  int count = 0;
  for (int t = 0; t < mesh.numTriangles(); t += step, ++count) {
    const auto ends = edgeVertices(mesh.topology->triangles.data(), 3 * unsigned(t));
    sum += double((mesh.vertices[ends[1]] - mesh.vertices[ends[0]]).norm());
  }
  return sum / count;
}

/// Whether the distance is so small, for the triangles, that to search with grown boxes is the
/// faster way: these let everything pass that is as near along each axis.
template <typename S>
bool isFewEdges(const PairOfMeshes<S>& meshes, double distance) {
  constexpr double kFew = 3;
  return distance <= kFew * std::min(meanEdge(meshes.first.mesh), meanEdge(meshes.second.mesh));
}

/// Whether `compare` is the faster way to compare the distance with one. Its result is rounded to
/// S, so that must be double.
template <typename S>
bool canCompare(const PairOfMeshes<S>& meshes, double distance) {
  constexpr double kNothing = 1e-9;
  const auto size =
      double(meshes.first.geometry->aabb_radius) + double(meshes.second.geometry->aabb_radius);
  return std::is_same<S, double>::value && distance > kNothing * size;
}

/// Whether the distance is at most `enough`. When it is not, `farther` is a lower bound of it: what
/// was passed, or the distance where it is less. `witness`: a pair that may be near; then the
/// nearest that was found.
template <typename S>
bool compare(const PairOfMeshes<S>& meshes, S enough, TrianglePair& witness, S& farther) {
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result(
      std::max(farther, std::nextafter(enough, std::numeric_limits<S>::max())));
  NearestPair<S> nearest(meshes.first, meshes.second, {request, result});
  nearest.stopAt(enough);
  nearest.addWitness(int(witness.first), int(witness.second));
  NearestSearch<S>(meshes.first, meshes.second, nearest).run();
  if (nearest.isImproved()) witness = {unsigned(result.b1), unsigned(result.b2)};
  farther = result.min_distance;
  return result.min_distance <= enough;
}

}  // namespace adaptive_bvh
