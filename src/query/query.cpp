#include "adaptive_bvh/query.h"

#include <utility>

#include "model_state.h"
#include "query/mesh_mesh.h"
#include "query/mesh_octree.h"
#include "query/mesh_shape.h"
#include "query/queried_mesh.h"
#include "query/supported_pairs.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Mesh = fcl::BVHModel<fcl::RSS<S>>;

/// One object of a query, as far as it matters to us.
template <typename S>
struct Side {
  explicit Side(const fcl::CollisionGeometry<S>* geometry) {
    type = geometry->getNodeType();  // repairs a tree changed behind our back
    is_shape = type >= fcl::GEOM_BOX && type <= fcl::GEOM_HALFSPACE;
    is_octree = type == fcl::GEOM_OCTREE;
    if (geometry->getObjectType() != fcl::OT_BVH) return;
    adaptive = dynamic_cast<const AdaptiveBVHModel<fcl::RSS<S>>*>(geometry);
    mesh = adaptive ? adaptive : dynamic_cast<const Mesh<S>*>(geometry);
  }

  /// What stands beside an adaptive model; null beside another.
  const AdaptiveTree<fcl::RSS<S>>* tree() const {
    return adaptive ? &detail::ModelAccess<fcl::RSS<S>>::tree(*adaptive) : nullptr;
  }
  Evidence* evidence() const { return adaptive ? &tree()->evidence : nullptr; }
  bool hasBoxes() const { return adaptive && tree()->boxes; }

  const AdaptiveBVHModel<fcl::RSS<S>>* adaptive = nullptr;
  const Mesh<S>* mesh = nullptr;
  fcl::NODE_TYPE type;
  bool is_shape = false, is_octree = false;
};

/// Hands a pair to the recorded query it belongs to, the mesh first. False: there is none, ask FCL.
template <typename S, typename Query>
bool dispatch(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2, Query&& query) {
  const Side<S> first(o1), second(o2);
  query.require(first.type, second.type);
  for (const Side<S>& side : {first, second})
    if (side.mesh) withTriangles<S>(side.mesh);
  Recorder recorder;
  recorder.side[0] = first.evidence();
  recorder.side[1] = second.evidence();
  if ((first.adaptive && second.mesh) || (first.mesh && second.adaptive))
    return query.meshMesh(first, tf1, second, tf2, recorder);
  const auto mesh_other = [&](const Side<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                              const Side<S>& other, const fcl::CollisionGeometry<S>& geometry,
                              const fcl::Transform3<S>& tf) {
    if (other.is_shape) return query.meshShape(*mesh.mesh, mesh_tf, geometry, tf, recorder);
    if (other.is_octree) return query.meshOctree(*mesh.mesh, mesh_tf, geometry, tf, recorder);
    return false;
  };
  if (first.adaptive) return mesh_other(first, tf1, second, *o2, tf2);
  if (!second.adaptive) return false;
  std::swap(recorder.side[0], recorder.side[1]);
  return mesh_other(second, tf2, first, *o1, tf1);
}

template <typename S>
struct DistanceQuery {
  const fcl::DistanceRequest<S>& request;
  fcl::DistanceResult<S>& result;
  S& distance;

  void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) const {
    requireDistance(first, second);
  }
  bool meshMesh(const Side<S>& first, const fcl::Transform3<S>& tf1, const Side<S>& second,
                const fcl::Transform3<S>& tf2, const Recorder& recorder) const {
    if (first.hasBoxes() && second.hasBoxes() &&
        boxedMeshDistance<S>({first.mesh, first.tree(), tf1}, {second.mesh, second.tree(), tf2},
                             request, result))
      distance = result.min_distance;
    else
      distance = meshMeshDistance(*first.mesh, tf1, *second.mesh, tf2, request, result, recorder);
    return true;
  }
  bool meshShape(const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                 const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& shape_tf,
                 const Recorder& recorder) const {
    distance = meshShapeDistance(mesh, mesh_tf, shape, shape_tf, request, result, recorder);
    return true;
  }
  bool meshOctree(const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                  const fcl::CollisionGeometry<S>& octree, const fcl::Transform3<S>& octree_tf,
                  const Recorder& recorder) const {
    if (request.enable_signed_distance) return false;
    distance = meshOctreeDistance(mesh, mesh_tf, octree, octree_tf, request, result, recorder);
    return true;
  }
};

template <typename S>
struct CollisionQuery {
  const fcl::CollisionRequest<S>& request;
  fcl::CollisionResult<S>& result;
  std::size_t& contacts;

  void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) const {
    requireCollision(first, second);
  }
  bool meshMesh(const Side<S>& first, const fcl::Transform3<S>& tf1, const Side<S>& second,
                const fcl::Transform3<S>& tf2, const Recorder& recorder) const {
    contacts = meshMeshCollide(*first.mesh, tf1, *second.mesh, tf2, request, result, recorder);
    return true;
  }
  bool meshShape(const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                 const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& shape_tf,
                 const Recorder& recorder) const {
    contacts = meshShapeCollide(mesh, mesh_tf, shape, shape_tf, request, result, recorder);
    return true;
  }
  bool meshOctree(const Mesh<S>& mesh, const fcl::Transform3<S>& mesh_tf,
                  const fcl::CollisionGeometry<S>& octree, const fcl::Transform3<S>& octree_tf,
                  const Recorder& recorder) const {
    if (request.enable_cost) return false;
    contacts = meshOctreeCollide(mesh, mesh_tf, octree, octree_tf, request, result, recorder);
    return true;
  }
};

}  // namespace

namespace detail {

template <typename S>
bool recordedDistance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                      const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                      const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                      S& distance) {
  if (!result.o1) unsetPoints(result);
  return dispatch(o1, tf1, o2, tf2, DistanceQuery<S>{request, result, distance});
}

template <typename S>
bool recordedCollide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                     const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                     const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                     std::size_t& contacts) {
  contacts = 0;
  if (request.num_max_contacts == 0) return true;  // as FCL, without its message
  return dispatch(o1, tf1, o2, tf2, CollisionQuery<S>{request, result, contacts});
}

/// FCL's own answer: of objects that touch the points are whatever was in memory.
template <typename S>
void finishDistance(const fcl::DistanceRequest<S>& request, S before,
                    fcl::DistanceResult<S>& result) {
  if (result.min_distance < before && result.min_distance <= 0 && !request.enable_signed_distance)
    unsetPoints(result);
}

template <typename S>
void finishCollide(const fcl::CollisionRequest<S>& request, std::size_t before,
                   fcl::CollisionResult<S>& result) {
  if (!request.enable_contact) unsetFields(result, before);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                            \
  template void finishDistance(const fcl::DistanceRequest<S>&, S, fcl::DistanceResult<S>&);    \
  template void finishCollide(const fcl::CollisionRequest<S>&, std::size_t,                    \
                              fcl::CollisionResult<S>&);                                       \
  template bool recordedDistance(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                                 const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                                 const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&, S&); \
  template bool recordedCollide(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,   \
                                const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,   \
                                const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&,     \
                                std::size_t&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace detail
}  // namespace adaptive_bvh
