#include "fcl/mesh_pairs.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "fcl/octree_pair.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

namespace {

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may overlap,
/// until it returns true. By FCL's nodes in FCL's order, so that a request for few contacts gets
/// those of FCL.
template <typename Pair, typename Test>
class OverlappingCells {
 public:
  using S = typename Pair::S;
  using Node = typename Pair::MeshNode;

  OverlappingCells(Pair& pair, Test& test) : pair_(pair), test_(test) {}

  void operator()(const Cell<S>& root) { visitNode(root, pair_.nodes().root()); }

 private:
  bool visitNode(const Cell<S>& cell, Node node) {
    if (pair_.nodes().isLeaf(node))
      return visitBound(cell, node, pair_.template triangle<TriangleOverlap<S>>(node));
    return visitBound(cell, node, pair_.volume(node));
  }

  template <typename Bound>
  bool visitBound(const Cell<S>& cell, Node node, Bound bound) {
    if (isApart(cell, bound)) return false;
    pair_.nodes().recordVisit(node);
    return descend(cell, node, bound);
  }

  bool descend(const Cell<S>& cell, Node node, TriangleOverlap<S>& triangle) {
    if (pair_.isLeaf(cell)) return test_(cell, pair_.nodes().triangle(node));
    return descendOctree(cell, node, triangle);
  }

  bool descend(const Cell<S>& cell, Node node, VolumeInOctree<S>& volume) {
    if (pair_.goesDownTheOctree(cell, node)) return descendOctree(cell, node, volume);
    return pair_.nodes().forEachBelow(node, [&](Node below) { return visitNode(cell, below); });
  }

  template <typename Bound>
  bool descendOctree(const Cell<S>& cell, Node node, Bound& bound) {
    return pair_.forEachChild(cell, [&](const Cell<S>& child) {
      return !isApart(child, bound) && descend(child, node, bound);
    });
  }

  template <typename Bound>
  bool isApart(const Cell<S>& cell, Bound& bound) {
    pair_.addTest();
    return bound.isApart(cell.extent);
  }

  Pair& pair_;
  Test& test_;
};

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may be nearer
/// than limit(), the nearer ones first, until it returns true.
template <typename Pair, typename Limit, typename Test>
class NearestCells {
 public:
  using S = typename Pair::S;
  using Node = typename Pair::MeshNode;

  NearestCells(Pair& pair, Limit& limit, Test& test) : pair_(pair), limit_(limit), test_(test) {}

  void operator()(const Cell<S>& root) { visitNode(root, pair_.nodes().root()); }

 private:
  /// What is below a cell or a node, and how far off it is.
  template <typename Part, int kMost>
  struct Parts {
    std::array<std::pair<S, Part>, std::size_t(kMost)> parts;
    std::size_t count = 0;

    void add(S distance, const Part& part) { parts[count++] = {distance, part}; }
    /// The nearest first, while they are nearer than limit().
    template <typename Visit>
    bool forEach(Limit& limit, const Visit& visit) {
      for (auto *next = parts.data(), *end = next + count; next != end; ++next) {
        std::iter_swap(next, std::min_element(next, end, [](const auto& x, const auto& y) {
                         return x.first < y.first;
                       }));
        if (!(next->first < limit())) return false;
        if (visit(next->second)) return true;
      }
      return false;
    }
  };

  bool visitNode(const Cell<S>& cell, Node node) {
    pair_.nodes().recordVisit(node);
    if (pair_.nodes().isLeaf(node))
      return descend(cell, node, pair_.template triangle<TriangleDistance<S>>(node));
    return descend(cell, node, pair_.volume(node));
  }

  bool descend(const Cell<S>& cell, Node node, const TriangleDistance<S>& triangle) {
    if (!pair_.isLeaf(cell)) return descendOctree(cell, node, triangle);
    if (!(triangle.distance(cell.extent) < limit_())) return false;
    return test_(cell, pair_.nodes().triangle(node));
  }

  bool descend(const Cell<S>& cell, Node node, const VolumeInOctree<S>& volume) {
    if (pair_.goesDownTheOctree(cell, node)) return descendOctree(cell, node, volume);
    Parts<Node, 4> below;
    pair_.nodes().forEachBelow(node, [&](Node child) {
      below.add(distance(cell, pair_.volume(child)), child);
      return false;
    });
    return below.forEach(limit_, [&](Node child) { return visitNode(cell, child); });
  }

  template <typename Bound>
  bool descendOctree(const Cell<S>& cell, Node node, const Bound& bound) {
    Parts<Cell<S>, 8> children;
    pair_.forEachChild(cell, [&](const Cell<S>& child) {
      children.add(distance(child, bound), child);
      return false;
    });
    return children.forEach(limit_,
                            [&](const Cell<S>& child) { return descend(child, node, bound); });
  }

  template <typename Bound>
  S distance(const Cell<S>& cell, const Bound& bound) {
    pair_.addTest();
    return bound.distance(cell.extent);
  }

  Pair& pair_;
  Limit& limit_;
  Test& test_;
};

template <typename Nodes, typename Placed, typename S>
S searchDistance(const Placed& mesh, const PlacedGeometry<S>& octree,
                 const DistanceQuery<S>& query) {
  if (query.isSatisfied()) return query.result.min_distance;
  const fcl::CollisionGeometry<S>* const object = trianglesOf(mesh).geometry;
  using Pair = MeshOctreePair<Nodes>;
  fcl::DistanceResult<S>& result = query.result;
  Pair pair(mesh, octree);
  const auto limit = [&] { return result.min_distance; };
  const auto test = [&](const Cell<S>& cell, int triangle) {
    const auto leaves = pair.leafPair(cell, triangle);
    const TriangleGap gap = leaves.gap();
    result.update(distanceAs<S>(gap.distance), octree.geometry, object, pair.id(cell), triangle,
                  leaves.inWorld(gap.points.second), leaves.inWorld(gap.points.first));
    return query.isSatisfied();
  };
  // When bodies touch, any pair that touches is the answer: it is searched first.
  const auto once = [&](const Cell<S>& cell, int triangle) {
    test(cell, triangle);
    return true;
  };
  pair.run(OverlappingCells<Pair, decltype(once)>(pair, once));
  if (!query.isSatisfied())
    pair.run(NearestCells<Pair, decltype(limit), decltype(test)>(pair, limit, test));
  return result.min_distance;
}

template <typename Nodes, typename Placed, typename S>
std::size_t searchContacts(const Placed& mesh, const PlacedGeometry<S>& octree,
                           const CollisionQuery<S>& query) {
  const fcl::CollisionGeometry<S>* const object = trianglesOf(mesh).geometry;
  if (query.isSatisfied() || !object->isOccupied()) return query.result.numContacts();
  using Pair = MeshOctreePair<Nodes>;
  fcl::CollisionResult<S>& result = query.result;
  Pair pair(mesh, octree);
  const auto test = [&](const Cell<S>& cell, int triangle) {
    const auto leaves = pair.leafPair(cell, triangle);
    ShapeContact found;
    const bool touches =
        query.request.enable_contact ? leaves.touches(found) : leaves.gap().distance <= 0;
    if (!touches) return false;
    fcl::Contact<S> contact(octree.geometry, object, pair.id(cell), triangle);
    if (query.request.enable_contact) {
      contact.pos = leaves.inWorld(found.position);
      contact.normal = leaves.turnedToWorld(-found.normal);  // from the octree to the mesh
      contact.penetration_depth = static_cast<S>(found.depth);
    }
    result.addContact(contact);
    return query.isSatisfied();
  };
  pair.run(OverlappingCells<Pair, decltype(test)>(pair, test));
  return result.numContacts();
}

}  // namespace

template <typename S>
S meshOctreeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                     const DistanceQuery<S>& query) {
  return searchDistance<WideNodes<S>>(mesh, octree, query);
}
template <typename BV>
typename BV::S modelOctreeDistance(const PlacedModel<BV>& model,
                                   const PlacedGeometry<typename BV::S>& octree,
                                   const DistanceQuery<typename BV::S>& query) {
  return searchDistance<FclNodes<BV>>(model, octree, query);
}

template <typename S>
std::size_t meshOctreeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                              const CollisionQuery<S>& query) {
  return searchContacts<WideNodes<S>>(mesh, octree, query);
}
template <typename BV>
std::size_t modelOctreeCollide(const PlacedModel<BV>& model,
                               const PlacedGeometry<typename BV::S>& octree,
                               const CollisionQuery<typename BV::S>& query) {
  return searchContacts<FclNodes<BV>>(model, octree, query);
}

#else

namespace {
[[noreturn]] void refuseOctree() {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}
}  // namespace

template <typename S>
S meshOctreeDistance(const MeshObject<S>&, const PlacedGeometry<S>&, const DistanceQuery<S>&) {
  refuseOctree();
}
template <typename BV>
typename BV::S modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry<typename BV::S>&,
                                   const DistanceQuery<typename BV::S>&) {
  refuseOctree();
}
template <typename S>
std::size_t meshOctreeCollide(const MeshObject<S>&, const PlacedGeometry<S>&,
                              const CollisionQuery<S>&) {
  refuseOctree();
}
template <typename BV>
std::size_t modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry<typename BV::S>&,
                               const CollisionQuery<typename BV::S>&) {
  refuseOctree();
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                      \
  template S meshOctreeDistance(const MeshObject<S>&, const PlacedGeometry<S>&,          \
                                const DistanceQuery<S>&);                                \
  template std::size_t meshOctreeCollide(const MeshObject<S>&, const PlacedGeometry<S>&, \
                                         const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                            \
  template BV::S modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&,      \
                                     const DistanceQuery<BV::S>&);                              \
  template std::size_t modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&, \
                                          const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
