#pragma once

#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {

/// The numbers under test where the library has code for both, as for FCL's shapes.
using MeshScalars = testing::Types<float, double>;
/// In tests of queries of meshes, which compute in double precision whatever their user's numbers
/// are: test/query/single_precision_test.cpp compares both.
using QueryScalars = testing::Types<double>;

template <typename S>
int numVertices(const adaptive_bvh::DeformableMesh<S>& mesh) {
  return static_cast<int>(mesh.vertices().size());
}
template <typename S>
int numTriangles(const adaptive_bvh::DeformableMesh<S>& mesh) {
  return static_cast<int>(mesh.triangles().size());
}

/// The triangles of a DeformableMesh or of any fcl::BVHModel, named as in FCL's models.
template <typename S>
struct BodyView {
  BodyView(const adaptive_bvh::DeformableMesh<S>& mesh)
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

  std::vector<Vector3<S>> positions() const { return {vertices, vertices + num_vertices}; }

  const fcl::CollisionGeometry<S>* geometry;
  const Vector3<S>* vertices;
  const fcl::Triangle* tri_indices;
  int num_vertices, num_tris;
};

/// The numbers of a DeformableMesh or of an AdaptiveBVHModel.
template <typename Body>
using ScalarOf = typename Body::Point::Scalar;

/// A DeformableMesh, or a fcl::BVHModel that is built, of the triangles.
template <typename Body, typename S>
Body makeBody(const TriangleMesh<S>& mesh) {
  if constexpr (std::is_same<Body, adaptive_bvh::DeformableMesh<S>>::value) {
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
  auto points = BodyView<ScalarOf<Body>>(body).positions();
  for (auto& p : points) move(p);
  body.update(points);
}

}  // namespace adaptive_bvh_test
