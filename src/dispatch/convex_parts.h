#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "dispatch/octree_cells.h"
#include "solids/box.h"
#include "solids/shape_solid.h"

namespace adaptive_bvh {

/// A shape, or a cell of an octree as a box, where it is in the world.
struct ConvexPart {
  PlacedSolid placed;
  std::intptr_t id;  ///< FCL's number of the cell; -1 of a shape
};

/// A ball around a cell and all that is in it, in the world.
struct CellBall {
  fcl::Vector3d middle;
  double radius;
};

/// A lower bound of the distance of a shape from what is in a ball, despite rounding.
inline double boundOf(const PlacedSolid& shape, const CellBall& ball) {
  constexpr double kRounding = 1e-12;
  const fcl::Vector3d from = ball.middle - shape.tf.translation();
  return shape.solid.surface(shape.tf.linear().transpose() * from).distance - ball.radius -
         kRounding * (ball.radius + from.norm() + shape.tf.translation().norm());
}

/// The convex parts of a body in its place: a shape, or the occupied cells of an octree.
class ConvexParts {
 public:
  /// Of FCL's geometry in either number type, to which it refers.
  template <typename S>
  ConvexParts(const fcl::CollisionGeometry<S>& geometry, const fcl::Transform3d& tf) : tf_(tf) {
#if FCL_HAVE_OCTOMAP
    if (geometry.getNodeType() == fcl::GEOM_OCTREE) {
      cells_.emplace(geometry);
      return;
    }
#endif
    shape_.emplace(geometry);
  }

  bool isOctree() const { return !shape_; }
  /// Of one that is no octree.
  const ShapeSolid& shape() const { return *shape_; }
#if FCL_HAVE_OCTOMAP
  /// Of an octree.
  const OctreeCells& cells() const { return *cells_; }
#endif
  const fcl::Transform3d& tf() const { return tf_; }

  /// Calls visit(part) for the shape, or for the cells with bound(ball) <= limit() for their balls
  /// and those of all cells around them, the nearest first in each, until it returns true. Returns
  /// whether it did.
  template <typename BoundOf, typename Limit, typename Visit>
  bool visit(const BoundOf& bound, const Limit& limit, const Visit& visit) const {
    if (shape_) return visit(ConvexPart{{**shape_, tf_}, -1});
    bool is_done = false;
#if FCL_HAVE_OCTOMAP
    cells_->visitRoot([&](const Cell& root) { is_done = descend(root, bound, limit, visit); });
#endif
    return is_done;
  }

 private:
#if FCL_HAVE_OCTOMAP
  /// The nearest children first.
  template <typename BoundOf, typename Limit, typename Visit>
  bool descend(const Cell& cell, const BoundOf& bound, const Limit& limit,
               const Visit& visit) const {
    if (cells_->isLeaf(cell)) return visitLeaf(cell, visit);
    std::array<std::pair<double, Cell>, 8> children;
    std::size_t count = 0;
    cells_->forEachChild(cell, [&](const Cell& child) {
      // The rotation is one up to an error.
      children[count++] = {bound(CellBall{tf_ * child.middle(), 1.01 * child.half().norm()}),
                           child};
      return false;
    });
    for (auto *next = children.data(), *end = next + count; next != end; ++next) {
      std::iter_swap(next, std::min_element(next, end, [](const auto& x, const auto& y) {
                       return x.first < y.first;
                     }));
      if (!(next->first <= limit())) break;
      if (descend(next->second, bound, limit, visit)) return true;
    }
    return false;
  }
  template <typename Visit>
  bool visitLeaf(const Cell& cell, const Visit& visit) const {
    const BoxSolid box(cell.half());
    return visit(ConvexPart{{box, tf_ * Eigen::Translation3d(cell.middle())}, cells_->id(cell)});
  }

  std::optional<OctreeCells> cells_;
#endif
  std::optional<ShapeSolid> shape_;
  const fcl::Transform3d tf_;
};

}  // namespace adaptive_bvh
