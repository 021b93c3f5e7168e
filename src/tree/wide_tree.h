#pragma once

#include <limits>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "geometry/body_coordinates.h"
#include "geometry/boxes4.h"
#include "threads/task_pool.h"
#include "tree/vertex_slots.h"

namespace adaptive_bvh {

/// Four integers.
using Int4 = std::int32_t __attribute__((vector_size(16)));

/// A node of a WideTree. An inner node has two to four nodes below it; a leaf has one to four
/// triangles. Boxes that it has none for are empty: they overlap nothing. Two cache lines.
struct alignas(128) WideNode {
  Boxes4 boxes;
  /// Of an inner node the nodes below it; of a leaf FCL's leaves with these triangles.
  std::int32_t below[4];
  /// Of a leaf: its first triangle, in the order of FCL's leaves; else -1.
  std::int32_t first : 29;
  std::uint32_t count : 3;  ///< of boxes
  /// FCL's nodes that this one stands for: the one above all the others, and those between it and
  /// `below`; -1 where there are fewer.
  std::int32_t binary[3];

  bool isLeaf() const { return first >= 0; }
};
static_assert(sizeof(WideNode) == 128, "no more than is read");

/// A four-wide tree, collapsed from a model's binary one, with boxes of the present positions (not
/// of those before, in a two-frame update) in single precision: what queries for contacts read.
///
/// Its coordinates are below 2. They are computed in double precision and rounded once; what that
/// took off them is kept, too: docs/bounds.md, 13.
template <typename S>
class WideTree {
 public:
  /// Bounds the error of a position's component: 2u = 2^-23 for the rounding of numbers below 2,
  /// and as much for all that is rounded in double precision.
  static constexpr float kPositionError = 1.f / (1 << 22);
  /// Bounds it for a position and its residual together.
  static constexpr float kResidualError = 1.f / (1ull << 44);
  /// By so much boxes reach beyond the positions of their triangles.
  static constexpr float kBoxMargin = 1.f / (1 << 20);

  /// Collapses the model's tree; boxes come with `refit`.
  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model, const VertexSlots& slots);

  /// Computes all positions and boxes anew, in these coordinates.
  template <typename BV>
  void refit(const fcl::BVHModel<BV>& model, const VertexSlots& slots,
             const BodyCoordinates& coordinates, const TaskPool& pool);

  const WideNode* nodes() const { return nodes_.data(); }
  int size() const { return static_cast<int>(nodes_.size()); }
  int depth() const { return depth_; }  ///< nodes from the root to the deepest leaf

  /// By slot.
  const Float4* positions() const { return positions_.data(); }
  /// The positions in double precision, less `positions`.
  const Float4* residuals() const { return residuals_.data(); }
  /// The index in the mesh of a triangle, which is given by its place in the order of the leaves.
  int triangle(unsigned triangle) const { return triangles_[triangle]; }
  /// FCL's leaf with it.
  int leaf(unsigned triangle) const { return vertices_[triangle][3]; }
  /// Where one of FCL's nodes is: a node that stands for it, or lane `lane` of a leaf. Nowhere
  /// (-1) if it is between others.
  struct Place {
    int node, lane;  ///< lane -1: the whole node
  };
  Place placeOf(int binary) const {
    const int at = places_[static_cast<std::size_t>(binary)];
    if (at < 0) return {-1, -1};
    return {at >> 3, (at & 7) - 1};
  }
  /// Its vertices; the fourth number is another.
  const Int4& vertices(unsigned triangle) const { return vertices_[triangle]; }

  const BodyCoordinates& coordinates() const { return coordinates_; }
  /// y = to_body (x - origin).
  const fcl::Matrix3d& toBody() const { return coordinates_.to_body; }
  const fcl::Vector3d& origin() const { return coordinates_.origin; }
  double scale() const { return coordinates_.scale; }

  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(nodes_) + size(positions_) + size(residuals_) + size(vertices_) + size(triangles_) +
           size(places_) + size(later_);
  }

 private:
  int blockBegin(const VertexSlots& slots, int node) const;
  std::size_t firstSlot(const VertexSlots& slots, int node) const;
  template <typename BV>
  void readPositions(const fcl::BVHModel<BV>& model, const VertexSlots& slots, std::size_t begin,
                     std::size_t end, bool is_shared);
  void refitNodes(const VertexSlots& slots, int begin, int end, bool is_shared,
                  std::vector<int>& later);
  void refitLeaf(WideNode& node, const VertexSlots& slots) const;
  void refitInner(WideNode& node) const;

  std::vector<WideNode> nodes_;  ///< those below a node follow it
  std::vector<Float4> positions_, residuals_;
  std::vector<Int4> vertices_;           ///< and FCL's leaf
  std::vector<int> triangles_;           ///< the index of each
  std::vector<int> places_;              ///< by FCL's node: 8 times the node, and the lane + 1
  std::vector<std::vector<int>> later_;  ///< of refits in parts
  int depth_ = 0;
  BodyCoordinates coordinates_;
};

}  // namespace adaptive_bvh
