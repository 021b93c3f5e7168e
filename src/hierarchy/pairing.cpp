#include "hierarchy/pairing.h"

#include <cstddef>

namespace adaptive_bvh {
namespace {

using Mates = Scratch<unsigned>;

void pairUp(Mates& mate, unsigned a, unsigned b) {
  mate[a] = b;
  mate[b] = a;
}

/// Step 1 of pairGroups.
class Walk {
 public:
  Walk(const GroupGraph& graph, Mates& mate) : graph_(graph), mate_(mate), next_(graph.size()) {
    for (unsigned g = 0; g < graph.size(); ++g) next_[g] = graph.begin(g);
    path_.reserve(16);
  }

  /// Walks from a group: pairs it if it has an unpaired neighbour, and all groups on the path.
  void walkFrom(unsigned start) {
    path_.assign(1, start);
    while (!path_.empty()) {
      const unsigned g = path_.back();
      const GroupGraph::Neighbour* best = mate_[g] == kNone ? bestFree(g) : nullptr;
      if (!best) {  // paired in the meantime, or without unpaired neighbours
        path_.pop_back();
        continue;
      }
      // Does the neighbour prefer another group? Weights increase along the path: it has no cycles.
      if (bestFree(best->group)->weight > best->weight)
        path_.push_back(best->group);
      else
        pairUp(mate_, g, best->group);
    }
  }

  /// Pairs a group, if it is unpaired, with its best unpaired neighbour.
  void takeBest(unsigned g) {
    if (mate_[g] != kNone) return;
    if (const GroupGraph::Neighbour* best = bestFree(g)) pairUp(mate_, g, best->group);
  }

 private:
  /// The best unpaired neighbour, or null. No group becomes unpaired during the walk, so each list
  /// of neighbours is scanned once.
  const GroupGraph::Neighbour* bestFree(unsigned g) {
    const GroupGraph::Neighbour*& next = next_[g];
    while (next != graph_.end(g) && mate_[next->group] != kNone) ++next;
    return next != graph_.end(g) ? next : nullptr;
  }

  const GroupGraph& graph_;
  Mates& mate_;
  Scratch<const GroupGraph::Neighbour*> next_;  // by group: earlier neighbours are paired
  Scratch<unsigned> path_;
};

/// Step 2 of pairGroups: augmenting paths, as in matching algorithms. One round of the search grows
/// alternating trees from all unpaired groups at once. A tree goes from a group to a neighbour
/// ("inner") and on to that neighbour's mate ("outer"). An outer group can be freed for another
/// partner by exchanging the mates along the path to the root. Where outer groups of two trees are
/// neighbours, both trees do this exchange, the two groups are paired, and both trees are done.
class Search {
 public:
  Search(const GroupGraph& graph, Mates& mate)
      : graph_(graph), mate_(mate), root_(graph.size()), from_(graph.size()) {}

  /// Runs one round from the unpaired groups `isolated`. Removes newly paired groups from this
  /// list, and returns whether there were any.
  bool round(Scratch<unsigned>& isolated) {
    root_.assign(graph_.size(), kNone);
    done_.assign(graph_.size(), false);
    queue_ = isolated;
    for (unsigned g : isolated) root_[g] = g;
    growing_ = isolated.size();
    for (std::size_t head = 0; head < queue_.size() && growing_ > 1; ++head) expand(queue_[head]);

    Scratch<unsigned> unpaired;
    for (unsigned g : isolated)
      if (mate_[g] == kNone) unpaired.push_back(g);
    const bool progress = unpaired.size() < isolated.size();
    isolated.swap(unpaired);
    return progress;
  }

 private:
  /// Visits the neighbours of an outer group, unless its tree is done.
  void expand(unsigned outer) {
    for (auto n = graph_.begin(outer); n != graph_.end(outer) && !done_[root_[outer]]; ++n) {
      const unsigned other = n->group;
      if (root_[other] == kNone) {
        grow(outer, other);
      } else if (isOuter(other) && root_[other] != root_[outer] && !done_[root_[other]]) {
        done_[root_[outer]] = done_[root_[other]] = true;
        growing_ -= 2;
        exchange(outer, other);
        exchange(other, outer);
      }
    }
  }

  /// Adds an inner group and its mate, an outer group, to the tree of `outer`.
  void grow(unsigned outer, unsigned inner) {
    const unsigned mate = mate_[inner];
    root_[inner] = root_[mate] = root_[outer];
    from_[inner] = outer;
    from_[mate] = kNone;
    queue_.push_back(mate);
  }

  /// Whether a group that is in a tree is outer: the mate of an inner group, or an unpaired root.
  bool isOuter(unsigned g) const { return mate_[g] == kNone || from_[g] == kNone; }

  /// Pairs `outer` with `partner`. The former mate of `outer` is paired with the group from which
  /// the tree reached it, which leaves its own mate, and so on up to the root.
  void exchange(unsigned outer, unsigned partner) {
    for (;;) {
      const unsigned left_alone = mate_[outer];
      mate_[outer] = partner;
      if (left_alone == kNone) return;
      const unsigned before = from_[left_alone];
      mate_[left_alone] = before;
      partner = left_alone;
      outer = before;
    }
  }

  const GroupGraph& graph_;
  Mates& mate_;
  Scratch<unsigned> root_;   // the isolated group whose tree a group is in
  Scratch<unsigned> from_;   // for an inner group: the outer group that it was reached from
  Scratch<bool> done_;       // by root: whether the root has been paired in this round
  Scratch<unsigned> queue_;  // outer groups to expand, breadth first
  std::size_t growing_ = 0;  // number of trees that are not done
};

/// At most 2 log2(groups) + 8 rounds.
int roundLimit(unsigned groups) {
  int rounds = 8;
  for (; groups > 1; groups /= 2) rounds += 2;
  return rounds;
}

}  // namespace

Scratch<unsigned> pairGroups(const GroupGraph& graph, const Scratch<unsigned>& favoured) {
  Mates mate(graph.size(), kNone);
  Walk walk(graph, mate);
  for (unsigned g : favoured) walk.takeBest(g);
  for (unsigned g = 0; g < graph.size(); ++g) walk.walkFrom(g);

  Scratch<unsigned> isolated;
  isolated.reserve(16);
  for (unsigned g = 0; g < graph.size(); ++g)
    if (mate[g] == kNone && graph.begin(g) != graph.end(g)) isolated.push_back(g);
  if (isolated.size() <= 1) return mate;
  Search search(graph, mate);
  for (int round = roundLimit(graph.size()); round > 0 && isolated.size() > 1; --round)
    if (!search.round(isolated)) break;
  return mate;
}

}  // namespace adaptive_bvh
