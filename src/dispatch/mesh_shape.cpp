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

bool isNearer(const DeformableMesh& mesh, const fcl::Transform3d& tf1,
              const fcl::CollisionGeometryd& shape, const fcl::Transform3d& tf2, double distance,
              bool solid) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  if (solid) requireClosed(stateOf(mesh), "isNearer of solid bodies");
  const ShapeSolid solid_shape(shape);
  const PlacedMesh placed(mesh, tf1);
  const PlacedSolid placed_shape{*solid_shape, tf2};
  return isNearer(placed, placed_shape, solid_shape.core(), distance) ||
         (solid && isContained(placed_shape, placed));
}

}  // namespace adaptive_bvh
