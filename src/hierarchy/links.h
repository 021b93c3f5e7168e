#pragma once

#include <cstddef>

#include <Eigen/Geometry>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// Two groups of triangles that share mesh edges of `weight` total length. first < second.
struct Link {
  unsigned first, second;
  double weight;
};

/// Joins the links between the same two groups, with the sum of their weights, and drops links of a
/// group with itself. Linear in the number of links. One sum a pair, so a weight is the same seen
/// from both groups.
Scratch<Link> combined(unsigned groups, const Scratch<Link>& links);

/// The neighbours of every group on one level: links as adjacency lists, best neighbour first.
/// Equal weights are ordered by number, so that everything built on them is deterministic.
class GroupGraph {
 public:
  struct Neighbour {
    unsigned group;
    double weight;
  };

  /// `links`: combined.
  GroupGraph(unsigned groups, const Scratch<Link>& links);

  unsigned size() const { return static_cast<unsigned>(start_.size()) - 1; }
  const Neighbour* begin(unsigned group) const { return &neighbours_[start_[group]]; }
  const Neighbour* end(unsigned group) const { return &neighbours_[start_[group + 1]]; }

 private:
  Scratch<unsigned> start_;
  Scratch<Neighbour> neighbours_;  // one more than there are, so that `end` may point at it
};

/// Items sorted, stably, by a key below `keys`: those of key k begin at start[k].
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

/// Which triangles share an edge, with the length of what they share. An edge that more than two
/// triangles share links all pairs of them.
///
/// Edges are equal if they have the same two vertices. Edges of only one triangle are compared a
/// second time by the positions of their ends: so triangles added one by one, each with
/// vertices of its own (FCL's addTriangle, STL files), and meshes cut along texture seams are
/// connected too.
///
/// Linear in `count`. An edge of more than 32 triangles, which no surface has, would make the pairs
/// quadratic; there each triangle is linked to the next 16 around it only.
template <typename S>
Scratch<Link> sharedEdges(const MeshView<S>& mesh, unsigned count);

using AlignedBox = Eigen::AlignedBox3d;

/// The numbers 0, 1, ... of the boxes along a Morton curve through their centres.
Scratch<unsigned> mortonOrder(const Scratch<AlignedBox>& boxes);

/// Links each of the boxes, which must be given in Morton order, to the next four; the smaller the
/// box around both, the greater the weight. After Meister and Bittner, "Parallel locally-ordered
/// clustering for bounding volume hierarchy construction" (2018), who search such a window. A
/// window of 16 makes volumes 4 % smaller (the area of all, on triangle soup), and building takes
/// half as long again.
Scratch<Link> proximityLinks(const Scratch<AlignedBox>& boxes_in_order);

}  // namespace adaptive_bvh
