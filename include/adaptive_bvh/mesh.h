#pragma once

#include <type_traits>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>  // BVH_model.h calls fit() without declaring it

#include "adaptive_bvh/build_flags.h"
#include "adaptive_bvh/point_array.h"

namespace adaptive_bvh {

/// Positions in one frame; triangles index them, counter-clockwise seen from outside. `loadMesh`
/// (mesh_io.h, component `mesh_io`) reads one from a file.
struct TriangleMesh {
  std::vector<fcl::Vector3d> vertices;   ///< positions
  std::vector<fcl::Triangle> triangles;  ///< three indices of vertices each
};

/// Joins vertices of exactly equal position, and renumbers the triangles. The first of equal
/// vertices is kept, in the order of the mesh. Vertices that are repeated for every face hide the
/// connectivity of the surface, which the bottom-up build and `selfCollide` use.
///
/// With a tolerance, the vertices are visited in their order. A vertex that is no farther than
/// `tolerance` from a kept vertex is replaced by the first such vertex; otherwise it is kept. So no
/// vertex moves by more than the tolerance, and kept vertices are farther apart. Triangles of which
/// two corners become one are then removed.
///
/// Every index must name a vertex. Throws std::invalid_argument if
/// the tolerance is negative or not finite.
void weldVertices(TriangleMesh& mesh, double tolerance = 0);

/// Builds `model` (any fcl::BVHModel, adaptive or plain; new or used) from the mesh: beginModel,
/// addSubModel, endModel. A model in single precision gets rounded positions. Vertex i of the mesh
/// is vertex i of the model. Returns FCL's code.
template <typename Model>
int fillModel(const TriangleMesh& mesh, Model& model) {
  if (model.build_state != fcl::BVH_BUILD_STATE_EMPTY) {
    model.beginModel();  // FCL clears a used model, refuses, and forgets what it just allocated
    delete[] model.vertices;
    delete[] model.tri_indices;
    model.vertices = nullptr;
    model.tri_indices = nullptr;
  }
  int code = model.beginModel(static_cast<int>(mesh.triangles.size()),
                              static_cast<int>(mesh.vertices.size()));
  using Point = std::remove_pointer_t<decltype(model.vertices)>;
  std::vector<Point> vertices;
  for (const fcl::Vector3d& x : mesh.vertices)
    vertices.push_back(x.template cast<typename Point::Scalar>());
  if (code == fcl::BVH_OK) code = model.addSubModel(vertices, mesh.triangles);
  if (code == fcl::BVH_OK) code = model.endModel();
  return code;
}

}  // namespace adaptive_bvh
