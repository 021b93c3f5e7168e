#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace adaptive_bvh {

/// Levels of nodes, or of the text around them, that a file may have: readers go down by recursion.
constexpr std::size_t kMostLevels = 500;

/// A file may have so many nodes, a node counted once for each way that leads to it, or
/// `kMostPlacementsPerNode` times as many as are written in it, whichever is more.
constexpr std::size_t kMostPlacements = 20000, kMostPlacementsPerNode = 4;

/// Placed meshes, with so many vertices and triangles in all; or so many times what the file holds.
constexpr std::size_t kMostElements = 10000000, kMostElementsPerElement = 4;

/// For each node of a scene the nodes that it names as its children.
using NodeGraph = std::vector<std::vector<std::size_t>>;

/// What is wrong with a hierarchy: a node below itself, too many levels, or too many nodes where
/// several name the same child; empty when nothing is.
std::string findHierarchyError(const NodeGraph& children);

}  // namespace adaptive_bvh
