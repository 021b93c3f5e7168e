#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

struct NeighbourRanges;

/// Which pairs of triangles of one mesh count, by labels.
enum class LabelRule {
  Within,   ///< both triangles have the same label
  Between,  ///< they have different labels
};

/// Which pairs of triangles of one mesh are neighbours, for queries of a mesh with itself: a cable
/// that touches its own loop is of interest, its neighbouring triangles are not (Ignored::surface).
/// Triangles with a common vertex are always neighbours. Vertices are compared by index
/// (weldVertices joins them).
///
/// Made once, by the caller, and used for all positions of the mesh and of its copies. Each
/// triangle has a list of its neighbours as ranges in the order of the mesh's tree, and each node
/// of the tree the neighbours that all its triangles have in common: so a query skips whole parts
/// of the surface. Making it takes time that grows with the sum of the neighbours of all triangles,
/// and so with the square of the number of rings or of the distance on an even surface; a little
/// more, because the search along edges is ordered by distance. Memory grows with the length of
/// the boundaries of all neighbourhoods. Copies share the lists, which never change: thread-safe.
class SurfaceNeighbourhood {
 public:
  /// Only triangles with a common vertex.
  explicit SurfaceNeighbourhood(const DeformableMesh& mesh);
  /// The triangles within so many steps from a triangle to one with a common vertex. 1 is the same
  /// as without; 0 counts as 1.
  static SurfaceNeighbourhood byRings(const DeformableMesh& mesh, unsigned rings);
  /// The triangles at most `distance` away along the surface: the length of the shortest path along
  /// edges from a vertex of one to a vertex of the other, at the present positions of the mesh. In
  /// double precision; sums are rounded. Throws std::invalid_argument if the distance is negative
  /// or not a number.
  static SurfaceNeighbourhood byDistance(const DeformableMesh& mesh, double distance);
  /// The pairs that do not count by a label for each triangle: of equal labels with
  /// LabelRule::Between, of different labels with LabelRule::Within. Throws std::invalid_argument
  /// if the number of labels is not that of the triangles.
  static SurfaceNeighbourhood byLabels(const DeformableMesh& mesh,
                                       const std::vector<unsigned>& labels, LabelRule rule);

  /// Whether two triangles, given by their indices, are neighbours. Throws std::invalid_argument if
  /// a triangle does not exist.
  bool contains(unsigned first, unsigned second) const;
  /// Memory in bytes.
  std::size_t bytes() const;

  /// For the library.
  const NeighbourRanges& ranges() const { return *ranges_; }

 private:
  explicit SurfaceNeighbourhood(std::shared_ptr<const NeighbourRanges> ranges);

  std::shared_ptr<const NeighbourRanges> ranges_;
};

}  // namespace adaptive_bvh
