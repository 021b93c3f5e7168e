#include "query/within/tracked_triangles.h"

#include <algorithm>
#include <cmath>

#include "query/within/candidate_rows.h"

namespace adaptive_bvh {
namespace {

/// Bounds the relative error of a computed length, and of its sum with a deformation.
constexpr float kLengthUp = 1 + 1.f / (1 << 20);

float squareOf(const Float4& v) { return float4::dot(v, v); }

}  // namespace

void TrackedTriangles::forgetMotion() {
  corners_.clear();
  motions_.clear();
  shapes_.clear();
  moved_.clear();
  vertices_.clear();
  points_.clear();
  positions_.clear();
  vertex_moved_.clear();
  num_measured_ = 0;
}

/// Gives ids to the vertices of the triangles that were appended.
void TrackedTriangles::appendVertices(const MeshState& mesh) {
  const std::size_t count = leaves_.size();
  corners_.reserve(count);
  motions_.resize(count);
  shapes_.resize(2 * count);
  moved_.resize(count);
  {
    SmallIds ids(mesh.vertices.size(), vertices_);
    while (corners_.size() < count) {
      const Int4& v = mesh.tree.corners(leaves_[corners_.size()]);
      const unsigned a = ids(unsigned(v[0])), b = ids(unsigned(v[1])), c = ids(unsigned(v[2]));
      corners_.push_back(Int4{int(a), int(b), int(c), 0});
    }
  }
  points_.resize(vertices_.size());
  positions_.resize(vertices_.size());
  vertex_moved_.resize(vertices_.size());
}

bool TrackedTriangles::convert(const MotionUnit& unit) {
  bool fits = true;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    fits = unit.convert(points_[i], positions_[i]) && fits;
    vertex_moved_[i] = 1;
  }
  return fits;
}

float TrackedTriangles::measure() {
  float most = 0;
  for (std::size_t id = 0; id < corners_.size(); ++id) {
    const Int4& v = corners_[id];
    const std::size_t a = std::size_t(v[0]), b = std::size_t(v[1]), c = std::size_t(v[2]);
    moved_[id] = vertex_moved_[a] | vertex_moved_[b] | vertex_moved_[c];
    if (!moved_[id] && id < num_measured_) continue;
    Float4& motion = motions_[id];
    Float4* const shape = &shapes_[2 * id];
    const Float4 centre = (positions_[a] + positions_[b] + positions_[c]) * float4::all(1.f / 3);
    const Float4 to_a = positions_[a] - centre, to_b = positions_[b] - centre;
    float deformation = 0;
    if (id < num_measured_) {
      // The third corner, relative to the centre, is minus the sum of the others, up to rounding.
      const Float4 da = to_a - shape[0], db = to_b - shape[1];
      deformation = std::sqrt(std::max({squareOf(da), squareOf(db), squareOf(da + db)}));
      deformation = deformation > 0 ? (deformation + motion[3]) * kLengthUp : motion[3];
    }
    shape[0] = to_a;
    shape[1] = to_b;
    motion = Float4{centre[0], centre[1], centre[2], deformation};
    most = std::max(most, deformation);
  }
  num_measured_ = corners_.size();
  return most;
}

}  // namespace adaptive_bvh
