#include "fcl/mesh_pairs.h"

#include <cmath>
#include <limits>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "fcl/shape_search.h"
#include "query/closed_surface.h"
#include "query/single_precision.h"

namespace adaptive_bvh {

template <typename S>
void meshShapeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                       const DistanceQuery<S>& query) {
  if (query.isSatisfied()) return;
  const ShapeSolid solid(*shape.geometry);
  const fcl::Transform3d tf = shape.tf.template cast<double>();
  answerInDouble(query, mesh.geometry, shape.geometry, [&](const DistanceQuery<double>& asked) {
    distanceToShape(MeshShapeSearch(mesh.placed, {*solid, tf}, solid.core()), asked);
  });
}

template <typename S>
void meshShapeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                      const CollisionQuery<S>& query) {
  if (query.isSatisfied()) return;
  const ShapeSolid solid(*shape.geometry);
  const fcl::Transform3d tf = shape.tf.template cast<double>();
  answerInDouble(
      query, mesh.geometry, shape.geometry,
      [&](const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
          const CollisionQuery<double>& asked) {
        collideWithShape(MeshShapeSearch(mesh.placed, {*solid, tf}, solid.core()), o1, o2, asked);
      });
}

bool isNearer(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core,
              double distance) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double above = std::nextafter(distance, kFar);
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result(above);
  distanceToShape(MeshShapeSearch(mesh, shape, core), {request, result}, distance);
  return result.min_distance < above;
}

template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, S distance,
              bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireClosed(stateOf(mesh), "isNearer of solid bodies");
  const ShapeSolid near(shape);
  return isNearer(PlacedMesh(mesh, tf1), {*near, tf2.template cast<double>()}, near.core(),
                  static_cast<double>(distance)) ||
         (solid && isContained(PlacedGeometry<S>{&shape, tf2}, MeshObject<S>(mesh, tf1)));
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                               \
  template void meshShapeDistance(const MeshObject<S>&, const PlacedGeometry<S>&, \
                                  const DistanceQuery<S>&);                       \
  template void meshShapeCollide(const MeshObject<S>&, const PlacedGeometry<S>&,  \
                                 const CollisionQuery<S>&);                       \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&,     \
                         const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, S, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
