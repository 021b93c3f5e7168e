#include "adaptive_bvh/query.h"

#include <stdexcept>
#include <typeinfo>

#include "base/rigid.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "fcl/model_pairs.h"
#include "query/closed_surface.h"
#include "thesis/model_state.h"

// distance and collide by FCL's signatures: the dispatch by the types of two objects.
// - One object is a DeformableMesh: the searches of dispatch/pairs.h.
// - Otherwise, one is a model (AdaptiveBVHModel or fcl::BVHModel): FCL's traversals with recording.
// - Other pairs are left to FCL, after a check that FCL supports them.
// The dispatch is written once; RunDistance and RunCollision say what is run for each kind of pair.
namespace adaptive_bvh {
namespace {

using Geometry = fcl::CollisionGeometryd;

[[noreturn]] void refuse(const char* why) {
  throw std::invalid_argument(std::string("adaptive_bvh: ") + why);
}

/// The geometry as a DeformableMesh, or null.
const DeformableMesh* meshOf(const fcl::CollisionGeometryd& geometry) {
  return typeid(geometry) == typeid(DeformableMesh) ? static_cast<const DeformableMesh*>(&geometry)
                                                    : nullptr;
}
/// The mesh of an AdaptiveBVHModel<BV>; null for other geometry. Throws if the model has none.
template <typename BV>
const DeformableMesh* meshOfModel(const fcl::CollisionGeometryd& geometry) {
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
const DeformableMesh* anyMeshOf(const fcl::CollisionGeometryd& geometry) {
  if (const DeformableMesh* mesh = meshOf(geometry)) return mesh;
  if (geometry.getObjectType() != fcl::OT_BVH) return nullptr;
  if (const auto* mesh = meshOfModel<fcl::RSSd>(geometry)) return mesh;
  if (const auto* mesh = meshOfModel<fcl::OBBRSSd>(geometry)) return mesh;
  refuse(
      "a query of a DeformableMesh and a fcl::BVHModel is not answered; make a DeformableMesh of "
      "the model, once");
}

/// An object of a query without a DeformableMesh: a model with volumes BV (an AdaptiveBVHModel or a
/// fcl::BVHModel), or any other geometry.
template <typename BV>
struct ModelOrOther {
  ModelOrOther(const PlacedGeometry& object, fcl::NODE_TYPE node_type)
      : type(node_type), placed(object) {
    if (object.geometry->getObjectType() != fcl::OT_BVH) return;
    const auto* adaptive = dynamic_cast<const AdaptiveBVHModel<BV>*>(object.geometry);
    model.model = adaptive ? adaptive : dynamic_cast<const fcl::BVHModel<BV>*>(object.geometry);
    model.statistics = adaptive ? &detail::ModelAccess<BV>::tree(*adaptive).statistics : nullptr;
    model.tf = object.tf;
  }
  bool isModel() const { return model.model != nullptr; }

  fcl::NODE_TYPE type;
  PlacedGeometry placed;
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
struct MeshOrPart {
  /// Throws std::invalid_argument for a type of geometry that such queries do not support.
  explicit MeshOrPart(const PlacedGeometry& object)
      : geometry(object.geometry), tf(object.tf), mesh(anyMeshOf(*object.geometry)) {
    if (!mesh && !isShape(geometry->getNodeType()) && !isOctree())
      refuse("a query of a DeformableMesh and a geometry of this type is not answered");
  }
  /// The object for the searches of dispatch/pairs.h.
  QueryObject object() const { return mesh ? QueryObject(*mesh, tf) : QueryObject(*geometry, tf); }
  bool isOctree() const { return geometry->getNodeType() == fcl::GEOM_OCTREE; }

  const fcl::CollisionGeometryd* geometry;
  const fcl::Transform3d& tf;
  const DeformableMesh* mesh;  ///< the geometry or a model's mesh; null for other geometry
};

/// Calls search(pair, first, o1, second, o2): `pair` has the functions for two objects of these
/// kinds, which are passed with their geometries in the order of FCL's results.
template <typename Search>
void searchInOrder(const MeshOrPart& a, const MeshOrPart& b, const Search& search) {
  const QueryObject first(a.object()), second(b.object());
  const PairSearch& pair = searchOf(first.kind(), second.kind());
  if (pair.is_swapped)
    search(pair, second, *b.geometry, first, *a.geometry);
  else
    search(pair, first, *a.geometry, second, *b.geometry);
}

/// Runs the query of a pair. Returns false if FCL's must be run. Throws if neither exists.
template <typename Run>
bool dispatch(const PlacedGeometry& first, const PlacedGeometry& second, const Run& run) {
  if (meshOf(*first.geometry) || meshOf(*second.geometry)) {
    run.meshAnd(MeshOrPart(first), MeshOrPart(second));
    return true;
  }
  const fcl::NODE_TYPE type1 = first.geometry->getNodeType(),
                       type2 = second.geometry->getNodeType();
  run.require(type1, type2);
  if (type1 == fcl::BV_OBBRSS || type2 == fcl::BV_OBBRSS)
    return runModels(ModelOrOther<fcl::OBBRSSd>(first, type1),
                     ModelOrOther<fcl::OBBRSSd>(second, type2), run);
  return runModels(ModelOrOther<fcl::RSSd>(first, type1), ModelOrOther<fcl::RSSd>(second, type2),
                   run);
}

/// What `dispatch` runs for a distance. The functions for models return whether they answered.
struct RunDistance {
  const DistanceQuery query;

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireDistance(first, second);
  }
  void meshAnd(const MeshOrPart& a, const MeshOrPart& b) const {
    if (query.request.enable_signed_distance && (a.isOctree() || b.isOctree()))
      refuse("a DeformableMesh and an octree have no signed distance");
    if (query.isSatisfied()) return;
    searchInOrder(a, b,
                  [&](const PairSearch& pair, const QueryObject& first, const Geometry& o1,
                      const QueryObject& second, const Geometry& o2) {
                    const double before = query.result.min_distance;
                    pair.distance(first, second, query);
                    setObjects(before, o1, o2, query);
                  });
  }
  template <typename BV>
  bool models(const PlacedModel<BV>& first, const PlacedModel<BV>& second) const {
    modelModelDistance(first, second, query);
    return true;
  }
  template <typename BV>
  bool modelShape(const PlacedModel<BV>& model, const PlacedGeometry& shape) const {
    modelShapeDistance(model, shape, query);
    return true;
  }
  template <typename BV>
  bool modelOctree(const PlacedModel<BV>& model, const PlacedGeometry& octree) const {
    if (query.request.enable_signed_distance) return false;
    modelOctreeDistance(model, octree, query);
    return true;
  }
};

/// Throws for octrees and models (not their meshes): they cannot be queried as solid bodies.
void requireSolids(const fcl::CollisionGeometryd& first, const fcl::CollisionGeometryd& second) {
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
                      const CollisionQuery& query) {
  if (second.kind() == ObjectKind::Shape)
    return addContained(second.solid(), first.mesh(), o1, o2, query);
  addContained(first.mesh(), second.mesh(), false, o1, o2, query);
  if (!query.isSatisfied()) addContained(second.mesh(), first.mesh(), true, o1, o2, query);
}

/// What `dispatch` runs for a collision. The functions for models return whether they answered.
struct RunCollision {
  const CollisionQuery query;
  bool solid;  ///< whether bodies are solid: one inside the other is in contact with it

  static void require(fcl::NODE_TYPE first, fcl::NODE_TYPE second) {
    requireCollision(first, second);
  }
  void meshAnd(const MeshOrPart& a, const MeshOrPart& b) const {
    if (query.request.enable_cost && (a.isOctree() || b.isOctree()))
      refuse("a DeformableMesh and an octree have no costs");
    for (const MeshOrPart* object : {&a, &b})
      if (solid && object->mesh) requireClosed(stateOf(*object->mesh), "collide of solid bodies");
    if (query.isSatisfied()) return;
    searchInOrder(a, b,
                  [&](const PairSearch& pair, const QueryObject& first, const Geometry& o1,
                      const QueryObject& second, const Geometry& o2) {
                    const std::size_t before = query.result.numContacts();
                    pair.collide(first, second, o1, o2, query);
                    if (solid && query.result.numContacts() == before)
                      addContainedPair(first, second, o1, o2, query);
                  });
  }
  template <typename BV>
  bool models(const PlacedModel<BV>& first, const PlacedModel<BV>& second) const {
    modelModelCollide(first, second, query);
    return true;
  }
  template <typename BV>
  bool modelShape(const PlacedModel<BV>& model, const PlacedGeometry& shape) const {
    modelShapeCollide(model, shape, query);
    return true;
  }
  template <typename BV>
  bool modelOctree(const PlacedModel<BV>& model, const PlacedGeometry& octree) const {
    if (query.request.enable_cost) return false;
    modelOctreeCollide(model, octree, query);
    return true;
  }
};

}  // namespace

double queries::distance(const Geometry* o1, const fcl::Transform3d& tf1, const Geometry* o2,
                         const fcl::Transform3d& tf2, const fcl::DistanceRequestd& request,
                         fcl::DistanceResultd& result) {
  requireRigid(tf1);
  requireRigid(tf2);
  if (!result.o1) unsetPoints(result);
  const double before = result.min_distance;
  if (dispatch({o1, tf1}, {o2, tf2}, RunDistance{{request, result}})) return result.min_distance;
  const double found = fcl::distance(o1, tf1, o2, tf2, request, result);
  // FCL sets no nearest points of bodies that touch, unless signed distances are requested.
  if (result.min_distance < before && result.min_distance <= 0 && !request.enable_signed_distance)
    unsetPoints(result);
  return found;
}

double queries::distance(const fcl::CollisionObjectd* o1, const fcl::CollisionObjectd* o2,
                         const fcl::DistanceRequestd& request, fcl::DistanceResultd& result) {
  return distance(o1->collisionGeometry().get(), o1->getTransform(), o2->collisionGeometry().get(),
                  o2->getTransform(), request, result);
}

std::size_t queries::collide(const Geometry* o1, const fcl::Transform3d& tf1, const Geometry* o2,
                             const fcl::Transform3d& tf2, const fcl::CollisionRequestd& request,
                             fcl::CollisionResultd& result, bool solid) {
  if (request.num_max_contacts == 0) return 0;  // as FCL, without its message
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireSolids(*o1, *o2);
  const std::size_t before = result.numContacts();
  const bool is_answered = dispatch({o1, tf1}, {o2, tf2}, RunCollision{{request, result}, solid});
  const std::size_t contacts =
      is_answered ? result.numContacts() : fcl::collide(o1, tf1, o2, tf2, request, result);
  // FCL sets the fields of contacts only on request.
  if (!request.enable_contact) unsetFields(result, before);
  return contacts;
}

std::size_t queries::collide(const fcl::CollisionObjectd* o1, const fcl::CollisionObjectd* o2,
                             const fcl::CollisionRequestd& request, fcl::CollisionResultd& result,
                             bool solid) {
  return collide(o1->collisionGeometry().get(), o1->getTransform(), o2->collisionGeometry().get(),
                 o2->getTransform(), request, result, solid);
}

}  // namespace adaptive_bvh
