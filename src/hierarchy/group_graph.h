#pragma once

#include <cstddef>

#include "geometry/scratch.h"

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

}  // namespace adaptive_bvh
