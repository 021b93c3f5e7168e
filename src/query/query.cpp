#include "adaptive_bvh/query.h"

#include <utility>

#include "geometry/rigid.h"
#include "model_state.h"
#include "query/box_contacts.h"
#include "query/fcl/mesh_mesh.h"
#include "query/fcl/mesh_octree.h"
#include "query/fcl/mesh_shape.h"
#include "query/pair_cache.h"
#include "query/supported_pairs.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {
namespace {

/// One object of a query: a mesh of BV, adaptive or FCL's, or any other geometry.
template <typename BV>
struct Object {
  using S = typename BV::S;

  Object(const PlacedGeometry<S>& object, fcl::NODE_TYPE node_type)
      : type(node_type), placed(object) {
    if (object.geometry->getObjectType() != fcl::OT_BVH) return;
    const auto* adaptive = dynamic_cast<const AdaptiveBVHModel<BV>*>(object.geometry);
    mesh.model = adaptive ? adaptive : dynamic_cast<const fcl::BVHModel<BV>*>(object.geometry);
    mesh.tree = adaptive ? &detail::ModelAccess<BV>::tree(*adaptive) : nullptr;
    mesh.tf = object.tf;
  }

  bool isShape() const { return type >= fcl::GEOM_BOX && type <= fcl::GEOM_HALFSPACE; }
  bool isOctree() const { return type == fcl::GEOM_OCTREE; }
  bool isMesh() const { return mesh.model != nullptr; }

  fcl::NODE_TYPE type;
  PlacedGeometry<S> placed;
  PlacedMesh<BV> mesh;  ///< without a model when it is not a mesh of BV
};

/// A mesh and no other mesh. False where FCL is to run, which reads the volumes.
template <typename BV, typename Run>
bool runMesh(const Object<BV>& mesh, const Object<BV>& other, const Run& run) {
  if (other.isShape()) return run.meshShape(mesh.mesh, other.placed);
  if (other.isOctree() && run.meshOctree(mesh.mesh, other.placed)) return true;
  updateVolumes(mesh.mesh);
  return false;
}

/// Hands a pair to its recorded query, the mesh first. False when there is none: FCL's is to run.
template <typename BV, typename Run>
bool runPair(const Object<BV>& first, const Object<BV>& second, const Run& run) {
  for (const Object<BV>* object : {&first, &second})
    if (object->isMesh()) requireTriangles(*object->mesh.model);
  const bool are_meshes = first.isMesh() && second.isMesh();
  if (are_meshes && run.byBoxes(first.mesh, second.mesh)) return true;
  if (!are_meshes && first.isMesh()) return runMesh(first, second, run);
  if (!are_meshes) return second.isMesh() && runMesh(second, first, run);
  updateVolumes(first.mesh);
  updateVolumes(second.mesh);
  return run.meshMesh(first.mesh, second.mesh);
}

/// What getNodeType says, after it has repaired a tree that was changed without our update. Volumes
/// that wait are left alone: the query may not need them.
template <typename S>
fcl::NODE_TYPE repairedType(const fcl::CollisionGeometry<S>& geometry) {
  if (geometry.getObjectType() == fcl::OT_BVH) {
    if (const auto* rss = dynamic_cast<const AdaptiveBVHModel<fcl::RSS<S>>*>(&geometry))
      return detail::ModelAccess<fcl::RSS<S>>::repairedType(*rss);
    if (const auto* both = dynamic_cast<const AdaptiveBVHModel<fcl::OBBRSS<S>>*>(&geometry))
      return detail::ModelAccess<fcl::OBBRSS<S>>::repairedType(*both);
  }
  return geometry.getNodeType();
}

/// As above, of objects of any types. Two meshes have the same volumes: others are refused.
template <typename S, typename Run>
bool dispatch(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second, const Run& run) {
  const fcl::NODE_TYPE type1 = repairedType(*first.geometry),
                       type2 = repairedType(*second.geometry);
  run.require(type1, type2);
  if (type1 == fcl::BV_OBBRSS || type2 == fcl::BV_OBBRSS)
    return runPair(Object<fcl::OBBRSS<S>>(first, type1), Object<fcl::OBBRSS<S>>(second, type2),
                   run);
  return runPair(Object<fcl::RSS<S>>(first, type1), Object<fcl::RSS<S>>(second, type2), run);
}

template <typename S>
struct RunDistance {
  const DistanceQuery<S>& query;
  S& distance;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireDistance(first, second);
  }
  template <typename BV>
  bool meshMesh(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) const {
    distance = meshMeshDistance(first, second, query);
    return true;
  }
  template <typename BV>
  bool meshShape(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& shape) const {
    distance = meshShapeDistance(mesh, shape, query);
    return true;
  }
  template <typename BV>
  bool meshOctree(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_signed_distance) return false;
    distance = meshOctreeDistance(mesh, octree, query);
    return true;
  }

  template <typename BV>
  bool byBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) const {
    if (!first.hasBoxes() || !second.hasBoxes()) return false;
    WitnessCache& witnesses = first.tree->witnesses;
    const WitnessCache::Pair last = witnesses.recall(second.model);
    PairCache<BV> cache{int(last.first), int(last.second), last.are_near, {}};
    if (!distanceByBoxes(first, second, query, cache)) return false;
    witnesses.keep(second.model,
                   {unsigned(cache.witness1), unsigned(cache.witness2), cache.are_near});
    distance = query.result.min_distance;
    return true;
  }
};

template <typename S>
struct RunCollision {
  const CollisionQuery<S>& query;
  std::size_t& contacts;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireCollision(first, second);
  }
  template <typename BV>
  bool meshMesh(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) const {
    contacts = meshMeshCollide(first, second, query);
    return true;
  }
  template <typename BV>
  bool byBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) const {
    if (!first.hasBoxes() || !second.hasBoxes()) return false;
    if (!query.isSatisfied() && !collideByBoxes(first, second, query)) return false;
    contacts = query.result.numContacts();
    return true;
  }
  template <typename BV>
  bool meshShape(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& shape) const {
    contacts = meshShapeCollide(mesh, shape, query);
    return true;
  }
  template <typename BV>
  bool meshOctree(const PlacedMesh<BV>& mesh, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_cost) return false;
    contacts = meshOctreeCollide(mesh, octree, query);
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
  requireRigid(tf1);
  requireRigid(tf2);
  if (!result.o1) unsetPoints(result);
  const DistanceQuery<S> query{request, result};
  return dispatch<S>({o1, tf1}, {o2, tf2}, RunDistance<S>{query, distance});
}

template <typename S>
bool recordedCollide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                     const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                     const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                     std::size_t& contacts) {
  contacts = 0;
  requireRigid(tf1);
  requireRigid(tf2);
  if (request.num_max_contacts == 0) return true;  // as FCL, without its message
  const CollisionQuery<S> query{request, result};
  return dispatch<S>({o1, tf1}, {o2, tf2}, RunCollision<S>{query, contacts});
}

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
