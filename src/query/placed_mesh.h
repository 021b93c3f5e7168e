#pragma once

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "geometry/triangle_contact.h"
#include "mesh/mesh_state.h"

namespace adaptive_bvh {

/// A mesh of a query, and where it is.
template <typename S>
struct PlacedMesh {
  PlacedMesh(const DeformableMesh<S>& placed, const fcl::Transform3<S>& placement)
      : PlacedMesh(placed, placement, placed) {}
  /// `reported`: what results name, with the same triangles.
  PlacedMesh(const DeformableMesh<S>& placed, const fcl::Transform3<S>& placement,
             const fcl::CollisionGeometry<S>& reported)
      : geometry(&reported), mesh(stateOf(placed)), tf(placement) {}

  const fcl::CollisionGeometry<S>* geometry;
  const MeshState<S>& mesh;
  fcl::Transform3<S> tf;

  const WideTree& tree() const { return mesh.tree; }
  /// A triangle, by its place in the order of the leaves, or by its index: its corners in the
  /// mesh's frame.
  TrianglePoints<double> pointsAt(unsigned place) const {
    const Int4& v = mesh.tree.corners(place);
    return {point(v[0]), point(v[1]), point(v[2])};
  }
  TrianglePoints<double> pointsOf(unsigned triangle) const {
    const VertexIndices v = mesh.view().verticesOf(triangle);
    return {point(v[0]), point(v[1]), point(v[2])};
  }

 private:
  template <typename Index>
  fcl::Vector3d point(Index vertex) const {
    return mesh.vertices[static_cast<std::size_t>(vertex)].template cast<double>();
  }
};

/// The other object of a query, a shape or an octree.
template <typename S>
struct PlacedGeometry {
  const fcl::CollisionGeometry<S>* geometry;
  fcl::Transform3<S> tf;
};

/// What a distance query is given.
template <typename S>
struct DistanceQuery {
  const fcl::DistanceRequest<S>& request;
  fcl::DistanceResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// What a collision query is given.
template <typename S>
struct CollisionQuery {
  const fcl::CollisionRequest<S>& request;
  fcl::CollisionResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

}  // namespace adaptive_bvh
