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

/// A shape, or a cell of an octree as a box, and its pose.
struct ConvexPart {
  PlacedSolid placed;
  std::intptr_t id;  ///< FCL's number of the cell; -1 for a shape
};

/// A bounding sphere of a cell, in the world.
struct CellBall {
  fcl::Vector3d middle;
  double radius;
};

/// A lower bound of the distance of a shape from everything in a ball, despite rounding.
inline double boundOf(const PlacedSolid& shape, const CellBall& ball) {
  constexpr double kRounding = 1e-12;
  const fcl::Vector3d offset = ball.middle - shape.tf.translation();
  return shape.solid.surface(shape.tf.linear().transpose() * offset).distance - ball.radius -
         kRounding * (ball.radius + offset.norm() + shape.tf.translation().norm());
}

/// The convex parts of a body, and its pose: a shape, or the occupied cells of an octree.
class ConvexParts {
 public:
  /// Refers to FCL's shape or octree.
  ConvexParts(const fcl::CollisionGeometryd& geometry, const fcl::Transform3d& tf) : tf_(tf) {
#if FCL_HAVE_OCTOMAP
    if (geometry.getNodeType() == fcl::GEOM_OCTREE) {
      cells_.emplace(geometry);
      return;
    }
#endif
    shape_.emplace(geometry);
  }

  bool isOctree() const { return !shape_; }
  const ShapeSolid& shape() const { return *shape_; }  ///< for a shape only
#if FCL_HAVE_OCTOMAP
  const OctreeCells& cells() const { return *cells_; }  ///< for an octree only
#endif
  const fcl::Transform3d& tf() const { return tf_; }

  /// Calls visit(part) for the shape, or for the octree's occupied leaves, until it returns true;
  /// returns whether it did. Children of a cell are visited by increasing bound(ball) of their
  /// bounding spheres, and skipped if it exceeds limit(), which visits may lower.
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
  /// Visits the cells below a cell; returns whether `visit` returned true.
  template <typename BoundOf, typename Limit, typename Visit>
  bool descend(const Cell& cell, const BoundOf& bound, const Limit& limit,
               const Visit& visit) const {
    if (cells_->isLeaf(cell)) return visitLeaf(cell, visit);
    std::array<std::pair<double, Cell>, 8> children;
    std::size_t count = 0;
    cells_->forEachChild(cell, [&](const Cell& child) {
      // The radius has a reserve for rotations that are orthonormal to 1e-3 only (requireRigid).
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
