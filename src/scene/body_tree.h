#pragma once

#include <vector>

#include "boxes/wide_tree.h"
#include "scene/body.h"

namespace adaptive_bvh {

/// A four-wide tree over the boxes of bodies. A body counts as a triangle with two corners, the
/// lowest and the highest of its box: so the box of the triangle is that of the body.
class BodyTree {
 public:
  /// Takes over the boxes, which are bounded, and at least one. Builds the tree anew when it has
  /// another number of bodies, or has become so much worse that its boxes are half as large again
  /// as when it was built; else only refits it.
  void update(const std::vector<WorldBox>& boxes);
  void clear();

  bool isEmpty() const { return corners_.empty(); }
  std::size_t size() const { return corners_.size() / 2; }

  /// Calls found(i, j), i < j, for each pair whose boxes are at most so far apart, in any order.
  template <typename Found>
  void forEachPair(double distance, const Found& found) const;
  /// Calls visit(i, gap) for bodies with a lower bound of the distance of their boxes from a box,
  /// by increasing bound. `visit` returns the distance beyond which no more bodies are needed.
  template <typename Visit>
  void visitByDistance(const WorldBox& box, const Visit& visit) const;
  /// Calls visit(i, t) for bodies with a lower bound of the t at which a ray enters their boxes, by
  /// increasing bound. `visit` returns the t beyond which no more bodies are needed.
  template <typename Visit>
  void visitAlongRay(const fcl::Vector3d& origin, const fcl::Vector3d& direction,
                     const Visit& visit) const;

 private:
  void build();
  void refit();
  double cost() const;

  std::vector<fcl::Vector3d> corners_;  ///< of each body the lowest and the highest
  WideTree tree_;
  double built_cost_ = 0;
};

}  // namespace adaptive_bvh

#include "scene/body_walks.h"
