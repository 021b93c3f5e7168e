#include "query/winding_tree.h"

#include <algorithm>
#include <cmath>

#include "boxes/tree_walk.h"
#include "triangles/solid_angle.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

constexpr double kFourPi = 12.566370614359172;

// The components of symmetric tensors that are kept, and how often each counts in a form of d.
constexpr int kSecond[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
constexpr int kThird[10][3] = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 1, 1}, {0, 1, 2},
                               {0, 2, 2}, {1, 1, 1}, {1, 1, 2}, {1, 2, 2}, {2, 2, 2}};
constexpr float kSecondCount[6] = {1, 2, 2, 1, 2, 1};
constexpr float kThirdCount[10] = {1, 3, 3, 3, 6, 3, 1, 3, 3, 1};
constexpr int kSecondAt[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

}  // namespace

WindingTree::Moments WindingTree::ofTriangle(const Vector (&corners)[3]) {
  Moments m;
  const Vector normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]) / (2 * kFourPi);
  m.area = normal.norm();
  m.first = normal;
  m.center = (corners[0] + corners[1] + corners[2]) / 3;
  fcl::Matrix3d spread = fcl::Matrix3d::Zero();  // the mean of h h
  for (const Vector& corner : corners) {
    const Vector h = corner - m.center;
    m.radius = std::max(m.radius, h.norm());
    spread += h * h.transpose() / 12;
  }
  m.square = m.area * spread.trace();
  for (int t = 0; t < 10; ++t) {
    const int i = kThird[t][0], j = kThird[t][1], k = kThird[t][2];
    m.third[t] =
        (normal[i] * spread(j, k) + normal[j] * spread(i, k) + normal[k] * spread(i, j)) / 3;
  }
  return m;
}

/// Adds moments about another centre, which is seen from that of the sum.
void WindingTree::add(const Moments& part, Moments& sum) {
  const Vector h = part.center - sum.center;
  const Vector& n = part.first;
  const auto second = [&](int i, int j) { return part.second[kSecondAt[i][j]]; };
  sum.radius = std::max(sum.radius, h.norm() + part.radius);
  sum.square += part.square + part.area * h.squaredNorm();
  sum.first += n;
  for (int t = 0; t < 6; ++t) {
    const int i = kSecond[t][0], j = kSecond[t][1];
    sum.second[t] += part.second[t] + (n[i] * h[j] + n[j] * h[i]) / 2;
  }
  for (int t = 0; t < 10; ++t) {
    const int i = kThird[t][0], j = kThird[t][1], k = kThird[t][2];
    sum.third[t] += part.third[t] +
                    2 * (second(i, j) * h[k] + second(i, k) * h[j] + second(j, k) * h[i]) / 3 +
                    (n[i] * h[j] * h[k] + n[j] * h[i] * h[k] + n[k] * h[i] * h[j]) / 3;
  }
}

WindingTree::Moments WindingTree::combined(const Moments* parts, const WideNode& node) {
  Moments sum;
  Vector middle = Vector::Zero();
  for (int i = 0; i < int(node.count); ++i) {
    sum.area += parts[i].area;
    sum.center += parts[i].area * parts[i].center;
    middle += parts[i].center / double(node.count);
  }
  sum.center = sum.area > 0 ? Vector(sum.center / sum.area) : middle;
  double by_boxes = 0;  // how far their farthest corner is
  for (int i = 0; i < int(node.count); ++i) {
    add(parts[i], sum);
    const Boxes4& b = node.boxes;
    const Vector low(b.low[0][i], b.low[1][i], b.low[2][i]),
        high(b.high[0][i], b.high[1][i], b.high[2][i]);
    by_boxes = std::max(
        by_boxes, (sum.center - low).cwiseAbs().cwiseMax((high - sum.center).cwiseAbs()).norm());
  }
  sum.radius = std::min(sum.radius, by_boxes);
  return sum;
}

void WindingTree::write(const Moments& m, int lane, Node& to) {
  constexpr double kUp = 1 + 1e-6;
  to.area[lane] = static_cast<float>(m.area * kUp);
  to.square[lane] = static_cast<float>(m.square * kUp);
  to.radius[lane] = static_cast<float>(m.radius * kUp);
  for (int k = 0; k < 3; ++k) {
    to.center[k][lane] = static_cast<float>(m.center[k]);
    to.first[k][lane] = static_cast<float>(m.first[k]);
  }
  for (int t = 0; t < 6; ++t)
    to.second[t][lane] = static_cast<float>(m.second[t]) * kSecondCount[t];
  to.trace[lane] = static_cast<float>(m.second[0] + m.second[3] + m.second[5]);
  for (int t = 0; t < 10; ++t) to.third[t][lane] = static_cast<float>(m.third[t]) * kThirdCount[t];
  to.traces[0][lane] = static_cast<float>(m.third[0] + m.third[3] + m.third[5]);
  to.traces[1][lane] = static_cast<float>(m.third[1] + m.third[6] + m.third[8]);
  to.traces[2][lane] = static_cast<float>(m.third[2] + m.third[7] + m.third[9]);
}

void WindingTree::refit(const MeshState& mesh) {
  const WideTree& tree = mesh.tree;
  nodes_.assign(static_cast<std::size_t>(tree.size()), Node());
  moments_.resize(nodes_.size());
  for (int number = tree.size(); number-- > 0;) {
    const WideNode& node = tree.nodes()[number];
    Moments parts[4];
    for (int i = 0; i < int(node.count); ++i) {
      if (node.isLeaf()) {
        const Int4& v = tree.corners(static_cast<unsigned>(node.first + i));
        Vector corners[3];
        for (int k = 0; k < 3; ++k)
          corners[k] = tree.coordinates()(mesh.vertices[static_cast<std::size_t>(v[k])]);
        parts[i] = ofTriangle(corners);
      } else {
        parts[i] = moments_[static_cast<std::size_t>(node.below[i])];
      }
      write(parts[i], i, nodes_[static_cast<std::size_t>(number)]);
    }
    moments_[static_cast<std::size_t>(number)] = combined(parts, node);
  }
}

ADAPTIVE_BVH_INLINE unsigned WindingTree::evaluate(const Node& node, const Vector4x3& x,
                                                   float limit, Sum& sum) {
  using float4::all;
  const Float4 dx = node.center[0] - x.x, dy = node.center[1] - x.y, dz = node.center[2] - x.z;
  const Float4 square = dx * dx + dy * dy + dz * dz, one = all(1);
  const Float4 inverse = one / float4::squareRoot(square), inverse2 = one / square;
  const Float4 q = node.radius * inverse, rest = one - q;
  // Rounding: of x and the centre, seen from R, and of what follows.
  const Float4 rounding = all(0x1p-20f) * (one + inverse);
  const Float4 error =
      inverse2 *
      (node.square * inverse2 * q * (all(4) - all(3) * q) / (rest * rest) + node.area * rounding);
  const auto is_far = (q < all(0.6f)) & (error <= all(limit)) & (square > all(1e-30f));
  const unsigned lanes = float4::bits(is_far);
  if (!lanes) return 0;
  const Float4 first = node.first[0] * dx + node.first[1] * dy + node.first[2] * dz;
  const Float4 second = (node.second[0] * dx + node.second[1] * dy + node.second[2] * dz) * dx +
                        (node.second[3] * dy + node.second[4] * dz) * dy + node.second[5] * dz * dz;
  const Float4* t = node.third;
  const Float4 third =
      ((t[0] * dx + t[1] * dy + t[2] * dz) * dx + (t[3] * dy + t[4] * dz) * dy + t[5] * dz * dz) *
          dx +
      ((t[6] * dy + t[7] * dz) * dy + t[8] * dz * dz) * dy + t[9] * dz * dz * dz;
  const Float4 traces = node.traces[0] * dx + node.traces[1] * dy + node.traces[2] * dz;
  const Float4 number =
      inverse2 * inverse *
      (first + node.trace +
       inverse2 * (all(7.5f) * third * inverse2 - all(4.5f) * traces - all(3) * second));
  for (int i = 0; i < 4; ++i)
    if (lanes >> i & 1) sum.number += double(number[i]), sum.error += double(error[i]);
  return lanes;
}

WindingTree::Sum WindingTree::walk(const MeshState& mesh, const Vector& x, const Vector& in_tree,
                                   float limit) const {
  const WideTree& tree = mesh.tree;
  const Vector4x3 at = vectors::all(in_tree);
  const Float4 in_order{0, 1, 2, 3};
  Sum sum;
  OpenNodes open(tree.depth());
  open.start();
  while (!open.isEmpty()) {
    const int number = open.pop().number;
    const WideNode& node = tree.nodes()[number];
    const unsigned all = (1u << node.count) - 1,
                   near = all & ~evaluate(nodes_[static_cast<std::size_t>(number)], at, limit, sum);
    if (!node.isLeaf()) open.push(node, near, in_order);
    for (unsigned lanes = node.isLeaf() ? near : 0; lanes; lanes &= lanes - 1) {
      const Int4& v = tree.corners(static_cast<unsigned>(node.first + __builtin_ctz(lanes)));
      const auto corner = [&](int k) -> const fcl::Vector3d& {
        return mesh.vertices[static_cast<std::size_t>(v[k])];
      };
      sum.number += solidAngle(corner(0), corner(1), corner(2), x, tree.scale()) / kFourPi;
    }
  }
  return sum;
}

double WindingTree::of(const MeshState& mesh, const Vector& x, double tolerance) const {
  const Vector in_tree = mesh.tree.coordinates()(x);
  constexpr double kFar = 1e9;  // less than 1e-17 of the sphere is seen from there
  if (!(in_tree.lpNorm<Eigen::Infinity>() < kFar)) return 0;
  // So much may each box be off. Most boxes are off by less, so that fewer of them would be too
  // few.
  constexpr double kBoxes = 48, kMore = 1. / 4;
  for (double limit = tolerance / kBoxes;; limit *= kMore) {
    const Sum sum = walk(mesh, x, in_tree, static_cast<float>(limit));
    if (sum.error <= tolerance) return sum.number;
  }
}

}  // namespace adaptive_bvh
