#pragma once

#include <array>
#include <cstring>
#include <functional>

#include <fcl/common/types.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/triangle.h>

namespace adaptive_bvh {

/// The vertex indices of a triangle. A point is represented by three equal indices.
using VertexIndices = std::array<unsigned, 3>;

/// Whether two arrays of points, with the given lengths, overlap in memory.
template <typename S>
bool overlap(const fcl::Vector3<S>* a, std::size_t count_a, const fcl::Vector3<S>* b,
             std::size_t count_b) {
  const std::less<const fcl::Vector3<S>*> before;
  return before(a, b + count_b) && before(b, a + count_a);
}

/// A non-owning view of a model's primitives (triangles, or points if `triangles` is null) and
/// their positions, in FCL's layout.
template <typename S>
struct MeshView {
  const fcl::Vector3<S>* vertices = nullptr;
  /// Positions before the last step, if volumes must enclose both (two-frame update); otherwise
  /// null.
  const fcl::Vector3<S>* previous = nullptr;
  const fcl::Triangle* triangles = nullptr;

  int verticesPerPrimitive() const { return triangles ? 3 : 1; }

  /// Vertex index of corner k of a primitive; a point has only corner 0.
  unsigned vertex(unsigned primitive, int k) const {
    return triangles ? static_cast<unsigned>(triangles[primitive][k]) : primitive;
  }

  VertexIndices verticesOf(unsigned primitive) const {
    if (!triangles) return {primitive, primitive, primitive};
    std::size_t v[3];  // copied at once: FCL's accessor is a function call for each index
    static_assert(sizeof(v) == sizeof(fcl::Triangle), "a triangle is three indices");
    std::memcpy(v, static_cast<const void*>(&triangles[primitive]), sizeof(v));
    return {static_cast<unsigned>(v[0]), static_cast<unsigned>(v[1]), static_cast<unsigned>(v[2])};
  }

  /// Calls visit(position) for a vertex, and for its previous position if `previous` is set.
  template <typename Visit>
  void forEachPositionOf(unsigned v, Visit&& visit) const {
    visit(vertices[v]);
    if (previous) visit(previous[v]);
  }

  /// Calls forEachPositionOf for every corner of a primitive.
  template <typename Visit>
  void forEachPosition(unsigned primitive, Visit&& visit) const {
    for (int k = 0; k < verticesPerPrimitive(); ++k) forEachPositionOf(vertex(primitive, k), visit);
  }
};

/// The primitives and positions of an FCL model.
template <typename BV>
MeshView<typename BV::S> viewOf(const fcl::BVHModel<BV>& model) {
  MeshView<typename BV::S> view;
  view.vertices = model.vertices;
  view.previous = model.prev_vertices;
  view.triangles = model.num_tris > 0 ? model.tri_indices : nullptr;
  return view;
}

}  // namespace adaptive_bvh
