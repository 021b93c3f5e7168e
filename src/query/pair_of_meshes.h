#pragma once

#include "model_state.h"
#include "query/proximity_arguments.h"
#include "query/wide_trees.h"
#include "query/within_search.h"

namespace adaptive_bvh {

template <typename BV>
PlacedMesh<BV> placed(const AdaptiveBVHModel<BV>& model,
                      const fcl::Transform3<typename BV::S>& tf) {
  return {&model, &treeOf(model), tf};
}

/// A triangle of each of two meshes, by their indices.
struct TrianglePair {
  unsigned first, second;
};

/// Two models, placed, or one with itself.
template <typename BV>
struct PairOfMeshes {
  using S = typename BV::S;

  PairOfMeshes(const AdaptiveBVHModel<BV>& model1, const fcl::Transform3<S>& tf1,
               const AdaptiveBVHModel<BV>& model2, const fcl::Transform3<S>& tf2)
      : first(placed(model1, tf1)), second(placed(model2, tf2)), to_first(tf1, tf2) {}
  WithinInput<BV> within(double distance, NeighbourFilter filter = NeighbourFilter::None) const {
    const WideTrees<S> trees = wideTreesOf(first, second);
    return {first, second, trees.first, trees.second, to_first, filter, distance};
  }
  RelativeFrame<S> frame() const {
    const WideTrees<S> trees = wideTreesOf(first, second);
    return RelativeFrame<S>(trees.first, trees.second, to_first.R.template cast<S>(),
                            to_first.T.template cast<S>());
  }
  /// Of two triangles; of triangle 0 where there are no such.
  TriangleGap gap(const TrianglePair& triangles) const {
    TrianglePoints<double> q = corners(*second.model, triangles.second);
    for (fcl::Vector3d& x : q) x = to_first(x);
    return gapOf(corners(*first.model, triangles.first), q);
  }

  const PlacedMesh<BV> first, second;
  const RelativePlacement to_first;

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
  sink.clear();
  const auto size1 = static_cast<unsigned>(input.first.model->num_tris),
             size2 = static_cast<unsigned>(input.second.model->num_tris);
  for (unsigned i = 0; i < size1; ++i)
    for (unsigned j = 0; j < size2 && !sink.isDone(); ++j) {
      const TriangleGap gap = tests.gap({i, j});
      if (tests.isNear(gap)) sink.add({i, j}, &gap);
    }
}

}  // namespace adaptive_bvh
