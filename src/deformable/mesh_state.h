#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "boxes/contours.h"
#include "boxes/feature_leaves.h"
#include "boxes/wide_tree.h"
#include "deformable/body_axes.h"
#include "deformable/moved_leaves.h"
#include "mesh/boundary_loops.h"
#include "mesh/components.h"
#include "mesh/local_bounds.h"
#include "mesh/vertex_triangles.h"

namespace adaptive_bvh {

/// What a mesh and its copies have in common: nothing of it changes after the build.
struct MeshTopology {
  std::vector<fcl::Triangle> triangles;  ///< as they were given
  LeafTriangles leaves;
  FeatureOwners owners;
  VertexTriangles vertex_triangles;
  BoundaryLoops boundary;
  Components components;
  FeatureLeaves features;
  Contours contours;
  std::vector<bool> shape;  ///< of the binary tree (shapeOf), for DeformableMesh::save

  std::size_t bytes() const {
    return sizeof(MeshTopology) + triangles.capacity() * sizeof(fcl::Triangle) + leaves.bytes() +
           owners.bytes() + vertex_triangles.bytes() + boundary.bytes() + components.bytes() +
           features.bytes() + contours.bytes() + shape.capacity() / 8;
  }
};

/// All that queries read of a mesh, in double precision whatever its user's numbers are.
struct MeshState {
  using Point = fcl::Vector3d;

  std::shared_ptr<const MeshTopology> topology;
  std::vector<Point> vertices;
  std::vector<Point>
      previous;  ///< positions of the frame before; empty unless there are two frames
  LocalBounds<double> bounds;
  WideTree tree;      ///< of `vertices`
  MovedLeaves moved;  ///< made by the first update of some vertices
  BodyAxes axes;      ///< along which the tree's coordinates lie
  double travel = 0;  ///< the sum of the largest displacements of all updates, rounded up
  /// A number of the sequence of updates in which `travel` counts. A copy, which shares it, begins
  /// another one when it is updated.
  std::uint64_t lineage = 0;
  bool is_copy = false;
  std::uint64_t positions = 0;  ///< a number that no other positions of any mesh have
  int update_threads = 1, query_threads = 1;
  MeshUpdate report;

  /// As FCL stores it.
  MeshView<double> view() const {
    return {vertices.data(), previous.empty() ? nullptr : previous.data(),
            topology->triangles.data()};
  }
  /// Allocates all that is missing for `*this = other` to throw nothing.
  void reserve(const MeshState& other) {
    vertices.reserve(other.vertices.size());
    previous.reserve(other.previous.size());
    tree.reserve(other.tree);
  }
  int numTriangles() const { return static_cast<int>(topology->triangles.size()); }
};

template <typename S>
struct HeldMesh;

namespace detail {

/// The library's own way to what a mesh holds.
template <typename S>
struct MeshAccess {
  static HeldMesh<S>& held(DeformableMesh<S>& mesh) { return *mesh.held_; }
  static const HeldMesh<S>& held(const DeformableMesh<S>& mesh) { return *mesh.held_; }
  static const MeshState& state(const DeformableMesh<S>& mesh);
  /// Without a state: it is to be built.
  static DeformableMesh<S> empty() { return DeformableMesh<S>(std::make_unique<HeldMesh<S>>()); }
};

}  // namespace detail

/// What a DeformableMesh holds.
template <>
struct HeldMesh<double> {
  using Points = std::vector<fcl::Vector3d>;

  const MeshState& state() const { return own; }
  MeshState& state() { return own; }
  const Points& vertices() const { return own.vertices; }
  const Points& previous() const { return own.previous; }
  /// Allocates all that is missing for `*this = other` to throw nothing.
  void reserve(const HeldMesh& other) { own.reserve(other.own); }
  /// Allocates all that following the state needs.
  static void reserve() {}

  MeshState own;
};

/// In single precision: a mesh in double precision, which all queries read, and positions as the
/// user reads them, which follow it.
template <>
struct HeldMesh<float> {
  using Points = std::vector<fcl::Vector3f>;

  const MeshState& state() const { return detail::MeshAccess<double>::state(mesh); }
  MeshState& state() { return detail::MeshAccess<double>::held(mesh).own; }
  const Points& vertices() const { return own_vertices; }
  const Points& previous() const { return own_previous; }
  void reserve(const HeldMesh& other) {
    detail::MeshAccess<double>::held(mesh).reserve(detail::MeshAccess<double>::held(other.mesh));
    own_vertices.reserve(other.own_vertices.size());
    own_previous.reserve(other.own_previous.size());
  }
  void reserve() {
    own_vertices.reserve(state().vertices.size());
    own_previous.reserve(state().previous.capacity());
  }

  DeformableMesh<double> mesh = detail::MeshAccess<double>::empty();
  Points own_vertices, own_previous;
};

template <typename S>
const MeshState& detail::MeshAccess<S>::state(const DeformableMesh<S>& mesh) {
  return mesh.held_->state();
}

template <typename S>
const MeshState& stateOf(const DeformableMesh<S>& mesh) {
  return detail::MeshAccess<S>::state(mesh);
}

/// The mesh that answers for one.
inline const DeformableMesh<double>& inDouble(const DeformableMesh<double>& mesh) { return mesh; }
inline const DeformableMesh<double>& inDouble(const DeformableMesh<float>& mesh) {
  return detail::MeshAccess<float>::held(mesh).mesh;
}

}  // namespace adaptive_bvh
