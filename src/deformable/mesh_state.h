#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "boxes/contours.h"
#include "boxes/feature_leaves.h"
#include "boxes/wide_tree.h"
#include "deformable/body_axes.h"
#include "hierarchy/dirty_nodes.h"
#include "mesh/boundary_loops.h"
#include "mesh/components.h"
#include "mesh/local_bounds.h"
#include "mesh/vertex_triangles.h"

namespace adaptive_bvh {

/// The data that a mesh shares with its copies. They depend on the triangles and the tree only, and
/// are constant after the build.
struct MeshTopology {
  std::vector<fcl::Triangle> triangles;  ///< as given by the user
  LeafTriangles leaves;
  FeatureOwners owners;
  VertexTriangles vertex_triangles;
  BoundaryLoops boundary;
  Components components;
  FeatureLeaves features;
  Contours contours;
  std::vector<bool> shape;  ///< shape of the binary tree (shapeOf), for DeformableMesh::save

  std::size_t bytes() const {
    return sizeof(MeshTopology) + triangles.capacity() * sizeof(fcl::Triangle) + leaves.bytes() +
           owners.bytes() + vertex_triangles.bytes() + boundary.bytes() + components.bytes() +
           features.bytes() + contours.bytes() + shape.capacity() / 8;
  }
};

/// The state of a mesh that queries read, always in double precision.
struct MeshState {
  using Point = fcl::Vector3d;

  std::shared_ptr<const MeshTopology> topology;
  std::vector<Point> vertices;
  std::vector<Point> previous;  ///< empty unless the last update was a two-frame update
  LocalBounds<double> bounds;
  WideTree tree;     ///< boxes of `vertices`
  DirtyNodes moved;  ///< created by the first update of some vertices
  BodyAxes axes;     ///< axes of the tree's coordinates
  /// Accumulated motion bound: the sum of the largest displacements of all updates, rounded up.
  double travel = 0;
  /// Identifies the sequence of updates over which `travel` accumulates. A copy shares it, and gets
  /// a new one at its next update.
  std::uint64_t lineage = 0;
  bool is_copy = false;       ///< whether this is a copy without an update since
  std::uint64_t version = 0;  ///< identifies the positions, among those of all meshes
  int update_threads = 1, query_threads = 1;
  MeshUpdate report;

  /// The mesh in FCL's layout.
  MeshView<double> view() const {
    return {vertices.data(), previous.empty() ? nullptr : previous.data(),
            topology->triangles.data()};
  }
  /// Allocates the memory that `*this = other` needs, so that the assignment throws nothing.
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

/// Gives the library access to the private data of a mesh.
template <typename S>
struct MeshAccess {
  static HeldMesh<S>& held(DeformableMesh<S>& mesh) { return *mesh.held_; }
  static const HeldMesh<S>& held(const DeformableMesh<S>& mesh) { return *mesh.held_; }
  static const MeshState& state(const DeformableMesh<S>& mesh);
  /// A mesh with an empty state, which is built later.
  static DeformableMesh<S> empty() { return DeformableMesh<S>(std::make_unique<HeldMesh<S>>()); }
};

}  // namespace detail

/// The private data of a DeformableMesh.
template <>
struct HeldMesh<double> {
  using Points = std::vector<fcl::Vector3d>;

  const MeshState& state() const { return own; }
  MeshState& state() { return own; }
  const Points& vertices() const { return own.vertices; }
  const Points& previous() const { return own.previous; }
  /// Allocates the memory that `*this = other` needs, so that the assignment throws nothing.
  void reserve(const HeldMesh& other) { own.reserve(other.own); }
  /// Allocates the memory for the copies of the state's positions; there are none.
  static void reserve() {}

  MeshState own;
};

/// The private data of a single-precision mesh: a double-precision mesh, which all queries read,
/// and a copy of its positions in single precision.
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

/// The double-precision mesh that queries read: the mesh itself, or the one inside it.
inline const DeformableMesh<double>& inDouble(const DeformableMesh<double>& mesh) { return mesh; }
inline const DeformableMesh<double>& inDouble(const DeformableMesh<float>& mesh) {
  return detail::MeshAccess<float>::held(mesh).mesh;
}

}  // namespace adaptive_bvh
