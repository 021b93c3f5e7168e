#include "query/points/boundary_cone.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/shortcut.h"
#include "query/points/boundary_kernel.h"
#include "triangles/orientation.h"

namespace adaptive_bvh {

#ifdef ADAPTIVE_BVH_HAS_AVX2
extern const AddBoundary kAddBoundaryAvx2;  // boundary_cone_avx2.cpp
#endif

namespace {

using Vector = fcl::Vector3d;

/// An exact cross product, rounded to a direction and a length.
struct ExactCross {
  Vector direction;  ///< zero if the product is zero
  double length;

  /// The cross product of a - x and b - x, with its length multiplied by 2^by.
  ExactCross(const Vector& a, const Vector& b, const Vector& x, int by) {
    ExactSum::Scaled components[3];
    int exponent = std::numeric_limits<int>::min();
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      ExactSum sum;
      sum.add(a[i], b[j], 1), sum.subtract(a[j], b[i], 1);
      sum.subtract(x[i], b[j], 1), sum.add(x[j], b[i], 1);
      sum.subtract(a[i], x[j], 1), sum.add(a[j], x[i], 1);
      components[k] = sum.value();
      if (components[k].mantissa != 0) exponent = std::max(exponent, components[k].exponent);
    }
    for (int k = 0; k < 3; ++k)
      direction[k] = components[k].mantissa == 0
                         ? 0
                         : std::ldexp(components[k].mantissa, components[k].exponent - exponent);
    const double norm = direction.norm();
    if (norm > 0) direction /= norm;
    length = norm > 0 ? std::ldexp(norm, exponent + by) : 0;
  }
};

/// The ends p and q of an edge relative to a point, and their lengths. All are multiplied by
/// 2^exponent, so that products are in range.
struct SeenEdge {
  int exponent;
  Vector p, q;
  double pn, qn;

  SeenEdge(const Vector& a, const Vector& b, const Vector& x) : p(a - x), q(b - x) {
    exponent = -std::ilogb(std::max(p.lpNorm<Eigen::Infinity>(), q.lpNorm<Eigen::Infinity>()));
    p = enlarged(p);
    q = enlarged(q);
    pn = p.stableNorm();
    qn = q.stableNorm();
  }
  Vector enlarged(const Vector& v) const {
    return {std::ldexp(v[0], exponent), std::ldexp(v[1], exponent), std::ldexp(v[2], exponent)};
  }
};

/// halfSolidAngle for an edge seen under nearly 180 degrees. The tangent of the angle is
/// apex (p x q) / (|p| |q| + p q + apex (|q| p + |p| q)) (van Oosterom and Strackee 1983). The sums
/// in the denominator cancel, so they are expressed by the exact |p x q|: docs/bounds.md, 16.
double nearHalfAngle(const Vector& a, const Vector& b, const Vector& x, const SeenEdge& seen,
                     const Vector& apex) {
  countExact(ExactDecision::BoundaryAngle);
  const ExactCross across(a, b, x, 2 * seen.exponent);
  const Vector edge = seen.enlarged(b - a);
  const double length = edge.norm();
  const Vector along = edge / length;
  const double from = seen.p.dot(along), to = seen.q.dot(along);
  // The denominator divided by |p x q|: |p| |q| + p q, then the components of |q| p + |p| q across
  // the edge and along it.
  const double real =
      across.length / (seen.pn * seen.qn - seen.p.dot(seen.q)) +
      apex.dot(along.cross(across.direction)) * (seen.pn + seen.qn) / length +
      apex.dot(along) * (across.length / length) * (from + to) / (to * seen.pn - from * seen.qn);
  return std::atan2(apex.dot(across.direction), real);
}

/// A right-handed frame whose third axis is opposite to a ray. For a ray along a coordinate axis,
/// its axes are coordinate axes and `order` says which ones; else `order` is 0, 1, 2.
struct ConeFrame {
  fcl::Matrix3d axes;
  int order[3] = {0, 1, 2};
  bool is_aligned;

  explicit ConeFrame(const Vector& ray) : is_aligned((ray.array() != 0).count() == 1) {
    is_aligned ? align(ray) : turn(ray);
  }
  void turn(const Vector& ray) {
    axes.col(2) = -ray.normalized();
    axes.col(0) = axes.col(2).unitOrthogonal();
    axes.col(1) = axes.col(2).cross(axes.col(0));
  }
  void align(const Vector& ray) {
    for (int k = 0; k < 3; ++k)
      if (ray[k] != 0) order[2] = k;
    const bool is_backward = ray[order[2]] < 0;
    order[is_backward ? 0 : 1] = (order[2] + 1) % 3;
    order[is_backward ? 1 : 0] = (order[2] + 2) % 3;
    for (int k = 0; k < 3; ++k) axes.col(k) = Vector::Unit(order[k]);
    if (!is_backward) axes.col(2) = -axes.col(2);
  }
};

constexpr std::size_t kBlock = BoundaryKernel<Pack<double>>::kBlock,
                      kStep = BoundaryKernel<Pack<double>>::kStep;
constexpr double kFullTurn = 6.283185307179586;

}  // namespace

AddBoundary addBoundary() {
#ifdef ADAPTIVE_BVH_HAS_AVX2
  if (packs::hasAvx2()) return kAddBoundaryAvx2;
#endif
  return BoundaryKernel<Pack<double>>::add;
}

double halfSolidAngle(const Vector& a, const Vector& b, const Vector& x,
                      const fcl::Matrix3d& axes) {
  if (a == x || b == x) return 0;
  const SeenEdge e(a, b, x);
  constexpr double kNear = 0x1p-6;
  if (e.pn * e.qn + e.p.dot(e.q) < kNear * e.pn * e.qn)
    return nearHalfAngle(a, b, x, e, axes.col(2));
  // The argument of 1 + z* w: see BoundaryKernel.
  const Vector u = axes.transpose() * (e.p / e.pn), v = axes.transpose() * (e.q / e.qn);
  return std::atan2(u[0] * v[1] - u[1] * v[0], (1 + u[2]) * (1 + v[2]) + u[0] * v[0] + u[1] * v[1]);
}

void BoundaryCone::Memory::push(const Vector& vertex, double weight) {
  for (std::size_t k = 0; k < 3; ++k) coordinates[k].push_back(vertex[static_cast<int>(k)]);
  weights.push_back(weight);
}

BoundaryCone::BoundaryCone(const MeshState& mesh) : scale_(mesh.tree.scale()) {
  Memory& memory = *memory_;
  for (std::vector<double>& numbers : memory.coordinates) numbers.clear();
  memory.weights.clear();
  const BoundaryLoops& loops = mesh.topology->boundary;
  const auto vertexAt = [&](std::size_t i) -> Vector {
    return scale_ * mesh.vertices[loops.vertices()[i]];
  };
  for (std::size_t curve = 0, i = 0; curve < loops.size(); ++curve) {
    const std::size_t first = i;
    for (; i < loops.end(curve); ++i) memory.push(vertexAt(i), 1);
    memory.push(vertexAt(first), 1);  // closes the curve
    memory.push(vertexAt(first), 0);  // separates it from the next one
  }
  // Padded, because the kernel adds kStep edges at once and reads kStep vertices beyond them.
  num_edges_ = (memory.weights.size() + kStep - 1) / kStep * kStep;
  while (memory.weights.size() < num_edges_ + kStep) memory.push(Vector::Zero(), 0);
}

bool BoundaryCone::addTo(double& number, const Vector& x, const Vector& ray, int tries) const {
  const Vector at = scale_ * x;
  const Memory& m = *memory_;
  const ConeFrame frame(ray);
  const BoundaryArrays arrays = {m.coordinates[0].data(), m.coordinates[1].data(),
                                 m.coordinates[2].data(), m.weights.data()};
  BoundaryView view;
  view.is_aligned = frame.is_aligned;
  // Refuses a vertex within an angle of 2^-10 of the ray's direction; of less after 16 tries.
  view.limit = std::ldexp(1., 42 + 2 * std::min(std::max(0, tries - 16), 20));
  for (int k = 0; k < 3; ++k) {
    view.at[k] = at[frame.order[k]];
    for (int i = 0; i < 3; ++i) view.axes[i][k] = frame.axes(frame.order[k], i);
  }
  const auto coordinates = [&](int k) {
    return m.coordinates[static_cast<std::size_t>(frame.order[k])].data();
  };
  const BoundaryArrays ordered = {coordinates(0), coordinates(1), coordinates(2), arrays.weight};
  static const AddBoundary addBlock = addBoundary();
  BoundaryTurn turn;
  double sum = 0;
  for (std::size_t begin = 0; begin < num_edges_; begin += kBlock) {
    unsigned listed[kBlock];
    std::size_t count = 0;
    if (!addBlock(ordered, begin, std::min(kBlock, num_edges_ - begin), view, turn, listed, count))
      return false;
    for (std::size_t k = 0; k < count; ++k) {  // edges that the kernel did not add
      const auto vertexAt = [&](std::size_t i) -> Vector {
        return {arrays.x[i], arrays.y[i], arrays.z[i]};
      };
      sum += halfSolidAngle(vertexAt(listed[k]), vertexAt(listed[k] + 1), at, frame.axes);
    }
  }
  // Adding 0 turns -0 into 0, so that the angle is pi and not -pi (BoundaryTurn).
  number += (sum + std::atan2(turn.y + 0., turn.x)) / kFullTurn + static_cast<double>(turn.turns);
  return true;
}

}  // namespace adaptive_bvh
