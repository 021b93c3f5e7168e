// Slabs of the nodes of a tree, computed bottom-up: the sums of normals from those of the children,
// the range along them from all triangles below.
#include "query/nearest/node_slabs.h"

#include <limits>

namespace adaptive_bvh {
namespace {

/// A box has a slab if at most this many nodes are below it: larger parts are hardly flat.
constexpr int kMostSlabNodes = 21;

/// Sets corners[c] to corner c of a leaf's triangles.
template <typename Frame>
void slabCorners(const WideTree& tree, const Frame& frame, const WideNode& leaf,
                 Vector4x3 (&corners)[3]) {
  gatherLeaf(tree.slots(), tree.positions(), leaf, corners);
  for (Vector4x3& corner : corners) corner = frame(corner);
}

/// Adds a normal, or its opposite if that is nearer to the sum, so that they do not cancel.
void addToNormal(fcl::Vector3f& sum, const fcl::Vector3f& normal) {
  sum += normal.dot(sum) < 0 ? fcl::Vector3f(-normal) : normal;
}

/// Returns the sum of the normals of a leaf's triangles.
template <typename Frame>
fcl::Vector3f normalSumOf(const WideTree& tree, const Frame& frame, const WideNode& leaf) {
  Vector4x3 c[3];
  slabCorners(tree, frame, leaf, c);
  const Vector4x3 normals =
      vectors::cross(vectors::difference(c[1], c[0]), vectors::difference(c[2], c[0]));
  fcl::Vector3f sum = fcl::Vector3f::Zero();
  for (int i = 0; i < int(leaf.count); ++i)
    addToNormal(sum, {normals.x[i], normals.y[i], normals.z[i]});
  return sum;
}

/// Sets one lane of `slabs` to the slab across `normal` around the nodes from `begin` to `end` - 1;
/// to none if the square of the normal's length underflows.
template <typename Frame>
void setSlab(const WideTree& tree, const Frame& frame, int begin, int end,
             const fcl::Vector3f& normal, int lane, NodeSlabs::Slabs& slabs) {
  constexpr float kLeast = 1e-15f, kHuge = std::numeric_limits<float>::max();
  const float length = normal.norm();
  if (!(length > kLeast && length < kHuge)) return;
  const fcl::Vector3f unit = normal / length;
  const Vector4x3 along = vectors::all(unit);
  Float4 low = float4::all(kHuge), high = -low;
  for (int n = begin; n < end; ++n) {
    if (!tree.nodes()[n].isLeaf()) continue;
    Vector4x3 corners[3];
    slabCorners(tree, frame, tree.nodes()[n], corners);
    for (const Vector4x3& corner : corners) {
      const Float4 at = vectors::dot(along, corner);
      low = float4::lower<Float4>(low, at);
      high = float4::upper<Float4>(high, at);
    }
  }
  slabs.normal.x[lane] = unit[0];
  slabs.normal.y[lane] = unit[1];
  slabs.normal.z[lane] = unit[2];
  slabs.middle[lane] = (packs::smallest(low) + packs::largest(high)) / 2;
  slabs.half[lane] = (packs::largest(high) - packs::smallest(low)) / 2;
}

}  // namespace

template <typename Frame>
void NodeSlabs::compute(const WideTree& tree, const Frame& frame) {
  const auto size = static_cast<std::size_t>(tree.size());
  subtrees_.resize(size);
  slabs_.resize(size);
  for (std::size_t n = size; n-- > 0;) {  // nodes below a node follow it
    const WideNode& node = tree.nodes()[n];
    if (node.isLeaf()) {
      subtrees_[n] = {normalSumOf(tree, frame, node), static_cast<int>(n) + 1};
      continue;
    }
    slabs_[n] = Slabs();
    fcl::Vector3f sum = fcl::Vector3f::Zero();
    int end = 0;
    for (int i = 0; i < int(node.count); ++i) {
      const Subtree& below = subtrees_[static_cast<std::size_t>(node.below[i])];
      end = below.end;
      addToNormal(sum, below.normal);
      if (end - node.below[i] <= kMostSlabNodes)
        setSlab(tree, frame, node.below[i], end, below.normal, i, slabs_[n]);
    }
    subtrees_[n] = {sum, end};
  }
}

void SlabSeparation::compute(const TreePair& trees) {
  const RelativeFrame& frame = trees.frame();
  first_.compute(trees.first(), SameFrame());
  frame.isSame() ? second_.compute(trees.second(), SameFrame())
                 : second_.compute(trees.second(), frame);
  margin_ = 64 * (frame.isSame() ? frame.same().error() : frame.error());
  limit_ = std::numeric_limits<float>::infinity();
}

}  // namespace adaptive_bvh
