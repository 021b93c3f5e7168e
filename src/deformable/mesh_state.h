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

/// The private data of a DeformableMesh, which queries read.
struct MeshState {
  using Point = fcl::Vector3d;

  std::shared_ptr<const MeshTopology> topology;
  std::vector<Point> vertices;
  std::vector<Point> previous;  ///< empty unless the last update was a two-frame update
  LocalBounds bounds;
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
  int threads = 1;            ///< of updates and queries
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

namespace detail {

/// Gives the library access to the private data of a mesh.
struct MeshAccess {
  static MeshState& state(DeformableMesh& mesh) { return *mesh.state_; }
  static const MeshState& state(const DeformableMesh& mesh) { return *mesh.state_; }
};

}  // namespace detail

inline const MeshState& stateOf(const DeformableMesh& mesh) {
  return detail::MeshAccess::state(mesh);
}

}  // namespace adaptive_bvh
