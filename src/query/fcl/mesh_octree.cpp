#include "query/fcl/mesh_octree.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "query/fcl/gjk_solver.h"
#include "query/fcl/octree_pair.h"
#include "query/fcl/shape_triangle.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

namespace {

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may overlap,
/// until it returns true. In FCL's order, so that a request for few contacts gets those of FCL.
template <typename BV, typename Test>
class OverlapSearch {
 public:
  using S = typename BV::S;

  OverlapSearch(MeshOctreePair<BV>& pair, Test& test) : pair_(pair), test_(test) {}

  void operator()(const Cell<S>& root) { visitNode(root, 0); }

 private:
  bool visitNode(const Cell<S>& cell, int b) {
    if (pair_.node(b).isLeaf())
      return visitBound(cell, b, pair_.template triangle<TriangleOverlap<S>>(b));
    return visitBound(cell, b, pair_.volume(b));
  }

  template <typename Bound>
  bool visitBound(const Cell<S>& cell, int b, Bound bound) {
    if (isApart(cell, bound)) return false;
    pair_.recordVisit(b);
    return descend(cell, b, bound);
  }

  bool descend(const Cell<S>& cell, int b, TriangleOverlap<S>& triangle) {
    if (pair_.isLeaf(cell)) return test_(cell, pair_.node(b).primitiveId());
    return descendOctree(cell, b, triangle);
  }

  bool descend(const Cell<S>& cell, int b, VolumeInOctree<BV>& volume) {
    if (pair_.goesDownTheOctree(cell, b)) return descendOctree(cell, b, volume);
    return visitNode(cell, pair_.node(b).leftChild()) ||
           visitNode(cell, pair_.node(b).rightChild());
  }

  template <typename Bound>
  bool descendOctree(const Cell<S>& cell, int b, Bound& bound) {
    return pair_.forEachChild(cell, [&](const Cell<S>& child) {
      return !isApart(child, bound) && descend(child, b, bound);
    });
  }

  template <typename Bound>
  bool isApart(const Cell<S>& cell, Bound& bound) {
    pair_.addTest();
    return bound.isApart(cell.extent);
  }

  MeshOctreePair<BV>& pair_;
  Test& test_;
};

/// Calls test(cell, triangle) for the pairs of an occupied cell and a triangle that may be nearer
/// than limit(), the nearer ones first, until it returns true.
template <typename BV, typename Limit, typename Test>
class NearestSearch {
 public:
  using S = typename BV::S;

  NearestSearch(MeshOctreePair<BV>& pair, Limit& limit, Test& test)
      : pair_(pair), limit_(limit), test_(test) {}

  void operator()(const Cell<S>& root) { visitNode(root, 0); }

 private:
  bool visitNode(const Cell<S>& cell, int b) {
    pair_.recordVisit(b);
    if (pair_.node(b).isLeaf())
      return descend(cell, b, pair_.template triangle<TriangleDistance<S>>(b));
    return descend(cell, b, pair_.volume(b));
  }

  bool descend(const Cell<S>& cell, int b, const TriangleDistance<S>& triangle) {
    if (!pair_.isLeaf(cell)) return descendOctree(cell, b, triangle);
    if (!(triangle.distance(cell.extent) < limit_())) return false;
    return test_(cell, pair_.node(b).primitiveId());
  }

  bool descend(const Cell<S>& cell, int b, const VolumeInOctree<BV>& volume) {
    if (pair_.goesDownTheOctree(cell, b)) return descendOctree(cell, b, volume);
    int near = pair_.node(b).leftChild(), far = pair_.node(b).rightChild();
    S to_near = distance(cell, near), to_far = distance(cell, far);
    if (to_far < to_near) {
      std::swap(near, far);
      std::swap(to_near, to_far);
    }
    return (to_near < limit_() && visitNode(cell, near)) ||
           (to_far < limit_() && visitNode(cell, far));
  }

  S distance(const Cell<S>& cell, int b) {
    pair_.addTest();
    return pair_.volume(b).distance(cell.extent);
  }

  template <typename Bound>
  bool descendOctree(const Cell<S>& cell, int b, const Bound& bound) {
    std::array<std::pair<S, Cell<S>>, 8> children;
    std::size_t count = 0;
    pair_.forEachChild(cell, [&](const Cell<S>& child) {
      pair_.addTest();
      const S distance = bound.distance(child.extent);
      if (distance < limit_()) children[count++] = {distance, child};
      return false;
    });
    for (auto *next = children.data(), *end = next + count; next != end; ++next) {
      std::iter_swap(next, std::min_element(next, end, [](const auto& x, const auto& y) {
                       return x.first < y.first;
                     }));
      if (!(next->first < limit_())) break;
      if (descend(next->second, b, bound)) return true;
    }
    return false;
  }

  MeshOctreePair<BV>& pair_;
  Limit& limit_;
  Test& test_;
};

}  // namespace

template <typename BV>
typename BV::S meshOctreeDistance(const PlacedMesh<BV>& mesh,
                                  const PlacedGeometry<typename BV::S>& octree,
                                  const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  fcl::DistanceResult<S>& result = query.result;
  if (query.isSatisfied()) return result.min_distance;
  return withSolver(query.request, [&](const auto& solver) {
    MeshOctreePair<BV> pair(mesh, octree, 0);
    const auto limit = [&] { return result.min_distance; };
    const auto test = [&](const Cell<S>& cell, int triangle) {
      const ShapeTriangleDistance<S> found = pair.askSolver(cell, [&](const auto&... box) {
        return shapeTriangleDistance(solver, box..., *mesh.model, mesh.tf, triangle);
      });
      result.update(found.distance, octree.geometry, mesh.model, pair.id(cell), triangle,
                    found.on_shape, found.on_triangle);
      return query.isSatisfied();
    };
    // When bodies touch, any pair that touches is the answer: it is searched first.
    const auto once = [&](const Cell<S>& cell, int triangle) {
      test(cell, triangle);
      return true;
    };
    pair.run(OverlapSearch<BV, decltype(once)>(pair, once));
    if (!query.isSatisfied())
      pair.run(NearestSearch<BV, decltype(limit), decltype(test)>(pair, limit, test));
    return result.min_distance;
  });
}

template <typename BV>
std::size_t meshOctreeCollide(const PlacedMesh<BV>& mesh,
                              const PlacedGeometry<typename BV::S>& octree,
                              const CollisionQuery<typename BV::S>& query) {
  using S = typename BV::S;
  fcl::CollisionResult<S>& result = query.result;
  if (query.isSatisfied() || !mesh.model->isOccupied()) return result.numContacts();
  return withSolver(query.request, [&](const auto& solver) {
    MeshOctreePair<BV> pair(mesh, octree, query.request.gjk_tolerance);
    const auto test = [&](const Cell<S>& cell, int triangle) {
      const fcl::Triangle& t = mesh.model->tri_indices[triangle];
      const fcl::Vector3<S>* v = mesh.model->vertices;
      const auto intersects = [&](fcl::Vector3<S>* point, S* depth, fcl::Vector3<S>* normal) {
        return pair.askSolver(cell, [&](const auto&... box) {
          return solver.shapeTriangleIntersect(box..., v[t[0]], v[t[1]], v[t[2]], mesh.tf, point,
                                               depth, normal);
        });
      };
      fcl::Contact<S> contact(octree.geometry, mesh.model, pair.id(cell), triangle);
      if (query.request.enable_contact
              ? intersects(&contact.pos, &contact.penetration_depth, &contact.normal)
              : intersects(nullptr, nullptr, nullptr))
        result.addContact(contact);
      return query.isSatisfied();
    };
    pair.run(OverlapSearch<BV, decltype(test)>(pair, test));
    return result.numContacts();
  });
}

#else

template <typename BV>
typename BV::S meshOctreeDistance(const PlacedMesh<BV>&, const PlacedGeometry<typename BV::S>&,
                                  const DistanceQuery<typename BV::S>&) {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}

template <typename BV>
std::size_t meshOctreeCollide(const PlacedMesh<BV>&, const PlacedGeometry<typename BV::S>&,
                              const CollisionQuery<typename BV::S>&) {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                          \
  template BV::S meshOctreeDistance(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&,      \
                                    const DistanceQuery<BV::S>&);                             \
  template std::size_t meshOctreeCollide(const PlacedMesh<BV>&, const PlacedGeometry<BV::S>&, \
                                         const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
