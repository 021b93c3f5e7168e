#pragma once

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "planar.h"

// A tree of boxes in the plane, which finds the edges of an outline near a triangle.
namespace adaptive_bvh {

/// A bounding box in the plane; initially empty.
struct PlanarBox {
  PlanarPoint least = {kInfinity, kInfinity}, most = {-kInfinity, -kInfinity};

  void add(const PlanarPoint& p) {
    least = {std::min(least.x, p.x), std::min(least.y, p.y)};
    most = {std::max(most.x, p.x), std::max(most.y, p.y)};
  }
  void add(const PlanarBox& box) {
    least = {std::min(least.x, box.least.x), std::min(least.y, box.least.y)};
    most = {std::max(most.x, box.most.x), std::max(most.y, box.most.y)};
  }
  /// Whether two boxes overlap, with a margin for the rounding of `PlanarFrame`.
  bool overlaps(const PlanarBox& box) const {
    return least.x <= box.most.x + kMargin && box.least.x <= most.x + kMargin &&
           least.y <= box.most.y + kMargin && box.least.y <= most.y + kMargin;
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMargin = 0x1p-49;
};

/// A binary tree over the boxes of consecutive items, with eight items in each leaf.
class PlanarTree {
 public:
  static constexpr std::size_t kItems = 8;  ///< items per leaf

  /// Builds the tree. boxOf(item) returns the box of an item; a removed item has an empty one.
  template <typename BoxOf>
  void build(std::size_t items, const BoxOf& boxOf) {
    items_ = items;
    leaves_ = 1;
    while (leaves_ * kItems < items) leaves_ *= 2;
    if (leaves_ == 1) return;  // too few items for boxes
    boxes_.assign(2 * leaves_, {});
    for (std::size_t i = 0; i < items; ++i) boxes_[leaves_ + i / kItems].add(boxOf(i));
    for (std::size_t node = leaves_; node-- > 1;) merge(node);
  }

  /// Updates the tree after the box of an item has changed.
  template <typename BoxOf>
  void update(std::size_t item, const BoxOf& boxOf) {
    if (leaves_ == 1) return;
    std::size_t node = leaves_ + item / kItems;
    boxes_[node] = {};
    forItemsOf(node, [&](std::size_t i) {
      boxes_[node].add(boxOf(i));
      return false;
    });
    while (node /= 2) merge(node);
  }

  /// Whether `test(item)` is true for any item whose leaf's box overlaps `box`.
  template <typename Test>
  bool any(const PlanarBox& box, WorkLimit& work, const Test& test) const {
    return anyBelow(1, box, work, test);
  }

 private:
  /// Sets the box of a node from those of its children.
  void merge(std::size_t node) {
    boxes_[node] = boxes_[2 * node];
    boxes_[node].add(boxes_[2 * node + 1]);
  }

  /// Calls test(item) for the items of a leaf until it returns true. Returns whether it did.
  template <typename Test>
  bool forItemsOf(std::size_t leaf, const Test& test) const {
    const std::size_t first = (leaf - leaves_) * kItems;
    for (std::size_t i = first; i < std::min(first + kItems, items_); ++i)
      if (test(i)) return true;
    return false;
  }

  template <typename Test>
  bool anyBelow(std::size_t node, const PlanarBox& box, WorkLimit& work, const Test& test) const {
    work.spend(1);
    if (leaves_ > 1 && !boxes_[node].overlaps(box)) return false;
    if (node < leaves_)
      return anyBelow(2 * node, box, work, test) || anyBelow(2 * node + 1, box, work, test);
    work.spend(kItems);
    return forItemsOf(node, test);
  }

  std::size_t items_ = 0, leaves_ = 1;  ///< numbers of items; of leaves, a power of two
  /// By node: 1 is the root, the children of node i are 2 i and 2 i + 1, leaves begin at leaves_.
  std::vector<PlanarBox> boxes_;
};

/// A rotated frame, along whose axes most of an outline's length lies, so that boxes of slanted
/// outlines are narrow. Rounding moves a point by at most 2^-51, for coordinates of at most 1.
class PlanarFrame {
 public:
  explicit PlanarFrame(const std::vector<PlanarPoint>& outline) {
    if (outline.size() <= PlanarTree::kItems) return;  // boxes are not used then
    // The mean of squared directions, weighted by length: a direction and its opposite have the
    // same square. The edges are complex numbers.
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const PlanarPoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
      const std::complex<double> edge(b.x - a.x, b.y - a.y);
      if (std::abs(edge) > 0) sum += edge * (edge / std::abs(edge));
    }
    if (std::abs(sum) > 0) axis_ = std::polar(1., std::arg(sum) / 2);
  }
  /// The coordinates of p in this frame.
  PlanarPoint operator()(const PlanarPoint& p) const {
    return {axis_.real() * p.x + axis_.imag() * p.y, axis_.real() * p.y - axis_.imag() * p.x};
  }

 private:
  std::complex<double> axis_ = 1;  ///< direction of the first axis
};

}  // namespace adaptive_bvh
