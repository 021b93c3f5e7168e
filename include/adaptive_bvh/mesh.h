#pragma once

#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>  // BVH_model.h calls fit() without declaring it

namespace adaptive_bvh {

/// Positions in one frame; triangles index them, counter-clockwise seen from outside. `loadMesh`
/// (mesh_io.h, component `mesh_io`) reads one from a file.
template <typename S>
struct TriangleMesh {
  std::vector<fcl::Vector3<S>> vertices;  ///< positions
  std::vector<fcl::Triangle> triangles;   ///< three indices of vertices each
};

/// Makes vertices of exactly equal position one, and renumbers the triangles. The first of the
/// equal ones stays; the order of the others is kept. Triangles that repeat a vertex for every face
/// hide the connectivity of the surface, which the bottom-up build and `selfCollide` use.
/// Defined for float and double. Every index must name a vertex.
template <typename S>
void weldVertices(TriangleMesh<S>& mesh);

/// Builds `model` (any fcl::BVHModel, adaptive or plain; new or used) from the mesh: beginModel,
/// addSubModel, endModel. Vertex i of the mesh is vertex i of the model. Returns FCL's code.
template <typename Model, typename S>
int fillModel(const TriangleMesh<S>& mesh, Model& model) {
  if (model.build_state != fcl::BVH_BUILD_STATE_EMPTY) {
    model.beginModel();  // FCL clears a used model, refuses, and forgets what it just allocated
    delete[] model.vertices;
    delete[] model.tri_indices;
    model.vertices = nullptr;
    model.tri_indices = nullptr;
  }
  int code = model.beginModel(static_cast<int>(mesh.triangles.size()),
                              static_cast<int>(mesh.vertices.size()));
  if (code == fcl::BVH_OK) code = model.addSubModel(mesh.vertices, mesh.triangles);
  if (code == fcl::BVH_OK) code = model.endModel();
  return code;
}

extern template void weldVertices(TriangleMesh<float>&);
extern template void weldVertices(TriangleMesh<double>&);

}  // namespace adaptive_bvh
