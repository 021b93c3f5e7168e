#pragma once

#include <cstdint>
#include <vector>

#include "hierarchy/bottom_up.h"
#include "hierarchy/leaf_slots.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// Stores the vertices of the leaves in tree order, so that the vertices below a node are close
/// together in memory.
///
/// A block is a maximal subtree with at most kBlock vertices. It has one slot for each of its
/// vertices; a vertex that several blocks share has a slot in each (about 1.4 slots per vertex in a
/// regular mesh). So the slots below a node within a block are a set that fits in a 64-bit word.
/// A larger node consists of whole blocks, and its slots are a range. Vertices without a triangle
/// have the last slots. A point is treated as a triangle with three equal vertices.
class VertexSlots {
 public:
  static constexpr int kBlock = 64;

  /// The slots below a node. Of a node within a block: first + i for each bit i set in `bits`. Of a
  /// larger node, for which `bits` is 0: the range from `first` to `last`, excluding `last`.
  struct Set {
    unsigned first, last;
    std::uint64_t bits;
  };

  void assign(const OrderedTree& tree, const MeshView<double>& mesh, std::size_t num_vertices);

  std::size_t leaves() const { return leaves_.size(); }
  std::size_t size() const { return vertices_.size(); }
  /// The number of slots whose vertex belongs to a triangle; these slots come first.
  std::size_t used() const { return used_; }
  /// The vertex of each slot.
  const std::vector<unsigned>& vertices() const { return vertices_; }

  /// The slots of each leaf.
  const LeafSlots* leafSlots() const { return leaves_.data(); }
  /// The first slot of the block that contains a leaf's vertices.
  unsigned blockStart(std::size_t leaf) const { return leaves_[leaf].block; }
  /// The slots, and the vertices, of a leaf's triangle.
  VertexIndices slotsOf(std::size_t leaf) const {
    const LeafSlots& l = leaves_[leaf];
    return {l.slot(0), l.slot(1), l.slot(2)};
  }
  VertexIndices verticesOf(std::size_t leaf) const {
    const VertexIndices slots = slotsOf(leaf);
    return {vertices_[slots[0]], vertices_[slots[1]], vertices_[slots[2]]};
  }

  static constexpr int kSamples = 12;
  using Samples = Eigen::Matrix<unsigned, Eigen::Dynamic, 1, 0, kSamples, 1>;
  /// Returns a few vertices, spread evenly over the leaves, where neighbours are near each other:
  /// different corners of successive triangles, because the first corners of long slivers may be
  /// collinear.
  Samples samples() const;

  /// The slots of `count` leaves from `first` on, which must be all leaves below one node.
  Set below(std::size_t first, std::size_t count) const {
    const unsigned block = leaves_[first].block;
    if (block != leaves_[first + count - 1].block) return below(first, count, 0);
    std::uint64_t bits = 0;
    for (std::size_t i = first; i < first + count; ++i) bits |= leaves_[i].bits();
    return {block, 0, bits};
  }
  /// The slots below a node whose Set::bits are known.
  Set below(std::size_t first, std::size_t count, std::uint64_t bits) const {
    const unsigned block = leaves_[first].block;
    if (bits != 0) return {block, 0, bits};
    return {block, first + count < leaves() ? leaves_[first + count].block : used_, 0};
  }

  std::size_t bytes() const {
    return leaves_.capacity() * sizeof(LeafSlots) + vertices_.capacity() * sizeof(unsigned);
  }

 private:
  std::vector<LeafSlots> leaves_;   ///< in the order of the tree's leaves
  std::vector<unsigned> vertices_;  ///< by slot
  unsigned used_ = 0;               ///< number of slots in blocks
};

}  // namespace adaptive_bvh
