#include <algorithm>
#include <cmath>
#include <cstddef>

#include "adaptive_bvh/hierarchy.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {
namespace {

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

struct TreeShape {
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
  TreeShape overall;
  std::vector<int> level, next;
  if (model.getNumBVs() > 0) level.push_back(0);
  for (; !level.empty(); level.swap(next), next.clear()) {
    LevelQuality now;
    TreeShape shape;
    for (int i : level) {
      const fcl::BVNode<BV>& node = model.getBV(i);
      ++now.nodes;
      now.volume += Volume<BV>::volume(node.bv);
      now.area += Volume<BV>::surfaceArea(node.bv);
      if (node.isLeaf()) {
        ++now.leaves;
        continue;
      }
      shape.add(model, node);
      overall.add(model, node);
      next.push_back(node.leftChild());
      next.push_back(node.rightChild());
    }
    now.aspect_ratio = shape.aspect_ratio.value();
    now.sibling_overlap = shape.sibling_overlap.value();
    quality.levels.push_back(now);
  }
  if (quality.levels.empty()) return quality;

  quality.depth = static_cast<int>(quality.levels.size()) - 1;
  int least_depth = 0;
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
