#include "adaptive_bvh/query.h"

#include <stdexcept>
#include <typeinfo>

#include "base/rigid.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "fcl/model_pairs.h"
#include "query/closed_surface.h"
#include "query/single_precision.h"
#include "thesis/model_state.h"

// distance and collide by FCL's signatures: the dispatch by the types of two objects.
// - One object is a DeformableMesh: the searches of dispatch/pairs.h, in double precision.
// - Otherwise, one is a model (AdaptiveBVHModel or fcl::BVHModel): FCL's traversals with recording.
// - Other pairs are left to FCL, after a check that FCL supports them.
// The dispatch is written once; RunDistance and RunCollision say what is run for each kind of pair.
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
/// The mesh of an AdaptiveBVHModel<BV>; null for other geometry. Throws if the model has none.
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
/// Returns the geometry as a mesh, or the mesh of an adaptive model; null for geometry without
/// triangles. Throws if there are triangles but no mesh.
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

/// An object of a query without a DeformableMesh: a model with volumes BV (an AdaptiveBVHModel or a
/// fcl::BVHModel), or any other geometry.
template <typename BV>
struct ModelOrOther {
  using S = typename BV::S;

  ModelOrOther(const PlacedGeometry<S>& object, fcl::NODE_TYPE node_type)
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
  PlacedModel<BV> model;  ///< its `model` is null for any other geometry
};

/// Runs the recorded query of a pair, with the model first. Returns false if there is none.
template <typename BV, typename Run>
bool runModels(const ModelOrOther<BV>& first, const ModelOrOther<BV>& second, const Run& run) {
  for (const ModelOrOther<BV>* object : {&first, &second})
    if (object->isModel()) requireTriangles(*object->model.model);
  if (first.isModel() && second.isModel()) return run.models(first.model, second.model);
  if (!first.isModel() && !second.isModel()) return false;
  const ModelOrOther<BV>&model = first.isModel() ? first : second,
        &other = first.isModel() ? second : first;
  if (isShape(other.type)) return run.modelShape(model.model, other.placed);
  return other.type == fcl::GEOM_OCTREE && run.modelOctree(model.model, other.placed);
}

/// An object of a query with a DeformableMesh, and its pose: a mesh, a shape or an octree.
template <typename S>
struct MeshOrPart {
  /// Throws std::invalid_argument for a type of geometry that such queries do not support.
  explicit MeshOrPart(const PlacedGeometry<S>& object)
      : geometry(object.geometry), tf(object.tf), mesh(anyMeshOf(*object.geometry)) {
    if (!mesh && !isShape(geometry->getNodeType()) && !isOctree())
      refuse("a query of a DeformableMesh and a geometry of this type is not answered");
  }
  /// The object with its pose in double precision, for the searches of dispatch/pairs.h.
  QueryObject inDouble() const {
    const fcl::Transform3d placed(tf.template cast<double>());
    return mesh ? QueryObject(*mesh, placed) : QueryObject(*geometry, placed);
  }
  bool isOctree() const { return geometry->getNodeType() == fcl::GEOM_OCTREE; }

  const fcl::CollisionGeometry<S>* geometry;
  const fcl::Transform3<S>& tf;
  const DeformableMesh<S>* mesh;  ///< the geometry or a model's mesh; null for other geometry
};

/// Calls search(pair, first, o1, second, o2): `pair` has the functions for two objects of these
/// kinds, which are passed with their geometries in the order of FCL's results.
template <typename S, typename Search>
void searchInOrder(const MeshOrPart<S>& a, const MeshOrPart<S>& b, const Search& search) {
  const QueryObject first(a.inDouble()), second(b.inDouble());
  const PairSearch& pair = searchOf(first.kind(), second.kind());
  if (pair.is_swapped)
    search(pair, second, b.geometry, first, a.geometry);
  else
    search(pair, first, a.geometry, second, b.geometry);
}

/// Runs the query of a pair. Returns false if FCL's must be run. Throws if neither exists.
template <typename S, typename Run>
bool dispatch(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second, const Run& run) {
  if (meshOf(*first.geometry) || meshOf(*second.geometry)) {
    run.meshAnd(MeshOrPart<S>(first), MeshOrPart<S>(second));
    return true;
  }
  const fcl::NODE_TYPE type1 = first.geometry->getNodeType(),
                       type2 = second.geometry->getNodeType();
  run.require(type1, type2);
  if (type1 == fcl::BV_OBBRSS || type2 == fcl::BV_OBBRSS)
    return runModels(ModelOrOther<fcl::OBBRSS<S>>(first, type1),
                     ModelOrOther<fcl::OBBRSS<S>>(second, type2), run);
  return runModels(ModelOrOther<fcl::RSS<S>>(first, type1),
                   ModelOrOther<fcl::RSS<S>>(second, type2), run);
}

/// What `dispatch` runs for a distance. The functions for models return whether they answered.
template <typename S>
struct RunDistance {
  const DistanceQuery<S>& query;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireDistance(first, second);
  }
  void meshAnd(const MeshOrPart<S>& a, const MeshOrPart<S>& b) const {
    if (query.request.enable_signed_distance && (a.isOctree() || b.isOctree()))
      refuse("a DeformableMesh and an octree have no signed distance");
    if (query.isSatisfied()) return;
    searchInOrder(a, b,
                  [&](const PairSearch& pair, const QueryObject& first, const auto* o1,
                      const QueryObject& second, const auto* o2) {
                    answerInDouble(query, o1, o2, [&](const DistanceQuery<double>& in_double) {
                      pair.distance(first, second, in_double);
                    });
                  });
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

/// Throws for octrees and models (not their meshes): they cannot be queried as solid bodies.
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

/// Adds the contacts of bodies whose surfaces do not touch: of two closed meshes if one lies inside
/// the other, of a closed mesh (first) and a shape if the shape lies inside the mesh.
void addContainedPair(const QueryObject& first, const QueryObject& second,
                      const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                      const CollisionQuery<double>& query) {
  if (second.kind() == ObjectKind::Shape)
    return addContained(second.solid(), first.mesh(), o1, o2, query);
  addContained(first.mesh(), second.mesh(), false, o1, o2, query);
  if (!query.isSatisfied()) addContained(second.mesh(), first.mesh(), true, o1, o2, query);
}

/// What `dispatch` runs for a collision. The functions for models return whether they answered.
template <typename S>
struct RunCollision {
  const CollisionQuery<S>& query;
  bool solid;  ///< whether bodies are solid: one inside the other is in contact with it

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireCollision(first, second);
  }
  void meshAnd(const MeshOrPart<S>& a, const MeshOrPart<S>& b) const {
    if (query.request.enable_cost && (a.isOctree() || b.isOctree()))
      refuse("a DeformableMesh and an octree have no costs");
    for (const MeshOrPart<S>* object : {&a, &b})
      if (solid && object->mesh) requireClosed(stateOf(*object->mesh), "collide of solid bodies");
    if (query.isSatisfied()) return;
    searchInOrder(a, b,
                  [&](const PairSearch& pair, const QueryObject& first, const auto* o1,
                      const QueryObject& second, const auto* o2) {
                    answerInDouble(
                        query, o1, o2,
                        [&](const fcl::CollisionGeometryd& d1, const fcl::CollisionGeometryd& d2,
                            const CollisionQuery<double>& in_double) {
                          const std::size_t before = in_double.result.numContacts();
                          pair.collide(first, second, d1, d2, in_double);
                          if (solid && in_double.result.numContacts() == before)
                            addContainedPair(first, second, d1, d2, in_double);
                        });
                  });
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

/// For a distance by FCL alone: `before` was the result's distance. FCL sets no nearest points of
/// bodies that touch, unless signed distances are requested.
template <typename S>
void finishDistance(const fcl::DistanceRequest<S>& request, S before,
                    fcl::DistanceResult<S>& result) {
  if (result.min_distance < before && result.min_distance <= 0 && !request.enable_signed_distance)
    unsetPoints(result);
}

/// `before` was the number of contacts. FCL sets the fields of contacts only on request.
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
