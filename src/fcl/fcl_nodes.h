#pragma once

#include "dispatch/octree_nodes.h"
#include "fcl/model_pairs.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {

/// A volume of FCL in double precision, enlarged by the rounding errors of
/// Volume::parallelogram, which computes in S.
template <typename BV>
SweptBox sweptBoxOf(const BV& bv) {
  const auto body = Volume<BV>::parallelogram(bv);
  const auto sum = Volume<BV>::coordinateSum(bv);
  const double rounded = 8 * rounding::epsilon<double>() * sum;
  return {body.middle,
          {body.half[0], body.half[1], fcl::Vector3d::Zero()},
          body.radius + rounded,
          Volume<BV>::axes(bv),
          sum};
}

/// The nodes of a model's FCL tree, for searches with an octree (MeshNodes says what each function
/// returns). MeshNode::node is FCL's index; the lane is not used.
template <typename BV>
class FclNodes final : public MeshNodes {
 public:
  explicit FclNodes(const PlacedModel<BV>& model)
      : model_(*model.model), statistics_(statisticsOf(model)) {}

  bool isLeaf(MeshNode node) const override { return model_.getBV(node.node).isLeaf(); }
  int triangle(MeshNode leaf) const override { return model_.getBV(leaf.node).primitiveId(); }
  SweptBox body(MeshNode node) const override { return sweptBoxOf(model_.getBV(node.node).bv); }
  double size(MeshNode node) const override { return model_.getBV(node.node).bv.size(); }
  int below(MeshNode node, MeshNode (&children)[4]) const override {
    children[0].node = model_.getBV(node.node).leftChild();
    children[1].node = model_.getBV(node.node).rightChild();
    return 2;
  }
  void recordVisit(MeshNode node) const override { statistics_.recordVisit(node.node, 0); }
  void recordTests(std::size_t node_tests, std::size_t triangle_tests) const override {
    QueryWork work;
    work.bv_tests = node_tests;
    work.leaf_tests = triangle_tests;
    statistics_.recordQuery(work);
  }

 private:
  const fcl::BVHModel<BV>& model_;
  const PairStatistics statistics_;  ///< the model is its first object
};

}  // namespace adaptive_bvh
