#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

#include "deformable/mesh_state.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// The number of threads of a query of two meshes.
inline int queryThreads(const MeshState& first, const MeshState& second) {
  return std::max(first.query_threads, second.query_threads);
}

/// A mesh of a query and its pose, a rigid transform. A view: the mesh must outlive it.
struct PlacedMesh {
  template <typename S>
  PlacedMesh(const DeformableMesh<S>& placed, const fcl::Transform3<S>& placement)
      : mesh(stateOf(placed)), tf(placement.template cast<double>()) {}
  PlacedMesh(const MeshState& placed, const fcl::Transform3d& placement)
      : mesh(placed), tf(placement) {}

  const MeshState& mesh;
  fcl::Transform3d tf;  ///< maps the mesh's frame to the world

  const WideTree& tree() const { return mesh.tree; }
  const LocalBounds<double>& bounds() const { return mesh.bounds; }
  /// Returns a triangle's corners in the mesh's frame, by its index in the order of the leaves.
  TrianglePoints<double> pointsAt(unsigned leaf_index) const {
    const Int4& v = mesh.tree.corners(leaf_index);
    return {point(v[0]), point(v[1]), point(v[2])};
  }
  /// Returns a triangle's corners in the mesh's frame, by its index in the mesh.
  TrianglePoints<double> pointsOf(unsigned triangle) const {
    const VertexIndices v = mesh.view().verticesOf(triangle);
    return {point(v[0]), point(v[1]), point(v[2])};
  }

 private:
  template <typename Index>
  const fcl::Vector3d& point(Index vertex) const {
    return mesh.vertices[static_cast<std::size_t>(vertex)];
  }
};

/// The request and the result of a distance query. No search is needed if isSatisfied().
template <typename S>
struct DistanceQuery {
  const fcl::DistanceRequest<S>& request;
  fcl::DistanceResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// The request and the result of a collision query. No search is needed if isSatisfied().
template <typename S>
struct CollisionQuery {
  const fcl::CollisionRequest<S>& request;
  fcl::CollisionResult<S>& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// Returns a point of NaN, for results that FCL leaves uninitialised: a mistaken use shows.
template <typename S>
fcl::Vector3<S> unsetPoint() {
  return fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN());
}

/// Sets the nearest points of a result to NaN.
template <typename S>
void unsetPoints(fcl::DistanceResult<S>& result) {
  for (fcl::Vector3<S>& point : result.nearest_points) point = unsetPoint<S>();
}

/// Sets position, normal and depth to NaN in the contacts from index `first` on. The const_cast is
/// sound: getContact returns a const reference, but the contact belongs to a non-const result.
template <typename S>
void unsetFields(fcl::CollisionResult<S>& result, std::size_t first) {
  for (std::size_t i = first; i < result.numContacts(); ++i) {
    auto& contact = const_cast<fcl::Contact<S>&>(result.getContact(i));
    contact.pos = contact.normal = unsetPoint<S>();
    contact.penetration_depth = std::numeric_limits<S>::quiet_NaN();
  }
}

}  // namespace adaptive_bvh
