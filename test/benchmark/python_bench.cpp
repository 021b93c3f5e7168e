// The C++ half of python_bench.py, which loads it: the same arrays, in the same process.
#include <chrono>

#include <fcl/geometry/bvh/BVH_model.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/query.h"

namespace {

using Clock = std::chrono::steady_clock;
using Positions = Eigen::Map<const Eigen::Matrix3Xd>;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What a mesh is built of: N x 3 numbers, and three indices for each triangle.
struct Arrays {
  const double* vertices;
  int num_vertices;
  const long* faces;
  int num_faces;

  adaptive_bvh::TriangleMesh mesh() const {
    adaptive_bvh::TriangleMesh mesh;
    for (int i = 0; i < num_vertices; ++i)
      mesh.vertices.emplace_back(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
    for (int t = 0; t < num_faces; ++t)
      mesh.triangles.emplace_back(faces[3 * t], faces[3 * t + 1], faces[3 * t + 2]);
    return mesh;
  }
};

using Mesh = adaptive_bvh::DeformableMesh;

}  // namespace

extern "C" {

Mesh* make(const double* vertices, int num_vertices, const long* faces, int num_faces) {
  return new Mesh(Arrays{vertices, num_vertices, faces, num_faces}.mesh());
}

void destroy(Mesh* mesh) { delete mesh; }

/// Seconds of one update.
double update(Mesh* mesh, const double* vertices) {
  const auto start = Clock::now();
  mesh->update(Positions(vertices, 3, static_cast<Eigen::Index>(mesh->vertices().size())));
  return secondsSince(start);
}

/// Seconds of one distance, the second mesh moved along z.
double distance(const Mesh* first, const Mesh* second, double z, int calls) {
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.translation().z() = z;
  const auto start = Clock::now();
  for (int i = 0; i < calls; ++i) {
    fcl::DistanceResultd result;
    adaptive_bvh::distance(first, fcl::Transform3d(fcl::Transform3d::Identity()), second, tf,
                           fcl::DistanceRequestd(true), result);
  }
  return secondsSince(start) / calls;
}

/// Seconds of what python-fcl has users do in each step: a new FCL model of the arrays.
double rebuild(const double* vertices, int num_vertices, const long* faces, int num_faces) {
  const adaptive_bvh::TriangleMesh mesh = Arrays{vertices, num_vertices, faces, num_faces}.mesh();
  const auto start = Clock::now();
  fcl::BVHModel<fcl::OBBRSSd> model;
  fillModel(mesh, model);
  return secondsSince(start);
}
}
