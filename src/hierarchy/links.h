#pragma once

#include <cstddef>

#include <Eigen/Geometry>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// A pair of groups of triangles, first < second. `weight` is the total length of the mesh edges
/// that they share; for proximityLinks it measures nearness.
struct Link {
  unsigned first, second;
  double weight;
};

/// Merges links between the same two groups by summing their weights, and drops links of a group
/// with itself. Linear in the number of links. Each pair has one sum, so both groups see the same
/// weight.
Scratch<Link> combined(unsigned groups, const Scratch<Link>& links);

/// The links of one level as adjacency lists, each sorted by decreasing weight. Equal weights are
/// ordered by group number, so that the build is deterministic.
class GroupGraph {
 public:
  struct Neighbour {
    unsigned group;
    double weight;
  };

  /// `links` must come from combined().
  GroupGraph(unsigned groups, const Scratch<Link>& links);

  unsigned size() const { return static_cast<unsigned>(start_.size()) - 1; }
  const Neighbour* begin(unsigned group) const { return &neighbours_[start_[group]]; }
  const Neighbour* end(unsigned group) const { return &neighbours_[start_[group + 1]]; }

 private:
  Scratch<unsigned> start_;        // of each group's list in neighbours_; then the end of the last
  Scratch<Neighbour> neighbours_;  // one element more, so that `end` may point to it
};

/// Items sorted by a key below `keys` (stable counting sort). Items with key k begin at start[k].
template <typename Item>
struct Buckets {
  template <typename KeyOf>
  Buckets(unsigned keys, const Scratch<Item>& unsorted, KeyOf&& key_of)
      : start(keys + 1, 0), items(unsorted.size()) {
    for (const Item& item : unsorted) ++start[key_of(item)];
    unsigned sum = 0;
    for (unsigned& end : start) end = sum += end;
    for (std::size_t i = unsorted.size(); i-- > 0;)
      items[--start[key_of(unsorted[i])]] = unsorted[i];
  }

  Item* begin(unsigned key) { return items.data() + start[key]; }
  Item* end(unsigned key) { return items.data() + start[key + 1]; }

  Scratch<unsigned> start;
  Scratch<Item> items;
};

/// Links triangles that share an edge, weighted by the length of the edge. An edge with more than
/// two triangles links all pairs of them.
///
/// Edges are equal if they have the same two vertices. Edges that belong to only one triangle are
/// then compared by the positions of their ends. So triangles with vertices of their own (FCL's
/// addTriangle, STL files) and meshes cut along texture seams are connected, too.
///
/// Takes time linear in `count`. Linking all pairs would be quadratic for an edge with very many
/// triangles. Above 32 triangles, which no surface has, each triangle is linked only to the next
/// 16.
Scratch<Link> sharedEdges(const MeshView<double>& mesh, unsigned count);

using AlignedBox = Eigen::AlignedBox3d;

/// The indices of the boxes, sorted along a Morton curve through their centres.
Scratch<unsigned> mortonOrder(const Scratch<AlignedBox>& boxes);

/// Links each box to the next four boxes; a smaller common box gives a greater weight. The boxes
/// must be in Morton order. After Meister and Bittner, "Parallel locally-ordered clustering for
/// bounding volume hierarchy construction" (2018), who search such a window. A window of 16 makes
/// volumes 4 % smaller (total area, on triangle soup), but building takes half as long again.
Scratch<Link> proximityLinks(const Scratch<AlignedBox>& boxes_in_order);

}  // namespace adaptive_bvh
