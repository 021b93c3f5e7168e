#pragma once

#include <vector>

namespace adaptive_bvh {

/// Two groups of triangles that share mesh edges of `weight` total length. first < second.
struct Link {
  unsigned first, second;
  double weight;
};

/// Links between the same two groups made one, their weights summed; links of a group with itself
/// dropped. Linear in the number of links. One sum a pair, so a weight reads alike from both sides.
std::vector<Link> combined(unsigned groups, const std::vector<Link>& links);

/// Who neighbours whom on one level: links as adjacency lists, best neighbour first. Equal weights
/// are ordered by number, so that everything built on them is deterministic.
class GroupGraph {
 public:
  struct Neighbour {
    unsigned group;
    double weight;
  };

  /// `links`: combined.
  GroupGraph(unsigned groups, const std::vector<Link>& links);

  unsigned size() const { return static_cast<unsigned>(start_.size()) - 1; }
  const Neighbour* begin(unsigned group) const { return &neighbours_[start_[group]]; }
  const Neighbour* end(unsigned group) const { return &neighbours_[start_[group + 1]]; }

 private:
  std::vector<unsigned> start_;
  std::vector<Neighbour> neighbours_;  // one more than there are, so that `end` may point at it
};

/// Places in which items 0, 1, ... with the given keys (< keys) stand sorted, stably: `start[k]` is
/// the first place of key k, `items` lists them.
struct Buckets {
  template <typename KeyOf>
  Buckets(unsigned keys, std::size_t count, KeyOf&& key_of) : start(keys + 1, 0), items(count) {
    for (std::size_t i = 0; i < count; ++i) ++start[key_of(i) + 1];
    for (unsigned k = 0; k < keys; ++k) start[k + 1] += start[k];
    std::vector<unsigned> place(start.begin(), start.end() - 1);
    for (std::size_t i = 0; i < count; ++i) items[place[key_of(i)]++] = static_cast<unsigned>(i);
  }

  std::vector<unsigned> start, items;
};

}  // namespace adaptive_bvh
