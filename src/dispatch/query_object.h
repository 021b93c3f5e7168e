#pragma once

#include <optional>

#include "dispatch/convex_parts.h"
#include "query/placed_mesh.h"
#include "solids/solid_pair.h"

namespace adaptive_bvh {

enum class ObjectKind { Mesh, Shape, Octree };

/// An object of a query and its pose: a mesh, or an FCL shape or octree. Refers to the object.
class QueryObject {
 public:
  QueryObject(const DeformableMesh& mesh, const fcl::Transform3d& tf) {
    mesh_.emplace(stateOf(mesh), tf);
  }
  /// Throws std::invalid_argument like ShapeSolid.
  QueryObject(const fcl::CollisionGeometryd& geometry, const fcl::Transform3d& tf) {
    parts_.emplace(geometry, tf);
  }

  ObjectKind kind() const {
    if (mesh_) return ObjectKind::Mesh;
    return parts_->isOctree() ? ObjectKind::Octree : ObjectKind::Shape;
  }
  const PlacedMesh& mesh() const { return *mesh_; }     ///< for a mesh only
  const ConvexParts& parts() const { return *parts_; }  ///< for a shape or octree only
  PlacedSolid solid() const { return {*parts_->shape(), parts_->tf()}; }

 private:
  std::optional<PlacedMesh> mesh_;
  std::optional<ConvexParts> parts_;
};

}  // namespace adaptive_bvh
