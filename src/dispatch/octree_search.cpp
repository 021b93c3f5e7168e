// Searches for pairs of an octree's cell and a triangle, by descending in both trees.
#include <algorithm>
#include <array>
#include <utility>

#include "dispatch/octree_pair.h"
#if FCL_HAVE_OCTOMAP

namespace adaptive_bvh {
namespace {

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may overlap,
/// until it returns true. In FCL's order for FCL's nodes, so that the first contacts are FCL's.
template <typename Test>
class OverlappingCells {
 public:
  OverlappingCells(MeshOctreePair& pair, const Test& test) : pair_(pair), test_(test) {}

  void operator()(const Cell& root) { visitNode(root, MeshNode()); }

 private:
  // Each function visits the pairs below a cell and a node; returns whether `test` returned true.

  bool visitNode(const Cell& cell, MeshNode node) {
    if (pair_.nodes().isLeaf(node))
      return visitBound(cell, node, pair_.triangle<TriangleOverlap>(node));
    return visitBound(cell, node, pair_.volume(node));
  }

  template <typename Bound>
  bool visitBound(const Cell& cell, MeshNode node, Bound bound) {
    if (isApart(cell, bound)) return false;
    pair_.nodes().recordVisit(node);
    return descend(cell, node, bound);
  }

  bool descend(const Cell& cell, MeshNode node, TriangleOverlap& triangle) {
    if (pair_.octree().isLeaf(cell)) return test_(cell, pair_.nodes().triangle(node));
    return descendOctree(cell, node, triangle);
  }

  bool descend(const Cell& cell, MeshNode node, VolumeInOctree& volume) {
    if (pair_.descendsInOctree(cell, node)) return descendOctree(cell, node, volume);
    MeshNode children[4];
    const int count = pair_.nodes().below(node, children);
    return std::any_of(children, children + count,
                       [&](MeshNode child) { return visitNode(cell, child); });
  }

  template <typename Bound>
  bool descendOctree(const Cell& cell, MeshNode node, Bound& bound) {
    return pair_.octree().forEachChild(cell, [&](const Cell& child) {
      return !isApart(child, bound) && descend(child, node, bound);
    });
  }

  template <typename Bound>
  bool isApart(const Cell& cell, Bound& bound) {
    pair_.addTest();
    return bound.isApart(cell.extent);
  }

  MeshOctreePair& pair_;
  const Test& test_;
};

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may be nearer
/// than `limit`, until it returns true. Visits nearest children first.
template <typename Test>
class NearestCells {
 public:
  NearestCells(MeshOctreePair& pair, const double& limit, const Test& test)
      : pair_(pair), limit_(limit), test_(test) {}

  void operator()(const Cell& root) { visitNode(root, MeshNode()); }

 private:
  /// The children of a cell or node, with lower bounds of their distances.
  template <typename Child, int kMost>
  struct Children {
    std::array<std::pair<double, Child>, std::size_t(kMost)> entries;
    std::size_t count = 0;

    void add(double distance, const Child& child) { entries[count++] = {distance, child}; }
    /// Visits children nearer than `limit`, nearest first, until `visit` returns true.
    template <typename Visit>
    bool forEach(const double& limit, const Visit& visit) {
      for (auto *next = entries.data(), *end = next + count; next != end; ++next) {
        std::iter_swap(next, std::min_element(next, end, [](const auto& x, const auto& y) {
                         return x.first < y.first;
                       }));
        if (!(next->first < limit)) return false;
        if (visit(next->second)) return true;
      }
      return false;
    }
  };

  bool visitNode(const Cell& cell, MeshNode node) {
    pair_.nodes().recordVisit(node);
    if (pair_.nodes().isLeaf(node))
      return descend(cell, node, pair_.triangle<TriangleDistance>(node));
    return descend(cell, node, pair_.volume(node));
  }

  bool descend(const Cell& cell, MeshNode node, const TriangleDistance& triangle) {
    if (!pair_.octree().isLeaf(cell)) return descendOctree(cell, node, triangle);
    if (!(triangle.distance(cell.extent) < limit_)) return false;
    return test_(cell, pair_.nodes().triangle(node));
  }

  bool descend(const Cell& cell, MeshNode node, const VolumeInOctree& volume) {
    if (pair_.descendsInOctree(cell, node)) return descendOctree(cell, node, volume);
    MeshNode nodes[4];
    const int count = pair_.nodes().below(node, nodes);
    Children<MeshNode, 4> below;
    for (int i = 0; i < count; ++i) below.add(distance(cell, pair_.volume(nodes[i])), nodes[i]);
    return below.forEach(limit_, [&](MeshNode child) { return visitNode(cell, child); });
  }

  template <typename Bound>
  bool descendOctree(const Cell& cell, MeshNode node, const Bound& bound) {
    Children<Cell, 8> children;
    pair_.octree().forEachChild(cell, [&](const Cell& child) {
      children.add(distance(child, bound), child);
      return false;
    });
    return children.forEach(limit_, [&](const Cell& child) { return descend(child, node, bound); });
  }

  template <typename Bound>
  double distance(const Cell& cell, const Bound& bound) {
    pair_.addTest();
    return bound.distance(cell.extent);
  }

  MeshOctreePair& pair_;
  const double& limit_;
  const Test& test_;
};

}  // namespace

void distanceToOctree(const QueryTriangles& mesh, const MeshNodes& nodes,
                      const PlacedOctree& octree, const DistanceQuery& query) {
  if (query.isSatisfied()) return;
  fcl::DistanceResultd& result = query.result;
  MeshOctreePair pair(mesh, nodes, octree);
  const auto test = [&](const Cell& cell, int triangle) {
    const auto tested = pair.cellAndTriangle(cell, triangle);
    const TriangleGap gap = tested.gap();
    result.update(gap.distance, nullptr, nullptr, octree.cells.id(cell), triangle,
                  tested.inWorld(gap.points.second), tested.inWorld(gap.points.first));
    return query.isSatisfied();
  };
  // The first pair that may overlap gives an upper bound, and is the answer if it touches.
  const auto testFirst = [&](const Cell& cell, int triangle) {
    test(cell, triangle);
    return true;
  };
  octree.cells.visitRoot(OverlappingCells<decltype(testFirst)>(pair, testFirst));
  if (!query.isSatisfied())
    octree.cells.visitRoot(NearestCells<decltype(test)>(pair, result.min_distance, test));
}

void collideWithOctree(const QueryTriangles& mesh, const MeshNodes& nodes,
                       const PlacedOctree& octree, const fcl::CollisionGeometryd& o1,
                       const fcl::CollisionGeometryd& o2, const CollisionQuery& query) {
  if (query.isSatisfied() || !o2.isOccupied()) return;
  MeshOctreePair pair(mesh, nodes, octree);
  const auto test = [&](const Cell& cell, int triangle) {
    const auto tested = pair.cellAndTriangle(cell, triangle);
    ShapeContact found;
    const bool touches =
        query.request.enable_contact ? tested.touches(found) : tested.gap().distance <= 0;
    if (!touches) return false;
    fcl::Contactd contact(&o1, &o2, octree.cells.id(cell), triangle);
    if (query.request.enable_contact) {
      contact.pos = tested.inWorld(found.position);
      contact.normal = tested.turnedToWorld(-found.normal);  // from the octree to the mesh
      contact.penetration_depth = found.depth;
    }
    query.result.addContact(contact);
    return query.isSatisfied();
  };
  octree.cells.visitRoot(OverlappingCells<decltype(test)>(pair, test));
}

}  // namespace adaptive_bvh

#endif  // FCL_HAVE_OCTOMAP
