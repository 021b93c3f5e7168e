#pragma once

#include <array>
#include <vector>

#include "adaptive_bvh/contact_set.h"

namespace adaptive_bvh {

/// A pair of a ContactSet: its kind, a FeatureKind (0 for triangles), and its number in that kind.
/// In one word, so that pairs can be linked to a list.
class PairLink {
 public:
  PairLink() = default;
  PairLink(unsigned kind, unsigned number) : word_(number << 2 | kind) {}

  bool exists() const { return word_ != ~0u; }
  unsigned kind() const { return word_ & 3; }
  unsigned number() const { return word_ >> 2; }

 private:
  unsigned word_ = ~0u;
};

/// How many pairs of each kind an update adds, and removes.
struct PairCounts {
  std::array<std::size_t, 3> added{}, removed{};

  void countAdded(const std::array<std::size_t, 3>& kinds) { count(kinds, added); }
  void countRemoved(const std::array<std::size_t, 3>& kinds) { count(kinds, removed); }
  void add(const PairCounts& other) {
    for (std::size_t k = 0; k < 3; ++k) {
      added[k] += other.added[k];
      removed[k] += other.removed[k];
    }
  }

 private:
  static void count(const std::array<std::size_t, 3>& kinds, std::array<std::size_t, 3>& all) {
    for (std::size_t k = 0; k < 3; ++k) all[k] += kinds[k];
  }
};

/// The numbers of the pairs of a ContactSet, of all kinds. Pairs that belong together, such as the
/// features of two triangles, form a list, to which the caller keeps the first link.
class PairNumbers {
 public:
  explicit PairNumbers(bool has_bodies) : has_bodies_(has_bodies) {}

  const NumberedPairs& operator[](unsigned kind) const { return kinds_[kind].list; }

  /// Begins an update: allocates all memory that it needs. Only this throws.
  void begin(const PairCounts& counts);
  /// Adds a pair in front of a list, and returns the new front. `bodies`: for a Scene.
  PairLink add(unsigned kind, const FeaturePair& pair, const BodyPair& bodies, PairLink front);
  /// Removes a pair from its list. Returns the new front.
  PairLink remove(unsigned kind, const FeaturePair& pair, PairLink front);
  /// Removes all pairs of a list.
  void removeAll(PairLink front) {
    while (front.exists()) front = free(front);
  }

  /// ContactSet::compact: sets `moved` to the new numbers of each kind, by which the caller
  /// replaces its links. If it throws, it has changed nothing else.
  void compact(std::array<std::vector<unsigned>, 3>& moved);

 private:
  struct Kind {
    NumberedPairs list;
    std::vector<PairLink> next;  ///< by number: the next pair of its list
    std::vector<unsigned> free;  ///< numbers for the next pairs, the last one first
  };

  PairLink& next(PairLink link) { return kinds_[link.kind()].next[link.number()]; }
  PairLink free(PairLink link);

  bool has_bodies_;
  std::array<Kind, 3> kinds_;
};

}  // namespace adaptive_bvh
