#include "fcl/mesh_shape.h"

#include "fcl/model_shape_search.h"
#include "fcl/shape_geometry.h"
#include "query/shape_contacts.h"
#include "query/shape_distance.h"
#include "query/shape_search.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

template <typename Search, typename Placed, typename S>
S distanceBy(const Placed& mesh, const PlacedGeometry<S>& shape, const DistanceQuery<S>& query,
             S enough) {
  if (query.isSatisfied()) return query.result.min_distance;
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    const Search search(mesh, geometry, core, shape.tf);
    ShapeDistance<S, Search>(shape, search, query, enough).run();
  });
  return query.result.min_distance;
}

template <typename Search, typename Placed, typename S>
std::size_t collideBy(const Placed& mesh, const PlacedGeometry<S>& shape,
                      const CollisionQuery<S>& query) {
  if (query.isSatisfied()) return query.result.numContacts();
  visitShape(*shape.geometry, [&](const TriangleShape& geometry, const ShapeCore& core) {
    const Search search(mesh, geometry, core, shape.tf);
    ShapeContacts<S, Search>(shape, geometry, core, search, query).run();
  });
  return query.result.numContacts();
}

}  // namespace

template <typename S>
S meshShapeDistance(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& shape,
                    const DistanceQuery<S>& query, S enough) {
  return distanceBy<MeshShapeSearch<S>>(mesh, shape, query, enough);
}
template <typename BV>
typename BV::S modelShapeDistance(const PlacedModel<BV>& model,
                                  const PlacedGeometry<typename BV::S>& shape,
                                  const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  return distanceBy<ModelShapeSearch<BV>>(model, shape, query, S(0));
}

template <typename S>
std::size_t meshShapeCollide(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& shape,
                             const CollisionQuery<S>& query) {
  return collideBy<MeshShapeSearch<S>>(mesh, shape, query);
}
template <typename BV>
std::size_t modelShapeCollide(const PlacedModel<BV>& model,
                              const PlacedGeometry<typename BV::S>& shape,
                              const CollisionQuery<typename BV::S>& query) {
  return collideBy<ModelShapeSearch<BV>>(model, shape, query);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                     \
  template S meshShapeDistance(const PlacedMesh<S>&, const PlacedGeometry<S>&,          \
                               const DistanceQuery<S>&, S);                             \
  template std::size_t meshShapeCollide(const PlacedMesh<S>&, const PlacedGeometry<S>&, \
                                        const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                           \
  template BV::S modelShapeDistance(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&,      \
                                    const DistanceQuery<BV::S>&);                              \
  template std::size_t modelShapeCollide(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&, \
                                         const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
