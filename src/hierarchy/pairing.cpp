#include "hierarchy/pairing.h"

#include <cstddef>

namespace adaptive_bvh {
namespace {

using Mates = Scratch<unsigned>;

void pairUp(Mates& mate, unsigned a, unsigned b) {
  mate[a] = b;
  mate[b] = a;
}

// ---- the walk -----------------------------------------------------------------------------------

class Walk {
 public:
  Walk(const GroupGraph& graph, Mates& mate) : graph_(graph), mate_(mate), next_(graph.size()) {
    for (unsigned g = 0; g < graph.size(); ++g) next_[g] = graph.begin(g);
    path_.reserve(16);
  }

  /// Pairs `start` if it has an unpaired neighbour, and all groups on the walk's path.
  void from(unsigned start) {
    path_.assign(1, start);
    while (!path_.empty()) {
      const unsigned g = path_.back();
      const GroupGraph::Neighbour* best = mate_[g] == kNone ? bestFree(g) : nullptr;
      if (!best) {  // paired in the meantime, or without unpaired neighbours
        path_.pop_back();
        continue;
      }
      // Weights increase along the path, so it has no cycles.
      if (bestFree(best->group)->weight > best->weight)
        path_.push_back(best->group);
      else
        pairUp(mate_, g, best->group);
    }
  }

  void takeBest(unsigned g) {
    if (mate_[g] != kNone) return;
    if (const GroupGraph::Neighbour* best = bestFree(g)) pairUp(mate_, g, best->group);
  }

 private:
  /// The best unpaired neighbour. No group becomes unpaired during the walk, so each list is
  /// scanned once.
  const GroupGraph::Neighbour* bestFree(unsigned g) {
    const GroupGraph::Neighbour*& next = next_[g];
    while (next != graph_.end(g) && mate_[next->group] != kNone) ++next;
    return next != graph_.end(g) ? next : nullptr;
  }

  const GroupGraph& graph_;
  Mates& mate_;
  Scratch<const GroupGraph::Neighbour*> next_;
  Scratch<unsigned> path_;
};

// ---- the search ---------------------------------------------------------------------------------

/// One round of the search grows alternating trees from all unpaired groups at once. A tree goes
/// from a group to a neighbour and on to that neighbour's mate. Groups at even distance ("outer")
/// can be freed for another partner by exchanging the mates along the path to the root. Where outer
/// groups of two trees are neighbours, both trees do this exchange, and leave the round.
class Search {
 public:
  Search(const GroupGraph& graph, Mates& mate)
      : graph_(graph), mate_(mate), root_(graph.size()), from_(graph.size()) {}

  /// Removes newly paired groups from `isolated`. Returns whether there were any.
  bool round(Scratch<unsigned>& isolated) {
    root_.assign(graph_.size(), kNone);
    done_.assign(graph_.size(), false);
    queue_ = isolated;
    for (unsigned g : isolated) root_[g] = g;
    searching_ = isolated.size();
    for (std::size_t head = 0; head < queue_.size() && searching_ > 1; ++head) expand(queue_[head]);

    Scratch<unsigned> left;
    for (unsigned g : isolated)
      if (mate_[g] == kNone) left.push_back(g);
    const bool progress = left.size() < isolated.size();
    isolated.swap(left);
    return progress;
  }

 private:
  void expand(unsigned outer) {
    for (auto n = graph_.begin(outer); n != graph_.end(outer) && !done_[root_[outer]]; ++n) {
      const unsigned other = n->group;
      if (root_[other] == kNone) {
        grow(outer, other);
      } else if (isOuter(other) && root_[other] != root_[outer] && !done_[root_[other]]) {
        done_[root_[outer]] = done_[root_[other]] = true;
        searching_ -= 2;
        exchange(outer, other);
        exchange(other, outer);
      }
    }
  }

  void grow(unsigned outer, unsigned inner) {
    const unsigned mate = mate_[inner];
    root_[inner] = root_[mate] = root_[outer];
    from_[inner] = outer;
    from_[mate] = kNone;
    queue_.push_back(mate);
  }

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
  Scratch<unsigned> root_;  // the isolated group whose tree a group is in
  Scratch<unsigned> from_;  // for an inner group: the outer group that it was reached from
  Scratch<bool> done_;      // by root
  Scratch<unsigned> queue_;
  std::size_t searching_ = 0;
};

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
  for (unsigned g = 0; g < graph.size(); ++g) walk.from(g);

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
