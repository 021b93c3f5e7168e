#pragma once

#include <limits>

#include "dispatch/octree_nodes.h"
#include "fcl/model_pairs.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {

/// Returns a volume in double precision, enlarged by the rounding of its computation in S.
template <typename BV>
SweptBox sweptBoxOf(const BV& bv) {
  const auto body = Volume<BV>::parallelogram(bv);
  const auto sum = static_cast<double>(Volume<BV>::coordinateSum(bv));
  const double rounded = 8 * static_cast<double>(rounding::epsilon<typename BV::S>()) * sum;
  return {body.middle.template cast<double>(),
          {body.half[0].template cast<double>(), body.half[1].template cast<double>(),
           fcl::Vector3d::Zero()},
          static_cast<double>(body.radius) + rounded,
          Volume<BV>::axes(bv).template cast<double>(),
          sum};
}

/// The nodes of a model's FCL tree.
template <typename BV>
class FclNodes final : public MeshNodes {
 public:
  explicit FclNodes(const PlacedModel<BV>& model)
      : model_(*model.model), statistics_(statisticsOf(model)) {}

  bool isLeaf(MeshNode node) const override { return model_.getBV(node.node).isLeaf(); }
  int triangle(MeshNode leaf) const override { return model_.getBV(leaf.node).primitiveId(); }
  SweptBox body(MeshNode node) const override { return sweptBoxOf(model_.getBV(node.node).bv); }
  double size(MeshNode node) const override {
    return static_cast<double>(model_.getBV(node.node).bv.size());
  }
  int below(MeshNode node, MeshNode (&nodes)[4]) const override {
    nodes[0].node = model_.getBV(node.node).leftChild();
    nodes[1].node = model_.getBV(node.node).rightChild();
    return 2;
  }
  void recordVisit(MeshNode node) const override { statistics_.recordObstruction(node.node, 0); }
  void recordTests(std::size_t of_nodes, std::size_t of_triangles) const override {
    QueryWork work;
    work.bv_tests = of_nodes;
    work.leaf_tests = of_triangles;
    statistics_.recordQuery(work);
  }

 private:
  const fcl::BVHModel<BV>& model_;
  const PairStatistics statistics_;
};

}  // namespace adaptive_bvh
