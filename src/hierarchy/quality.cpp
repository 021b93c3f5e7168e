#include <algorithm>
#include <cmath>
#include <cstddef>

#include "adaptive_bvh/hierarchy.h"
#include "volume/rss.h"

namespace adaptive_bvh {
namespace {

/// Steiner's formula for the points within r of an a x b rectangle.
template <typename S>
double volumeOf(const fcl::RSS<S>& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return a * b * 2 * r + M_PI * r * r * (a + b) + 4. / 3 * M_PI * r * r * r;
}

/// Its derivative by r.
template <typename S>
double areaOf(const fcl::RSS<S>& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return 2 * a * b + 2 * M_PI * r * (a + b) + 4 * M_PI * r * r;
}

/// The share of sample points of `inner` that lie in `outer`. The points are the first 64 of the
/// additive recurrence with the powers of 1/g, g^4 = g + 1 (Roberts 2018), which fills a box evenly
/// from any number of points on.
template <typename S>
double shareWithin(const fcl::RSS<S>& inner, const fcl::RSS<S>& outer) {
  constexpr int kSamples = 64;
  constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  const S slack = S(1e-6) * (outer.r + outer.l[0] + outer.l[1]);  // coplanar ones count as touching
  int within = 0;
  for (int i = 0; i < kSamples; ++i) {
    double at[3];
    for (int k = 0; k < 3; ++k) at[k] = std::fmod(0.5 + kStep[k] * (i + 1), 1.);
    const fcl::Vector3<S> p = inner.To + inner.axis.col(0) * (S(at[0]) * inner.l[0]) +
                              inner.axis.col(1) * (S(at[1]) * inner.l[1]) +
                              inner.axis.col(2) * (S(2 * at[2] - 1) * inner.r);
    within += Volume<fcl::RSS<S>>::distanceToRectangle(outer, p) <= outer.r + slack;
  }
  return within / double(kSamples);
}

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

struct Shape {
  Mean aspect_ratio, sibling_overlap;

  template <typename S>
  void add(const fcl::BVHModel<fcl::RSS<S>>& model, const fcl::BVNode<fcl::RSS<S>>& node) {
    const double a = node.bv.l[0] + 2 * node.bv.r, b = node.bv.l[1] + 2 * node.bv.r;
    if (std::min(a, b) > 0) aspect_ratio.add(std::max(a, b) / std::min(a, b));
    const fcl::RSS<S>& left = model.getBV(node.leftChild()).bv;
    const fcl::RSS<S>& right = model.getBV(node.rightChild()).bv;
    const bool left_is_smaller = areaOf(left) <= areaOf(right);
    sibling_overlap.add(left_is_smaller ? shareWithin(left, right) : shareWithin(right, left));
  }
};

}  // namespace

const char* toString(HierarchyStrategy strategy) {
  return strategy == HierarchyStrategy::TopDown ? "top-down" : "bottom-up";
}

template <typename S>
HierarchyQuality measureHierarchy(const fcl::BVHModel<fcl::RSS<S>>& model) {
  HierarchyQuality quality;
  Shape overall;
  std::vector<int> level, next;
  if (model.getNumBVs() > 0) level.push_back(0);
  for (; !level.empty(); level.swap(next), next.clear()) {
    LevelQuality now;
    Shape shape;
    for (int i : level) {
      const fcl::BVNode<fcl::RSS<S>>& node = model.getBV(i);
      ++now.nodes;
      now.volume += volumeOf(node.bv);
      now.area += areaOf(node.bv);
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

template HierarchyQuality measureHierarchy(const fcl::BVHModel<fcl::RSS<float>>&);
template HierarchyQuality measureHierarchy(const fcl::BVHModel<fcl::RSS<double>>&);

}  // namespace adaptive_bvh
