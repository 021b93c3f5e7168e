#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "fcl/octree_cells.h"
#include "fcl/shape_geometry.h"
#include "query/placed_mesh.h"
#include "triangles/shape_pair.h"

namespace adaptive_bvh {

/// A shape, or a cell of an octree as a box, where it is in the world.
struct ConvexPart {
  PlacedShape placed;
  std::intptr_t id;  ///< FCL's number of the cell; -1 of a shape
};

/// A ball around a cell and all that is in it, in the world.
struct CellBall {
  fcl::Vector3d middle;
  double radius;
};

/// A lower bound of the distance of a shape from what is in a ball, despite rounding.
inline double boundOf(const PlacedShape& shape, const CellBall& ball) {
  constexpr double kRounding = 1e-12;
  const fcl::Vector3d from = ball.middle - shape.tf.translation();
  return shape.shape.surface(shape.tf.linear().transpose() * from).distance - ball.radius -
         kRounding * (ball.radius + from.norm() + shape.tf.translation().norm());
}

#if FCL_HAVE_OCTOMAP

/// The occupied leaves of an octree in its place.
template <typename S, typename BoundOf, typename Limit, typename Visit>
class CellVisitor {
 public:
  CellVisitor(const PlacedGeometry<S>& octree, const BoundOf& bound, const Limit& limit,
              const Visit& visit)
      : cells_(*octree.geometry),
        tf_(octree.tf.template cast<double>()),
        bound_(bound),
        limit_(limit),
        visit_(visit) {}

  bool run() const {
    bool is_done = false;
    cells_.visitRoot([&](const Cell<S>& root) { is_done = descend(root); });
    return is_done;
  }

 private:
  /// The nearest children first.
  bool descend(const Cell<S>& cell) const {
    if (cells_.isLeaf(cell)) return visitLeaf(cell);
    std::array<std::pair<double, Cell<S>>, 8> children;
    std::size_t count = 0;
    cells_.forEachChild(cell, [&](const Cell<S>& child) {
      children[count++] = {bound_(ballAround(child)), child};
      return false;
    });
    for (auto *next = children.data(), *end = next + count; next != end; ++next) {
      std::iter_swap(next, std::min_element(next, end, [](const auto& x, const auto& y) {
                       return x.first < y.first;
                     }));
      if (!(next->first <= limit_())) break;
      if (descend(next->second)) return true;
    }
    return false;
  }
  bool visitLeaf(const Cell<S>& cell) const {
    const BoxShape box(halfOf(cell));
    return visit_(ConvexPart{{box, tf_ * Eigen::Translation3d(middleOf(cell))}, cells_.id(cell)});
  }

  static fcl::Vector3d middleOf(const Cell<S>& cell) {
    return (cell.box.min_.template cast<double>() + cell.box.max_.template cast<double>()) / 2;
  }
  static fcl::Vector3d halfOf(const Cell<S>& cell) {
    return (cell.box.max_.template cast<double>() - cell.box.min_.template cast<double>()) / 2;
  }
  CellBall ballAround(const Cell<S>& cell) const {
    // The rotation is one up to an error.
    return {tf_ * middleOf(cell), 1.01 * halfOf(cell).norm()};
  }

  const OctreeCells<S> cells_;
  const fcl::Transform3d tf_;
  const BoundOf& bound_;
  const Limit& limit_;
  const Visit& visit_;
};

#endif

/// Calls visit(part) for a shape, or for the cells of an octree with bound(ball) <= limit() for
/// their balls and those of all cells around them, the nearest first in each, until it returns
/// true. Returns whether it did.
template <typename S, typename BoundOf, typename Limit, typename Visit>
bool visitParts(const PlacedGeometry<S>& body, const BoundOf& bound, const Limit& limit,
                const Visit& visit) {
#if FCL_HAVE_OCTOMAP
  if (body.geometry->getNodeType() == fcl::GEOM_OCTREE)
    return CellVisitor<S, BoundOf, Limit, Visit>(body, bound, limit, visit).run();
#endif
  bool is_done = false;
  visitShape(*body.geometry, [&](const TriangleShape& shape, const ShapeCore&) {
    is_done = visit(ConvexPart{{shape, body.tf.template cast<double>()}, -1});
  });
  return is_done;
}

}  // namespace adaptive_bvh
