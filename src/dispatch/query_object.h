#pragma once

#include <optional>

#include "dispatch/convex_parts.h"
#include "query/placed_mesh.h"
#include "solids/solid_pair.h"

namespace adaptive_bvh {

enum class ObjectKind { Mesh, Shape, Octree };

/// An object of a query where it is in the world, in double precision: a mesh, or a shape or an
/// octree of FCL's in either number type. Refers to them.
class QueryObject {
 public:
  template <typename S>
  QueryObject(const DeformableMesh<S>& mesh, const fcl::Transform3d& tf)
      : parallel_(kParallelIn<S>) {
    mesh_.emplace(stateOf(mesh), tf);
  }
  /// Throws std::invalid_argument where ShapeSolid does.
  template <typename S>
  QueryObject(const fcl::CollisionGeometry<S>& geometry, const fcl::Transform3d& tf)
      : parallel_(kParallelIn<S>) {
    parts_.emplace(geometry, tf);
  }

  ObjectKind kind() const {
    if (mesh_) return ObjectKind::Mesh;
    return parts_->isOctree() ? ObjectKind::Octree : ObjectKind::Shape;
  }
  /// Of a mesh.
  const PlacedMesh& mesh() const { return *mesh_; }
  /// Of a shape or an octree.
  const ConvexParts& parts() const { return *parts_; }
  PlacedSolid solid() const { return {*parts_->shape(), parts_->tf()}; }
  /// The sine of an angle that rounding of the transform makes of none.
  double parallel() const { return parallel_; }

 private:
  std::optional<PlacedMesh> mesh_;
  std::optional<ConvexParts> parts_;
  double parallel_;
};

}  // namespace adaptive_bvh
