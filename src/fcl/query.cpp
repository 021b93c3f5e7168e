#include "adaptive_bvh/query.h"

#include <optional>
#include <stdexcept>
#include <typeinfo>

#include "base/rigid.h"
#include "fcl/mesh_pairs.h"
#include "query/close_triangles.h"
#include "query/closed_surface.h"
#include "query/contacts.h"
#include "query/nearest_search.h"
#include "query/placed_mesh.h"
#include "query/single_precision.h"
#include "thesis/model_state.h"

namespace adaptive_bvh {
namespace {

[[noreturn]] void refuse(const char* why) {
  throw std::invalid_argument(std::string("adaptive_bvh: ") + why);
}

/// The geometry as a DeformableMesh, or null.
template <typename S>
const DeformableMesh<S>* meshOf(const fcl::CollisionGeometry<S>& geometry) {
  return typeid(geometry) == typeid(DeformableMesh<S>)
             ? static_cast<const DeformableMesh<S>*>(&geometry)
             : nullptr;
}
/// The geometry as a mesh, or the mesh of an adaptive model. Throws on geometry with triangles but
/// without a mesh.
template <typename S, typename BV>
const DeformableMesh<S>* meshOfModel(const fcl::CollisionGeometry<S>& geometry) {
  const auto* model = dynamic_cast<const AdaptiveBVHModel<BV>*>(&geometry);
  if (!model) return nullptr;
  if (!model->hasMesh())
    refuse(
        "a query of a DeformableMesh and an AdaptiveBVHModel needs the model's mesh: call mesh() "
        "of the model once before");
  return &static_cast<const AdaptiveBVHModel<BV>*>(model)->mesh();
}
template <typename S>
const DeformableMesh<S>* anyMeshOf(const fcl::CollisionGeometry<S>& geometry) {
  if (const DeformableMesh<S>* mesh = meshOf(geometry)) return mesh;
  if (geometry.getObjectType() != fcl::OT_BVH) return nullptr;
  if (const auto* mesh = meshOfModel<S, fcl::RSS<S>>(geometry)) return mesh;
  if (const auto* mesh = meshOfModel<S, fcl::OBBRSS<S>>(geometry)) return mesh;
  refuse(
      "a query of a DeformableMesh and a fcl::BVHModel is not answered; make a DeformableMesh of "
      "the model, once");
}

/// One object of a query that has no DeformableMesh: a model of BV, adaptive or FCL's, or any other
/// geometry.
template <typename BV>
struct Object {
  using S = typename BV::S;

  Object(const PlacedGeometry<S>& object, fcl::NODE_TYPE node_type)
      : type(node_type), placed(object) {
    if (object.geometry->getObjectType() != fcl::OT_BVH) return;
    const auto* adaptive = dynamic_cast<const AdaptiveBVHModel<BV>*>(object.geometry);
    model.model = adaptive ? adaptive : dynamic_cast<const fcl::BVHModel<BV>*>(object.geometry);
    model.statistics = adaptive ? &detail::ModelAccess<BV>::tree(*adaptive).statistics : nullptr;
    model.tf = object.tf;
  }
  bool isModel() const { return model.model != nullptr; }

  fcl::NODE_TYPE type;
  PlacedGeometry<S> placed;
  PlacedModel<BV> model;  ///< without a model when it is not one of BV
};

/// Hands a pair to its recorded query, the model first. False when there is none: FCL's is to run.
template <typename BV, typename Run>
bool runModels(const Object<BV>& first, const Object<BV>& second, const Run& run) {
  for (const Object<BV>* object : {&first, &second})
    if (object->isModel()) requireTriangles(*object->model.model);
  if (first.isModel() && second.isModel()) return run.models(first.model, second.model);
  if (!first.isModel() && !second.isModel()) return false;
  const Object<BV>&model = first.isModel() ? first : second,
        &other = first.isModel() ? second : first;
  if (isShape(other.type)) return run.modelShape(model.model, other.placed);
  return other.type == fcl::GEOM_OCTREE && run.modelOctree(model.model, other.placed);
}

/// A DeformableMesh and something else.
template <typename S, typename Run>
void runMesh(const MeshObject<S>& mesh, const PlacedGeometry<S>& other, const Run& run) {
  const fcl::NODE_TYPE type = other.geometry->getNodeType();
  if (isShape(type)) return run.meshShape(mesh, other);
  if (type == fcl::GEOM_OCTREE) return run.meshOctree(mesh, other);
  refuse("a query of a DeformableMesh and a geometry of this type is not answered");
}

/// Whether the pair is answered: else FCL's query is to run. Two models have the same volumes:
/// others are refused.
template <typename S, typename Run>
bool dispatch(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second, const Run& run) {
  if (meshOf(*first.geometry) || meshOf(*second.geometry)) {
    const DeformableMesh<S>*a = anyMeshOf(*first.geometry), *b = anyMeshOf(*second.geometry);
    if (a && b)
      run.meshes(MeshObject<S>(*a, first.tf, *first.geometry),
                 MeshObject<S>(*b, second.tf, *second.geometry));
    else if (a)
      runMesh(MeshObject<S>(*a, first.tf), second, run);
    else
      runMesh(MeshObject<S>(*b, second.tf), first, run);
    return true;
  }
  const fcl::NODE_TYPE type1 = first.geometry->getNodeType(),
                       type2 = second.geometry->getNodeType();
  run.require(type1, type2);
  if (type1 == fcl::BV_OBBRSS || type2 == fcl::BV_OBBRSS)
    return runModels(Object<fcl::OBBRSS<S>>(first, type1), Object<fcl::OBBRSS<S>>(second, type2),
                     run);
  return runModels(Object<fcl::RSS<S>>(first, type1), Object<fcl::RSS<S>>(second, type2), run);
}

void searchNearest(const PlacedMesh& first, const PlacedMesh& second,
                   const DistanceQuery<double>& query) {
  NearestPair nearest(first, second, query);
  constexpr int kMany = 1024;  // else it takes as long as it gains
  if (first.mesh.numTriangles() + second.mesh.numTriangles() > kMany) {
    const TrianglePair close = closeTriangles(PairOfMeshes(first, second));
    nearest.addWitness(int(close.first), int(close.second));
  }
  NearestSearch(first, second, nearest).run();
}

template <typename S>
struct RunDistance {
  const DistanceQuery<S>& query;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireDistance(first, second);
  }
  void meshes(const MeshObject<S>& first, const MeshObject<S>& second) const {
    if (query.isSatisfied()) return;
    answerInDouble(query, first.geometry, second.geometry,
                   [&](const DistanceQuery<double>& in_double) {
                     searchNearest(first.placed, second.placed, in_double);
                   });
  }
  void meshShape(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape) const {
    meshShapeDistance(mesh, shape, query);
  }
  void meshOctree(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_signed_distance)
      refuse("a DeformableMesh and an octree have no signed distance");
    meshOctreeDistance(mesh, octree, query);
  }
  template <typename BV>
  bool models(const PlacedModel<BV>& first, const PlacedModel<BV>& second) const {
    modelModelDistance(first, second, query);
    return true;
  }
  template <typename BV>
  bool modelShape(const PlacedModel<BV>& model, const PlacedGeometry<S>& shape) const {
    modelShapeDistance(model, shape, query);
    return true;
  }
  template <typename BV>
  bool modelOctree(const PlacedModel<BV>& model, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_signed_distance) return false;
    modelOctreeDistance(model, octree, query);
    return true;
  }
};

/// Throws std::invalid_argument where nothing can be said of the inside of a body.
template <typename S>
void requireSolids(const fcl::CollisionGeometry<S>& first,
                   const fcl::CollisionGeometry<S>& second) {
  const auto isOctree = [](const auto& g) { return g.getNodeType() == fcl::GEOM_OCTREE; };
  const auto isModel = [](const auto& g) { return g.getObjectType() == fcl::OT_BVH; };
  if (isOctree(first) || isOctree(second))
    refuse("a query of solid bodies does not answer for octrees");
  if (!meshOf(first) && !meshOf(second) && (isModel(first) || isModel(second)))
    refuse("a query of solid bodies needs a DeformableMesh: that of a model is model.mesh()");
}

template <typename S>
struct RunCollision {
  const CollisionQuery<S>& query;
  bool solid;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireCollision(first, second);
  }
  void requireClosedIfSolid(const MeshObject<S>& mesh) const {
    if (solid) requireClosed(mesh.placed.mesh, "collide of solid bodies");
  }
  void meshes(const MeshObject<S>& first, const MeshObject<S>& second) const {
    requireClosedIfSolid(first);
    requireClosedIfSolid(second);
    const std::size_t before = query.result.numContacts();
    if (query.isSatisfied()) return;
    answerInDouble(query, first.geometry, second.geometry,
                   [&](const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                       const CollisionQuery<double>& in_double) {
                     collideMeshes({o1, first.placed}, {o2, second.placed}, in_double);
                   });
    if (!solid || query.result.numContacts() > before) return;
    addContained(first, second, false, query);
    if (!query.isSatisfied()) addContained(second, first, true, query);
  }
  void meshShape(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape) const {
    requireClosedIfSolid(mesh);
    const std::size_t before = query.result.numContacts();
    if (query.isSatisfied()) return;
    meshShapeCollide(mesh, shape, query);
    if (solid && query.result.numContacts() == before) addContained(shape, mesh, query);
  }
  void meshOctree(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_cost) refuse("a DeformableMesh and an octree have no costs");
    meshOctreeCollide(mesh, octree, query);
  }
  template <typename BV>
  bool models(const PlacedModel<BV>& first, const PlacedModel<BV>& second) const {
    modelModelCollide(first, second, query);
    return true;
  }
  template <typename BV>
  bool modelShape(const PlacedModel<BV>& model, const PlacedGeometry<S>& shape) const {
    modelShapeCollide(model, shape, query);
    return true;
  }
  template <typename BV>
  bool modelOctree(const PlacedModel<BV>& model, const PlacedGeometry<S>& octree) const {
    if (query.request.enable_cost) return false;
    modelOctreeCollide(model, octree, query);
    return true;
  }
};

}  // namespace

namespace detail {

template <typename S>
bool answerDistance(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                    const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                    const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  if (!result.o1) unsetPoints(result);
  const DistanceQuery<S> query{request, result};
  return dispatch<S>({o1, tf1}, {o2, tf2}, RunDistance<S>{query});
}

template <typename S>
bool answerCollide(const fcl::CollisionGeometry<S>* o1, const fcl::Transform3<S>& tf1,
                   const fcl::CollisionGeometry<S>* o2, const fcl::Transform3<S>& tf2,
                   const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                   bool solid) {
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireSolids(*o1, *o2);
  const CollisionQuery<S> query{request, result};
  return dispatch<S>({o1, tf1}, {o2, tf2}, RunCollision<S>{query, solid});
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

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                         \
  template void finishDistance(const fcl::DistanceRequest<S>&, S, fcl::DistanceResult<S>&); \
  template void finishCollide(const fcl::CollisionRequest<S>&, std::size_t,                 \
                              fcl::CollisionResult<S>&);                                    \
  template bool answerDistance(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&, \
                               const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&, \
                               const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&);    \
  template bool answerCollide(const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                              const fcl::CollisionGeometry<S>*, const fcl::Transform3<S>&,  \
                              const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace detail
}  // namespace adaptive_bvh
