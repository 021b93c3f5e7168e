// measureHierarchy: how tight the volumes of a tree are, level by level.

#include "adaptive_bvh/hierarchy.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {
namespace {

/// The mean of numbers; 0 if there are none.
class Mean {
 public:
  void add(double x) {
    sum_ += x;
    ++count_;
  }
  double value() const { return count_ > 0 ? sum_ / count_ : 0; }

 private:
  double sum_ = 0;
  int count_ = 0;
};

/// Means over inner nodes: see LevelQuality.
struct InnerNodeMeans {
  Mean aspect_ratio, sibling_overlap;

  template <typename BV>
  void add(const fcl::BVHModel<BV>& model, const fcl::BVNode<BV>& node) {
    using V = Volume<BV>;
    if (const double ratio = V::aspectRatio(node.bv); ratio > 0) aspect_ratio.add(ratio);
    const BV& left = model.getBV(node.leftChild()).bv;
    const BV& right = model.getBV(node.rightChild()).bv;
    const bool left_is_smaller = V::surfaceArea(left) <= V::surfaceArea(right);
    sibling_overlap.add(left_is_smaller ? V::shareWithin(left, right)
                                        : V::shareWithin(right, left));
  }
};

}  // namespace

const char* toString(HierarchyStrategy strategy) {
  return strategy == HierarchyStrategy::TopDown ? "top-down" : "bottom-up";
}

template <typename BV>
HierarchyQuality measureHierarchy(const fcl::BVHModel<BV>& model) {
  HierarchyQuality quality;
  InnerNodeMeans overall;
  std::vector<int> level_nodes, next_level_nodes;
  if (model.getNumBVs() > 0) level_nodes.push_back(0);
  for (; !level_nodes.empty(); level_nodes.swap(next_level_nodes), next_level_nodes.clear()) {
    LevelQuality level;
    InnerNodeMeans means;
    for (int i : level_nodes) {
      const fcl::BVNode<BV>& node = model.getBV(i);
      ++level.nodes;
      level.volume += Volume<BV>::volume(node.bv);
      level.area += Volume<BV>::surfaceArea(node.bv);
      if (node.isLeaf()) {
        ++level.leaves;
        continue;
      }
      means.add(model, node);
      overall.add(model, node);
      next_level_nodes.push_back(node.leftChild());
      next_level_nodes.push_back(node.rightChild());
    }
    level.aspect_ratio = means.aspect_ratio.value();
    level.sibling_overlap = means.sibling_overlap.value();
    quality.levels.push_back(level);
  }
  if (quality.levels.empty()) return quality;

  quality.depth = static_cast<int>(quality.levels.size()) - 1;
  int least_depth = 0;  // of a binary tree with this number of leaves
  while ((1LL << least_depth) < (model.getNumBVs() + 1) / 2) ++least_depth;
  quality.balance = quality.depth > 0 ? double(least_depth) / quality.depth : 1;
  quality.aspect_ratio = overall.aspect_ratio.value();
  quality.sibling_overlap = overall.sibling_overlap.value();
  return quality;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) \
  template HierarchyQuality measureHierarchy(const fcl::BVHModel<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
