#pragma once

#include <cstdint>
#include <vector>

#include "hierarchy/bottom_up.h"
#include "hierarchy/leaf_slots.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// The vertices of the leaves in the order of the tree, so that those below a node lie together.
///
/// A block is a subtree with at most kBlock vertices, as large as possible. It has one slot for
/// each of its vertices; a vertex that several blocks share has a slot in each (about 1.4 slots a
/// vertex in a regular mesh). So what is kept by slot is, below a node, a range of slots, or within
/// a block a set of them that fits in one word. Vertices without a triangle have slots at the end.
/// A point is a triangle with three equal vertices.
class VertexSlots {
 public:
  static constexpr int kBlock = 64;

  /// The slots below a node: `first` and those after it whose bit is set; all up to `last` where
  /// no bit is.
  struct Set {
    unsigned first, last;
    std::uint64_t bits;
  };

  template <typename S>
  void adopt(const OrderedTree& tree, const MeshView<S>& mesh, std::size_t num_vertices);

  std::size_t leaves() const { return leaves_.size(); }
  std::size_t size() const { return vertices_.size(); }
  /// The number of slots whose vertex has a triangle; they come first.
  std::size_t used() const { return end_; }
  /// The vertex of each slot.
  const std::vector<unsigned>& vertices() const { return vertices_; }

  /// By leaf.
  const LeafSlots* leafSlots() const { return leaves_.data(); }
  /// The first slot of the block that a leaf belongs to.
  unsigned block(std::size_t leaf) const { return leaves_[leaf].block; }
  VertexIndices slotsOf(std::size_t leaf) const {
    const LeafSlots& l = leaves_[leaf];
    return {l.slot(0), l.slot(1), l.slot(2)};
  }
  VertexIndices verticesOf(std::size_t leaf) const {
    const VertexIndices slots = slotsOf(leaf);
    return {vertices_[slots[0]], vertices_[slots[1]], vertices_[slots[2]]};
  }

  /// The slots of `count` leaves from `first` on, which are the leaves below one node.
  Set below(std::size_t first, std::size_t count) const {
    const unsigned block = leaves_[first].block;
    if (block != leaves_[first + count - 1].block) return below(first, count, 0);
    std::uint64_t bits = 0;
    for (std::size_t i = first; i < first + count; ++i) bits |= leaves_[i].bits();
    return {block, 0, bits};
  }
  /// The same slots, if Set::bits is known.
  Set below(std::size_t first, std::size_t count, std::uint64_t bits) const {
    const unsigned block = leaves_[first].block;
    if (bits != 0) return {block, 0, bits};
    return {block, first + count < leaves() ? leaves_[first + count].block : end_, 0};
  }

  std::size_t bytes() const {
    return leaves_.capacity() * sizeof(LeafSlots) + vertices_.capacity() * sizeof(unsigned);
  }

 private:
  std::vector<LeafSlots> leaves_;
  std::vector<unsigned> vertices_;
  unsigned end_ = 0;  ///< of the last block
};

}  // namespace adaptive_bvh
