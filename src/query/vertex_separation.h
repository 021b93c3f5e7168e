#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// How far apart all vertices below two nodes are, in double precision, from the positions
/// themselves. Where flat parts lie parallel, boxes and volumes fall short of their distance by
/// what these are rounded to, and a search would go down to every pair of triangles. This takes
/// time in proportion to the vertices, so it is for few pairs high in the trees; a few samples say
/// beforehand whether it is in vain.
template <typename BV>
class VertexSeparation {
 public:
  using S = typename BV::S;

  /// (R, T) takes the second model's coordinates to the first's.
  VertexSeparation(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                   const fcl::Matrix3<S>& R, const fcl::Vector3<S>& T)
      : first_(first),
        second_(second),
        R_(R.template cast<double>()),
        T_(T.template cast<double>()) {}

  /// A lower bound of the distance, up to rounding, when it is at least `enough`; else any smaller
  /// number. Tried are `direction` (of any length), in the first's coordinates, and the normals of
  /// either part.
  double operator()(int node1, int node2, const fcl::Vector3<S>& direction, double enough) {
    const Part a = partOf(first_, node1), b = partOf(second_, node2);
    origin2_ = b.samples[0];
    origin1_ = a.samples[0];
    offset_ = R_ * origin2_ + T_ - origin1_;
    double best = along(a, b, direction.template cast<double>(), enough);
    if (best < enough) best = std::max(best, along(a, b, normalOf(a), enough));
    if (best < enough) best = std::max(best, along(a, b, R_ * normalOf(b), enough));
    return best;
  }
  /// Vertices read so far.
  long read() const { return read_; }

 private:
  using Vector = fcl::Vector3d;
  static constexpr int kSamples = 12;

  /// The vertices below a node, as slots.
  struct Part {
    const PlacedMesh<BV>* mesh;
    VertexSlots::Set slots;
    std::array<Vector, kSamples> samples;
  };

  static Part partOf(const PlacedMesh<BV>& mesh, int node) {
    const auto& bv = mesh.model->getBV(node);
    const auto first = static_cast<std::size_t>(bv.first_primitive),
               count = static_cast<std::size_t>(bv.num_primitives);
    const VertexSlots& slots = mesh.tree->topology.slots;
    Part part{&mesh, slots.below(first, count), {}};
    for (std::size_t i = 0; i < kSamples; ++i) {
      const VertexIndices v = slots.verticesOf(first + i * (count - 1) / (kSamples - 1));
      part.samples[i] = mesh.model->vertices[v[i % 3]].template cast<double>();
    }
    return part;
  }

  /// Of a flat part: across three samples far apart.
  static Vector normalOf(const Part& part) {
    const Vector& from = part.samples[0];
    const auto farthest = [&](const auto& measure) {
      return *std::max_element(
          part.samples.begin(), part.samples.end(),
          [&](const Vector& p, const Vector& q) { return measure(p) < measure(q); });
    };
    const Vector u = farthest([&](const Vector& p) { return (p - from).squaredNorm(); }) - from;
    const Vector v =
        farthest([&](const Vector& p) { return u.cross(p - from).squaredNorm(); }) - from;
    return u.cross(v).stableNormalized();
  }

  /// Along a vector, from the first part to the second or back. It is made a unit vector here, in
  /// double precision: a rotation or a direction in single precision has a length of 1 to 7 digits.
  double along(const Part& a, const Part& b, Vector n, double enough) {
    const double length = n.norm();
    if (!(length > 0)) return std::numeric_limits<double>::lowest();
    n /= length;
    const Vector middle_a = a.samples[kSamples / 2] - origin1_,
                 middle_b = R_ * (b.samples[kSamples / 2] - origin2_) + offset_;
    if (n.dot(middle_b - middle_a) < 0) n = -n;
    const Vector n2 = R_.transpose() * n;
    const double apart = n.dot(offset_);
    // The farthest of a along n and of b against it may be so far together:
    const double room = apart - enough;
    double high_a = 0, high_b = 0;  // of the origins
    for (int i = 0; i < kSamples; ++i) {
      high_a = std::max(high_a, n.dot(a.samples[std::size_t(i)] - origin1_));
      high_b = std::max(high_b, -n2.dot(b.samples[std::size_t(i)] - origin2_));
    }
    read_ += 2 * kSamples;
    if (!(high_a + high_b <= room)) return std::numeric_limits<double>::lowest();
    high_a = farthest(a, n, origin1_);
    if (!(high_a + high_b <= room)) return std::numeric_limits<double>::lowest();
    high_b = farthest(b, -n2, origin2_);
    return apart - high_a - high_b;
  }

  /// The largest n (p - origin) of all vertices p, and of the origin.
  double farthest(const Part& part, const Vector& n, const Vector& origin) {
    const fcl::BVHModel<BV>& model = *part.mesh->model;
    const unsigned* const slots = part.mesh->tree->topology.slots.vertices().data();
    const std::size_t first = part.slots.first, last = part.slots.last;
    const auto vertices = static_cast<std::size_t>(model.num_vertices);
    if (part.slots.bits) {
      const std::uint64_t bits = part.slots.bits;
      std::size_t at[VertexSlots::kBlock], count = 0;
      for (std::uint64_t left = bits; left; left &= left - 1)
        at[count++] = slots[first + static_cast<std::size_t>(__builtin_ctzll(left))];
      return farthest(model.vertices, n, origin, count, [&](std::size_t i) { return at[i]; });
    }
    if (last - first >= vertices)  // all of them: in the mesh's order
      return farthest(model.vertices, n, origin, vertices, [](std::size_t i) { return i; });
    return farthest(model.vertices, n, origin, last - first,
                    [&](std::size_t i) { return std::size_t(slots[first + i]); });
  }
  template <typename Index>
  double farthest(const fcl::Vector3<S>* vertices, const Vector& n, const Vector& origin,
                  std::size_t count, const Index& index) {
    const double from = n.dot(origin), x = n[0], y = n[1], z = n[2];
    double most[4] = {from, from, from, from};  // four sums do not wait for each other
    const auto add = [&](std::size_t i, double& largest) {
      const fcl::Vector3<S>& p = vertices[index(i)];
      const double along = x * double(p[0]) + y * double(p[1]) + z * double(p[2]);
      largest = largest < along ? along : largest;
    };
    std::size_t i = 0;
    for (; i + 4 <= count; i += 4)
      for (std::size_t k = 0; k < 4; ++k) add(i + k, most[k]);
    for (; i < count; ++i) add(i, most[0]);
    read_ += static_cast<long>(count);
    return std::max(std::max(most[0], most[1]), std::max(most[2], most[3])) - from;
  }

  const PlacedMesh<BV>&first_, &second_;
  const Eigen::Matrix3d R_;
  const Vector T_;
  Vector origin1_, origin2_, offset_;
  long read_ = 0;
};

}  // namespace adaptive_bvh
