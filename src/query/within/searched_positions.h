#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/rigid.h"
#include "deformable/mesh_state.h"
#include "deformable/moved_leaves.h"

namespace adaptive_bvh {

/// How far the vertices of two meshes, or of one, have moved since a search last visited them.
struct VertexMotion {
  std::size_t vertices = 0;  ///< how many there are
  std::size_t moved = 0;     ///< those that have moved by more than the limit
  double most = 0;           ///< largest motion of the others, rounded up
  double sum = 0;            ///< sum of the motions, each at most the limit

  /// Mean motion, where those beyond the limit count as much as the limit.
  double mean() const { return vertices > 0 ? sum / double(vertices) : 0; }
  double share() const { return vertices > 0 ? double(moved) / double(vertices) : 0; }
};

/// The positions of all vertices of one mesh when a search last visited them, in the frame of the
/// first mesh. A translation that all vertices of both meshes have in common does not count: it is
/// taken off (SearchedPositions).
class SearchedVertices {
 public:
  bool isEmpty() const { return points_.empty(); }
  void clear() { points_.clear(); }
  template <typename ToFirst>
  void assign(const MeshState& mesh, const ToFirst& to_first) {
    points_.resize(mesh.vertices.size());
    for (std::size_t v = 0; v < points_.size(); ++v) points_[v] = to_first(mesh.vertices[v]);
  }

  /// Adds the sum of the motions, and that of their squares.
  template <typename ToFirst>
  void addSums(const MeshState& mesh, const ToFirst& to_first, const fcl::Vector3d& translation,
               fcl::Vector3d& sum, double& squares) const {
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const fcl::Vector3d motion = to_first(mesh.vertices[v]) - points_[v] - translation;
      sum += motion;
      squares += motion.squaredNorm();
    }
  }
  /// Adds the motion of each vertex. Calls far(v) for each that is beyond the limit.
  template <typename ToFirst, typename Far>
  void measure(const MeshState& mesh, const ToFirst& to_first, const fcl::Vector3d& translation,
               double limit, VertexMotion& result, const Far& far) const {
    double most = 0, sum = 0;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const fcl::Vector3d motion = to_first(mesh.vertices[v]) - points_[v] - translation;
      const double length = std::sqrt(motion[0] * motion[0] + motion[1] * motion[1] +
                                      motion[2] * motion[2]);
      if (length <= limit) {
        most = std::max(most, length);
        sum += length;
      } else {
        far(static_cast<unsigned>(v));
        sum += limit;
        ++result.moved;
      }
    }
    result.vertices += points_.size();
    result.most = std::max(result.most, most * (1 + 0x1p-48));
    result.sum += sum;
  }
  /// Sets the position of one vertex to the present one.
  template <typename ToFirst>
  void visit(unsigned v, const MeshState& mesh, const ToFirst& to_first,
             const fcl::Vector3d& translation) {
    points_[v] = to_first(mesh.vertices[v]) - translation;
  }

 private:
  std::vector<fcl::Vector3d> points_;
};

}  // namespace adaptive_bvh
