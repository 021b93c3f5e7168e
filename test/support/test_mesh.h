#pragma once

#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {

inline int numVertices(const adaptive_bvh::DeformableMesh& mesh) {
  return static_cast<int>(mesh.vertices().size());
}
inline int numTriangles(const adaptive_bvh::DeformableMesh& mesh) {
  return static_cast<int>(mesh.triangles().size());
}

/// The triangles of a DeformableMesh or of any fcl::BVHModel, named as in FCL's models.
struct BodyView {
  BodyView(const adaptive_bvh::DeformableMesh& mesh)
      : geometry(&mesh),
        vertices(mesh.vertices().data()),
        tri_indices(mesh.triangles().data()),
        num_vertices(numVertices(mesh)),
        num_tris(numTriangles(mesh)) {}
  template <typename BV>
  BodyView(const fcl::BVHModel<BV>& model)
      : geometry(&model),
        vertices(model.vertices),
        tri_indices(model.tri_indices),
        num_vertices(model.num_vertices),
        num_tris(model.num_tris) {}

  std::vector<fcl::Vector3d> positions() const { return {vertices, vertices + num_vertices}; }

  const fcl::CollisionGeometryd* geometry;
  const fcl::Vector3d* vertices;
  const fcl::Triangle* tri_indices;
  int num_vertices, num_tris;
};

/// The numbers of a DeformableMesh or of an AdaptiveBVHModel.
template <typename Body>
using ScalarOf = typename Body::Point::Scalar;

/// A DeformableMesh, or a fcl::BVHModel that is built, of the triangles.
template <typename Body>
Body makeBody(const TriangleMesh& mesh) {
  if constexpr (std::is_same<Body, adaptive_bvh::DeformableMesh>::value) {
    return Body(mesh);
  } else {
    Body model;
    EXPECT_EQ(fcl::BVH_OK, fillModel(mesh, model));
    return model;
  }
}

/// Updates a body, by all vertices, to positions that move(p) has changed, each.
template <typename Body, typename Move>
void moveVertices(Body& body, const Move& move) {
  auto points = BodyView(body).positions();
  for (auto& p : points) move(p);
  body.update(points);
}

}  // namespace adaptive_bvh_test
