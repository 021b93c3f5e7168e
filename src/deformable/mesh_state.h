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
#include "mesh/components.h"
#include "mesh/vertex_triangles.h"

namespace adaptive_bvh {

/// What a mesh and its copies have in common: nothing of it changes after the build.
struct MeshTopology {
  std::vector<fcl::Triangle> triangles;  ///< as they were given
  LeafTriangles leaves;
  FeatureOwners owners;
  VertexTriangles vertex_triangles;
  Components components;
  FeatureLeaves features;
  Contours contours;
  std::vector<bool> shape;  ///< of the binary tree (shapeOf), for DeformableMesh::save

  std::size_t bytes() const {
    return sizeof(MeshTopology) + triangles.capacity() * sizeof(fcl::Triangle) + leaves.bytes() +
           owners.bytes() + vertex_triangles.bytes() + components.bytes() + features.bytes() +
           contours.bytes() + shape.capacity() / 8;
  }
};

/// What a DeformableMesh holds, and all that queries read.
template <typename S>
struct MeshState {
  using Point = fcl::Vector3<S>;

  std::shared_ptr<const MeshTopology> topology;
  std::vector<Point> vertices;
  std::vector<Point>
      previous;       ///< positions of the frame before; empty unless there are two frames
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
  MeshView<S> view() const {
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

namespace detail {

/// The library's own way to what a mesh holds.
template <typename S>
struct MeshAccess {
  static const MeshState<S>& state(const DeformableMesh<S>& mesh) { return *mesh.state_; }
};

}  // namespace detail

template <typename S>
const MeshState<S>& stateOf(const DeformableMesh<S>& mesh) {
  return detail::MeshAccess<S>::state(mesh);
}

}  // namespace adaptive_bvh
