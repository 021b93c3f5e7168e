#pragma once

#include <optional>

#include "dispatch/convex_parts.h"
#include "query/placed_mesh.h"
#include "solids/solid_pair.h"

namespace adaptive_bvh {

enum class ObjectKind { Mesh, Shape, Octree };

/// An object of a query and its pose, in double precision: a mesh, or an FCL shape or octree of
/// either number type. Refers to the object.
class QueryObject {
 public:
  template <typename S>
  QueryObject(const DeformableMesh<S>& mesh, const fcl::Transform3d& tf)
      : parallel_(kParallelIn<S>) {
    mesh_.emplace(stateOf(mesh), tf);
  }
  /// Throws std::invalid_argument like ShapeSolid.
  template <typename S>
  QueryObject(const fcl::CollisionGeometry<S>& geometry, const fcl::Transform3d& tf)
      : parallel_(kParallelIn<S>) {
    parts_.emplace(geometry, tf);
  }

  ObjectKind kind() const {
    if (mesh_) return ObjectKind::Mesh;
    return parts_->isOctree() ? ObjectKind::Octree : ObjectKind::Shape;
  }
  const PlacedMesh& mesh() const { return *mesh_; }     ///< for a mesh only
  const ConvexParts& parts() const { return *parts_; }  ///< for a shape or octree only
  PlacedSolid solid() const { return {*parts_->shape(), parts_->tf()}; }
  /// The largest sine that rounding of the transform produces for parallel directions.
  double parallel() const { return parallel_; }

 private:
  std::optional<PlacedMesh> mesh_;
  std::optional<ConvexParts> parts_;
  double parallel_;
};

}  // namespace adaptive_bvh
