#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <fcl/common/types.h>

#include "base/box.h"
#include "base/float4.h"
#include "base/task_pool.h"
#include "base/vectors.h"
#include "hierarchy/bottom_up.h"
#include "hierarchy/vertex_slots.h"

namespace adaptive_bvh {

/// Orthonormalizes axes that are nearly orthonormal (Gram and Schmidt).
inline fcl::Matrix3d orthonormal(fcl::Matrix3d axes) {
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < k; ++j) axes.col(k) -= axes.col(j) * axes.col(j).dot(axes.col(k));
    axes.col(k).normalize();
  }
  return axes;
}

/// The coordinates of a four-wide tree: y = scale R^T (x - origin), with a rotation R, in double
/// precision. The scale is a power of two.
struct BodyCoordinates {
  fcl::Matrix3d to_body = fcl::Matrix3d::Identity();  ///< scale R^T
  fcl::Vector3d origin = fcl::Vector3d::Zero();
  double scale = 1;

  BodyCoordinates() = default;
  BodyCoordinates(const fcl::Matrix3d& axes, const fcl::Vector3d& from, double to_scale)
      : to_body(to_scale * axes.transpose()), origin(from), scale(to_scale) {}
  /// Coordinates with the origin `middle`, along axes that are orthonormal up to rounding. The
  /// scale brings `length` to between 1 and 2.
  static BodyCoordinates about(const fcl::Vector3d& middle, const fcl::Matrix3d& axes,
                               double length) {
    constexpr int kMost = 999;  // so that the scale and its inverse are normal numbers
    const int exponent = length > 0 ? std::clamp(std::ilogb(length), -kMost, kMost) : 0;
    return {orthonormal(axes), middle, std::ldexp(1., -exponent)};
  }

  fcl::Matrix3d axes() const { return to_body.transpose() / scale; }
  fcl::Vector3d operator()(const fcl::Vector3d& x) const { return to_body * (x - origin); }
};

/// Converts points to tree coordinates, each as a rounded point in single precision and a residual,
/// the rounding error.
class RoundedCoordinates {
 public:
  explicit RoundedCoordinates(const BodyCoordinates& coordinates) : origin_(coordinates.origin) {
    const fcl::Matrix3d& m = coordinates.to_body;
    for (int k = 0; k < 3; ++k) {
      xy_[k] = Pack<double>{m(0, k), m(1, k)};
      z_[k] = packs::all(m(2, k));
    }
  }

  ADAPTIVE_BVH_INLINE void operator()(const fcl::Vector3d& x, Float4& rounded,
                                      Float4& residual) const {
    Float4 twice[2], residuals[2];
    (*this)(x, x, twice, residuals);
    rounded = twice[0];
    residual = residuals[0];
  }
  /// Converts two points at once.
  ADAPTIVE_BVH_INLINE void operator()(const fcl::Vector3d& a, const fcl::Vector3d& b,
                                      Float4* rounded, Float4* residuals) const {
    const fcl::Vector3d v = a - origin_, w = b - origin_;
    // x and y of each point, and z of both.
    const Pack<double> xy_a = xy(v), xy_b = xy(w),
                       zs = z_[0] * Pack<double>{v[0], w[0]} + z_[1] * Pack<double>{v[1], w[1]} +
                            z_[2] * Pack<double>{v[2], w[2]};
    const Float4 rounded_a = float4::narrowed(xy_a), rounded_b = float4::narrowed(xy_b),
                 rounded_zs = float4::narrowed(zs);
    const auto residual = [](const Pack<double>& exact, const Float4& rounded_pair) -> Float4 {
      return float4::narrowed(exact - float4::widenedXy(rounded_pair));
    };
    const Float4 residual_zs = residual(zs, rounded_zs);
    rounded[0] = float4::joined<0>(rounded_a, rounded_zs);
    rounded[1] = float4::joined<1>(rounded_b, rounded_zs);
    residuals[0] = float4::joined<0>(residual(xy_a, rounded_a), residual_zs);
    residuals[1] = float4::joined<1>(residual(xy_b, rounded_b), residual_zs);
  }

 private:
  ADAPTIVE_BVH_INLINE Pack<double> xy(const fcl::Vector3d& x) const {
    using packs::all;
    return xy_[0] * all(x[0]) + xy_[1] * all(x[1]) + xy_[2] * all(x[2]);
  }

  const fcl::Vector3d origin_;
  /// The first two rows of the matrix, by column; its third row, each number repeated.
  Pack<double> xy_[3], z_[3];
};

/// Four integers.
using Int4 = std::int32_t __attribute__((vector_size(16)));

/// A node of a WideTree. An inner node has two to four children; a leaf has one to four triangles.
/// Unused boxes are empty: they overlap nothing. Two cache lines.
struct alignas(128) WideNode {
  Boxes4 boxes;
  /// The children of an inner node.
  std::int32_t below[4];
  /// For a leaf, the index of its first triangle in the order of the leaves; otherwise -1.
  std::int32_t first : 29;
  std::uint32_t count : 3;  ///< number of used boxes
  std::int32_t leaf;        ///< its number among the leaves; -1 for an inner node

  bool isLeaf() const { return first >= 0; }
};
static_assert(sizeof(WideNode) == 128, "no more than is read");

/// Empty boxes extend from kNowhere to -kNowhere: they overlap nothing, and stay finite when they
/// are rotated and scaled.
constexpr float kNowhere = 1e30f;
inline const Boxes4 kEmptyBoxes = {{{kNowhere, kNowhere, kNowhere, kNowhere},
                                    {kNowhere, kNowhere, kNowhere, kNowhere},
                                    {kNowhere, kNowhere, kNowhere, kNowhere}},
                                   {{-kNowhere, -kNowhere, -kNowhere, -kNowhere},
                                    {-kNowhere, -kNowhere, -kNowhere, -kNowhere},
                                    {-kNowhere, -kNowhere, -kNowhere, -kNowhere}}};
/// Sets the boxes of an inner node to the bounding boxes boxesOf(child) of its children.
template <typename BoxesOf>
ADAPTIVE_BVH_INLINE void refitInner(const WideNode& links, const BoxesOf& boxesOf, Boxes4& boxes) {
  using float4::lower;
  using float4::transposed;
  using float4::upper;
  const Boxes4* below[4];
  for (int i = 0; i < 4; ++i) below[i] = i < links.count ? &boxesOf(links.below[i]) : &kEmptyBoxes;
  for (int k = 0; k < 3; ++k) {
    const auto low =
        transposed(below[0]->low[k], below[1]->low[k], below[2]->low[k], below[3]->low[k]);
    const auto high =
        transposed(below[0]->high[k], below[1]->high[k], below[2]->high[k], below[3]->high[k]);
    boxes.low[k] = lower(lower(low.x, low.y), lower(low.z, low.w));
    boxes.high[k] = upper(upper(high.x, high.y), upper(high.z, high.w));
  }
}
ADAPTIVE_BVH_INLINE void refitInner(WideNode& node, const WideNode* nodes) {
  refitInner(
      node, [&](int child) -> const Boxes4& { return nodes[child].boxes; }, node.boxes);
}

/// Loads the corners of four triangles, given by their indices in the order of the leaves, from the
/// positions of a tree.
ADAPTIVE_BVH_INLINE void gatherCorners(const VertexSlots& slots, const Float4* positions,
                                       const std::array<unsigned, 4>& triangles,
                                       Vector4x3 (&corners)[3]) {
  VertexIndices slot[4];
  for (std::size_t k = 0; k < 4; ++k) slot[k] = slots.slotsOf(triangles[k]);
  for (std::size_t c = 0; c < 3; ++c)
    corners[c] = float4::columns(positions[slot[0][c]], positions[slot[1][c]],
                                 positions[slot[2][c]], positions[slot[3][c]]);
}

/// The leaf order, shared by the trees of a mesh and of its copies.
struct LeafTriangles {
  VertexSlots slots;
  /// For each triangle in the order of the leaves: its three vertices and its index.
  std::vector<Int4> corners;

  void assign(const OrderedTree& tree, const MeshView<double>& mesh, std::size_t num_triangles,
              std::size_t num_vertices) {
    slots.assign(tree, mesh, num_vertices);
    corners.resize(num_triangles);
    for (std::size_t i = 0; i < num_triangles; ++i) {
      const unsigned triangle = tree.primitives[i];
      const VertexIndices v = mesh.verticesOf(triangle);
      corners[i] = Int4{int(v[0]), int(v[1]), int(v[2]), int(triangle)};
    }
  }

  std::size_t bytes() const { return slots.bytes() + corners.capacity() * sizeof(Int4); }
};

/// A four-wide tree, collapsed from a binary one, that the library's queries traverse. Its boxes,
/// in single precision, enclose the current positions (not the previous ones, in a two-frame
/// update).
///
/// Its coordinates are below 2. They are computed in double precision and rounded once; the
/// rounding errors are stored, too: docs/bounds.md, 13.
class WideTree {
 public:
  /// Bounds the error of a component of a position: 2u = 2^-23 for rounding numbers below 2, and as
  /// much again for all rounding in double precision.
  static constexpr float kPositionError = 1.f / (1 << 22);
  /// Bounds the error of the sum of a position and its residual.
  static constexpr float kResidualError = 1.f / (1ull << 44);
  /// The margin by which boxes extend beyond their triangles' positions.
  static constexpr float kBoxMargin = 1.f / (1 << 20);

  WideTree() = default;
  /// Collapses a binary tree over those triangles; `refit` sets the boxes.
  WideTree(const OrderedTree& binary, std::shared_ptr<const LeafTriangles> triangles);

  /// Copies another tree except for its positions and boxes, which `refit` sets.
  void assignTopology(const WideTree& other);

  /// Allocates the memory that refits with this pool need, so that they throw nothing.
  void reserve(const TaskPool& pool);
  /// Allocates the memory that `*this = other` needs, so that the assignment throws nothing.
  void reserve(const WideTree& other);

  /// Recomputes all positions and boxes in these coordinates.
  void refit(const fcl::Vector3d* vertices, const BodyCoordinates& coordinates,
             const TaskPool& pool);

  /// Refits one node. A leaf first converts its positions; the children of an inner node must have
  /// been refitted. All positions must be in the range of the coordinates.
  void refitNode(const fcl::Vector3d* vertices, int number);

  const WideNode* nodes() const { return nodes_.data(); }
  int size() const { return static_cast<int>(nodes_.size()); }
  int depth() const { return depth_; }  ///< number of nodes from the root to the deepest leaf

  const VertexSlots& slots() const { return triangles_->slots; }
  /// Indexed by slot.
  const Float4* positions() const { return positions_.data(); }
  /// The rounding errors of `positions`, by slot.
  const Float4* residuals() const { return residuals_.data(); }
  /// The vertices and the index of a triangle, given by its index in the order of the leaves.
  const Int4& corners(unsigned leaf_index) const { return triangles_->corners[leaf_index]; }
  int triangle(unsigned leaf_index) const { return corners(leaf_index)[3]; }

  const BodyCoordinates& coordinates() const { return coordinates_; }
  /// y = to_body (x - origin).
  const fcl::Matrix3d& toBody() const { return coordinates_.to_body; }
  const fcl::Vector3d& origin() const { return coordinates_.origin; }
  double scale() const { return coordinates_.scale; }

  /// Memory in bytes of this tree alone, without what it shares.
  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(nodes_) + size(positions_) + size(residuals_) + size(postponed_);
  }

 private:
  int blockBegin(int node) const;
  std::size_t firstSlot(int node) const;
  void readPositions(const fcl::Vector3d* vertices, std::size_t begin, std::size_t end,
                     bool is_shared);
  int refitNodes(int begin, int end, bool is_shared, int* postponed);
  void refitLeaf(WideNode& node) const;

  std::shared_ptr<const LeafTriangles> triangles_;
  std::vector<WideNode> nodes_;                ///< children follow their parent
  std::vector<Float4> positions_, residuals_;  ///< by slot
  /// For a refit in parts: for each part a count, then up to `depth_` nodes that refitNodes
  /// postpones until all parts are refitted.
  std::vector<int> postponed_;
  int depth_ = 0;
  BodyCoordinates coordinates_;
};

}  // namespace adaptive_bvh
