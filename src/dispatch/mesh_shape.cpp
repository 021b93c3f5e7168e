// isNearer of a mesh and a shape: a search for the distance, below an upper bound.
#include "dispatch/contained.h"
#include "dispatch/shape_search.h"

#include <cmath>
#include <limits>

#include "adaptive_bvh/proximity.h"
#include "base/rigid.h"
#include "query/closed_surface.h"

namespace adaptive_bvh {

bool isNearer(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core,
              double distance) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double above = std::nextafter(distance, kFar);  // so that `distance` itself is below it
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result(above);
  distanceToShape(MeshShapeSearch(mesh, shape, core), {request, result}, distance);
  return result.min_distance < above;
}

template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2,
              NonDeduced<S> distance, bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireClosed(stateOf(mesh), "isNearer of solid bodies");
  const ShapeSolid solid_shape(shape);
  const PlacedMesh placed(mesh, tf1);
  const PlacedSolid placed_shape{*solid_shape, tf2.template cast<double>()};
  return isNearer(placed, placed_shape, solid_shape.core(), static_cast<double>(distance)) ||
         (solid && isContained(placed_shape, placed));
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                           \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&, \
                         const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, S, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
