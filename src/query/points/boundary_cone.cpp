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

  /// (a - x) x (b - x) = a x b - x x b - a x x, with its length multiplied by 2^length_exponent.
  ExactCross(const Vector& a, const Vector& b, const Vector& x, int length_exponent) {
    ExactSum::Scaled components[3];
    int exponent = std::numeric_limits<int>::min();  // of the largest component
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
    length = norm > 0 ? std::ldexp(norm, exponent + length_exponent) : 0;
  }
};

/// An edge seen from a point x: the vectors p and q from x to its ends a and b, multiplied by
/// 2^exponent so that their products are in range.
struct SeenEdge {
  int exponent;
  Vector p, q;
  double p_length, q_length;

  SeenEdge(const Vector& a, const Vector& b, const Vector& x) : p(a - x), q(b - x) {
    exponent = -std::ilogb(std::max(p.lpNorm<Eigen::Infinity>(), q.lpNorm<Eigen::Infinity>()));
    p = scaled(p);
    q = scaled(q);
    p_length = p.stableNorm();
    q_length = q.stableNorm();
  }
  Vector scaled(const Vector& v) const {
    return {std::ldexp(v[0], exponent), std::ldexp(v[1], exponent), std::ldexp(v[2], exponent)};
  }
};

/// halfSolidAngle for an edge seen under nearly 180 degrees. `apex`: direction of the apex, of
/// length 1. The tangent of half the solid angle is
/// apex (p x q) / (|p| |q| + p q + apex (|q| p + |p| q)) (van Oosterom and Strackee 1983). The sums
/// in the denominator cancel, so they are expressed by the exact |p x q|: docs/bounds.md, 16.
double halfSolidAngleOfWideEdge(const Vector& a, const Vector& b, const Vector& x,
                                const SeenEdge& seen, const Vector& apex) {
  countExact(ExactDecision::BoundaryAngle);
  const double p_length = seen.p_length, q_length = seen.q_length;
  const ExactCross cross(a, b, x, 2 * seen.exponent);
  const Vector edge = seen.scaled(b - a);
  const double length = edge.norm();
  const Vector along = edge / length;
  const double p_along = seen.p.dot(along), q_along = seen.q.dot(along);
  // Divided by |p x q|: |p| |q| + p q, and |q| p + |p| q across the edge, then along it.
  const double denominator =
      cross.length / (p_length * q_length - seen.p.dot(seen.q)) +
      apex.dot(along.cross(cross.direction)) * (p_length + q_length) / length +
      apex.dot(along) * (cross.length / length) * (p_along + q_along) /
          (q_along * p_length - p_along * q_length);
  return std::atan2(apex.dot(cross.direction), denominator);
}

/// A right-handed frame whose third axis, the direction of the cone's apex, is opposite to a ray.
struct ConeFrame {
  fcl::Matrix3d axes;        ///< columns
  bool is_aligned;           ///< the ray is along a coordinate axis; so are all axes of the frame
  int order[3] = {0, 1, 2};  ///< if aligned, the number of the coordinate that axis k is along

  explicit ConeFrame(const Vector& ray) : is_aligned((ray.array() != 0).count() == 1) {
    is_aligned ? setAligned(ray) : setRotated(ray);
  }
  void setRotated(const Vector& ray) {
    axes.col(2) = -ray.normalized();
    axes.col(0) = axes.col(2).unitOrthogonal();
    axes.col(1) = axes.col(2).cross(axes.col(0));
  }
  void setAligned(const Vector& ray) {
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
/// Twice the greatest error of half the solid angle of an edge at the ray: 2^-29 after many tries.
constexpr double kNearRay = 0x1p-28;

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
  constexpr double kWide = 0x1p-6;  // of 1 + the cosine of the angle under which the edge is seen
  if (e.p_length * e.q_length + e.p.dot(e.q) < kWide * e.p_length * e.q_length)
    return halfSolidAngleOfWideEdge(a, b, x, e, axes.col(2));
  // The argument of 1 + z* w (see BoundaryKernel), for the directions u and v of the ends.
  const Vector u = axes.transpose() * (e.p / e.p_length), v = axes.transpose() * (e.q / e.q_length);
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
  // Pad: the kernel adds kStep edges at once and reads kStep vertices beyond the last edge.
  num_edges_ = (memory.weights.size() + kStep - 1) / kStep * kStep;
  while (memory.weights.size() < num_edges_ + kStep) memory.push(Vector::Zero(), 0);
}

bool BoundaryCone::addTo(double& winding, const Vector& x, const Vector& ray, int tries) const {
  const Vector point = scale_ * x;
  const std::array<std::vector<double>, 3>& coordinates = memory_->coordinates;
  const ConeFrame frame(ray);
  BoundaryView view;
  view.is_aligned = frame.is_aligned;
  // The limit for vertices at an angle of 2^-10 from the ray; at smaller angles after 16 tries.
  view.limit = std::ldexp(1., 42 + 2 * std::min(std::max(0, tries - 16), 20));
  for (int k = 0; k < 3; ++k) {
    view.point[k] = point[frame.order[k]];
    for (int i = 0; i < 3; ++i) view.axes[i][k] = frame.axes(frame.order[k], i);
  }
  const auto inOrder = [&](int k) {
    return coordinates[static_cast<std::size_t>(frame.order[k])].data();
  };
  const BoundaryArrays boundary = {inOrder(0), inOrder(1), inOrder(2), memory_->weights.data()};
  static const AddBoundary addBlock = addBoundary();
  BoundaryTurn turn;  // half the solid angle of the edges that the kernel adds
  double sum = 0;     // of the others
  for (std::size_t begin = 0; begin < num_edges_; begin += kBlock) {
    unsigned skipped[kBlock];
    std::size_t num_skipped = 0;
    if (!addBlock(boundary, begin, std::min(kBlock, num_edges_ - begin), view, turn, skipped,
                  num_skipped))
      return false;
    for (std::size_t k = 0; k < num_skipped; ++k) {
      const auto vertexAt = [&](std::size_t i) -> Vector {
        return {coordinates[0][i], coordinates[1][i], coordinates[2][i]};
      };
      const double half =
          halfSolidAngle(vertexAt(skipped[k]), vertexAt(skipped[k] + 1), point, frame.axes);
      // The ray meets the edge, or rounding decides on which side it passes.
      if (std::fabs(half) > kFullTurn / 2 - kNearRay) return false;
      sum += half;
    }
  }
  // Adding 0 turns -0 into 0, so that the angle is pi and not -pi (BoundaryTurn).
  winding += (sum + std::atan2(turn.y + 0., turn.x)) / kFullTurn + static_cast<double>(turn.turns);
  return true;
}

}  // namespace adaptive_bvh
