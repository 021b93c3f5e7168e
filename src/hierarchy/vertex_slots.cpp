#include "hierarchy/vertex_slots.h"

#include <algorithm>

#include "base/scratch.h"

namespace adaptive_bvh {
namespace {

/// Numbers the vertices of blocks, one block after the other.
class Numbering {
 public:
  explicit Numbering(std::size_t vertices) : block_(vertices, 0), number_(block_) {}

  void beginBlock() {
    ++blocks_;
    count_ = 0;
  }
  /// Returns the vertex's number in this block; a new vertex gets the next number.
  unsigned operator()(unsigned v) {
    if (block_[v] != blocks_) {
      block_[v] = blocks_;
      number_[v] = count_++;
    }
    return number_[v];
  }
  unsigned count() const { return count_; }
  bool isNumbered(unsigned v) const { return block_[v] != 0; }

 private:
  // By vertex: the last block that contains it, or 0, and its number there.
  Scratch<unsigned> block_, number_;
  unsigned blocks_ = 0, count_ = 0;  // the present block, counted from 1; its number of vertices
};

}  // namespace

/// Goes down the tree to the first subtrees that fit into a block, and appends a block for each.
void VertexSlots::assign(const OrderedTree& tree, const MeshView<double>& mesh,
                         std::size_t num_vertices) {
  Scratch<VertexIndices> corners(tree.primitives.size());
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = mesh.verticesOf(tree.primitives[i]);
  leaves_.resize(corners.size());
  vertices_.clear();
  vertices_.reserve(num_vertices);  // a lower bound of the number of slots
  Numbering numbers(num_vertices);
  // Whether the leaves of a subtree have at most kBlock vertices.
  const auto fits = [&](std::size_t first, std::size_t count) {
    if (count > 2 * kBlock) return false;  // nearly always right, and saves counting
    numbers.beginBlock();
    for (std::size_t i = first; i < first + count; ++i)
      for (unsigned v : corners[i]) numbers(v);
    return numbers.count() <= kBlock;
  };
  const auto append = [&](std::size_t first, std::size_t count) {
    const auto block = static_cast<unsigned>(vertices_.size());
    numbers.beginBlock();
    for (std::size_t i = first; i < first + count; ++i) {
      leaves_[i].block = block;
      for (std::size_t k = 0; k < 3; ++k) {
        const unsigned v = corners[i][k], offset = numbers(v);
        if (block + offset == vertices_.size()) vertices_.push_back(v);
        leaves_[i].offset[k] = static_cast<std::uint8_t>(offset);
      }
    }
  };
  Scratch<int> open(1, 0);
  while (!open.empty()) {  // in the order of the leaves
    const OrderedTree::Node& node = tree.nodes[static_cast<std::size_t>(open.back())];
    open.pop_back();
    if (node.isLeaf() || fits(node.first, node.count)) {
      append(node.first, node.count);
    } else {
      open.push_back(node.right);
      open.push_back(node.left);
    }
  }
  used_ = static_cast<unsigned>(vertices_.size());
  for (unsigned v = 0; v < static_cast<unsigned>(num_vertices); ++v)
    if (!numbers.isNumbered(v)) vertices_.push_back(v);
  vertices_.shrink_to_fit();
}

VertexSlots::Samples VertexSlots::samples() const {
  const auto count = static_cast<Eigen::Index>(std::min<std::size_t>(kSamples, leaves()));
  Samples samples(count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    samples[Eigen::Index(i)] = verticesOf(i * leaves() / static_cast<std::size_t>(count))[i % 3];
  return samples;
}

}  // namespace adaptive_bvh
