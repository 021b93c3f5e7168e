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
  VertexMotion() = default;
  VertexMotion(double farthest, double far) : limit(farthest), soon(far) {}

  double limit = 0, soon = 0;  ///< the motion that calls for a search; that which takes part in it
  std::size_t vertices = 0;    ///< how many there are
  std::size_t beyond = 0;      ///< vertices that have moved by more than the limit
  std::size_t moved = 0;       ///< vertices that have moved by more than `soon`
  double most = 0;             ///< largest motion of the others, rounded up
  double largest = 0;          ///< largest motion of all, rounded up
  double sum = 0;              ///< sum of the motions, jumps left out

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
  /// Adds the motion of each vertex. Appends vertices that have moved by more than result.soon.
  template <typename ToFirst>
  void measure(const MeshState& mesh, const ToFirst& to_first, const fcl::Vector3d& translation,
               VertexMotion& result, std::vector<unsigned>& moved) const {
    double most = 0, largest = 0, sum = 0;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const fcl::Vector3d motion = to_first(mesh.vertices[v]) - points_[v] - translation;
      const double length =
          std::sqrt(motion[0] * motion[0] + motion[1] * motion[1] + motion[2] * motion[2]);
      largest = std::max(largest, length);
      sum += std::min(length, kMostCounted * result.limit);
      if (length <= result.soon) {
        most = std::max(most, length);
      } else {
        moved.push_back(static_cast<unsigned>(v));
        result.beyond += length > result.limit;
      }
    }
    constexpr double kUp = 1 + 0x1p-48;
    result.vertices += points_.size();
    result.moved += moved.size();
    result.most = std::max(result.most, most * kUp);
    result.largest = std::max(result.largest, largest * kUp);
    result.sum += sum;
  }
  /// Sets the position of one vertex to the present one.
  template <typename ToFirst>
  void visit(unsigned v, const MeshState& mesh, const ToFirst& to_first,
             const fcl::Vector3d& translation) {
    points_[v] = to_first(mesh.vertices[v]) - translation;
  }

 private:
  static constexpr double kMostCounted = 8;  ///< limits that a motion counts for in a mean

  std::vector<fcl::Vector3d> points_;
};

}  // namespace adaptive_bvh
