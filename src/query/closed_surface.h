#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>

#include "deformable/mesh_state.h"
#include "mesh/vertex_triangles.h"

namespace adaptive_bvh {

/// Returns "1 time", "2 times" and so on, for a message.
inline std::string times(int count) {
  return std::to_string(count) + (count == 1 ? " time" : " times");
}

/// Throws std::invalid_argument unless a mesh is closed: its triangles traverse every edge equally
/// often in both directions. The message names an edge, and the query that needs this, `what`.
inline void requireClosed(const MeshState& mesh, const char* what) {
  if (mesh.topology->owners.isClosed()) return;
  std::string edge;
  forEachOpenEdge(mesh.view(), static_cast<unsigned>(mesh.numTriangles()),
                  mesh.topology->vertex_triangles,
                  [&](unsigned from, unsigned to, const EdgeUse& use) {
                    edge = "the edge from vertex " + std::to_string(from) + " to vertex " +
                           std::to_string(to) + ", of triangle " + std::to_string(use.triangle) +
                           ", is run through " + times(std::max(use.forward, use.back)) +
                           " that way and " + times(std::min(use.forward, use.back)) + " back";
                    return false;  // visit no further edge
                  });
  throw std::invalid_argument("adaptive_bvh: " + std::string(what) +
                              " needs a mesh that is closed, and this one is not: " + edge);
}

}  // namespace adaptive_bvh
