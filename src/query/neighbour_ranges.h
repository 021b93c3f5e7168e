#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "adaptive_bvh/surface_neighbourhood.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// The neighbours of each triangle of a mesh, and those that all triangles of a node have in
/// common. Triangles are numbered in the order of the leaves, in which a node has a range of them.
struct NeighbourRanges {
  /// From `begin` to `end`, which is excluded.
  struct Range {
    unsigned begin, end;
  };

  std::shared_ptr<const MeshTopology> topology;
  std::vector<Range> ranges;          ///< of all lists, one list after the other
  std::vector<std::size_t> begins;    ///< of each list in `ranges`; one more than there are lists
  std::vector<unsigned> of_triangle;  ///< list, by leaf index
  std::vector<unsigned> of_node;      ///< list, by node
  std::vector<Range> triangles;       ///< by node
  std::vector<unsigned> leaf_index;   ///< by triangle

  /// Whether a list contains a range.
  bool contains(unsigned list, const Range& range) const;
  /// Whether the list of a triangle has the other, by leaf indices.
  bool areListed(unsigned first, unsigned second) const {
    return contains(of_triangle[first], {second, second + 1});
  }
  /// Whether two triangles are neighbours, by leaf indices.
  bool areNeighbours(unsigned first, unsigned second) const {
    return shareVertex(first, second) || areListed(first, second);
  }
  /// Whether all triangles of one node are neighbours of all triangles of the other.
  bool areAllNeighbours(int first, int second) const {
    return contains(of_node[std::size_t(first)], triangles[std::size_t(second)]);
  }
  bool shareVertex(unsigned first, unsigned second) const;
  std::size_t bytes() const;

  /// Appends a list. Returns its number.
  unsigned add(const std::vector<Range>& list);
};

/// The triangles with a common vertex.
std::shared_ptr<const NeighbourRanges> neighboursByVertices(const MeshState& mesh);

/// The neighbours along the surface that a query of a mesh with itself leaves out, or null. Throws
/// std::invalid_argument if they are those of another mesh.
const NeighbourRanges* surfaceOf(const Ignored& ignored, const MeshState& mesh);

}  // namespace adaptive_bvh
