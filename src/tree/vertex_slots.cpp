#include "tree/vertex_slots.h"

#include "geometry/scratch.h"

#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// Numbers the vertices of one block after the other.
class Numbering {
 public:
  explicit Numbering(int vertices)
      : block_(static_cast<std::size_t>(vertices), 0), number_(block_) {}

  void beginBlock() {
    ++blocks_;
    count_ = 0;
  }
  /// The vertex's number in this block; a new one is the count so far.
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
  Scratch<unsigned> block_, number_;  // by vertex: the last block that it was numbered in
  unsigned blocks_ = 0, count_ = 0;
};

}  // namespace

template <typename BV>
void VertexSlots::adopt(const fcl::BVHModel<BV>& model) {
  const auto mesh = viewOf(model);
  Scratch<VertexIndices> corners((static_cast<std::size_t>(model.getNumBVs()) + 1) / 2);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (node.isLeaf())
      corners[static_cast<std::size_t>(node.first_primitive)] =
          mesh.verticesOf(static_cast<unsigned>(node.primitiveId()));
  }
  leaves_.resize(corners.size());
  vertices_.clear();
  vertices_.reserve(static_cast<std::size_t>(model.num_vertices));  // as many slots, or more
  Numbering numbers(model.num_vertices);
  const auto fits = [&](std::size_t first, std::size_t count) {
    if (count > 2 * kBlock) return false;  // cheaper than counting; a mesh has fewer vertices
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
    const fcl::BVNode<BV>& node = model.getBV(open.back());
    open.pop_back();
    const auto first = static_cast<std::size_t>(node.first_primitive);
    const auto count = static_cast<std::size_t>(node.num_primitives);
    if (node.isLeaf() || fits(first, count)) {
      append(first, count);
    } else {
      open.push_back(node.rightChild());
      open.push_back(node.leftChild());
    }
  }
  end_ = static_cast<unsigned>(vertices_.size());
  for (unsigned v = 0; v < static_cast<unsigned>(model.num_vertices); ++v)
    if (!numbers.isNumbered(v)) vertices_.push_back(v);
  vertices_.shrink_to_fit();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template void VertexSlots::adopt(const fcl::BVHModel<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
