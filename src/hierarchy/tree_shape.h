#pragma once

#include <vector>

#include "hierarchy/bottom_up.h"

namespace adaptive_bvh {

/// The shape of an ordered tree: a bit for each node, in the order of the nodes, set for a leaf.
/// The shape and the order of the primitives are all of the tree.
std::vector<bool> shapeOf(const OrderedTree& tree);

/// Makes the tree of a shape, with `primitives` by place. Returns false unless the shape is that of
/// one binary tree with a leaf for each primitive, no deeper than buildBottomUp makes one, and each
/// of the primitives from 0 on comes once.
bool treeOf(const std::vector<bool>& shape, Scratch<unsigned> primitives, OrderedTree& tree);

}  // namespace adaptive_bvh
