#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "base/leased.h"
#include "boxes/wide_search.h"
#include "boxes/wide_tree.h"
#include "scene/body.h"

namespace adaptive_bvh {

/// A four-wide tree over boxes of bodies, each given by its index. WideTree bounds triangles, so
/// each box is a triangle whose vertices are the lowest and the highest corner of the box.
class BodyTree {
 public:
  /// Refits the tree to these boxes, which must be bounded, and at least one. Rebuilds it if the
  /// number of boxes has changed, or if the areas of its nodes' boxes have grown by half since the
  /// build. After std::bad_alloc the tree must be updated again before it is read.
  void update(const std::vector<WorldBox>& boxes);
  void clear();

  bool isEmpty() const { return corners_.empty(); }
  std::size_t size() const { return corners_.size() / 2; }

  /// Calls found(i, j), i < j, for all pairs with boxes at most `distance` apart, in any order.
  template <typename Found>
  void forEachPair(double distance, const Found& found) const;
  /// Calls visit(i, gap) for bodies in increasing order of `gap`, a lower bound of the distance of
  /// their boxes from `box`. `visit` returns the distance beyond which no bodies are needed.
  template <typename Visit>
  void visitByDistance(const WorldBox& box, const Visit& visit) const;
  /// Calls visit(i, t) for bodies in increasing order of `t`, a lower bound of the ray's parameter
  /// where it enters their boxes. `visit` returns the t beyond which no bodies are needed.
  template <typename Visit>
  void visitAlongRay(const fcl::Vector3d& origin, const fcl::Vector3d& direction,
                     const Visit& visit) const;

 private:
  void build();
  void refit();
  double cost() const;

  std::vector<fcl::Vector3d> corners_;  ///< lowest and highest corner of each box
  WideTree tree_;
  std::size_t built_count_ = 0;  ///< number of bodies in `tree_`
  double built_cost_ = 0;        ///< cost() after the build
};

/// A sink of WideSearch: calls found(i, j), i < j, for each pair of bodies in the leaves found.
template <typename Found>
class BodyPairSink final : public LeafSink {
 public:
  BodyPairSink(const WideTree& tree, const Found& found) : tree_(tree), found_(found) {}

  bool take(const LeavesFound* found, int count) override {
    for (int k = 0; k < count; ++k)
      for (unsigned bits = found[k].pairs; bits; bits &= bits - 1) {
        const int bit = __builtin_ctz(bits);
        const int i = tree_.triangle(unsigned(found[k].first->first + (bit & 3))),
                  j = tree_.triangle(unsigned(found[k].second->first + (bit >> 2)));
        found_(unsigned(std::min(i, j)), unsigned(std::max(i, j)));
      }
    return false;
  }

 private:
  const WideTree& tree_;
  const Found& found_;
};

template <typename Found>
void BodyTree::forEachPair(double distance, const Found& found) const {
  if (isEmpty()) return;
  BodyPairSink<Found> sink(tree_, found);
  WideTrees trees{tree_.nodes(), tree_.nodes(), 2 * tree_.depth(),
                  BoxFrame(nullptr, distance * tree_.scale())};
  trees.is_self = true;
  const NodePair roots{0, 0};
  WideSearch(trees).run({&roots, &roots + 1}, sink);
}

/// An entry of the queue of a best-first traversal: a node or a body.
struct OpenBody {
  double bound;
  int number;  ///< index of the node or body
  bool is_body;

  /// Heap order, from the top: smaller bounds, then bodies before nodes, then smaller indices.
  friend bool operator<(const OpenBody& a, const OpenBody& b) {
    if (a.bound != b.bound) return a.bound > b.bound;
    if (a.is_body != b.is_body) return b.is_body;
    return a.number > b.number;
  }
};

/// Calls visit(body, bound) by increasing bound. `visit` returns the largest bound of interest.
/// boundOf(boxes, lane) returns a lower bound; infinity skips the box.
template <typename BoundOf, typename Visit>
void visitBestFirst(const WideTree& tree, const BoundOf& boundOf, const Visit& visit) {
  const Leased<std::vector<OpenBody>> memory;
  std::vector<OpenBody>& open = *memory;
  open.clear();
  open.push_back({0, 0, false});
  double largest = std::numeric_limits<double>::infinity();
  while (!open.empty() && open.front().bound <= largest) {
    std::pop_heap(open.begin(), open.end());
    const OpenBody next = open.back();
    open.pop_back();
    if (next.is_body) {
      largest = visit(static_cast<unsigned>(next.number), next.bound);
      continue;
    }
    const WideNode& node = tree.nodes()[next.number];
    for (int i = 0; i < int(node.count); ++i) {
      const double bound = boundOf(node.boxes, i);
      if (!(bound <= largest) || bound == std::numeric_limits<double>::infinity()) continue;
      open.push_back({bound,
                      node.isLeaf() ? tree.triangle(unsigned(node.first + i)) : node.below[i],
                      node.isLeaf()});
      std::push_heap(open.begin(), open.end());
    }
  }
}

template <typename Visit>
void BodyTree::visitByDistance(const WorldBox& box, const Visit& visit) const {
  if (isEmpty()) return;
  const double scale = tree_.scale();
  const fcl::Vector3d low = tree_.coordinates()(box.low), high = tree_.coordinates()(box.high);
  const double error = 1e-15 * (low.cwiseAbs() + high.cwiseAbs()).maxCoeff();
  const auto boundOf = [&](const Boxes4& boxes, int i) -> double {
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      const double gap =
          std::max(double(boxes.low[k][i]) - high[k], low[k] - double(boxes.high[k][i]));
      if (gap > error) square += (gap - error) * (gap - error);
    }
    return std::sqrt(square) * (1 - 1e-14) / scale;
  };
  visitBestFirst(tree_, boundOf, visit);
}

template <typename Visit>
void BodyTree::visitAlongRay(const fcl::Vector3d& origin, const fcl::Vector3d& direction,
                             const Visit& visit) const {
  if (isEmpty()) return;
  const fcl::Vector3d start = tree_.coordinates()(origin), slope = tree_.toBody() * direction;
  const double error = 1e-14 * start.cwiseAbs().maxCoeff();
  const auto boundOf = [&](const Boxes4& boxes, int i) -> double {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double enter = 0, leave = kNone;
    for (int k = 0; k < 3; ++k) {
      const double low = double(boxes.low[k][i]) - error - start[k],
                   high = double(boxes.high[k][i]) + error - start[k];
      if (slope[k] == 0) {
        if (low > 0 || high < 0) return kNone;
        continue;
      }
      const double a = low / slope[k], b = high / slope[k];
      enter = std::max(enter, std::min(a, b) * (1 - 1e-14));
      leave = std::min(leave, std::max(a, b) * (1 + 1e-14));
    }
    return enter <= leave ? enter : kNone;
  };
  visitBestFirst(tree_, boundOf, visit);
}

}  // namespace adaptive_bvh
