#pragma once

#include <cstdint>
#include <vector>

#include "base/rigid.h"
#include "base/vectors.h"
#include "deformable/mesh_state.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// The coordinates in which motion is measured: (x - origin) scale, in the first mesh's frame and
/// in single precision. The scale is a power of two that makes them less than kLargest. The origin
/// may change at any time, because only differences of two triangles count.
struct MotionUnit {
  static constexpr float kLargest = 2;
  /// Bounds the error of a component of a position: 2^-23 for rounding, and as much again for all
  /// rounding in double precision.
  static constexpr float kError = 1.f / (1 << 22);
  /// Bounds the error of how far two triangles have moved, one relative to the other.
  static constexpr float kMotionError = 3.f / (1 << 17);

  fcl::Vector3d origin = fcl::Vector3d::Zero();
  double scale = 1;

  /// False if a component is not below kLargest.
  bool convert(const fcl::Vector3d& x, Float4& to) const {
    const fcl::Vector3d y = (x - origin) * scale;
    to = Float4{static_cast<float>(y[0]), static_cast<float>(y[1]), static_cast<float>(y[2]), 0};
    return y.cwiseAbs().maxCoeff() < double(kLargest);
  }
};

/// The triangles of one mesh that occur in candidates of a ContactSet, by ids, and where they are:
/// their corners in the first mesh's frame, exactly as the queries compute them, and their motion.
///
/// The motion of a triangle is described by its centre, and by its deformation: a sum over all
/// updates of how far its corners move relative to the centre. From one time to another each point
/// of a triangle moves by the difference of the centres, and by at most that of the deformations
/// beside it. docs/bounds.md, 21.
class TrackedTriangles {
 public:
  /// The ids: the triangles' indices in the order of the leaves. Append, then call `track`.
  std::vector<unsigned>& leaves() { return leaves_; }
  unsigned leaf(unsigned id) const { return leaves_[id]; }
  std::size_t size() const { return leaves_.size(); }

  /// Forgets all positions and motion.
  void forgetMotion();
  /// Reads the positions of all vertices that are tracked, and of triangles that were appended.
  /// Returns false if coordinates exceed MotionUnit::kLargest: then call `move` in another unit.
  template <typename ToFirst>
  bool read(const MeshState& mesh, const ToFirst& to_first, const MotionUnit& unit);
  /// Converts all positions to another unit with the same scale.
  bool convert(const MotionUnit& unit);
  /// Computes the centres and deformations for the positions that were read. Returns the largest
  /// deformation.
  float measure();

  // The state of the last `read` and `measure`, by id.
  bool hasMoved(unsigned id) const { return moved_[id] != 0; }
  /// Whether any of four has moved.
  ADAPTIVE_BVH_INLINE bool hasAnyMoved(const unsigned* ids) const {
    return (moved_[ids[0]] | moved_[ids[1]] | moved_[ids[2]] | moved_[ids[3]]) != 0;
  }
  /// Centre; in the fourth component the deformation.
  const Float4* motions() const { return motions_.data(); }
  /// Corners in double precision.
  TrianglePoints points(unsigned id) const {
    const Int4& v = corners_[id];
    return {points_[std::size_t(v[0])], points_[std::size_t(v[1])], points_[std::size_t(v[2])]};
  }
  /// Corners in the unit.
  ADAPTIVE_BVH_INLINE const Float4& corner(unsigned id, int k) const {
    return positions_[static_cast<std::size_t>(corners_[id][k])];
  }

 private:
  void appendVertices(const MeshState& mesh);

  std::vector<unsigned> leaves_;
  // By id.
  std::vector<Int4> corners_;  ///< three ids of vertices
  std::vector<Float4> motions_;
  std::vector<Float4> shapes_;  ///< two for each: the first two corners relative to the centre
  std::vector<std::uint8_t> moved_;
  // By id of a vertex.
  std::vector<unsigned> vertices_;
  std::vector<fcl::Vector3d> points_;
  std::vector<Float4> positions_;
  std::vector<std::uint8_t> vertex_moved_;
  std::size_t num_measured_ = 0;  ///< number of triangles that have a motion
};

/// Reads the vertices from `begin` on. See TrackedTriangles::read.
template <typename ToFirst>
bool TrackedTriangles::read(const MeshState& mesh, const ToFirst& to_first,
                            const MotionUnit& unit) {
  const std::size_t before = points_.size();
  if (corners_.size() < leaves_.size()) appendVertices(mesh);
  bool fits = true;
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const fcl::Vector3d& now = to_first(mesh.vertices[vertices_[i]]);
    fcl::Vector3d& last = points_[i];
    vertex_moved_[i] = i >= before || now[0] != last[0] || now[1] != last[1] || now[2] != last[2];
    if (!vertex_moved_[i]) continue;
    last = now;
    fits = unit.convert(now, positions_[i]) && fits;
  }
  return fits;
}

}  // namespace adaptive_bvh
