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
  return std::max(first.threads, second.threads);
}

/// A mesh of a query and its pose, a rigid transform. A view: the mesh must outlive it.
struct PlacedMesh {
  PlacedMesh(const DeformableMesh& placed, const fcl::Transform3d& placement)
      : mesh(stateOf(placed)), tf(placement) {}
  PlacedMesh(const MeshState& placed, const fcl::Transform3d& placement)
      : mesh(placed), tf(placement) {}

  const MeshState& mesh;
  fcl::Transform3d tf;  ///< maps the mesh's frame to the world

  const WideTree& tree() const { return mesh.tree; }
  const LocalBounds& bounds() const { return mesh.bounds; }
  /// Returns a triangle's corners in the mesh's frame, by its index in the order of the leaves.
  TrianglePoints pointsAt(unsigned leaf_index) const {
    const Int4& v = mesh.tree.corners(leaf_index);
    return {point(v[0]), point(v[1]), point(v[2])};
  }
  /// Returns a triangle's corners in the mesh's frame, by its index in the mesh.
  TrianglePoints pointsOf(unsigned triangle) const {
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
struct DistanceQuery {
  const fcl::DistanceRequestd& request;
  fcl::DistanceResultd& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// The request and the result of a collision query. No search is needed if isSatisfied().
struct CollisionQuery {
  const fcl::CollisionRequestd& request;
  fcl::CollisionResultd& result;

  bool isSatisfied() const { return request.isSatisfied(result); }
};

/// Stores the objects in a result whose distance a search has lowered; it was `before`.
inline void setObjects(double before, const fcl::CollisionGeometryd& o1,
                       const fcl::CollisionGeometryd& o2, const DistanceQuery& query) {
  if (!(query.result.min_distance < before)) return;
  query.result.o1 = &o1;
  query.result.o2 = &o2;
}

/// Returns a point of NaN, for results that FCL leaves uninitialised: a mistaken use shows.
inline fcl::Vector3d unsetPoint() {
  return fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

/// Sets the nearest points of a result to NaN.
inline void unsetPoints(fcl::DistanceResultd& result) {
  for (fcl::Vector3d& point : result.nearest_points) point = unsetPoint();
}

/// Sets position, normal and depth to NaN in the contacts from index `first` on. The const_cast is
/// sound: getContact returns a const reference, but the contact belongs to a non-const result.
inline void unsetFields(fcl::CollisionResultd& result, std::size_t first) {
  for (std::size_t i = first; i < result.numContacts(); ++i) {
    auto& contact = const_cast<fcl::Contactd&>(result.getContact(i));
    contact.pos = contact.normal = unsetPoint();
    contact.penetration_depth = std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace adaptive_bvh
