#include "query/mesh_octree.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif
#include <fcl/geometry/shape/utility.h>

#include "query/gjk_solver.h"
#include "volume/rounding.h"

namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

namespace {

/// A cell of an octree and where it is, in the octree's coordinates.
template <typename S>
struct Cell {
  const typename fcl::OcTree<S>::OcTreeNode* node;
  fcl::AABB<S> box;
};

/// Walks pairs of an occupied cell and a node of the mesh that may be nearer than a limit.
template <typename S>
class MeshOctreeWalk {
 public:
  using Point = fcl::Vector3<S>;

  MeshOctreeWalk(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& mesh_tf,
                 const fcl::OcTree<S>& octree, const fcl::Transform3<S>& octree_tf,
                 const Recorder& recorder)
      : mesh_(mesh),
        mesh_tf_(mesh_tf),
        octree_(octree),
        octree_tf_(octree_tf),
        to_octree_(octree_tf.inverse(Eigen::Isometry) * mesh_tf),
        recorder_(recorder) {}
  ~MeshOctreeWalk() { recorder_.addQuery(bv_tests_, leaf_tests_); }

  /// Calls test(cell's box, its pose, cell, triangle) for every leaf of both whose bound is less
  /// than limit(), the nearer ones first; until it returns true.
  template <typename Limit, typename Test>
  void run(Limit&& limit, Test&& test) {
    if (octree_.getRoot() && octree_.isNodeOccupied(octree_.getRoot()))
      visit({octree_.getRoot(), octree_.getRootBV()}, 0, limit, test);
  }

 private:
  /// A lower bound of the distance of a cell and a volume, below 0 when they overlap: of the cell
  /// and the box around the volume, both along the octree's axes. Sums of a few products no larger
  /// than `size`: 32 epsilon of that covers their rounding.
  S separation(const fcl::AABB<S>& cell, int node) {
    ++bv_tests_;
    const fcl::RSS<S>& bv = mesh_.getBV(node).bv;
    const Point a = bv.axis.col(0) * (bv.l[0] / 2), b = bv.axis.col(1) * (bv.l[1] / 2);
    const Point middle = to_octree_ * (bv.To + a + b);
    const Point half = (to_octree_.linear() * a).cwiseAbs() + (to_octree_.linear() * b).cwiseAbs() +
                       Point::Constant(bv.r);
    const Point gap = ((middle - half) - cell.max_).cwiseMax(cell.min_ - (middle + half));
    const S size = to_octree_.translation().template lpNorm<1>() + bv.To.template lpNorm<1>() +
                   bv.l[0] + bv.l[1] + bv.r + cell.min_.template lpNorm<1>() +
                   cell.max_.template lpNorm<1>();
    const S overlap = gap.maxCoeff();
    return (overlap < 0 ? overlap : gap.cwiseMax(S(0)).norm()) - 32 * rounding::epsilon<S>() * size;
  }

  template <typename Limit, typename Test>
  bool visit(const Cell<S>& cell, int b, Limit&& limit, Test&& test) {
    recorder_.addVisit(b, 0);
    const fcl::BVNode<fcl::RSS<S>>& node = mesh_.getBV(b);
    const bool cell_is_leaf = !octree_.nodeHasChildren(cell.node);
    if (cell_is_leaf && node.isLeaf()) {
      ++leaf_tests_;
      fcl::Box<S> box;
      fcl::Transform3<S> box_tf;
      fcl::constructBox(cell.box, octree_tf_, box, box_tf);
      return test(box, box_tf, cell.node, node.primitiveId());
    }
    struct Next {
      S separation;
      Cell<S> cell;
      int node;
    };
    std::array<Next, 8> next;
    std::size_t count = 0;
    if (node.isLeaf() || (!cell_is_leaf && cell.box.size() > node.bv.size())) {
      for (unsigned i = 0; i < 8; ++i) {
        if (!octree_.nodeChildExists(cell.node, i)) continue;
        Cell<S> child{octree_.getNodeChild(cell.node, i), fcl::AABB<S>()};
        if (!octree_.isNodeOccupied(child.node)) continue;
        fcl::computeChildBV(cell.box, i, child.box);
        next[count++] = {separation(child.box, b), child, b};
      }
    } else {
      for (int child : {node.leftChild(), node.rightChild()})
        next[count++] = {separation(cell.box, child), cell, child};
    }
    for (Next *first = next.data(), *end = first + count; first != end; ++first) {
      std::swap(*first, *std::min_element(first, end, [](const Next& x, const Next& y) {
        return x.separation < y.separation;
      }));
      if (!(first->separation < limit())) break;
      if (visit(first->cell, first->node, limit, test)) return true;
    }
    return false;
  }

  const fcl::BVHModel<fcl::RSS<S>>& mesh_;
  const fcl::Transform3<S>& mesh_tf_;
  const fcl::OcTree<S>& octree_;
  const fcl::Transform3<S>& octree_tf_;
  const fcl::Transform3<S> to_octree_;
  Recorder recorder_;
  long bv_tests_ = 0, leaf_tests_ = 0;
};

}  // namespace

template <typename S>
S meshOctreeDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh, const fcl::Transform3<S>& mesh_tf,
                     const fcl::CollisionGeometry<S>& geometry, const fcl::Transform3<S>& octree_tf,
                     const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                     const Recorder& recorder) {
  if (request.isSatisfied(result)) return result.min_distance;
  const auto& octree = static_cast<const fcl::OcTree<S>&>(geometry);
  return withSolver(request, [&](const auto& solver) {
    const auto test = [&](const fcl::Box<S>& box, const fcl::Transform3<S>& box_tf,
                          const typename fcl::OcTree<S>::OcTreeNode* cell, int triangle) {
      const fcl::Triangle& corners = mesh.tri_indices[triangle];
      S distance;
      fcl::Vector3<S> on_box, on_triangle;
      solver.shapeTriangleDistance(box, box_tf, mesh.vertices[corners[0]],
                                   mesh.vertices[corners[1]], mesh.vertices[corners[2]], mesh_tf,
                                   &distance, &on_box, &on_triangle);
      result.update(distance, &octree, &mesh, cell - octree.getRoot(), triangle, on_box,
                    on_triangle);
      return request.isSatisfied(result);
    };
    MeshOctreeWalk<S>(mesh, mesh_tf, octree, octree_tf, recorder)
        .run([&] { return result.min_distance; }, test);
    return result.min_distance;
  });
}

template <typename S>
std::size_t meshOctreeCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh,
                              const fcl::Transform3<S>& mesh_tf,
                              const fcl::CollisionGeometry<S>& geometry,
                              const fcl::Transform3<S>& octree_tf,
                              const fcl::CollisionRequest<S>& request,
                              fcl::CollisionResult<S>& result, const Recorder& recorder) {
  if (request.isSatisfied(result) || !mesh.isOccupied()) return result.numContacts();
  const auto& octree = static_cast<const fcl::OcTree<S>&>(geometry);
  return withSolver(request, [&](const auto& solver) {
    const auto test = [&](const fcl::Box<S>& box, const fcl::Transform3<S>& box_tf,
                          const typename fcl::OcTree<S>::OcTreeNode* cell, int triangle) {
      const fcl::Triangle& corners = mesh.tri_indices[triangle];
      const auto intersects = [&](fcl::Vector3<S>* point, S* depth, fcl::Vector3<S>* normal) {
        return solver.shapeTriangleIntersect(box, box_tf, mesh.vertices[corners[0]],
                                             mesh.vertices[corners[1]], mesh.vertices[corners[2]],
                                             mesh_tf, point, depth, normal);
      };
      const std::intptr_t id = cell - octree.getRoot();
      if (!request.enable_contact) {
        if (intersects(nullptr, nullptr, nullptr))
          result.addContact(fcl::Contact<S>(&octree, &mesh, id, triangle));
      } else {
        fcl::Vector3<S> point, normal;
        S depth;
        if (intersects(&point, &depth, &normal))
          result.addContact(fcl::Contact<S>(&octree, &mesh, id, triangle, point, normal, depth));
      }
      return request.isSatisfied(result);
    };
    // Volumes that just touch are not pruned: their separation is then less than 0.
    MeshOctreeWalk<S>(mesh, mesh_tf, octree, octree_tf, recorder).run([] { return S(0); }, test);
    return result.numContacts();
  });
}

#else

template <typename S>
S meshOctreeDistance(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,
                     const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,
                     const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&, const Recorder&) {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}

template <typename S>
std::size_t meshOctreeCollide(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,
                              const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,
                              const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&,
                              const Recorder&) {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template S meshOctreeDistance(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                                const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,  \
                                const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&,      \
                                const Recorder&);                                             \
  template std::size_t meshOctreeCollide(                                                     \
      const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,                           \
      const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&,                            \
      const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, const Recorder&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
